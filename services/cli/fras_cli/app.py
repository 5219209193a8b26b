"""The `fras` command: names, options and help; what they do stands in the modules beside it."""

import sys
from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console

app = typer.Typer(
    name="fras",
    help="Autonomous tissue retraction: plan, watch, move, explain, record.",
    no_args_is_help=True,
    add_completion=True,
    pretty_exceptions_enable=False,
    context_settings={"help_option_names": ["-h", "--help"]},
)
log_app = typer.Typer(help="Look into audit logs.", no_args_is_help=True)
scenario_app = typer.Typer(help="Make and check scenario files.", no_args_is_help=True)
app.add_typer(log_app, name="log")
app.add_typer(scenario_app, name="scenario")

Cell = Annotated[str, typer.Option(help="Cell: stacks of different cells don't hear each other.")]
AspDir = Annotated[Path | None, typer.Option(help="Rules of your own, laid out like asp/.")]
Compose = Annotated[
    str, typer.Option(help="Processes of an own stack: local, crtk, or a file like theirs.")
]
Connect = Annotated[
    str | None, typer.Option(help="Endpoint of a router whose stack to use, tcp/HOST:PORT.")
]


def _print_version(asked: bool) -> None:
    if asked:
        from importlib.metadata import version

        print(f"fras {version('fras')}")
        raise typer.Exit


@app.callback()
def common(
    version: Annotated[
        bool,
        typer.Option("--version", callback=_print_version, is_eager=True, help="Show the version."),
    ] = False,
) -> None:
    """Autonomous tissue retraction: plan, watch, move, explain, record."""


SERVICE_ARGUMENTS = {"allow_extra_args": True, "ignore_unknown_options": True}


def _log_file(log: Path) -> Path:
    """Return the log that a run's folder holds, or the file that was named."""
    return log / "audit.mcap" if log.is_dir() else log


def _console(as_json: bool = False) -> Console:
    return Console(stderr=as_json)


@app.command()
def run(
    scenario: Annotated[
        str, typer.Argument(help="A scenario file, or of ours: default, a, b, c, slab.")
    ] = "default",
    seed: Annotated[int | None, typer.Option(help="Draw the scene from this seed.")] = None,
    seeds: Annotated[
        str | None, typer.Option(help="Many seeds, A..B, through one stack.", metavar="A..B")
    ] = None,
    pace: Annotated[
        float | None, typer.Option(help="Simulated seconds a second; 0: as fast as possible.")
    ] = None,
    out: Annotated[
        Path | None, typer.Option(help="The run's own folder.", show_default="runs/<stamp>-<seed>")
    ] = None,
    ignore_ap: Annotated[
        bool, typer.Option("--ignore-ap", help="First grasp nearest the ROI, attached or not.")
    ] = False,
    no_limit: Annotated[
        bool, typer.Option("--no-limit", help="Switch the force limits off.")
    ] = False,
    criterion: Annotated[
        str | None, typer.Option(help="sum, literal, lex, nearest or weighted.")
    ] = None,
    mesh: Annotated[
        str | None, typer.Option(help="Node counts of the tissue.", metavar="NX,NY,NZ")
    ] = None,
    json: Annotated[
        bool, typer.Option("--json", help="Print the summary as JSON on standard output.")
    ] = False,
    asp_dir: AspDir = None,
    compose: Compose = "local",
    cell: Cell = "local",
    connect: Connect = None,
    port: Annotated[
        int | None, typer.Option(help="Start an own stack with its router on this port.")
    ] = None,
) -> None:
    """Run a trial: the stack of `fras up` if there is one in the cell, else an own one."""
    from fras_cli.options import build_trial, choose_seeds
    from fras_cli.run import default_out, run_trials
    from fras_cli.stack import Layout

    chosen = choose_seeds(seed, seeds)
    trials = [
        build_trial(
            scenario,
            seed=one,
            pace=pace,
            ignore_ap=ignore_ap,
            no_limit=no_limit,
            criterion=criterion,
            mesh=mesh,
        )
        for one in chosen
    ]
    folder = out or default_out(seeds or str(trials[0].scenario.seed))
    raise typer.Exit(
        run_trials(
            [trial.scenario for trial in trials],
            mesh=trials[0].mesh,
            out=folder,
            cell=cell,
            connect=connect,
            port=port,
            console=_console(json),
            as_json=json,
            layout=Layout(compose, asp_dir),
        )
    )


