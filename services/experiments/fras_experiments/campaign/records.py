"""What is kept of a trial: what it came to, how long it took, and its force against height."""

import hashlib
from typing import Final

import msgspec

from fras_common.scenario import Scenario

SUCCESS: Final = "success"
PLANNED: Final = "planned"
"""Outcome of a trial that was to end once its first plan was published, and did."""


class Result(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """A trial in numbers: the same on any worker. None: not known, or there is none.

    Attributes
    ----------
    outcome, reason : str
        As its log says. Where its stack or its worker died: aborted, and a reason that begins with
        `stack:` or `worker:`.
    complete : bool
        Whether its log is whole.
    visibility : float or None
        Share of the tissue around the region of interest lifted clear of it, at the end.
    max_force_n : float or None
        Over the trial, by the scenario's metric [N].
    crossings : int
        How often the force rose above the soft limit in pulls.
    longest_above_ticks : int
        Longest run of ticks above it, in one pull.
    actions : int
        How many were done.
    grasp_block, grasp_x_m, grasp_y_m
        The last block that was grasped, and its centre at rest [m].
    roi_x_m, roi_y_m : float
        Region of interest [m].
    lift_m : float or None
        Largest height of the tip above where the last pull began [m].
    patient_max_force_n : float or None
        What the patient bore over the trial, by the scenario's metric [N]; None without a patient,
        as the others of it.
    patient_above_ticks, missed_ticks, needless_ticks : int or None
        Ticks in which the patient bore more than the soft limit; those of them in which the model
        did not say so; ticks in which only the model said so.
    """

    outcome: str
    reason: str
    scenario_kind: str | None = None
    complete: bool = False
    visibility: float | None = None
    max_force_n: float | None = None
    soft_limit_n: float
    hard_limit_n: float
    crossings: int | None = None
    longest_above_ticks: int | None = None
    plans: int | None = None
    replans: int | None = None
    actions: int | None = None
    ticks: int | None = None
    grasp_block: str | None = None
    grasp_x_m: float | None = None
    grasp_y_m: float | None = None
    roi_x_m: float | None = None
    roi_y_m: float | None = None
    lift_m: float | None = None
    patient_max_force_n: float | None = None
    patient_above_ticks: int | None = None
    missed_ticks: int | None = None
    needless_ticks: int | None = None


class Timing(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """How a trial was run; differs from run to run.

    Attributes
    ----------
    worker : str
        Name of the worker.
    wall_s, cpu_s : float [s]
        Of the trial and of making numbers of its log; processor time of stack and worker.
    plan_first_s, plan_median_s : float or None [s]
        Grounding and solving of its plans.
    plan_service_s : float or None [s]
        Of its first plan through the planner: from the stamp of SA's context to that of the plan.
    replan_move_s, replan_release_s : float or None [s]
        The same, of its first later plan that keeps the grasp (scenario B), and of the first that
        releases it (C).
    """

    worker: str
    wall_s: float
    cpu_s: float
    plan_first_s: float | None = None
    plan_median_s: float | None = None
    plan_service_s: float | None = None
    replan_move_s: float | None = None
    replan_release_s: float | None = None


class Lifted(msgspec.Struct, frozen=True, array_like=True):
    """One tick of a lift: height of the tip above its begin [m], force [N], visibility."""

    tick: int
    height_m: float
    force_n: float
    visibility: float


class Record(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """One trial as the store keeps it.

    Attributes
    ----------
    code : str
        What computed it, see `code_version`.
    log : str
        Its log, relative to the results folder; empty where none is kept.
    """

    code: str
    result: Result
    timing: Timing
    series: tuple[Lifted, ...] = ()
    log: str = ""


def key_of(code: str, scenario: Scenario, mesh: bytes) -> str:
    """Hash of what decides a trial's result, and so of where its record is.

    Returns
    -------
    str
        Hexadecimal, 32 digits.
    """
    digest = hashlib.sha256()
    for part in (code.encode(), msgspec.json.encode(scenario), hashlib.sha256(mesh).digest()):
        digest.update(len(part).to_bytes(8, "little") + part)
    return digest.hexdigest()[:32]


def limits_of(scenario: Scenario) -> tuple[float, float]:
    """Soft and hard limit of a scenario [N]."""
    soft_n = scenario.awareness.force_limit_n
    hard_n = scenario.awareness.hard_limit_n
    return soft_n, 2.0 * soft_n if hard_n is None else hard_n


def without_result(scenario: Scenario, reason: str) -> Result:
    """Make the result of a trial that nothing is known of but why."""
    soft_n, hard_n = limits_of(scenario)
    roi_m = scenario.scene.roi_m if scenario.scene else None
    return Result(
        outcome="aborted",
        reason=reason,
        soft_limit_n=soft_n,
        hard_limit_n=hard_n,
        roi_x_m=roi_m[0] if roi_m else None,
        roi_y_m=roi_m[1] if roi_m else None,
    )


def until_plan(scenario: Scenario, *, complete: bool) -> Result:
    """Make the result of a trial that was ended with its first plan.

    How far the arms had come by then differs from run to run, and is not told.
    """
    bare = without_result(scenario, "")
    return msgspec.structs.replace(bare, outcome=PLANNED, complete=complete, plans=1)
