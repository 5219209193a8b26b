from itertools import pairwise
from pathlib import Path

import pytest

from fras_supervisor import TableError, find_table, load_table
from fras_supervisor.order import ended_before, start_order, topological
from fras_supervisor.table import expand, parse_table

ROUTER = '[process.router]\ncommand = ["router", "{connect}"]\nreadiness = "listening"\n'
SIM = '[process.sim]\ncommand = ["sim"]\nneeds = ["router"]\n'


def test_local_toml_is_the_stack_of_the_design() -> None:
    table = load_table(find_table("local"))
    assert set(table.processes) == {"router", "sim", "sa", "planner", "motion", "recorder"}
    assert table.processes["router"].readiness == "listening"
    assert table.processes["router"].needs == ()
    for name in ("sim", "sa", "planner", "motion", "recorder"):
        process = table.processes[name]
        assert process.needs == ("router",)
        assert process.readiness == "token"
        assert f"fras_{name}" in process.command
    assert {one.restart for one in table.processes.values()} == {"on-failure"}
    stopping = topological(ended_before(table.processes))
    assert stopping[-2:] == ("recorder", "router")


def test_unknown_table_is_named_with_those_there_are() -> None:
    with pytest.raises(TableError, match=r"nowhere.*local"):
        find_table("nowhere")


def test_defaults_and_the_names_from_the_keys() -> None:
    sim = parse_table(ROUTER + SIM, "t.toml").processes["sim"]
    assert sim.name == "sim"
    assert (sim.readiness, sim.restart, sim.host) == ("token", "never", "localhost")
    assert sim.stop_timeout_s > 0


def test_placeholders_are_filled_in_and_double_braces_are_literal() -> None:
    text = '[process.sim]\ncommand = ["{python}", "--json", "{{{cell}}}", "{name}{log_dir}"]\n'
    sim = parse_table(text, "t.toml").processes["sim"]
    values = {"python": "py", "cell": "c", "name": "sim", "log_dir": "/l", "connect": "tcp/h:1"}
    assert expand(sim, values) == ("py", "--json", "{c}", "sim/l")


@pytest.mark.parametrize("restart", ["never", "on-failure", "always"])
def test_every_restart_policy_is_valid_in_a_table(restart: str) -> None:
    table = parse_table(ROUTER + f'restart = "{restart}"\n', "t.toml")
    assert table.processes["router"].restart == restart


@pytest.mark.parametrize(
    ("text", "key", "value", "allowed"),
    [
        (SIM, "process.sim.needs", "router", "names of other processes"),
        (ROUTER + SIM + 'host = "a b"\n', "process.sim.host", "a b", "name of a host"),
        (ROUTER + SIM + 'needz = ["x"]\n', "process.sim.needz", ["x"], "keys command, needs"),
        (ROUTER + SIM + 'name = "x"\n', "process.sim.name", "x", "keys command, needs"),
        (ROUTER + 'needs = ["router"]\n', "process.router.needs", "router", "other"),
        (
            ROUTER + SIM + '[process.sa]\ncommand = ["sa"]\nneeds = ["sim", "sim"]\n',
            "process.sa.needs",
            "sim",
            "each once",
        ),
        (ROUTER + 'restart = "sometimes"\n', "process.router.restart", "sometimes", "on-failure"),
        (SIM + 'readiness = "soon"\n', "process.sim.readiness", "soon", "token"),
        (ROUTER + "stop_timeout_s = 0\n", "process.router.stop_timeout_s", 0, "above 0"),
        (ROUTER + "stop_timeout_s = inf\n", "process.router.stop_timeout_s", float("inf"), "3600"),
        (ROUTER + 'stop_timeout_s = "5"\n', "process.router.stop_timeout_s", "5", "number"),
        (ROUTER + "ready_timeout_s = -1\n", "process.router.ready_timeout_s", -1, "above 0"),
        (ROUTER + "backoff_s = 0\n", "process.router.backoff_s", 0, "above 0"),
        (
            ROUTER + "backoff_s = 2\nbackoff_cap_s = 1\n",
            "process.router.backoff_cap_s",
            1.0,
            "not less than backoff_s",
        ),
        (ROUTER + "restart_budget = 0\n", "process.router.restart_budget", 0, "from 1"),
        (ROUTER + "watchdog_s = 1.0\n", "process.router.watchdog_s", 1.0, "0 (off)"),
        (ROUTER + "loop_watchdog_s = -1\n", "process.router.loop_watchdog_s", -1, "0 (off)"),
        (ROUTER + "memory_limit_mb = 3\n", "process.router.memory_limit_mb", 3, "from 16"),
        (ROUTER + "open_files_limit = 9\n", "process.router.open_files_limit", 9, "from 64"),
        (ROUTER + "nice = 20\n", "process.router.nice", 20, "to 19"),
        ("[process.sim]\ncommand = []\n", "process.sim.command", [], "program first"),
        ('[process.sim]\ncommand = [""]\n', "process.sim.command", [""], "program first"),
        ('[process.sim]\ncommand = "sim"\n', "process.sim.command", "sim", "list of texts"),
        ("[process.sim]\nneeds = []\n", "process.sim.command", None, "program first"),
        ('[process.sim]\ncommand = ["{cel}"]\n', "process.sim.command", "{cel}", "{cell}"),
        ('[process.sim]\ncommand = ["{}"]\n', "process.sim.command", "{}", "{cell}"),
        ('[process.sim]\ncommand = ["{cell"]\n', "process.sim.command", "{cell", "{cell}"),
        (
            '[process.sim]\ncommand = ["{cell.__class__}"]\n',
            "process.sim.command",
            "{cell.__class__}",
            "{cell}",
        ),
        ('[process.sim]\ncommand = ["{cell!r}"]\n', "process.sim.command", "{cell!r}", "{cell}"),
        ('[process."../x"]\ncommand = ["x"]\n', "process.../x", "../x", "lower-case"),
        ('[process]\nsim = "x"\n', "process.sim", "x", "a table"),
        ("", "process", None, "at least one"),
        ("[process]\n", "process", {}, "at least one"),
        ("process = 3\n", "process", 3, "at least one"),
        (ROUTER + "[services.x]\n", "services", {"x": {}}, "only tables"),
    ],
)
def test_bad_tables_are_named_by_file_key_value_and_what_is_allowed(
    text: str, key: str, value: object, allowed: str
) -> None:
    with pytest.raises(TableError) as caught:
        parse_table(text, "t.toml")
    error = caught.value
    assert (error.file, error.key, error.value) == ("t.toml", key, value)
    assert allowed in error.allowed
    assert str(error).startswith(f"t.toml: {key} = {value!r}")


