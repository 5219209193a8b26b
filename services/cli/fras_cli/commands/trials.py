"""Commands that run a trial, lead it and plan."""

from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console

from fras_cli.commands.shared import (
    AspDir,
    Cell,
    Compose,
    Connect,
    Mesh,
    PlanId,
    ScenarioName,
    Secure,
    console,
)
from fras_common.signals import silent_interrupt

trials_app = typer.Typer()


@trials_app.command()
@silent_interrupt()
def run(
    scenario: ScenarioName = "default",
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
        str | None, typer.Option(help="sum, literal, lex, nearest, weighted or capped.")
    ] = None,
    mesh: Mesh = None,
    confirm: Annotated[
        bool, typer.Option("--confirm", help="Ask in the terminal before each plan is done.")
    ] = False,
    json: Annotated[
        bool, typer.Option("--json", help="Print the summary as JSON on standard output.")
    ] = False,
    asp_dir: AspDir = None,
    compose: Compose = "local",
    secure: Secure = False,
    cell: Cell = "local",
    connect: Connect = None,
    port: Annotated[
        int | None, typer.Option(help="Start an own stack with its router on this port.")
    ] = None,
    view: Annotated[bool, typer.Option("--view", help="Serve the surgeon's page beside.")] = False,
    view_port: Annotated[int, typer.Option(help="Where: 127.0.0.1 and this port.")] = 8080,
) -> None:
    """Run a trial: the stack of `fras up` if there is one in the cell, else an own one."""
    from fras_cli.confirm import require_terminal
    from fras_cli.layout import layout_of
    from fras_cli.options import build_trial, choose_seeds
    from fras_cli.run import default_out, run_trials
    from fras_cli.viewing import Page

    if confirm:
        require_terminal()
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
            confirm=confirm,
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
            console=console(json),
            as_json=json,
            layout=layout_of(compose, asp_dir, secure=secure),
            asks=confirm,
            page=Page(port=view_port) if view else None,
        )
    )


@trials_app.command()
def stop(
    reason: Annotated[str, typer.Option(help="Why; it stands in the audit log.")] = "stop pressed",
    cell: Cell = "local",
    connect: Connect = None,
) -> None:
    """Stop the arms now; they stay where they are until `fras resume`."""
    from fras_cli.keep import hold

    raise typer.Exit(hold(cell, connect, reason, console()))


@trials_app.command()
def approve(
    plan: PlanId = "",
    cell: Cell = "local",
    connect: Connect = None,
) -> None:
    """Let the plan that waits be done; 0 if that was taken, 1 if it was refused."""
    from fras_cli.decide import approve

    raise typer.Exit(approve(cell, connect, plan, console()))


@trials_app.command()
def reject(
    reason: Annotated[str, typer.Option(help="Why; it stands in the plan and the audit log.")],
    exclude: Annotated[
        list[str] | None,
        typer.Option(
            help="A block or an arm that no later plan grasps (with); may be given again.",
            metavar="'b(3,4)' or psm1",
            show_default="what the plan grasps or holds",
        ),
    ] = None,
    plan: PlanId = "",
    cell: Cell = "local",
    connect: Connect = None,
) -> None:
    """Have another plan made than the one that waits, without what is excluded."""
    from fras_cli.decide import reject

    raise typer.Exit(reject(cell, connect, plan, reason, exclude or [], console()))


@trials_app.command("why-not")
def why_not(
    question: Annotated[str, typer.Argument(help="A block, b(3,4), or an action, release(psm1).")],
    cell: Cell = "local",
    connect: Connect = None,
) -> None:
    """Ask a running planner why its latest plan is not another one."""
    from fras_cli.keep import why_not

    raise typer.Exit(why_not(question, cell, connect, console()))


@trials_app.command()
def resume(
    holder: Annotated[str, typer.Option(help="Whose hold to lift.")] = "cli",
    cell: Cell = "local",
    connect: Connect = None,
) -> None:
    """Lift a hold."""
    from fras_cli.keep import resume

    raise typer.Exit(resume(cell, connect, holder, console()))


@trials_app.command()
def plan(
    contexts: Annotated[
        Path, typer.Argument(help="A context as JSON, or a list of them; - for standard input.")
    ],
    criterion: Annotated[
        str, typer.Option(help="sum, literal, lex, nearest, weighted, capped, or one of your own.")
    ] = "capped",
    goal: Annotated[
        str, typer.Option(help="visible: the ROI is seen; clear: and no arm is at its limit.")
    ] = "visible",
    asp_dir: AspDir = None,
    why_not: Annotated[
        list[str] | None,
        typer.Option(
            help="Why not this block, or this action first? May be given again.",
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
