"""What `make extras` holds an environment against; trying them all is long, and not done here."""

import sys
from pathlib import Path

import pytest
from release.environment import Environment, ExtraFails
from release.extras import check_installed, main
from release.pins import FRAS, closure


class Holding(Environment):
    """An environment of which only what is installed is asked."""

    def __init__(self, extra: str, names: set[str]) -> None:
        self.extra = extra
        self.names = names

    def installed(self) -> set[str]:
        return self.names


PLANNER = {FRAS, *map(str, closure(FRAS, "planner"))}


def test_what_the_metadata_says_is_enough() -> None:
    assert check_installed(Holding("planner", PLANNER), ["planner"]) == len(PLANNER)
    assert {"clingo", "eclipse-zenoh"} < PLANNER
    assert not {"pin", "numba", "mcap"} & PLANNER


@pytest.mark.parametrize(
    ("names", "said"),
    [
        (PLANNER | {"pin"}, r"fras\[planner\]: installed without need: \['pin'\], missing: \[\]"),
        (PLANNER - {"clingo"}, r"without need: \[\], missing: \['clingo'\]"),
    ],
)
def test_more_or_less_is_named(names: set[str], said: str) -> None:
    with pytest.raises(ExtraFails, match=said):
        check_installed(Holding("planner", names), ["planner"])


def test_a_command_that_fails_is_told_with_what_it_said(tmp_path: Path) -> None:
    environment = Holding("planner", set())
    environment.folder = tmp_path
    environment.python = Path(sys.executable)
    assert environment.run("python", "-c", "import os; print(sorted(os.environ))").startswith("[")
    with pytest.raises(ExtraFails, match=r"fras\[planner\]: python -c .* ended with 7\nno more\n"):
        environment.run("python", "-c", "import sys; print('no more'); sys.exit(7)")
    assert set(environment.variables) == {"HOME", "PATH", "COLUMNS"}


@pytest.mark.parametrize("argument", ["plane", "dev"])
def test_an_extra_that_is_not_tried_is_named(
    argument: str, capsys: pytest.CaptureFixture[str]
) -> None:
    with pytest.raises(SystemExit) as ended:
        main([argument])
    assert ended.value.code == 2
    assert f"{argument}: there are sim, sa, planner" in capsys.readouterr().err
