"""Any process killed with SIGKILL at any tick: it starts again, and the trial goes on.

A few of all combinations run each time, several in one trial; `make test-full` kills each service
in each phase, in a trial of its own.
"""

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import msgspec
import pytest

from fras_audit import SERVICES, audit_log
from fras_common.messages import RobotState, TissueState, Verdict
from fras_log import verify_file
from support import campaign
from support.cells import Cell, Kill, in_phase, ticks_of
from support.logs import messages

# Scenario, action and phase.
PHASES = {
    "approach": ("a", "reach", "traverse"),
    "grasp": ("a", "grasp", "close"),
    "pull": ("a", "pull", "lift"),
    "move": ("b", "move", "carry"),
    "release": ("c", "release", "open"),
}
Case = tuple[tuple[str, str], ...]
ALL: list[Case] = [
    ((victim, phase),)
    for victim in ("sim", "sa", "planner", "motion", "router")
    for phase in PHASES
]
# Who is killed one after the other in one trial.
FEW: list[Case] = [
    (("sa", "grasp"), ("sim", "pull"), ("sa", "pull")),
    (("planner", "approach"), ("planner", "pull")),
    (("router", "pull"), ("motion", "pull")),
    (("sim", "release"), ("motion", "release")),
]
CASES = campaign.length(ALL, FEW)
# Once each of these is back, everything goes on as if nothing had been.
UNNOTICED = {"sim", "sa"}
STOP_FORCE_N = 0.05
# What each says in every trial that it takes up.
SAYS = {
    "sim": "sim/tissue_state",
    "sa": "sa/verdict",
    "motion": "robot/state",
    "planner": "planner/task_status",
}


@pytest.fixture(scope="module")
def cell(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Cell]:
    made = Cell(tmp_path_factory.mktemp("cell"))
    yield made
    made.close()


class Undisturbed:
    """Logs of trials that nothing happened to, by scenario."""

    def __init__(self, cell: Cell) -> None:
        self._cell = cell
        self._logs: dict[str, Path] = {}

    def log(self, scenario: str) -> Path:
        if scenario not in self._logs:
            self._logs[scenario] = self._cell.run(scenario)[1]
        return self._logs[scenario]


@pytest.fixture(scope="module")
def undisturbed(cell: Cell) -> Undisturbed:
    return Undisturbed(cell)


def untold(message: Any) -> Any:
    """All of a message but who said it when, in which trial, and how long it took."""
    if isinstance(message, TissueState):
        message = msgspec.structs.replace(
            message, solver=msgspec.structs.replace(message.solver, wall_s=0.0)
        )
    return msgspec.structs.replace(message, stamp_ns=0, seq=0, source="", trial="")


def by_tick(log: Path, key: str) -> dict[int, Any]:
    return {one.tick: untold(one) for one in messages(log, key)}


@pytest.mark.parametrize("case", CASES, ids=lambda case: "+".join(map("-".join, case)))
def test_the_trial_goes_on(cell: Cell, undisturbed: Undisturbed, case: Case) -> None:
    (scenario,) = {PHASES[phase][0] for _, phase in case}
    victims = {victim for victim, _ in case}
    reference = undisturbed.log(scenario)
    kills = [Kill(victim, in_phase(*PHASES[phase][1:])) for victim, phase in case]
    cell.kill_at(kills)
    end, log = cell.run(scenario)
    assert [kill.victim for kill in kills if not kill.back_ns] == [], "these were not killed"
    assert (end.outcome, end.reason) == ("success", "the region of interest is visible")
    found = verify_file(log)
    assert [str(finding) for finding in found.findings] == []

    states: list[RobotState] = messages(log, "robot/state")
    last = states[-1].tick
    for key in ("robot/state", "sim/tissue_state", "sa/verdict"):
        assert ticks_of(log, key) == set(range(last + 1)), key
    # A tick that was said twice was the same tick.
    for tick, state in {one.tick: one for one in states}.items():
        poses = {
            tuple((arm.tip_in_world, arm.jaw_rad) for arm in one.arms.values())
            for one in states
            if one.tick == tick
        }
        assert len(poses) == 1, state
    verdicts: list[Verdict] = messages(log, "sa/verdict")
    expected: list[Verdict] = messages(reference, "sa/verdict")
    bound_n = max(one.max_force_n for one in expected) + STOP_FORCE_N
    assert max(one.max_force_n for one in verdicts) <= bound_n

    # While one was away nothing moved: one tick may have been on its way.
    for kill in kills:
        while_away = {one.tick for one in states if kill.killed_ns < one.stamp_ns < kill.back_ns}
        assert kill.victim == "planner" or len(while_away) <= 1, kill.victim
    # Every decision follows from the log, over the restart too; the tissue where sim was killed.
    derived = [name for name in SERVICES if name != "sim" or "sim" in victims]
    report = audit_log(log, derived, lambda service, done, total: None)
    assert [tally for tally in report.tallies if not tally.is_clean] == []

    if victims <= UNNOTICED:
        for key in ("sim/tissue_state", "sa/verdict"):
            assert by_tick(log, key) == by_tick(reference, key)
        assert end.plans == messages(reference, "planner/task_status")[-1].plans
    for victim in victims - {"router"}:
        lives = {one.source for one in messages(log, SAYS[victim])}
        assert len(lives) == 1 + [kill.victim for kill in kills].count(victim), lives
