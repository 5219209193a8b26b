"""From a file and the command line's options to one checked, resolved scenario."""

import os
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import msgspec

from fras_cli.mesh_input import mesh_path, read_mesh_file
from fras_common.scenario import Scenario, ScenarioError, check, load, resolve, to_toml
from fras_common.scenario.loader import convert
from fras_common.shipped import shipped

COMMAND_LINE = "command line"


def find_scenario(text: str) -> Path:
    """Path of a scenario: a file, or the name of one that comes with FRAS.

    Raises
    ------
    ScenarioError
        If there is neither.
    """
    path = Path(text)
    if path.exists() or path.suffix == ".toml":
        return path
    folder = shipped_scenarios()
    names = sorted(file.stem for file in folder.glob("*.toml"))
    if text in names:
        return folder / f"{text}.toml"
    raise ScenarioError(text, "file", text, f"is neither a file nor one of: {', '.join(names)}")


def shipped_scenarios() -> Path:
    """Folder of the scenarios that come with FRAS."""
    return shipped("compose") / "scenarios"


def choose_seeds(seed: int | None, seeds: str | None) -> list[int | None]:
    """Seeds to run, one after the other; None stands for the scenario's own.

    Raises
    ------
    ScenarioError
        If both are given, or `seeds` is no range.
    """
    if seeds is None:
        return [seed]
    if seed is not None:
        raise ScenarioError(COMMAND_LINE, "--seed", seed, "not together with --seeds")
    return list(parse_seeds(seeds))


def parse_mesh(text: str) -> list[int]:
    """Node counts from `NX,NY,NZ`.

    Raises
    ------
    ScenarioError
        If that is not three whole numbers.
    """
    parts = text.split(",")
    if len(parts) != 3 or not all(part.strip().isdigit() for part in parts):
        raise ScenarioError(COMMAND_LINE, "--mesh", text, "three node counts, as 21,25,2")
    return [int(part) for part in parts]


RANGE = "a range such as 1..20"


def parse_seeds(text: str) -> range:
    """Seeds from `A..B`, both included.

    Raises
    ------
    ScenarioError
        If that is no range.
    """
    first, dots, last = text.partition("..")
    if not dots or not first.isdigit() or not last.isdigit():
        allowed = f"{RANGE}; one alone is {text}..{text}" if text.isdigit() else RANGE
        raise ScenarioError(COMMAND_LINE, "--seeds", text, allowed)
    if int(last) < int(first):
        turned = f"the smaller one comes first: {last}..{first}"
        raise ScenarioError(COMMAND_LINE, "--seeds", text, turned)
    return range(int(first), int(last) + 1)


@dataclass(frozen=True)
class TrialInput:
    """What a trial is started with: a checked, resolved scenario, its mesh file's content or none.

    Parameters
    ----------
    mesh_path : Path or None
        Where the mesh was read.
    """

    scenario: Scenario
    mesh: bytes = b""
    mesh_path: Path | None = None


def build_scenario(
    file: str,
    *,
    seed: int | None = None,
    pace: float | None = None,
    ignore_ap: bool = False,
    no_limit: bool = False,
    criterion: str | None = None,
    mesh: str | None = None,
) -> Scenario:
    """Make the scenario alone, as `build_trial` does."""
    return build_trial(
        file,
        seed=seed,
        pace=pace,
        ignore_ap=ignore_ap,
        no_limit=no_limit,
        criterion=criterion,
        mesh=mesh,
    ).scenario


def build_trial(
    file: str,
    *,
    seed: int | None = None,
    pace: float | None = None,
    ignore_ap: bool = False,
    no_limit: bool = False,
    criterion: str | None = None,
    mesh: str | None = None,
    confirm: bool = False,
) -> TrialInput:
    """Read a scenario and its mesh, lay the options over it, check it, draw its scene if need be.

    A `seed` given here draws a new scene, also where the file holds one.

    Raises
    ------
    ScenarioError
        Naming the file or the command line, the key, the value and what is allowed.
    """
    path = find_scenario(file)
    raw: dict[str, Any] = msgspec.to_builtins(load(path))
    if seed is not None:
        raw["seed"] = seed
        raw["scene"] = None
    if pace is not None:
        raw["run"]["pace"] = pace
    if ignore_ap:
        raw["planner"]["ignore_ap"] = True
    if no_limit:
        raw["awareness"]["no_limit"] = True
    if confirm:
        raw["planner"]["confirm"] = True
    if criterion is not None:
        raw["planner"]["criterion"] = criterion
    if mesh is not None:
        raw["tissue"]["node_counts"] = parse_mesh(mesh)
    scenario = convert(raw, COMMAND_LINE)
    if scenario.tissue.mesh_file is None:
        return TrialInput(resolve(check(scenario, COMMAND_LINE)))
    if mesh is not None:
        raise ScenarioError(
            COMMAND_LINE, "--mesh", mesh, f"is for the box, and {path} has a mesh_file"
        )
    fitted, data = read_mesh_file(scenario, path)
    return TrialInput(resolve(fitted), data, mesh_path(scenario, path))


def write_new_scenario(base: str, seed: int, out: Path | None) -> None:
    """Write the scenario that `seed` draws, to a file that must not exist or to standard output.

    Raises
    ------
    ScenarioError
        If the file exists or can't be written.
    """
    trial = build_trial(base, seed=seed)
    scenario = trial.scenario
    if trial.mesh_path is not None:
        # The new file's reader looks for the mesh from where that file is.
        there = Path(os.path.relpath(trial.mesh_path, (out or Path("new.toml")).parent))
        tissue = msgspec.structs.replace(scenario.tissue, mesh_file=there.as_posix())
        scenario = msgspec.structs.replace(scenario, tissue=tissue)
    text = to_toml(scenario)
    if out is None:
        print(text, end="")
        return
    try:
        with out.open("x", encoding="utf-8") as file:
            file.write(text)
    except OSError as error:
        raise ScenarioError(
            COMMAND_LINE, "--out", str(out), f"can't be written: {error}"
        ) from error
