"""Why another host's router is not reached: told by name, and only while it is waited for."""

import socket
import time

import pytest

from fras_cli.far_routers import AFTER_S, EVERY_S, HEARD_AFTER_S, FarRouters, obstacle
from fras_cli.layout import Layout


def test_a_place_that_nobody_listens_at_is_told_with_its_port():
    with socket.create_server(("127.0.0.1", 0)) as taken:
        port = taken.getsockname()[1]
        assert obstacle(f"tcp/127.0.0.1:{port}") == ""
    assert obstacle(f"tcp/127.0.0.1:{port}").startswith("nothing listens there")
    assert str(port) in obstacle(f"tcp/127.0.0.1:{port}")


@pytest.mark.parametrize(
    ("failure", "told"),
    [(socket.gaierror(), "no such host name: robot"), (TimeoutError(), "no answer: another")],
)
def test_each_obstacle_has_words(
    monkeypatch: pytest.MonkeyPatch, failure: OSError, told: str
) -> None:
    def connect(*_: object) -> socket.socket:
        raise failure

    monkeypatch.setattr(socket, "create_connection", connect)
    assert obstacle("tls/robot:7447").startswith(told)


def look_until_told(routers: FarRouters, now_s: float) -> list[str]:
    deadline_s = time.monotonic() + 20.0
    while time.monotonic() < deadline_s:
        if said := routers.look(waiting=True, now_s=now_s):
            return said
        time.sleep(0.01)  # the interval between two looks
    return []


def test_it_is_told_once_while_services_are_waited_for():
    with socket.create_server(("127.0.0.1", 0)) as taken:
        endpoint = f"tcp/127.0.0.1:{taken.getsockname()[1]}"
    routers = FarRouters({"A": endpoint})
    assert routers.look(waiting=True, now_s=0.0) == []
    said = look_until_told(routers, max(AFTER_S, EVERY_S))
    assert [one.partition(": nothing")[0] for one in said] == [
        f"the router of host A at {endpoint}"
    ]
    assert routers.look(waiting=True, now_s=EVERY_S + 1.0) == []
    assert routers.look(waiting=False, now_s=EVERY_S + 2.0) == []


def test_a_router_that_answers_is_suspected_only_when_nobody_is_heard_for_long():
    with socket.create_server(("127.0.0.1", 0)) as taken:
        routers = FarRouters({"A": f"tcp/127.0.0.1:{taken.getsockname()[1]}"})
        assert routers.look(waiting=True, now_s=0.0) == []
        said = look_until_told(routers, HEARD_AFTER_S)
    assert "no service behind it is heard" in said[0]


def test_a_host_looks_for_the_routers_that_it_links_to():
    addresses = {"A": "10.0.0.1"}
    of_b = Layout("two-hosts", host="B", addresses=addresses)
    assert of_b.far_routers(7447) == {"A": "tcp/10.0.0.1:7447"}
    assert Layout("two-hosts", host="A", addresses=addresses).far_routers(7447) == {}
    assert Layout().far_routers(7447) == {}
