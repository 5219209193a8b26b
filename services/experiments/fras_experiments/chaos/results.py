"""What a campaign found: one record a trial, as `chaos.json` has it."""

import math
from collections.abc import Iterable, Sequence
from pathlib import Path

import msgspec

from fras_common.files import write_whole
from fras_experiments.chaos.faults import KINDS, Fault, Kind
from fras_experiments.chaos.invariants import Breach

KILLS: tuple[Kind, ...] = ("kill", "router")


class FaultRecord(msgspec.Struct, frozen=True, kw_only=True):
    """A fault and what came of it.

    Attributes
    ----------
    at_ns : int
        When it happened [ns since the Unix epoch]; 0: the trial ended before.
    recovery_s : float or None
        From the fault to the next tick, where ticks stood still; None where they did not, or where
        none followed.
    """

    fault: Fault
    at_ns: int
    until_ns: int
    recovery_s: float | None


class TrialRecord(msgspec.Struct, frozen=True, kw_only=True):
    """One trial.

    Attributes
    ----------
    outcome, reason : str
        As its log says; "" and a text where the log does not.
    audited : int
        Messages derived again; 0 where that was not asked for.
    log : str
        Relative to the campaign's folder.
    """

    number: int
    faults: tuple[FaultRecord, ...]
    outcome: str
    reason: str
    breaches: tuple[Breach, ...]
    ticks: int
    wall_s: float
    audited: int
    log: str


class Campaign(msgspec.Struct, frozen=True, kw_only=True):
    """A campaign, whole or as far as it has come.

    Attributes
    ----------
    asked : int
        Trials asked for.
    undisturbed_ticks, undisturbed_force_n : int, float
        Of the trial in which nothing happened.
    load : tuple of float
        Load of the machine over one minute, when it began and when it ended.
    cores : int
    """

    scenario: str
    seed: int
    kinds: tuple[Kind, ...]
    asked: int
    undisturbed_ticks: int
    undisturbed_force_n: float
    load: tuple[float, float]
    cores: int
    trials: tuple[TrialRecord, ...]

    @property
    def broken(self) -> tuple[TrialRecord, ...]:
        """Trials in which something did not hold."""
        return tuple(one for one in self.trials if one.breaches)


class Row(msgspec.Struct, frozen=True):
    """One kind of fault over all trials."""

    name: str
    happened: int
    success: int
    held: int
    broken: int
    stalled: int
    p50_s: float | None
    p95_s: float | None
    max_s: float | None


Pair = tuple[TrialRecord, FaultRecord]


def named(campaign: Campaign) -> dict[str, list[Pair]]:
    """Faults that happened, with their trials, by what happened to whom."""
    found: dict[str, list[Pair]] = {}
    order = {kind: place for place, kind in enumerate(KINDS)}
    for trial in campaign.trials:
        for one in trial.faults:
            if one.at_ns:
                found.setdefault(_name(one.fault), []).append((trial, one))
    names = sorted(found, key=lambda name: (order[found[name][0][1].fault.kind], name))
    return {name: found[name] for name in names}


def rows(campaign: Campaign) -> tuple[Row, ...]:
    """Count by fault; the last one is all kills."""
    found = named(campaign)
    kills = [pair for pairs in found.values() for pair in pairs if pair[1].fault.kind in KILLS]
    return (*(_row(name, pairs) for name, pairs in found.items()), _row("all kills", kills))


def _name(fault: Fault) -> str:
    return f"kill {fault.victim}" if fault.kind in KILLS else f"{fault.kind} {fault.victim}"


def _row(name: str, pairs: Sequence[Pair]) -> Row:
    trials = {trial.number: trial for trial, _ in pairs}
    times = sorted(one.recovery_s for _, one in pairs if one.recovery_s is not None)
    return Row(
        name,
        len(pairs),
        sum(one.outcome == "success" for one in trials.values()),
        sum(one.reason.startswith("hold:") for one in trials.values()),
        sum(bool(one.breaches) for one in trials.values()),
        len(times),
        percentile(times, 0.5),
        percentile(times, 0.95),
        times[-1] if times else None,
    )


def percentile(ordered: Sequence[float], share: float) -> float | None:
    """Return the smallest value that at least this share does not exceed; None of nothing."""
    if not ordered:
        return None
    return ordered[max(0, math.ceil(share * len(ordered)) - 1)]


def save(campaign: Campaign, path: Path) -> None:
    """Write it, whole or not at all."""
    write_whole(path, msgspec.json.format(msgspec.json.encode(campaign), indent=2) + b"\n")


def load(path: Path) -> Campaign:
    """Read it back.

    Raises
    ------
    msgspec.ValidationError, OSError
    """
    return msgspec.json.decode(path.read_bytes(), type=Campaign)


def breaches_of(campaign: Campaign) -> Iterable[tuple[int, Breach]]:
    """Each breach, with the number of its trial."""
    return ((trial.number, one) for trial in campaign.trials for one in trial.breaches)
