"""Scenario files: read, checked, written. An error names file, key, value and what is allowed."""

import difflib
import re
import tomllib
from collections.abc import Mapping
from pathlib import Path
from typing import Any, cast, get_args

import msgspec
import tomlkit

from fras_common.files import TEXT_BYTES, read_at_most
from fras_common.scenario.errors import ScenarioError
from fras_common.scenario.limits import breaches
from fras_common.scenario.model import Scenario, Section
from fras_common.scenario.patient import patient_scenario

_PATH = re.compile(r" - at `\$\.?(.*)`$")
_UNKNOWN = re.compile(r"Object contains unknown field `(.*?)`")


def load(path: Path) -> Scenario:
    """Read and check a scenario file.

    Raises
    ------
    ScenarioError
        The file can't be read, is no TOML, or holds something that is not allowed.
    """
    try:
        raw = tomllib.loads(read_at_most(path, TEXT_BYTES).decode())
    except (OSError, UnicodeDecodeError) as error:
        raise ScenarioError(str(path), "file", str(path), f"can't be read: {error}") from error
    except (ValueError, RecursionError) as error:
        # tomllib also lets through what int() says of too many digits, and nesting without end.
        raise ScenarioError(str(path), "file", str(path), f"is not TOML: {error}") from error
    return convert(raw, str(path))


def convert(raw: Mapping[str, Any], file: str) -> Scenario:
    """Turn the content of a file (or the command line's overrides) into a checked scenario."""
    try:
        scenario = msgspec.convert(raw, Scenario)
    except msgspec.ValidationError as error:
        raise _explain(error, raw, file) from error
    return check(scenario, file)


def check(scenario: Scenario, file: str = "scenario") -> Scenario:
    """Check what one field alone can't tell, and return the scenario.

    What lies where on the tissue is checked for a box only; for a mesh file `fit_to_mesh` does it,
    once the size is known.

    Raises
    ------
    ScenarioError
        ROI outside the tissue, a disc off the tissue, inverted ranges, no room for the ROI that the
        generator is to draw, an element that the box has not, a breach of `limits`, or a patient
        that is no tissue.
    """
    tissue, generator = scenario.tissue, scenario.generator
    if tissue.mesh_file is None:
        check_places(scenario, file)
        if tissue.element not in {"hex8-sri", "hex8"}:
            raise ScenarioError(
                file, "tissue.element", tissue.element,
                "the box consists of hexahedra: hex8-sri or hex8, or give a mesh_file",
            )  # fmt: skip
        if tissue.mesh_scale != 1.0:
            raise ScenarioError(
                file, "tissue.mesh_scale", tissue.mesh_scale,
                "scales a mesh_file, and there is none: leave it out",
            )  # fmt: skip
    if generator.disc_radius_max_m < generator.disc_radius_min_m:
        raise ScenarioError(
            file, "generator.disc_radius_max_m", generator.disc_radius_max_m,
            f"must be at least disc_radius_min_m = {generator.disc_radius_min_m}",
        )  # fmt: skip
    for key, value, allowed in breaches(scenario):
        raise ScenarioError(file, key, value, allowed)
    if scenario.scene is not None and tissue.mesh_file is None:
        patient_scenario(scenario, file)
    return scenario


def check_places(scenario: Scenario, file: str) -> None:
    """Check that ROI and discs lie on the tissue, and that it has room for a ROI to be drawn.

    Raises
    ------
    ScenarioError
    """
    size, scene, generator = scenario.tissue.size_m, scenario.scene, scenario.generator
    if scene is not None:
        for axis, name in enumerate("xy"):
            if not 0 <= scene.roi_m[axis] <= size[axis]:
                raise ScenarioError(
                    file, "scene.roi_m", list(scene.roi_m),
                    f"{name} must lie on the tissue, between 0 and {size[axis]} m",
                )  # fmt: skip
        if not -0.01 < scene.roi_m[2] <= 0:
            raise ScenarioError(
                file, "scene.roi_m", list(scene.roi_m),
                "z must lie under the tissue, above -0.01 m and at most 0",
            )  # fmt: skip
        for index, disc in enumerate(scene.discs):
            if not (0 <= disc.center_m[0] <= size[0] and 0 <= disc.center_m[1] <= size[1]):
                raise ScenarioError(
                    file, f"scene.discs[{index}].center_m", list(disc.center_m),
                    f"must lie on the tissue: x up to {size[0]} m, y up to {size[1]} m",
                )  # fmt: skip
    half = min(size[0], size[1]) / 2
    if scene is None and generator.roi_edge_margin_m >= half:
        raise ScenarioError(
            file, "generator.roi_edge_margin_m", generator.roi_edge_margin_m,
            f"must be below {half}, half the tissue's shorter side",
        )  # fmt: skip


def to_toml(scenario: Scenario) -> str:
    """Write a scenario so that `load` gives the same one back."""
    document = tomlkit.document()
    for key, value in msgspec.to_builtins(scenario).items():
        if value is not None:
            document[key] = _without_none(value)
    return tomlkit.dumps(document)


def _without_none(value: object) -> object:
    """TOML has no null: an absent key means the default, which is None wherever None is allowed."""
    if isinstance(value, dict):
        table = cast(dict[str, object], value)
        return {key: _without_none(item) for key, item in table.items() if item is not None}
    if isinstance(value, list | tuple):
        return [_without_none(item) for item in cast(list[object], value)]
    return value


def _explain(error: msgspec.ValidationError, raw: Mapping[str, Any], file: str) -> ScenarioError:
    text = str(error)
    found = _PATH.search(text)
    parent = found.group(1) if found else ""
    problem = _PATH.sub("", text)
    unknown = _UNKNOWN.match(problem)
    if unknown is None:
        if problem.startswith("Invalid enum value"):
            problem = f"allowed: {', '.join(_choices_at(parent))}"
        return ScenarioError(file, parent, _look_up(raw, parent), problem)
    name = unknown.group(1)
    known = _fields_at(parent)
    close = difflib.get_close_matches(name, known, n=1, cutoff=0.5)
    hint = f"did you mean {close[0]}? " if close else ""
    key = f"{parent}.{name}" if parent else name
    return ScenarioError(
        file, key, _look_up(raw, key), f"unknown key; {hint}known here: {', '.join(known)}"
    )


def _annotation_at(path: str) -> Any:
    """Look up the declared type of the value at `path`."""
    annotation: Any = Scenario
    for part in filter(None, re.sub(r"\[.*?\]", "", path).split(".")):
        fields = msgspec.structs.fields(_section_in(annotation))
        annotation = next(field.type for field in fields if field.name == part)
    return annotation


def _fields_at(path: str) -> list[str]:
    """Names that the table at `path` knows."""
    return list(_section_in(_annotation_at(path)).__struct_fields__)


def _choices_at(path: str) -> list[str]:
    return [str(choice) for choice in get_args(_annotation_at(path))]


def _section_in(annotation: Any) -> Any:
    """Find the table's type inside Optional, tuple and the like."""
    if isinstance(annotation, type) and issubclass(annotation, Section):
        return annotation
    return next(found for part in get_args(annotation) if (found := _section_in(part)))


def _look_up(raw: Any, path: str) -> object:
    for part in re.findall(r"[^.\[\]]+", path):
        if isinstance(raw, list | tuple):
            items = cast(list[object], raw)
            raw = items[int(part)] if part.isdigit() and int(part) < len(items) else items
        elif isinstance(raw, Mapping):
            raw = cast(Mapping[str, object], raw).get(part)
    return raw