def test_not_a_number_is_no_timeout() -> None:
    with pytest.raises(TableError, match="stop_timeout_s"):
        parse_table(ROUTER + "stop_timeout_s = nan\n", "t.toml")


@pytest.mark.parametrize(
    "text",
    [ROUTER + ROUTER, ROUTER + 'command = ["again"]\n', "[process.router\n"],
    ids=["process twice", "key twice", "no TOML"],
)
def test_duplicates_and_broken_toml_are_named_with_their_line(text: str) -> None:
    with pytest.raises(TableError, match=r"t\.toml: file = .*line \d+"):
        parse_table(text, "t.toml")


def test_cycle_of_needs_is_shown_as_a_ring() -> None:
    rows = {"a": "b", "b": "c", "c": "a", "d": "a"}
    text = "".join(
        f'[process.{name}]\ncommand = ["x"]\nneeds = ["{need}"]\n' for name, need in rows.items()
    )
    with pytest.raises(TableError) as caught:
        parse_table(text, "t.toml")
    ring = str(caught.value.value).split(" -> ")
    assert ring[0] == ring[-1]
    assert set(ring) == {"a", "b", "c"}
    assert all(rows[one] == other for one, other in pairwise(ring))
    assert caught.value.key == f"process.{ring[0]}.needs"


def test_a_process_cannot_outlive_what_it_needs() -> None:
    with pytest.raises(TableError) as caught:
        parse_table(ROUTER + SIM + 'outlives = ["router"]\n', "t.toml")
    assert caught.value.key == "process.sim.outlives"


def test_missing_and_unreadable_files_are_named(tmp_path: Path) -> None:
    with pytest.raises(TableError, match="No such file"):
        load_table(tmp_path / "none.toml")
    (tmp_path / "latin.toml").write_bytes(b"# \xe4")
    with pytest.raises(TableError, match="utf-8"):
        load_table(tmp_path / "latin.toml")


def test_start_order_of_the_local_stack_begins_with_the_router() -> None:
    assert start_order(load_table(find_table()).processes)[0] == "router"


def test_a_process_can_be_given_arguments_as_they_stand():
    table = parse_table('[process.one]\ncommand = ["{python}", "-m", "one"]\n', "here")
    given = table.with_arguments("one", "--rules", "a {odd} name")
    values = {"python": "py", "cell": "", "connect": "", "log_dir": "", "name": "one"}
    assert expand(given.processes["one"], values) == ("py", "-m", "one", "--rules", "a {odd} name")
    assert expand(table.processes["one"], values) == ("py", "-m", "one")
