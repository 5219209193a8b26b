"""The numbers of a trial: `summary.json`, from its log alone."""

import math
from collections.abc import Iterable

import msgspec
import numpy as np
from msgspec import UNSET, UnsetType

from fras_cli.report.trial import Trial

CUT_SHORT = "the log ends before the trial did"


class Percentiles(msgspec.Struct, frozen=True, kw_only=True):
    """Median and 99th percentile of a duration [ms]."""

    p50: float
    p99: float


class PatientSummary(msgspec.Struct, frozen=True, kw_only=True):
    """What the patient bore in truth, beside what its model said; by the scenario's metric.

    Attributes
    ----------
    max_force_n : float
        Over the trial [N].
    believed_max_force_n : float or None
        What the model said it was [N].
    ticks_above_limit : int
        Ticks in which it bore more than the soft limit.
    missed : int
        Those of them in which the model said that it did not.
    needless : int
        Ticks in which the model said so, and it did not.
    """

    max_force_n: float
    believed_max_force_n: float | None
    ticks_above_limit: int
    missed: int
    needless: int


class Summary(msgspec.Struct, frozen=True, kw_only=True):
    """One trial in numbers; None stands for what the log does not say.

    Attributes
    ----------
    outcome : str
        success, no_plan, aborted or failed.
    scenario_kind : str or None
        A: pull; B: a later plan moves; C: a later plan releases.
    visibility : float or None
        Share of the tissue around the region of interest lifted clear of it, at the end.
    max_force_n : float or None
        Over the trial, by the scenario's metric [N].
    limit_n : float
        The soft limit [N].
    violations : list of str or None
        Safety specifications that what was done broke, in words; None if the trial has no end.
    ticks, sim_s : int, float
        Ticks simulated, and the same as simulated time [s].
    wall_s : float
        From the trial's first message to its last [s].
    startup_s : float or None
        From the command to the first tick [s].
    tick_ms : Percentiles or None
        Between consecutive ticks of one action that nobody held.
    fe_ms : Percentiles or None
        The finite-element step alone.
    messages, lost : int
        In the file, and missing in it by their numbering.
    head : str
        Of the log's hash chain, hexadecimal; empty where the log was never closed. Noted elsewhere,
        it tells whether the log was changed since (`fras log verify --head`).
    complete : bool
        Whether the file is whole; else the numbers hold for what came before the cut.
    versions : dict of str to str
    detail : str, optional
        What the gate or the arm that ended the trial's last action said of it.
    patient : PatientSummary, optional
        Left out where the trial has no patient besides its model.
    """

    outcome: str
    reason: str
    seed: int
    scenario_kind: str | None
    visibility: float | None
    max_force_n: float | None
    limit_n: float
    ticks_above_limit: int
    plans: int
    replans: int
    actions: list[str]
    violations: list[str] | None
    ticks: int
    sim_s: float
    wall_s: float
    startup_s: float | None
    tick_ms: Percentiles | None
    fe_ms: Percentiles | None
    messages: int
    lost: int
    log: str
    head: str
    complete: bool
    versions: dict[str, str]
    detail: str | UnsetType = UNSET
    patient: PatientSummary | UnsetType = UNSET


def summarise(trial: Trial) -> Summary:
    """Reduce a trial to its summary."""
    ending = trial.ending
    status = trial.statuses[-1] if trial.statuses else None
    limit_n = trial.scenario.awareness.force_limit_n
    # SA tells what is no number as a negative one; both can have none.
    forces = [v.max_force_n for v in trial.verdicts if 0 <= v.max_force_n < math.inf]
    visibility = trial.verdicts[-1].visibility if trial.verdicts else -1.0
    ticks = max((state.tick for state in trial.robot), default=0)
    return Summary(
        outcome=ending.outcome if ending else "aborted",
        reason=ending.reason if ending else CUT_SHORT,
        seed=trial.scenario.seed,
        scenario_kind=status.scenario_kind if status else None,
        visibility=visibility if visibility >= 0 else None,
        max_force_n=max(forces, default=None),
        limit_n=limit_n,
        ticks_above_limit=sum(force > limit_n for force in forces),
        plans=status.plans if status else 0,
        replans=status.replans if status else 0,
        actions=list(status.actions) if status else [],
        violations=list(ending.violations) if ending else None,
        ticks=ticks,
        # Not 0.30000000000000004 in a file that people read.
        sim_s=round(ticks * trial.dt_s, 9),
        wall_s=(trial.last_ns - trial.first_ns) / 1e9,
        startup_s=_startup_s(trial),
        tick_ms=_percentiles(_tick_ms(trial)),
        fe_ms=_percentiles(1e3 * tissue.wall_s for tissue in trial.tissue if tissue.tick > 0),
        messages=trial.messages,
        lost=trial.lost,
        log=trial.path,
        head=trial.metadata.get("head", ""),
        complete=trial.complete,
        versions=_versions(trial),
        detail=_detail(trial),
        patient=_patient(trial, max(forces, default=None)),
    )


def to_json(summary: Summary) -> bytes:
    """Encode as indented JSON with a final newline."""
    return msgspec.json.format(msgspec.json.encode(summary), indent=2) + b"\n"


def _detail(trial: Trial) -> str | UnsetType:
    last = trial.results[-1] if trial.results else None
    ended = trial.ending is not None and last is not None and trial.ending.reason == last.reason
    return last.text if last is not None and ended and last.text else UNSET


def _patient(trial: Trial, believed_max_n: float | None) -> PatientSummary | UnsetType:
    """Hold what the patient bore against what was believed in the same tick."""
    if not trial.patient:
        return UNSET
    limit_n = trial.scenario.awareness.force_limit_n
    believed_n = {verdict.tick: verdict.max_force_n for verdict in trial.verdicts}
    both = [(force_n, believed_n[tick]) for tick, force_n in trial.borne if tick in believed_n]
    return PatientSummary(
        max_force_n=max(force_n for _, force_n in trial.borne),
        believed_max_force_n=believed_max_n,
        ticks_above_limit=sum(force_n > limit_n for _, force_n in trial.borne),
        missed=sum(force_n > limit_n >= said_n >= 0 for force_n, said_n in both),
        needless=sum(said_n > limit_n >= force_n for force_n, said_n in both),
    )


def _startup_s(trial: Trial) -> float | None:
    if not trial.started_ns or not trial.robot or trial.robot[0].tick != 0:
        return None
    return (trial.robot[0].stamp_ns - trial.started_ns) / 1e9


def _tick_ms(trial: Trial) -> list[float]:
    """Milliseconds between consecutive ticks; planning and a person's hold are no part of it."""
    return [
        (state.stamp_ns - before.stamp_ns) / 1e6
        for before, state in zip(trial.robot, trial.robot[1:], strict=False)
        if state.tick == before.tick + 1
        and state.goal_id == before.goal_id != ""
        and not (state.held or before.held)
    ]


def _percentiles(values_ms: Iterable[float]) -> Percentiles | None:
    values = np.fromiter(values_ms, dtype=np.float64)
    if not values.size:
        return None
    p50, p99 = np.percentile(values, [50, 99])
    return Percentiles(p50=round(float(p50), 4), p99=round(float(p99), 4))


def _versions(trial: Trial) -> dict[str, str]:
    suffix = "_version"
    named = {k.removesuffix(suffix): v for k, v in trial.metadata.items() if k.endswith(suffix)}
    host = trial.metadata.get("host")
    return named | ({"host": host} if host else {})
