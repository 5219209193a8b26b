"""The lists in pyproject.toml that must name every folder of services/."""

import tomllib
from pathlib import Path
from typing import Any

import pytest

ROOT = Path(__file__).parents[2]
FOLDERS = sorted(
    folder.name
    for folder in (ROOT / "services").iterdir()
    if folder.is_dir() and not folder.name.startswith((".", "_"))
)
PATHS = [f"services/{name}" for name in FOLDERS]
PACKAGES = [f"fras_{name}" for name in FOLDERS]


@pytest.fixture(scope="module")
def project() -> dict[str, Any]:
    return tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))


@pytest.mark.parametrize("name", FOLDERS)
def test_each_folder_holds_one_package_of_its_name(name: str):
    inside = [
        entry.name
        for entry in (ROOT / "services" / name).iterdir()
        if entry.is_dir() and not entry.name.startswith((".", "_"))
    ]
    assert inside == [f"fras_{name}"]
    assert (ROOT / "services" / name / f"fras_{name}" / "__init__.py").is_file()


def test_editable_installs_see_every_service(project: dict[str, Any]):
    assert sorted(project["tool"]["hatch"]["build"]["dev-mode-dirs"]) == PATHS


def test_wheels_hold_every_service(project: dict[str, Any]):
    wheel = project["tool"]["hatch"]["build"]["targets"]["wheel"]
    services = {key: to for key, to in wheel["sources"].items() if key.startswith("services/")}
    assert services == dict.fromkeys(PATHS, "")
    others = {key.partition("/")[0] for key in wheel["sources"]}
    assert set(wheel["only-include"]) == others
    assert all((ROOT / folder).is_dir() for folder in wheel["only-include"])


def test_every_service_but_common_has_an_extra(project: dict[str, Any]):
    extras = set(project["project"]["optional-dependencies"])
    beside_services = {"all", "bench", "dev", "docs", "export", "mkl", "rerun"}
    assert extras - beside_services == set(FOLDERS) - {"common"}


def test_the_extra_all_names_every_service(project: dict[str, Any]):
    (everything,) = project["project"]["optional-dependencies"]["all"]
    name, _, inside = everything.partition("[")
    assert name == project["project"]["name"]
    assert set(inside.rstrip("]").split(",")) == set(FOLDERS) - {"common"}


def test_the_import_contracts_know_every_package(project: dict[str, Any]):
    linter = project["tool"]["importlinter"]
    assert sorted(linter["root_packages"]) == PACKAGES
    named = {
        contract["name"]: {*contract.get("source_modules", []), *contract.get("modules", [])}
        for contract in linter["contracts"]
    }
    assert named["only the bus imports zenoh"] == set(PACKAGES)
    common = next(
        c
        for c in linter["contracts"]
        if c["source_modules" if "source_modules" in c else "modules"] == ["fras_common"]
    )
    assert set(common["forbidden_modules"]) == set(PACKAGES) - {"fras_common"}


def test_pyright_finds_every_service(project: dict[str, Any]):
    for environment in project["tool"]["pyright"]["executionEnvironments"]:
        # Beside them the root, for `benchmarks`.
        assert sorted(path for path in environment["extraPaths"] if path != ".") == PATHS


def test_each_service_of_the_topic_table_can_be_started():
    from fras_common.topics import SERVICES

    for name in SERVICES:
        assert name in FOLDERS