@app.command()
def up(
    cell: Cell = "local",
    port: Annotated[int, typer.Option(help="Port of the router.")] = 7447,
    logs: Annotated[
        Path | None, typer.Option(help="Folder of the logs.", show_default="runs/up-<cell>/logs")
    ] = None,
    asp_dir: AspDir = None,
    compose: Compose = "local",
) -> None:
    """Start the stack and keep it, for `fras run` and for clients of your own."""
    from fras_cli.keep import up
    from fras_cli.stack import Layout

    folder = logs or Path("runs") / f"up-{cell}" / "logs"
    raise typer.Exit(up(cell, port, folder, _console(), Layout(compose, asp_dir)))


@app.command()
def down(cell: Cell = "local") -> None:
    """Stop the stack that `fras up` keeps."""
    from fras_cli.keep import down

    raise typer.Exit(down(cell, _console()))


@app.command()
def status(cell: Cell = "local", connect: Connect = None) -> None:
    """Show services, health and task of a cell."""
    from fras_cli.keep import status

    raise typer.Exit(status(cell, connect, _console()))


@app.command()
def stop(
    reason: Annotated[str, typer.Option(help="Why; it stands in the audit log.")] = "stop pressed",
    cell: Cell = "local",
    connect: Connect = None,
) -> None:
    """Stop the arms now; they stay where they are until `fras resume`."""
    from fras_cli.keep import hold

    raise typer.Exit(hold(cell, connect, reason, _console()))


@app.command("why-not")
def why_not(
    question: Annotated[str, typer.Argument(help="A block, b(3,4), or an action, release(psm1).")],
    cell: Cell = "local",
    connect: Connect = None,
) -> None:
    """Ask a running planner why its latest plan is not another one."""
    from fras_cli.keep import why_not

    raise typer.Exit(why_not(question, cell, connect, _console()))


@app.command()
def resume(
    holder: Annotated[str, typer.Option(help="Whose hold to lift.")] = "cli",
    cell: Cell = "local",
    connect: Connect = None,
) -> None:
    """Lift a hold."""
    from fras_cli.keep import resume

    raise typer.Exit(resume(cell, connect, holder, _console()))


@app.command()
def plan(
    contexts: Annotated[
        Path, typer.Argument(help="A context as JSON, or a list of them; - for standard input.")
    ],
    criterion: Annotated[
        str, typer.Option(help="sum, literal, lex, nearest or weighted, or one of your own.")
    ] = "weighted",
    goal: Annotated[
        str, typer.Option(help="visible: the ROI is seen; clear: and no arm is at its limit.")
    ] = "visible",
    asp_dir: AspDir = None,
    why_not: Annotated[
        list[str] | None,
        typer.Option(
            help="Why not this block, or this action first? May be given more than once.",
            metavar="'b(3,4)' or 'pull(psm1,b(3,4))'",
        ),
    ] = None,
    json: Annotated[bool, typer.Option("--json", help="Print the plans as JSON.")] = False,
) -> None:
    """Plan from a context, and explain the plan; no service needs to run."""
    from fras_cli.plan import plan as plan_file

    raise typer.Exit(
        plan_file(
            contexts,
            criterion=criterion,
            goal=goal,
            asp_dir=asp_dir,
            questions=why_not or [],
            as_json=json,
            console=Console(),
        )
    )


@app.command()
def report(
    log: Annotated[Path, typer.Argument(help="An audit log, or a run's folder.")],
    out: Annotated[
        Path | None, typer.Option(help="Where to write.", show_default="beside the log")
    ] = None,
) -> None:
    """Write summary.json and report.html from an audit log alone."""
    from fras_cli.display import print_summary
    from fras_cli.report import write_report

    path = _log_file(log)
    folder = out or path.parent
    summary = write_report(path, folder)
    print_summary(_console(), summary, [("report", str(folder / "report.html"))])


@app.command()
def audit(
    log: Annotated[Path, typer.Argument(help="An audit log, or a run's folder.")],
    only: Annotated[
        str | None,
        typer.Option(help="Some services: sa, planner, motion, sim.", metavar="SERVICE,..."),
    ] = None,
    asp_dir: Annotated[
        Path | None,
        typer.Option(help="Instead: what would these rules, laid out like asp/, have decided?"),
    ] = None,
    json: Annotated[bool, typer.Option("--json", help="Print the result as JSON.")] = False,
) -> None:
    """Derive every decision and state of a log again, and compare; 0 only if all are equal."""
    from fras_common.threads import one_thread

    # As in the services, before any numerical library: sums in their order, to the last bit.
    one_thread()
    from fras_cli.audit import audit, other_rules

    path = _log_file(log)
    if asp_dir is not None:
        status = other_rules(path, asp_dir, as_json=json, console=Console())
    else:
        status = audit(path, only, as_json=json, console=Console())
    raise typer.Exit(status)


