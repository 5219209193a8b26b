"""compose/secure*.toml: the plain tables, and every process with its certificate."""

from dataclasses import replace
from pathlib import Path

import msgspec
import pytest

from fras_cli.layout import Layout, layout_of
from fras_cli.own_keys import require_keys
from fras_supervisor import TableError, find_table, load_table
from fras_supervisor.table import PLACEHOLDERS, parse_table

KEYS = Path("/keys")
WITH_KEYS = (*PLACEHOLDERS, "keys")


@pytest.mark.parametrize("plain", ["local", "crtk", "twin"])
def test_a_secure_table_is_the_plain_one_with_certificates(plain: str):
    before = load_table(find_table(plain)).processes
    after = Layout(plain, keys=KEYS).table().processes
    assert list(after) == list(before)
    for name, process in before.items():
        own = ("--tls", "{keys}", *(("--cell", "{cell}") if name == "router" else ()))
        assert after[name] == msgspec.structs.replace(process, command=(*process.command, *own))


def test_a_table_of_ones_own_is_taken_if_each_process_shows_its_certificate(tmp_path: Path):
    own = tmp_path / "own.toml"
    own.write_text(
        '[process.router]\ncommand = ["x", "--tls", "{keys}"]\n[process.sim]\ncommand = ["y"]\n'
    )
    with pytest.raises(TableError, match=r"process\.sim\.command"):
        Layout(str(own), keys=KEYS).table()
    own.write_text('[process.router]\ncommand = ["x", "--tls", "{keys}"]\n')
    assert list(Layout(str(own), keys=KEYS).table().processes) == ["router"]


def test_a_table_without_any_is_refused():
    table = parse_table('[process.sim]\ncommand = ["x"]\n', "here", WITH_KEYS)
    with pytest.raises(TableError, match="for --secure"):
        require_keys(table)


def test_secure_is_said_of_a_layout_in_words(monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setenv("FRAS_KEYS", str(KEYS))
    layout = layout_of("local", None, secure=True)
    assert (layout.keys, layout.protocol, layout.in_words()) == (KEYS, "tls", "--secure")
    assert layout_of("local", None, secure=False) == replace(layout, keys=None)


def test_two_hosts_with_certificates_are_the_two_hosts():
    """Each service with its certificate; each router knows who speaks through the other."""
    before = load_table(find_table("two-hosts"))
    after = Layout("two-hosts", keys=KEYS).table()
    assert (list(after.processes), after.hosts) == (list(before.processes), before.hosts)
    behind = {"router-a": "router-b={services_B}", "router-b": "router-a={services_A},cli,monitor"}
    for name, process in before.processes.items():
        own = ("--tls", "{keys}")
        if name in behind:
            own = (*own, "--cell", "{cell}", "--name", "{name}", "--link", behind[name])
        expected = msgspec.structs.replace(process, command=(*process.command, *own))
        assert after.processes[name] == expected
