"""Each service by itself: its own main, with its own arguments."""

import typer

from fras_cli.commands.shared import SERVICE_ARGUMENTS

services_app = typer.Typer()


# Extra and module of what is not `fras_<name>`.
_MODULES = {
    "router": ("router", "fras_common.router"),
    "arms": ("motion", "fras_motion.arms_main"),
    "patient": ("sim", "fras_sim.patient_main"),
}


def _service(name: str, help_text: str) -> None:
    """Register `fras <name>`: the service's own main, with its own arguments."""

    @services_app.command(
        name, help=help_text, context_settings=SERVICE_ARGUMENTS, add_help_option=False
    )
    def command(context: typer.Context) -> None:
        import importlib

        from fras_common.extras import require_extra

        extra, module = _MODULES.get(name, (name, f"fras_{name}.__main__"))
        with require_extra(extra):
            main = importlib.import_module(module).main
        raise typer.Exit(main(context.args))

    _ = command


for _name, _help in {
    "router": "Run a Zenoh router.",
    "sim": "Run the tissue simulator.",
    "patient": "Run the tissue simulator as the patient, beside the model of it.",
    "sa": "Run situation awareness.",
    "planner": "Run the planner and its executive.",
    "motion": "Run motion.",
    "arms": "Play two arms under CRTK's keys, for `fras motion --driver crtk`.",
    "recorder": "Run the recorder.",
}.items():
    _service(_name, _help)