@app.command()
def replay(
    log: Annotated[Path, typer.Argument(help="An audit log, or a run's folder.")],
    cell: Annotated[
        str, typer.Option(help="Cell to replay into; no service may be there.")
    ] = "replay",
    connect: Annotated[
        str | None,
        typer.Option(help="Endpoint of a router, tcp/HOST:PORT.", show_default="an own one"),
    ] = None,
    rate: Annotated[float, typer.Option(help="Seconds of the log a second, 0.1 to 100.")] = 1.0,
    fast: Annotated[
        bool, typer.Option("--as-fast-as-possible", help="As fast as messages go out.")
    ] = False,
    loop: Annotated[bool, typer.Option("--loop", help="Begin anew at the end.")] = False,
    paused: Annotated[bool, typer.Option("--paused", help="Stand still at the start.")] = False,
    stay: Annotated[
        bool, typer.Option("--stay", help="Stay at the end until told to stop.")
    ] = False,
    first: Annotated[
        str | None,
        typer.Option("--from", help="Where to begin: a tick, or seconds.", metavar="TICK|2.5s"),
    ] = None,
    last: Annotated[
        str | None,
        typer.Option("--to", help="Where to end, that tick included.", metavar="TICK|2.5s"),
    ] = None,
    include: Annotated[
        list[str] | None,
        typer.Option(help="Replay this key or family (sim/**) only; may be given again."),
    ] = None,
    exclude: Annotated[
        list[str] | None, typer.Option(help="Leave this key or family out; may be given again.")
    ] = None,
    remap: Annotated[
        list[str] | None,
        typer.Option(help="Send a key, or family, under another name.", metavar="OLD=NEW"),
    ] = None,
) -> None:
    """Play a log back onto the bus: keys in the terminal or queries control it, as it runs."""
    from fras_cli.replay import UNLIMITED, Wanted
    from fras_cli.replay import replay as replay_log

    wanted = Wanted(
        cell,
        connect,
        rate=UNLIMITED if fast else rate,
        loop=loop,
        paused=paused,
        stay=stay,
        first=first,
        last=last,
        include=include or (),
        exclude=exclude or (),
        remap=remap or (),
    )
    raise typer.Exit(replay_log(_log_file(log), wanted, _console()))


@app.command(context_settings=SERVICE_ARGUMENTS)
def bench(
    context: typer.Context,
    name: Annotated[
        str | None, typer.Argument(help="Which; without it, the list.", metavar="[NAME]")
    ] = None,
) -> None:
    """Measure: `fras bench NAME`, with that benchmark's own options behind."""
    from fras_cli.bench import list_benchmarks, run_benchmark

    if name is None:
        list_benchmarks(_console())
    else:
        raise typer.Exit(run_benchmark(name, context.args))


@log_app.command("info")
def log_info(
    log: Annotated[Path, typer.Argument(help="An audit log, or a run's folder.")],
) -> None:
    """List the keys of a log with counts and rates, and how the trial ended."""
    from fras_cli.log_info import print_info

    print_info(_log_file(log), _console())


@log_app.command("verify")
def log_verify(
    log: Annotated[Path, typer.Argument(help="An audit log, or a run's folder.")],
    asp_dir: Annotated[
        Path | None, typer.Option(help="Specifications of your own, laid out like asp/.")
    ] = None,
    key: Annotated[
        list[Path] | None,
        typer.Option(help="Public key to trust instead of this machine's; may be given again."),
    ] = None,
    head: Annotated[
        str, typer.Option(help="Head of the chain, as noted when the log was closed.")
    ] = "",
) -> None:
    """Tell whether a log is what was recorded, and its trial kept to the safety specifications."""
    from fras_cli.log_verify import verify_log

    raise typer.Exit(verify_log(_log_file(log), asp_dir, _console(), keys=key or [], head=head))


@log_app.command("recover")
def log_recover(
    log: Annotated[Path, typer.Argument(help="A damaged audit log, or a run's folder.")],
    out: Annotated[
        Path | None, typer.Option(help="File to write.", show_default="LOG.recovered.mcap")
    ] = None,
) -> None:
    """Write what a damaged log still holds into a new one; the old one stays as it is."""
    from fras_cli.log_recover import recover_log

    raise typer.Exit(recover_log(_log_file(log), out, _console()))


