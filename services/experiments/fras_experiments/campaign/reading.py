"""A campaign as a file, and those that come with FRAS."""

import hashlib
import tomllib
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Annotated, Any, Final, Literal, cast

import msgspec
import tomlkit

from fras_cli.mesh_input import mesh_path, read_mesh_file
from fras_cli.options import find_scenario, parse_mesh, parse_seeds
from fras_cli.own_rules import read_rules
from fras_common.digests import rules_digest
from fras_common.files import TEXT_BYTES, read_at_most
from fras_common.scenario import Scenario, ScenarioError, load
from fras_experiments.campaign.spec import (
    BadCampaign,
    Campaign,
    Sample,
    TrialSpec,
    Until,
    digest_of,
    expand,
)

FAULTS: Final = "faults"
MESH: Final = "tissue.node_counts"
KNOWN: Final = {
    "file": "campaign, set, sweep, cases, sample",
    "campaign": "name, scenario, seeds, design, until, about",
    "sample": "count, seed, fields",
}
CHOICES: Final = {
    "design": "factorial, one-at-a-time",
    "until": "end, plan",
    "scale": "linear, log",
}
NAME: Final = r"^[A-Za-z0-9][A-Za-z0-9._-]{0,79}$"


class _Head(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    name: Annotated[str, msgspec.Meta(pattern=NAME)]
    scenario: str = "default"
    seeds: str | None = None
    design: Literal["factorial", "one-at-a-time"] = "factorial"
    about: str = ""
    until: Until = "end"


class _File(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """The tables of a file; `stored` is what a results folder adds, and is not read here."""

    campaign: _Head
    set: dict[str, Any] = msgspec.field(default_factory=dict[str, Any])
    sweep: dict[str, Any] = msgspec.field(default_factory=dict[str, Any])
    cases: tuple[dict[str, Any], ...] = ()
    sample: Sample | None = None
    stored: dict[str, str] | None = None


@dataclass(frozen=True)
class Prepared:
    """A campaign that can begin.

    Attributes
    ----------
    base : Scenario
        As its file says.
    mesh : bytes
        Content of its mesh file, if it has one.
    digest : str
        Over all that is asked for.
    rules : mapping of str to str
        Text of the planner's rules by path, where they are not those supplied.
    """

    campaign: Campaign
    base: Scenario
    mesh: bytes
    trials: tuple[TrialSpec, ...]
    digest: str
    rules: Mapping[str, str] = field(default_factory=dict[str, str])

    def by_rules(self, rules: Mapping[str, str]) -> "Prepared":
        """Return the same trials planned by other rules: another campaign to a results folder."""
        digest = hashlib.sha256(f"{self.digest} {rules_digest(rules)}".encode()).hexdigest()
        return replace(self, rules=rules, digest=digest)


def shipped() -> dict[str, Path]:
    """Files of the campaigns that come with FRAS, by name."""
    folder = Path(__file__).parent / "shipped"
    return {file.stem: file for file in sorted(folder.glob("*.toml"))}


def find_campaign(text: str) -> Path:
    """Path of a campaign: a file, or one that comes with FRAS.

    Raises
    ------
    BadCampaign
        If there is neither.
    """
    path = Path(text)
    if path.suffix == ".toml" or path.is_file():
        return path
    known = shipped()
    if text in known:
        return known[text]
    names = ", ".join([*known, FAULTS])
    raise BadCampaign(text, "file", text, f"is neither a file nor one of: {names}")


def read_campaign(path: Path) -> Campaign:
    """Read a campaign's file.

    Raises
    ------
    BadCampaign
        Naming the file, the key, the value and what is allowed.
    """
    raw = _toml(path)
    for table in ("set", "sweep"):
        raw.update({table: _flat(raw[table])} if table in raw else {})
    cases: object = raw.get("cases")
    if isinstance(cases, list):
        raw["cases"] = [_flat(one) for one in cast("list[object]", cases)]
    sample: object = raw.get("sample")
    if isinstance(sample, dict) and "fields" in sample:
        table = cast("dict[str, object]", sample)
        raw["sample"] = {**table, "fields": _flat(table["fields"], leaves=("low", "high"))}
    try:
        file = msgspec.convert(raw, _File)
    except msgspec.ValidationError as error:
        raise _explained(error, raw, path) from error
    for swept, values in file.sweep.items():
        if not isinstance(values, list):
            raise BadCampaign(str(path), f"sweep.{swept}", values, "a list of the values to try")
    head = file.campaign
    return Campaign(
        name=head.name,
        scenario=_beside(path, head.scenario),
        seeds=None if head.seeds is None else _seeds(path, head.seeds),
        design=head.design,
        about=head.about,
        until=head.until,
        set=file.set,
        sweep=file.sweep,
        cases=file.cases,
        sample=file.sample,
    )


def prepare(
    text: str,
    *,
    seeds: str | None = None,
    mesh: str | None = None,
    asp_dir: Path | None = None,
) -> Prepared:
    """Read a campaign, lay the command line's options over it, list its trials.

    Raises
    ------
    BadCampaign, ScenarioError, NoRoomForRoi, UnusableRules
    """
    path = find_campaign(text)
    campaign = read_campaign(path)
    if seeds is not None:
        campaign = replace(campaign, seeds=parse_seeds(seeds))
    if mesh is not None:
        if MESH in campaign.varied:
            problem = f"the campaign varies {MESH} itself: leave out --mesh"
            raise BadCampaign(str(path), "--mesh", mesh, problem)
        fields = {**campaign.set, MESH: parse_mesh(mesh)}
        campaign = replace(campaign, set=fields)
    asked = prepared(campaign, text if path in shipped().values() else str(path))
    return asked if asp_dir is None else asked.by_rules(read_rules(asp_dir))


def prepared(campaign: Campaign, where: str) -> Prepared:
    """Read the base scenario, its mesh, and list the trials.

    Parameters
    ----------
    where : str
        For errors.

    Raises
    ------
    BadCampaign, ScenarioError, NoRoomForRoi
    """
    file = find_scenario(campaign.scenario)
    base = load(file)
    if base.tissue.mesh_file is None:
        trials = expand(campaign, base, where)
        return Prepared(campaign, base, b"", trials, digest_of(campaign, trials, b""))
    if MESH in (*campaign.set, *campaign.varied):
        given = campaign.set.get(MESH, "varied")
        raise BadCampaign(where, MESH, given, f"is for the box, and {file} has a mesh_file")
    mesh = mesh_path(base, file).read_bytes() if mesh_path(base, file).is_file() else b""
    trials = expand(campaign, base, where, lambda one: read_mesh_file(one, file)[0])
    return Prepared(campaign, base, mesh, trials, digest_of(campaign, trials, mesh))


def to_toml(campaign: Campaign, stored: Mapping[str, str]) -> str:
    """Write a campaign so that `read_campaign` gives the same one back."""
    seeds = campaign.seeds
    head = {
        "name": campaign.name,
        "about": campaign.about,
        "scenario": campaign.scenario,
        "seeds": None if seeds is None else f"{seeds.start}..{seeds.stop - 1}",
        "design": campaign.design,
        "until": campaign.until,
    }
    document = tomlkit.document()
    document["campaign"] = {key: value for key, value in head.items() if value is not None}
    for name in ("set", "sweep"):
        if content := getattr(campaign, name):
            document[name] = content
    if campaign.sample is not None:
        document["sample"] = msgspec.to_builtins(campaign.sample)
    if campaign.cases:
        document["cases"] = list(campaign.cases)
    document["stored"] = dict(stored)
    return tomlkit.dumps(document)


def stored_in(path: Path) -> tuple[str, dict[str, str]]:
    """Read of a stored campaign its name and what the store noted.

    Raises
    ------
    BadCampaign
    """
    raw = _toml(path)
    try:
        file = msgspec.convert(raw, _Stored)
    except msgspec.ValidationError as error:
        raise _explained(error, raw, path) from error
    return file.campaign.name, file.stored


class _Named(msgspec.Struct, frozen=True):
    name: str


class _Stored(msgspec.Struct, frozen=True):
    campaign: _Named
    stored: dict[str, str]


def _toml(path: Path) -> dict[str, Any]:
    try:
        return tomllib.loads(read_at_most(path, TEXT_BYTES).decode())
    except (OSError, UnicodeDecodeError) as error:
        raise BadCampaign(str(path), "file", str(path), f"can't be read: {error}") from error
    except (ValueError, RecursionError) as error:
        raise BadCampaign(str(path), "file", str(path), f"is not TOML: {error}") from error


def _flat(table: object, leaves: tuple[str, ...] = ()) -> object:
    """Name fields by dotted paths: `a.b = 1`, `"a.b" = 1` and `[a] b = 1` say the same."""
    if not isinstance(table, Mapping):
        return table
    return dict(_paths(cast("Mapping[Any, Any]", table), "", leaves))


def _paths(
    table: Mapping[Any, Any], before: str, leaves: tuple[str, ...]
) -> Iterator[tuple[str, object]]:
    for key, value in table.items():
        path = f"{before}{key}"
        if isinstance(value, Mapping) and not any(leaf in value for leaf in leaves):
            yield from _paths(cast("Mapping[Any, Any]", value), f"{path}.", leaves)
        else:
            yield path, cast("object", value)


def _beside(path: Path, scenario: str) -> str:
    """Look for a scenario's file beside the campaign's, as for a mesh beside the scenario's."""
    file = Path(scenario)
    if file.suffix != ".toml" or file.is_absolute():
        return scenario
    return str((path.parent / file).resolve())


def _seeds(path: Path, text: str) -> range:
    try:
        return parse_seeds(text)
    except ScenarioError as error:
        raise BadCampaign(
            str(path), "campaign.seeds", text, str(error.values["allowed"])
        ) from error


def _explained(error: msgspec.ValidationError, raw: Mapping[str, Any], path: Path) -> BadCampaign:
    problem, _, place = str(error).partition(" - at `$")
    key = place.rstrip("`").lstrip(".") or "file"
    if "unknown field" in problem:
        problem += f"; known: {KNOWN.get(key, KNOWN['file'])}"
    elif "enum" in problem:
        problem = f"allowed: {CHOICES[key.rpartition('.')[2]]}"
    found: Any = raw
    for part in key.split("."):
        found = cast("Mapping[str, Any]", found).get(part, "") if isinstance(found, Mapping) else ""
    return BadCampaign(str(path), key, found if key != "file" else path.name, problem)
