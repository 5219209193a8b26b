"""Each package imports nothing that its extra does not install; `make extras` tries it for real."""

import sys
from collections.abc import Mapping
from functools import cache
from importlib.metadata import packages_distributions
from pathlib import Path

import grimp
import pytest
from packaging.utils import canonicalize_name
from release.extras import LAZY, TRIALS, WITHOUT
from release.pins import FRAS, ROOT, extras_of_fras, requirements_of

SERVICES = sorted(folder.name for folder in (ROOT / "services").glob("[a-z]*") if folder.is_dir())
PACKAGES = [f"fras_{name}" for name in SERVICES]
SAYS_SO = "fras_log.export.exporting"
# Distributions of another name than what is imported, which do not tell it themselves.
IMPORTED_AS = {"pinocchio": "pin", "coal": "coal"}


@pytest.fixture(scope="module")
def graph() -> grimp.ImportGraph:
    return grimp.build_graph(
        *PACKAGES,
        include_external_packages=True,
        exclude_type_checking_imports=True,
        cache_dir=None,
    )


@cache
def providers() -> Mapping[str, list[str]]:
    return packages_distributions()


@cache
def libraries_of(*extras: str) -> set[str]:
    """What is named for FRAS itself and for its extras: what only comes along is not counted on."""
    return {
        canonicalize_name(requirement.name)
        for extra in ("", *extras)
        for requirement in requirements_of(FRAS, extra)
    }


def extras_of(module: str) -> tuple[str, ...]:
    own = module.partition(".")[0].removeprefix("fras_")
    return (own if own != "common" else "", LAZY.get(module, ""))


@pytest.mark.parametrize("package", PACKAGES)
def test_it_imports_nothing_that_its_extra_does_not_install(
    graph: grimp.ImportGraph, package: str
) -> None:
    strangers: list[str] = []
    for module in {package, *graph.find_descendants(package)}:
        allowed = libraries_of(*extras_of(module))
        for imported in graph.find_modules_directly_imported_by(module):
            top = imported.partition(".")[0]
            if top in PACKAGES:
                missing = libraries_of(*extras_of(imported)) - allowed
                said = module == SAYS_SO and imported in LAZY
            else:
                named = providers().get(top, [IMPORTED_AS.get(top, top)])
                missing = {canonicalize_name(one) for one in named}
                missing = set() if missing & allowed else missing
                said = top in sys.stdlib_module_names
            if missing and not said:
                strangers.append(f"{module} -> {imported} ({', '.join(sorted(missing))})")
    assert strangers == []


@pytest.mark.parametrize("name", ["sim", "sa", "planner", "motion", "recorder", "monitor"])
def test_a_service_alone_installs_nothing_of_another_ones_trade(name: str) -> None:
    trades = {
        "sim": {"numba", "scipy", "meshio"},
        "planner": {"clingo"},
        "motion": {"pin", "ruckig"},
        "recorder": {"mcap", "cryptography"},
        "monitor": {"viser", "mcap", "cryptography"},
    }
    others = set().union(*trades.values()) - trades.get(name, set())
    assert not libraries_of(name) & others


def test_every_extra_is_tried_alone_by_make_extras() -> None:
    assert set(TRIALS) | set(WITHOUT) == set(extras_of_fras())


def test_grimp_sees_what_is_imported_within_functions(graph: grimp.ImportGraph) -> None:
    """Else the test above would pass whatever a command loads when it is called."""
    text = Path(ROOT / "services/cli/fras_cli/app.py").read_text(encoding="utf-8")
    assert "\n        from fras_cli.failures import" in text
    assert "fras_cli.failures" in graph.find_modules_directly_imported_by("fras_cli.app")
