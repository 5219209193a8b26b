"""A table for several hosts: what of it one host runs, and what is refused before it starts."""

import socket
from pathlib import Path

import pytest

from fras_supervisor import (
    AddressNotHere,
    BadAddress,
    NoAddress,
    NothingOnHost,
    OnOtherHost,
    PortTaken,
    Stack,
    TableError,
    UnknownHost,
    find_table,
    free_port,
    load_table,
    place,
)
from fras_supervisor.docker import compose_file
from fras_supervisor.hosts import endpoint_at, read_addresses
from fras_supervisor.table import parse_table

HOSTS = '[host.A]\naddress = "10.0.0.1"\n[host.B]\n[host.C]\n'


def row(name: str, host: str, *words: str, more: str = "") -> str:
    command = ", ".join(f'"{word}"' for word in ("{python}", *words))
    return f'[process.{name}]\nhost = "{host}"\ncommand = [{command}]\n{more}'


TWO = HOSTS + row("arms", "A", "{router_A}", "{router_B}") + row("camera", "B", "{router_A}")


def test_a_host_gets_its_own_processes_and_knows_the_others():
    table, routers = place(parse_table(TWO, "t.toml"), "B", 7500, {})
    assert list(table.processes) == ["camera"]
    assert table.processes["camera"].host == "localhost"
    assert (table.here, table.elsewhere) == ("B", {"arms": "A"})
    assert routers == {"router_A": "tcp/10.0.0.1:7447"}


def test_its_own_address_takes_its_own_port_and_those_given_go_before_the_tables():
    addresses = {"A": "10.0.0.9", "B": "tls/b.lan:1234"}
    _, routers = place(parse_table(TWO, "t.toml"), "A", 7500, addresses)
    assert routers == {"router_A": "tcp/10.0.0.9:7500", "router_B": "tls/b.lan:1234"}


@pytest.mark.parametrize(
    ("host", "addresses", "error", "said"),
    [
        ("D", {}, UnknownHost, "no host 'D'; it has A, B, C"),
        ("A", {"D": "10.0.0.4"}, UnknownHost, "no host 'D'"),
        ("", {"A": "10.0.0.4"}, UnknownHost, "no host ''"),
        ("C", {}, NothingOnHost, "no process is of host C"),
        ("A", {}, NoAddress, r"process arms asks .* host B.*--address B=HOST"),
        ("B", {"A": "10.0.0.4:99999"}, BadAddress, "10.0.0.4:99999"),
        ("B", {"A": "a b"}, BadAddress, "'a b' is not the address"),
    ],
)
def test_what_cannot_be_placed_is_named(
    host: str, addresses: dict[str, str], error: type[Exception], said: str
):
    with pytest.raises(error, match=said):
        place(parse_table(TWO, "t.toml"), host, 7447, addresses)


def test_a_table_of_one_machine_has_no_hosts():
    with pytest.raises(UnknownHost, match="at all"):
        place(load_table(find_table()), "A", 7447, {})


@pytest.mark.parametrize(
    ("text", "key", "value"),
    [
        (HOSTS + row("sim", "D"), "process.sim.host", "D"),
        (HOSTS + row("sim", "localhost"), "process.sim.host", "localhost"),
        (TWO + row("x", "A", more='needs = ["camera"]\n'), "process.x.needs", "camera"),
        (TWO + row("x", "A", more='outlives = ["camera"]\n'), "process.x.outlives", "camera"),
        (HOSTS + row("sim", "A", "{router_D}"), "process.sim.command", "{router_D}"),
        ("[host.A]\nport = 1\n" + row("sim", "A"), "host.A.port", 1),
        ('[host."a b"]\n' + row("sim", "A"), "host.a b", "a b"),
        ("[host]\nA = 1\n" + row("sim", "A"), "host.A", 1),
        ("host = 1\n" + row("sim", "A"), "host", 1),
    ],
)
def test_a_table_is_checked_as_a_whole(text: str, key: str, value: object):
    with pytest.raises(TableError) as caught:
        parse_table(text, "t.toml")
    assert (caught.value.key, caught.value.value) == (key, value)


