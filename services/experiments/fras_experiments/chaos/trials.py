"""One trial, from its log alone: what it did undisturbed, and what holds where it was disturbed."""

import importlib
from collections.abc import Sequence
from itertools import groupby
from pathlib import Path

from fras_common.errors import FrasError
from fras_common.messages import RobotState
from fras_experiments.chaos.evidence import Evidence, read_evidence
from fras_experiments.chaos.faults import Stretch
from fras_experiments.chaos.injector import Injected
from fras_experiments.chaos.invariants import OVER, Breach, Undisturbed, look
from fras_experiments.chaos.recovery import recovery_s, stalls
from fras_experiments.chaos.results import FaultRecord, TrialRecord
from fras_log import verify_file

DERIVED = ("sa", "planner", "motion")


class NothingToDisturb(FrasError):
    """The trial has no ticks even where nothing happens."""


def course_of(states: Sequence[RobotState]) -> tuple[Stretch, ...]:
    """Tell what the arms do over a trial, stretch by stretch.

    Raises
    ------
    NothingToDisturb
    """
    moving = [
        (f"{state.action.name}/{state.action.phase}", state.tick)
        for state in states
        if state.action is not None and state.action.phase not in OVER
    ]
    found: list[Stretch] = []
    for name, run in groupby(moving, key=lambda one: one[0]):
        ticks = sorted({tick for _, tick in run})
        found.append(Stretch(name, ticks[0], ticks[-1] - ticks[0] + 1))
    if not found:
        raise NothingToDisturb("no arm moves in this scenario: choose another one")
    return tuple(found)


def undisturbed_of(log: Path) -> tuple[Undisturbed, tuple[Stretch, ...], int]:
    """Read what a trial does when nothing happens, and how many ticks it has."""
    evidence, _ = read_evidence(log)
    forces = [one.max_force_n for one in evidence.verdicts]
    ending = evidence.ending
    return (
        Undisturbed(ending.outcome if ending else "", max(forces, default=0.0)),
        course_of(evidence.states),
        evidence.states[-1].tick,
    )


def judge(
    number: int,
    log: Path,
    folder: Path,
    injected: Sequence[Injected],
    undisturbed: Undisturbed,
    wall_s: float,
    *,
    audit: bool,
) -> TrialRecord:
    """Hold a trial's log against all that must hold.

    Parameters
    ----------
    folder : Path
        Of the campaign.
    audit : bool
        Whether each decision is derived again, too.
    """
    try:
        evidence = read_evidence(log)[0]
    except FrasError as error:
        evidence = Evidence("")
        breaches = [Breach("intact", str(error))]
    else:
        breaches = [*_verified(log), *look(evidence, undisturbed)]
    audited = 0
    if audit and not breaches:
        derived, audited = _derived(log)
        breaches += derived
    ending = evidence.ending
    return TrialRecord(
        number=number,
        faults=_came_of(injected, evidence),
        outcome=ending.outcome if ending else "",
        reason=ending.reason if ending else "the log does not say how it ended",
        breaches=tuple(breaches),
        ticks=max((one.tick for one in evidence.states), default=0),
        wall_s=round(wall_s, 3),
        audited=audited,
        log=str(log.relative_to(folder)),
    )


def _verified(log: Path) -> list[Breach]:
    found = verify_file(log)
    breaches = [Breach("intact", str(one), one.tick) for one in found.findings]
    if not found.closed:
        breaches.append(Breach("intact", "the recorder did not finish the log"))
    if found.chained != found.messages:
        text = f"the chain vouches for {found.chained} of {found.messages} messages"
        breaches.append(Breach("intact", text))
    return breaches


def _derived(log: Path) -> tuple[list[Breach], int]:
    # Only where it is asked for: it knows every core.
    audit_log = importlib.import_module("fras_audit").audit_log
    report = audit_log(log, DERIVED, _unseen)
    breaches = [
        Breach("derived", f"{tally.service}, {tally.what}: {tally.differences} differ")
        for tally in report.tallies
        if not tally.is_clean
    ]
    return breaches, report.compared


def _unseen(service: str, done: int, total: int) -> None:
    """Nobody watches the audit of a campaign."""


def _came_of(injected: Sequence[Injected], evidence: Evidence) -> tuple[FaultRecord, ...]:
    # Ticks are told by motion's clock, unless that is what jumped.
    jumped = any(one.fault.kind == "clock" and one.fault.victim == "motion" for one in injected)
    found = stalls(evidence.tick_times_ns(by_arrival=jumped))
    ends_ns = [one.at_ns for one in injected[1:]] + [0]
    return tuple(
        FaultRecord(
            fault=one.fault,
            at_ns=one.at_ns,
            until_ns=one.until_ns,
            recovery_s=recovery_s(one.at_ns, end_ns or 2**63, found) if one.at_ns else None,
        )
        for one, end_ns in zip(injected, ends_ns, strict=True)
    )
