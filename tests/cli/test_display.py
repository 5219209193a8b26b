"""What a person reads while a trial runs."""

import io

import msgspec
from rich.console import Console

from fras_cli.display import LiveDisplay, action_line, bar, render
from fras_cli.trial import TrialView
from fras_common.messages import TaskStatus
from fras_common.messages.planner import TaskPhase
from support.verdicts import verdict


def task(phase: TaskPhase, action: str = "", goal_id: str = "") -> TaskStatus:
    return TaskStatus(
        phase=phase,
        action=action,
        goal_id=goal_id,
        tried=[],
        plans=1,
        replans=0,
        scenario_kind="A",
        actions=[],
        outcome="",
        reason="",
        violations=[],
    )


def test_action_in_words() -> None:
    assert action_line(TrialView()) == "starting the trial"
    assert action_line(TrialView(task=task("planning"))) == "planning"
    pulling = TrialView(task=task("acting", "pull(psm2,b(1,6))", "g3"))
    assert action_line(pulling) == "action 3: psm2 lifting b(1,6)"
    releasing = TrialView(task=task("acting", "release(psm1)", "g4"))
    assert action_line(releasing) == "action 4: psm1 releasing"


def test_bars_stay_in_their_frame() -> None:
    assert len({len(bar(fraction)) for fraction in (-1.0, 0.0, 0.4, 1.0, 9.0)}) == 1
    assert "·" not in bar(9.0)


def test_view_shows_force_against_limit_and_who_is_waited_for() -> None:
    above = verdict(0, level="soft", reason="force_soft", max_force_n=0.51, visibility=0.42)
    view = TrialView(
        task=task("acting", "pull(psm2,b(1,6))", "g3"),
        verdict=above,
        waiting={"motion": "waiting: sim"},
    )
    output = io.StringIO()
    Console(file=output, width=100).print(render(view))
    assert "0.51 N of 0.50 N" in output.getvalue()
    assert "42.0%" in output.getvalue()
    assert "motion waiting: sim" in output.getvalue()
    assert "crosses" not in output.getvalue()
    coming = msgspec.structs.replace(above, tick=120, crossing_tick=128)
    Console(file=output, width=100).print(render(TrialView(verdict=coming)))
    assert "crosses its limit in about 8 ticks" in output.getvalue()


def test_without_a_terminal_each_change_is_one_line() -> None:
    output = io.StringIO()
    with LiveDisplay(Console(file=output, width=100)) as display:
        for _ in range(3):
            display.show(TrialView(task=task("planning")))
        display.show(TrialView(task=task("ended")))
    assert output.getvalue() == "planning\nended, closing the log\n"