def test_each_host_may_have_a_router_and_the_cell_one_of_all_else():
    def rows(module: str, names: tuple[str, str]) -> str:
        return HOSTS + "".join(
            row(name, host, "-m", module, more='readiness = "listening"\n')
            for name, host in zip(names, "AB", strict=True)
        )

    parse_table(rows("fras_common.router", ("router-a", "router-b")), "t.toml")
    with pytest.raises(TableError, match="each service once"):
        parse_table(rows("fras_sim", ("sim", "sim-b")), "t.toml")


def test_the_shipped_one_places_every_service_once():
    table = load_table(find_table("two-hosts"))
    here, routers = place(table, "A", 7447, {"A": "10.0.0.1"})
    there, _ = place(table, "B", 7447, {"A": "10.0.0.1"})
    assert here.processes.keys() == there.elsewhere.keys()
    assert there.processes.keys() == here.elsewhere.keys()
    assert routers == {"router_A": "tcp/10.0.0.1:7447"}
    with pytest.raises(TableError, match="fras up --host A"):
        Stack(table, "c", f"tcp/127.0.0.1:{free_port()}", None, set)  # pyright: ignore
    with pytest.raises(TableError, match="one machine"):
        compose_file(table)


def test_a_process_of_another_host_is_not_restarted_here(tmp_path):
    table, routers = place(parse_table(TWO, "t.toml"), "B", 7447, {})
    stack = Stack(table, "c", "tcp/127.0.0.1:7447", tmp_path, set, values=routers)
    with pytest.raises(OnOtherHost, match="of host A"):
        stack.restart("arms")


@pytest.mark.parametrize("address", ["192.0.2.1", "127.0.0.1"])
def test_its_own_address_is_tried_before_anything_starts(tmp_path: Path, address: str):
    text = HOSTS + row("arms", "A", "{router_A}", more='readiness = "listening"\n')
    with socket.create_server(("127.0.0.1", 0)) as taken:
        port = taken.getsockname()[1]
        table, routers = place(parse_table(text, "t.toml"), "A", port, {"A": address})
        stack = Stack(
            table, "c", f"tcp/127.0.0.1:{free_port()}", tmp_path / "logs", set, values=routers
        )
        expected = PortTaken if address == "127.0.0.1" else AddressNotHere
        with pytest.raises(expected):
            stack.start()
    assert not (tmp_path / "logs").exists()


@pytest.mark.parametrize(
    ("address", "endpoint"),
    [
        ("10.0.0.1", "tcp/10.0.0.1:7447"),
        ("robot.lan:80", "tcp/robot.lan:80"),
        ("[fd00::1]", "tcp/[fd00::1]:7447"),
        ("[fd00::1]:80", "tcp/[fd00::1]:80"),
        ("tls/robot.lan", "tls/robot.lan:7447"),
    ],
)
def test_an_address_becomes_an_endpoint(address: str, endpoint: str):
    assert endpoint_at(address) == endpoint


@pytest.mark.parametrize("text", ["A", "A=", "=10.0.0.1"])
def test_addresses_are_given_by_name(text: str):
    assert read_addresses(["A=10.0.0.1", "B=b"]) == {"A": "10.0.0.1", "B": "b"}
    with pytest.raises(BadAddress, match="each name once"):
        read_addresses([text])
    with pytest.raises(BadAddress, match="each name once"):
        read_addresses(["A=a", "A=b"])


def test_services_of_a_host_are_its_services_and_its_supervisor():
    text = (
        HOSTS
        + row(
            "router-a",
            "A",
            "-m",
            "fras_common.router",
            "{services_B}",
            more='readiness="listening"\n',
        )
        + row("sim", "B", "-m", "fras_sim")
        + row("camera", "B")
        + row("router-b", "B", "-m", "fras_common.router", more='readiness="listening"\n')
    )
    _, filled = place(parse_table(text, "t.toml"), "A", 7500, {})
    assert filled == {"services_B": "sim,supervisor"}


def test_routers_with_certificates_are_reached_by_tls_alone():
    _, routers = place(parse_table(TWO, "t.toml"), "B", 7500, {}, "tls")
    assert routers == {"router_A": "tls/10.0.0.1:7447"}
    with pytest.raises(BadAddress, match="routers with certificates speak tls"):
        place(parse_table(TWO, "t.toml"), "B", 7500, {"A": "tcp/10.0.0.1:7447"}, "tls")
