import os
import socket
from collections.abc import Iterator
from pathlib import Path

import pytest

from fras_supervisor import BadEndpoint, Endpoint, PortTaken, free_port
from fras_supervisor.ports import accepts, holder_of, require_free


@pytest.fixture
def listener() -> Iterator[Endpoint]:
    with socket.create_server(("127.0.0.1", 0)) as server:
        yield Endpoint("tcp", *server.getsockname())


def test_free_port_can_be_bound_and_is_out_of_the_way_of_outgoing_connections() -> None:
    port = free_port()
    require_free(Endpoint("tcp", "127.0.0.1", port))
    first = int(Path("/proc/sys/net/ipv4/ip_local_port_range").read_text().split()[0])
    assert port < first or first <= 20_200
    with socket.create_server(("127.0.0.1", port)):
        assert accepts(Endpoint("tcp", "127.0.0.1", port))


def test_taken_port_is_named_with_its_holder(listener: Endpoint) -> None:
    with pytest.raises(PortTaken, match=f"port {listener.port} is taken by pid") as caught:
        require_free(listener)
    assert caught.value.port == listener.port
    assert str(os.getpid()) in str(caught.value.holder)


def test_nobody_holds_a_free_port() -> None:
    assert holder_of(free_port()) is None


def test_accepts_tells_a_listener_from_none(listener: Endpoint) -> None:
    assert accepts(listener)
    assert accepts(Endpoint("tcp", "0.0.0.0", listener.port))
    assert not accepts(Endpoint("tcp", "127.0.0.1", free_port()))


@pytest.mark.parametrize(
    ("text", "endpoint"),
    [
        ("tcp/127.0.0.1:7447", Endpoint("tcp", "127.0.0.1", 7447)),
        ("tls/or-3.hospital:1", Endpoint("tls", "or-3.hospital", 1)),
        ("tcp/[::1]:65535", Endpoint("tcp", "::1", 65535)),
    ],
)
def test_endpoints_are_read(text: str, endpoint: Endpoint) -> None:
    assert Endpoint.parse(text) == endpoint


@pytest.mark.parametrize(
    "text",
    ["", "7447", "127.0.0.1:7447", "tcp/127.0.0.1", "tcp/h:0", "tcp/h:65536", "udp/h:1", "tcp/:1"],
)
def test_bad_endpoints_are_refused(text: str) -> None:
    with pytest.raises(BadEndpoint) as caught:
        Endpoint.parse(text)
    assert caught.value.endpoint == text


def test_unknown_host_is_a_bad_endpoint() -> None:
    with pytest.raises(BadEndpoint, match=r"no-such-host\.invalid"):
        require_free(Endpoint("tcp", "no-such-host.invalid", 7447))
