"""What a campaign is, and the trials that it consists of: the same ones on every machine."""

import hashlib
import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from itertools import product
from random import Random
from typing import Annotated, Any, Final, Literal, cast

import msgspec
from msgspec import Meta

from fras_common.scenario import Scenario, ScenarioError, resolve
from fras_common.scenario.loader import convert

MOST_TRIALS: Final = 100_000
Until = Literal["end", "plan"]
FORBIDDEN: Final[dict[str, str]] = {
    "seed": "is what campaign.seeds gives",
    "scene": "is drawn from the seeds; for one scene leave campaign.seeds out, and give the "
    "scene in the scenario's file",
    "tissue.mesh_file": "is the base scenario's: one mesh file a campaign",
    "planner.confirm": "would wait for a person at each plan, and nobody is there",
    "run.supervised": "would wait for a person at the surgeon's page, and nobody is there",
}
"""Fields that no campaign may set, and why."""
GIVEN: Final[dict[str, object]] = {"run.pace": 0.0, "recorder.fsync": False}
"""What trials of a campaign have unless it says otherwise; neither changes a result."""


class BadCampaign(ScenarioError):
    """A campaign that can't be run."""


class _Table(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Base of every table of the file."""


class Draw(_Table, frozen=True, kw_only=True):
    """From where to where a field is drawn, evenly on a linear or a logarithmic scale."""

    low: float
    high: float
    scale: Literal["linear", "log"] = "linear"


class Sample(_Table, frozen=True, kw_only=True):
    """Points drawn by Latin hypercube: each field's range is cut in `count`, each part used once.

    Attributes
    ----------
    fields : dict of str to Draw
        By dotted path. One field's values do not depend on which others are drawn.
    """

    count: Annotated[int, Meta(ge=1, le=MOST_TRIALS)]
    seed: Annotated[int, Meta(ge=0, lt=2**53)] = 0
    fields: dict[str, Draw]


@dataclass(frozen=True, kw_only=True)
class Campaign:
    """Which trials to run.

    Attributes
    ----------
    scenario : str
        The base scenario: a file, or the name of one that comes with FRAS.
    seeds : range or None
        Scenes to draw; None: the base scenario's own seed and scene.
    design : {"factorial", "one-at-a-time"}
        Each value of a swept field with each of the others; or the base once, and then each value
        alone against it.
    set, sweep : dict
        By the dotted path of a scenario's field: one value for all trials, or several to try.
    until : {"end", "plan"}
        Where a trial ends: by itself, or once its first plan is published.
    cases : tuple of dict
        Values that go together; with `factorial` each case meets every other variation.
    """

    name: str
    scenario: str = "default"
    seeds: range | None = None
    design: Literal["factorial", "one-at-a-time"] = "factorial"
    about: str = ""
    until: Until = "end"
    set: dict[str, Any] = field(default_factory=dict[str, Any])
    sweep: dict[str, list[Any]] = field(default_factory=dict[str, list[Any]])
    cases: tuple[dict[str, Any], ...] = ()
    sample: Sample | None = None

    @property
    def varied(self) -> tuple[str, ...]:
        """Paths of the fields that differ between trials: columns of the table."""
        drawn = self.sample.fields if self.sample else {}
        return tuple(dict.fromkeys([*self.sweep, *(p for one in self.cases for p in one), *drawn]))


@dataclass(frozen=True)
class TrialSpec:
    """One trial of a campaign.

    Attributes
    ----------
    number : int
        From 0, in the campaign's order: seed by seed, within a seed point by point.
    labels : mapping of str to value
        What the varied fields are here, by path, in the campaign's order.
    scenario : Scenario
        Resolved.
    """

    number: int
    labels: Mapping[str, object]
    scenario: Scenario


def expand(
    campaign: Campaign,
    base: Scenario,
    where: str,
    fit: Callable[[Scenario], Scenario] = lambda scenario: scenario,
) -> tuple[TrialSpec, ...]:
    """List the trials of a campaign, in its order.

    Parameters
    ----------
    base : Scenario
        What `campaign.scenario` stands for.
    where : str
        The campaign's file or name, for errors.
    fit : callable
        Fits a scenario to the base's mesh file, if it has one.

    Raises
    ------
    BadCampaign
        A field is unknown or not to be varied, nothing or too much is asked for.
    ScenarioError
        A value is not allowed: with its path, and what is.
    NoRoomForRoi
        A scene can't be drawn.
    """
    _refuse_forbidden(campaign, where)
    plain: dict[str, Any] = msgspec.to_builtins(base)
    fields = {**GIVEN, **campaign.set}
    common = msgspec.to_builtins(convert(_with(plain, fields, where), f"{where}: [set]"))
    points = _distinct(_points(campaign, common, where), common, campaign.varied)
    seeds = [None] if campaign.seeds is None else campaign.seeds
    if len(points) * len(seeds) > MOST_TRIALS:
        text = f"{len(points)} points with {len(seeds)} seeds: at most {MOST_TRIALS} trials in all"
        raise BadCampaign(where, "campaign", campaign.name, text)
    varying = f"{where}: {_tables(campaign)}" if campaign.varied else where
    trials: list[TrialSpec] = []
    for seed in seeds:
        seeded = {} if seed is None else {"seed": seed, "scene": None}
        for point in points:
            raw = {**_with(common, point, where), **seeded}
            scenario = resolve(fit(convert(raw, varying)))
            told: dict[str, Any] = msgspec.to_builtins(scenario)
            labels = {path: value_at(told, path) for path in campaign.varied}
            trials.append(TrialSpec(len(trials), labels, scenario))
    return tuple(trials)


def digest_of(campaign: Campaign, trials: Sequence[TrialSpec], mesh: bytes) -> str:
    """SHA-256 over what a campaign asks for: its name, its trials, where they end, the mesh.

    Returns
    -------
    str
        Hexadecimal.
    """
    digest = hashlib.sha256(hashlib.sha256(mesh).digest())
    asked: list[object] = [campaign.name, *((dict(one.labels), one.scenario) for one in trials)]
    # What was asked for before there was a choice is still the same.
    asked += [] if campaign.until == "end" else [campaign.until]
    for part in asked:
        encoded = msgspec.json.encode(part)
        digest.update(len(encoded).to_bytes(8, "little") + encoded)
    return digest.hexdigest()


def value_at(raw: Mapping[str, Any], path: str) -> object:
    """Look up a field of a scenario as plain values; None where its table is absent."""
    found: Any = raw
    for part in path.split("."):
        found = cast("Mapping[str, Any]", found).get(part) if isinstance(found, Mapping) else None
    return found


def _with(raw: Mapping[str, Any], fields: Mapping[str, object], where: str) -> dict[str, Any]:
    """Return a scenario's plain values with some fields changed."""
    changed = dict(raw)
    for path, value in fields.items():
        *tables, name = path.split(".")
        inner = changed
        for depth, table in enumerate(tables):
            below = inner.get(table)
            if below is not None and not isinstance(below, Mapping):
                known = ".".join(tables[: depth + 1])
                raise BadCampaign(where, path, value, f"{known} is no table of the scenario")
            inner[table] = dict(cast("Mapping[str, Any]", below or {}))
            inner = inner[table]
        inner[name] = value
    return changed


def _refuse_forbidden(campaign: Campaign, where: str) -> None:
    for path in (*campaign.set, *campaign.varied):
        for forbidden, why in FORBIDDEN.items():
            if path == forbidden or path.startswith(forbidden + "."):
                value = campaign.set.get(path, campaign.sweep.get(path, "..."))
                raise BadCampaign(where, path, value, why)
    for path in campaign.varied:
        if path in campaign.set:
            text = "stands under [set], too: one of them must go"
            raise BadCampaign(where, path, campaign.set[path], text)
    for path, values in campaign.sweep.items():
        if not values:
            raise BadCampaign(
                where, f"sweep.{path}", values, "zero trials: give at least one value"
            )
    if campaign.sample is not None and not campaign.sample.fields:
        raise BadCampaign(where, "sample.fields", {}, "give at least one field, or no [sample]")
    if campaign.seeds is not None and not campaign.seeds:
        raise BadCampaign(where, "campaign.seeds", "", "zero trials: a range such as 0..19")


def _tables(campaign: Campaign) -> str:
    asked = {"[sweep]": campaign.sweep, "[[cases]]": campaign.cases, "[sample]": campaign.sample}
    return ", ".join(name for name, content in asked.items() if content)


def _points(
    campaign: Campaign, common: Mapping[str, Any], where: str
) -> Iterator[dict[str, object]]:
    swept = [[{path: value} for value in values] for path, values in campaign.sweep.items()]
    cases = list(campaign.cases)
    drawn = _drawn(campaign.sample, common, where) if campaign.sample else []
    if campaign.design == "one-at-a-time":
        yield {}
        for alone in (*swept, cases, drawn):
            yield from alone
        return
    for together in product(*swept, cases or [{}], drawn or [{}]):
        yield {path: value for part in together for path, value in part.items()}


def _distinct(
    points: Iterator[dict[str, object]], common: Mapping[str, Any], varied: Sequence[str]
) -> list[dict[str, object]]:
    """Leave out a point that says what one before it said: the base's own value, swept as well."""
    found: dict[bytes, dict[str, object]] = {}
    for point in points:
        told = [point.get(path, value_at(common, path)) for path in varied]
        found.setdefault(msgspec.json.encode(told), point)
    return list(found.values())


def _drawn(sample: Sample, common: Mapping[str, Any], where: str) -> list[dict[str, object]]:
    columns = {path: _column(sample, path, common, where) for path in sample.fields}
    return [{path: column[row] for path, column in columns.items()} for row in range(sample.count)]


def _column(
    sample: Sample, path: str, common: Mapping[str, Any], where: str
) -> list[float] | list[int]:
    draw, key = sample.fields[path], f"sample.fields.{path}"
    if not (math.isfinite(draw.low) and math.isfinite(draw.high) and draw.low < draw.high):
        raise BadCampaign(where, key, [draw.low, draw.high], "low must be below high")
    if draw.scale == "log" and draw.low <= 0:
        raise BadCampaign(where, f"{key}.low", draw.low, "must be above 0 on a logarithmic scale")
    now = value_at(common, path)
    if now is not None and (isinstance(now, bool) or not isinstance(now, int | float)):
        raise BadCampaign(where, key, now, "is no number: only numbers can be drawn; use [sweep]")
    chance = Random(f"fras campaign {sample.seed} {path}")
    strata = sorted(range(sample.count), key=lambda _: chance.random())
    shares = [(stratum + chance.random()) / sample.count for stratum in strata]
    if draw.scale == "log":
        ratio = draw.high / draw.low
        values = [draw.low * ratio**share for share in shares]
    else:
        values = [draw.low + (draw.high - draw.low) * share for share in shares]
    # Nine digits: what stands in the table is what was run.
    return (
        [round(value) for value in values]
        if isinstance(now, int)
        else [float(f"{value:.9g}") for value in values]
    )
