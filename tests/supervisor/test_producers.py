"""Tables in which two processes would do the same, or one could never be ready."""

import pytest

from fras_supervisor import TableError, find_table, load_table
from fras_supervisor.extras import missing
from fras_supervisor.producers import keys_of, service_of
from fras_supervisor.table import parse_table

PYTHON = '["{python}", "-m", '


def row(name: str, *words: str, **settings: str) -> str:
    command = ", ".join(f'"{word}"' for word in words)
    extra = "".join(f'{key} = "{value}"\n' for key, value in settings.items())
    return f"[process.{name}]\ncommand = [{command}]\n{extra}\n"


def refused(text: str) -> TableError:
    with pytest.raises(TableError) as caught:
        parse_table(text, "t.toml")
    return caught.value


@pytest.mark.parametrize(
    ("command", "service"),
    [
        (["{python}", "-m", "fras_sim", "--cell", "x"], "sim"),
        (["{python}", "-m", "fras_motion.arms_main"], "arms"),
        (["{python}", "-m", "fras_common.router"], "router"),
        (["fras", "sa"], "sa"),
        (["/usr/bin/fras", "sa"], "sa"),
        (["{python}", "-m", "dvrk_bridge"], ""),
        (["{python}", "-m"], ""),
        (["fras"], ""),
    ],
)
def test_the_service_of_a_command(command: list[str], service: str) -> None:
    assert service_of(command) == service


def test_two_processes_that_run_one_service_are_named() -> None:
    error = refused(row("sim", "{python}", "-m", "fras_sim") + row("twin", "fras", "sim"))
    assert error.key == "process.twin.command"
    assert "process.sim runs sim already" in error.allowed


def test_simulated_arms_beside_a_process_of_arms_are_two_producers() -> None:
    arms = row("arms", "{python}", "-m", "fras_motion.arms_main", readiness="alive")
    error = refused(arms + row("motion", "{python}", "-m", "fras_motion"))
    assert error.key == "process.motion.command"
    assert "process.arms produces psm1/measured_js already" in error.allowed
    crtk = ("{python}", "-m", "fras_motion", "--driver", "crtk")
    assert set(parse_table(arms + row("motion", *crtk), "t.toml").processes) == {"arms", "motion"}


def test_a_process_that_could_never_be_ready_is_named() -> None:
    error = refused(row("tissue", "{python}", "-m", "fras_sim"))
    assert error.key == "process.tissue"
    assert "sim says ready/sim, and ready/tissue would be waited for" in error.allowed


def test_a_bridge_of_somebody_else_may_be_called_anything() -> None:
    assert parse_table(row("dvrk", "{python}", "-m", "bridge"), "t.toml").processes["dvrk"]


@pytest.mark.parametrize("name", ["local", "crtk"])
def test_the_tables_of_ours_give_every_key_its_producer(name: str) -> None:
    table = load_table(find_table(name))
    produced = [key for one in table.processes.values() for key in keys_of(one.command)]
    assert len(produced) == len(set(produced))
    assert {"sim/tissue_state", "robot/state", "sa/verdict", "psm1/measured_js"} <= set(produced)


REQUIREMENTS = [
    "msgspec>=0.20",
    "numba>=0.61; extra == 'sim'",
    "scipy[x]>=1.14; extra == 'sim'",
    'clingo>=5.7; extra == "planner"',
    "mkl>=2024; (platform_machine == 'x86_64') and extra == 'sim'",
]


@pytest.mark.parametrize(
    ("extra", "installed", "lacking"),
    [
        ("sim", {"numba", "scipy"}, ()),
        ("sim", {"scipy"}, ("numba",)),
        ("sim", set[str](), ("numba", "scipy")),
        ("planner", {"numba"}, ("clingo",)),
        ("router", set[str](), ()),
    ],
)
def test_libraries_that_an_extra_lacks(
    extra: str, installed: set[str], lacking: tuple[str, ...]
) -> None:
    assert missing(extra, REQUIREMENTS, installed.__contains__) == lacking