@log_app.command("show")
def log_show(
    log: Annotated[Path, typer.Argument(help="An audit log, or a run's folder.")],
    key: Annotated[str, typer.Argument(help="One of the keys that `fras log info` lists.")],
    json: Annotated[bool, typer.Option("--json", help="JSON, one message a line.")] = False,
    first: Annotated[int | None, typer.Option("--from", help="First tick to show.")] = None,
    last: Annotated[int | None, typer.Option("--to", help="Last tick to show.")] = None,
) -> None:
    """Show the messages of one key."""
    from fras_cli.log_show import show_log

    show_log(_log_file(log), key, _console(json), as_json=json, first_tick=first, last_tick=last)


@log_app.command("export")
def log_export(
    log: Annotated[Path, typer.Argument(help="An audit log, or a run's folder.")],
    foxglove: Annotated[
        bool, typer.Option("--foxglove", help="Write an MCAP file for Foxglove and Lichtblick.")
    ] = False,
    rerun: Annotated[
        bool, typer.Option("--rerun", help="Write an .rrd file for Rerun; needs the extra `rerun`.")
    ] = False,
    out: Annotated[
        Path | None,
        typer.Option(
            help="File to write; with both formats, its name without the ending.",
            show_default="beside the log",
        ),
    ] = None,
    force: Annotated[bool, typer.Option("--force", help="Overwrite what is there.")] = False,
    layout: Annotated[
        bool, typer.Option("--layout", help="Write a layout to import beside the Foxglove file.")
    ] = False,
) -> None:
    """Export a trial for viewers: scene, force and visibility, and the plans' reasons."""
    from fras_cli.log_export import export_log
    from fras_log.export import Format

    kinds = [Format.FOXGLOVE] * foxglove + [Format.RERUN] * rerun
    raise typer.Exit(export_log(_log_file(log), kinds, out, force, layout, _console()))


@scenario_app.command("new")
def scenario_new(
    seed: Annotated[int, typer.Option(help="Seed of the scene.")],
    out: Annotated[
        Path | None, typer.Option(help="File to write.", show_default="standard output")
    ] = None,
    base: Annotated[str, typer.Option(help="Scenario whose other fields to take.")] = "default",
) -> None:
    """Draw a scene from a seed and write it as a scenario file of its own."""
    from fras_cli.options import write_new_scenario

    write_new_scenario(base, seed, out)


@scenario_app.command("check")
def scenario_check(
    scenario: Annotated[str, typer.Argument(help="A scenario file.")],
) -> None:
    """Check a scenario file without running it."""
    from fras_cli.options import build_scenario

    checked = build_scenario(scenario)
    tissue = checked.tissue
    mesh = tissue.mesh_file or f"{tissue.node_counts} nodes"
    _console().print(f"{scenario}: fine; seed {checked.seed}, {mesh}")


# Extra and module of what is not `fras_<name>`.
_MODULES = {
    "router": ("router", "fras_common.router"),
    "arms": ("motion", "fras_motion.arms_main"),
}


def _service(name: str, help_text: str) -> None:
    """Register `fras <name>`: the service's own main, with its own arguments."""

    @app.command(name, help=help_text, context_settings=SERVICE_ARGUMENTS, add_help_option=False)
    def command(context: typer.Context) -> None:
        import importlib

        from fras_common.service.extras import require_extra

        extra, module = _MODULES.get(name, (name, f"fras_{name}.__main__"))
        with require_extra(extra):
            main = importlib.import_module(module).main
        raise typer.Exit(main(context.args))

    _ = command


for _name, _help in {
    "router": "Run a Zenoh router.",
    "sim": "Run the tissue simulator.",
    "sa": "Run situation awareness.",
    "planner": "Run the planner and its executive.",
    "motion": "Run motion.",
    "arms": "Play two arms under CRTK's keys, for `fras motion --driver crtk`.",
    "recorder": "Run the recorder.",
}.items():
    _service(_name, _help)


def main() -> None:
    """Run the command; a known error is one line and an exit status, not a traceback."""
    from fras_cli.failures import EXIT_BAD_INPUT, exit_status
    from fras_common.errors import FrasError

    try:
        app()
    except FrasError as error:
        print(f"fras: {error}", file=sys.stderr)
        sys.exit(exit_status(error))
    except OSError as error:
        print(f"fras: {error.filename or 'a file'}: {error.strerror or error}", file=sys.stderr)
        sys.exit(EXIT_BAD_INPUT)
