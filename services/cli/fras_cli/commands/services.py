"""Each service by itself: its own main, with its own arguments."""

import importlib
from collections.abc import Callable
from dataclasses import dataclass
from typing import Final

import typer

from fras_cli.commands.shared import SERVICE_ARGUMENTS
from fras_common.extras import require_extra

services_app = typer.Typer()


@dataclass(frozen=True)
class ServiceCommand:
    """A service's command: what it says, and where its main function is."""

    about: str
    module: str
    extra: str

    def main(self) -> Callable[[list[str] | None], int]:
        """Load the service's main function.

        Raises
        ------
        MissingExtra
            If a library that the service needs is not installed.
        """
        with require_extra(self.extra):
            return importlib.import_module(self.module).main


SERVICES: Final = {
    "router": ServiceCommand("Run a Zenoh router.", "fras_common.router", "router"),
    "sim": ServiceCommand("Run the tissue simulator.", "fras_sim.__main__", "sim"),
    "patient": ServiceCommand(
        "Run the tissue simulator as the patient, beside the model of it.",
        "fras_sim.patient_main",
        "sim",
    ),
    "sa": ServiceCommand("Run situation awareness.", "fras_sa.__main__", "sa"),
    "planner": ServiceCommand(
        "Run the planner and its executive.", "fras_planner.__main__", "planner"
    ),
    "motion": ServiceCommand("Run motion.", "fras_motion.__main__", "motion"),
    "arms": ServiceCommand(
        "Play two arms under CRTK's keys, for `fras motion --driver crtk`.",
        "fras_motion.arms_main",
        "motion",
    ),
    "recorder": ServiceCommand("Run the recorder.", "fras_recorder.__main__", "recorder"),
}


def _register(name: str, service: ServiceCommand) -> None:
    @services_app.command(
        name, help=service.about, context_settings=SERVICE_ARGUMENTS, add_help_option=False
    )
    def command(context: typer.Context) -> None:
        raise typer.Exit(service.main()(context.args))

    _ = command


for _name, _service in SERVICES.items():
    _register(_name, _service)
