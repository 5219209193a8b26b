"""What is pinned, what a bill of materials says of it, and under which licences it stands."""

import json
import re
import tomllib
from importlib.metadata import distributions
from typing import Any

import pytest
from cyclonedx.schema import OutputFormat
from cyclonedx.validation import make_schemabased_validator
from packaging.requirements import Requirement
from packaging.utils import canonicalize_name
from release.licences import ALSO, PAGE, PERMITTED, READ, is_allowed, licence_of, row
from release.pins import FRAS, ROOT, Pin, PinMissing, all_pins, extras_of_fras, read_pins
from release.pins import installed as installed_of
from release.sbom import SCHEMA, as_json, bill_of_materials

# Whatever a virtual environment begins with.
OF_THE_ENVIRONMENT = {"pip", "setuptools", "wheel", "uv"}
INSTALLED = {canonicalize_name(one.name) for one in distributions()}
PINS = [pin for pin in all_pins() if canonicalize_name(pin.name) in INSTALLED]


@pytest.fixture(scope="module")
def bill() -> dict[str, Any]:
    return json.loads(as_json(bill_of_materials(PINS)))


def test_whatever_is_installed_is_pinned() -> None:
    assert INSTALLED - {canonicalize_name(FRAS)} - OF_THE_ENVIRONMENT <= set(read_pins())


def test_every_pin_is_needed_by_something() -> None:
    assert [pin.name for pin in PINS if not pin.extras] == []


def test_pins_stand_in_order_and_once() -> None:
    lines = (ROOT / "constraints.txt").read_text(encoding="utf-8").splitlines()[1:]
    assert lines == sorted(lines, key=str.lower)
    assert len(read_pins()) == len(lines)


def test_each_requirement_of_ours_admits_its_pin() -> None:
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
    extras = project["project"]["optional-dependencies"].values()
    lists = [project["project"]["dependencies"], project["build-system"]["requires"], *extras]
    pins = read_pins()
    for requirement in (Requirement(line) for lines in lists for line in lines):
        if requirement.name != FRAS:
            _, version = pins[canonicalize_name(requirement.name)]
            assert requirement.specifier.contains(version), requirement


def test_a_pin_that_is_not_installed_is_named() -> None:
    with pytest.raises(PinMissing, match=r"mcap is pinned at 0\.1, and 1\..* is installed"):
        installed_of(Pin("mcap", "0.1", ()))
    with pytest.raises(PinMissing, match="nothing is installed"):
        installed_of(Pin("no-such-library", "1.0", ()))


@pytest.mark.parametrize("pin", PINS, ids=lambda pin: pin.name)
def test_its_licence_goes_with_ours_for_whoever_gets_it(pin: Pin) -> None:
    licence, _ = licence_of(installed_of(pin))
    assert licence, f"{pin.name} gives no SPDX expression: read its licence, and add it to READ"
    for extra in pin.extras:
        assert is_allowed(licence, ALSO.get(extra, frozenset())), (licence, extra or FRAS)


@pytest.mark.parametrize(
    ("expression", "allowed"),
    [
        ("MIT", True),
        ("EPL-2.0 OR Apache-2.0", True),
        ("BSD-3-Clause AND MIT", True),
        ("Apache-2.0 WITH LLVM-exception", True),
        ("GPL-3.0-or-later", False),
        ("MIT AND GPL-3.0-or-later", False),
        ("LGPL-2.1-only OR GPL-2.0-only", False),
        ("LicenseRef-Unheard-Of", False),
        ("", False),
    ],
)
def test_of_alternatives_one_is_enough_of_what_is_joined_each_counts(
    expression: str, allowed: bool
) -> None:
    assert is_allowed(expression) is allowed


def test_whoever_runs_fras_gets_no_licence_that_only_tools_may_have() -> None:
    assert set(ALSO) == {"mkl", "bench", "dev"}
    assert not any("GPL" in licence or "Intel" in licence for licence in PERMITTED)


def test_nothing_was_read_by_hand_that_states_its_licence_itself() -> None:
    by_hand = {pin.name for pin in PINS if licence_of(installed_of(pin))[1]}
    assert by_hand == READ.keys() & {pin.name for pin in PINS}


def test_the_page_of_licences_names_each_pin_as_it_is() -> None:
    text = PAGE.read_text(encoding="utf-8")
    rows = {line.split(" | ")[0].removeprefix("| "): line for line in text.splitlines()[1:]}
    assert [row(pin) for pin in PINS if rows.get(pin.name) != row(pin)] == [], "make licences"
    listed = re.findall(r"^\| (\S+) \| (\S+) \|", text, re.MULTILINE)
    named = dict(one for one in listed if one[0] not in {"distribution", "---"})
    assert named == dict(read_pins().values())


def test_the_bill_is_what_its_schema_allows(bill: dict[str, Any]) -> None:
    validator = make_schemabased_validator(OutputFormat.JSON, SCHEMA)
    assert validator.validate_str(json.dumps(bill)) is None


def test_the_bill_names_each_pin_with_its_licence(bill: dict[str, Any]) -> None:
    assert {one["name"]: one["version"] for one in bill["components"]} == {
        pin.name: pin.version for pin in PINS
    }
    assert all(one["licenses"] for one in bill["components"])
    assert bill["metadata"]["component"]["name"] == FRAS


def test_the_bill_tells_what_runs_from_what_only_measures(bill: dict[str, Any]) -> None:
    scopes = {one["name"]: one["scope"] for one in bill["components"]}
    assert [scopes[name] for name in ("eclipse-zenoh", "clingo", "felupe", "ruff")] == [
        "required",
        "optional",
        "excluded",
        "excluded",
    ]
    needs = {one["ref"]: one.get("dependsOn", []) for one in bill["dependencies"]}
    assert not any(one.startswith("felupe") for one in needs[FRAS])
    assert any(one.startswith("libpinocchio@") for one in needs[f"pin@{version_of('pin')}"])


def test_the_same_pins_give_the_same_file(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("SOURCE_DATE_EPOCH", "1700000000")
    bill: Any = bill_of_materials
    first = as_json(bill(PINS))
    assert as_json(bill(PINS)) == first
    assert "2023-11-14T22:13:20" in first
    assert bill(PINS[1:]).serial_number != bill(PINS).serial_number


def version_of(name: str) -> str:
    return read_pins()[canonicalize_name(name)][1]


def test_every_extra_is_known() -> None:
    assert {"", "planner", "motion", "dev"} <= set(extras_of_fras())
