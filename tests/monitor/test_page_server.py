"""The page over its real web server: who is let in, what is served, what the buttons do."""

import gzip
import http.client
import json
import re
import threading
import time
from collections.abc import Callable, Iterator
from typing import Any, NamedTuple

import pytest
from websockets.exceptions import InvalidStatus
from websockets.sync.client import ClientConnection, connect
from websockets.sync.connection import Connection
from websockets.typing import Origin, Subprotocol

from fras_common.bus import MemoryBus, MemoryFabric
from fras_common.messages import Holds, HoldState, Presence, WhyNotReply
from fras_common.service import ServiceHost
from fras_common.topics import HEALTH, HOLD, HOLDS, PRESENCE, RESUME, ROBOT_STATE, WHY_NOT
from fras_monitor.access import Policy
from fras_monitor.page.door import PortInUse
from fras_monitor.service import MonitorService
from support import pictures as p

PATIENCE_S = 30.0
TOKEN, VIEW = "t" * 20, "v" * 20


class Open:
    """One open page, without drawing: what it was told so far."""

    def __init__(self, connection: Connection) -> None:
        self.connection = connection
        self.view: dict[str, Any] = {}
        self.said: list[dict[str, Any]] = []

    def send(self, **command: Any) -> None:
        self.connection.send(json.dumps(command))

    def until(self, condition: Callable[["Open"], Any]) -> Any:
        deadline_s = time.monotonic() + PATIENCE_S
        while not (found := condition(self)):
            assert time.monotonic() < deadline_s, (self.said, self.view)
            news = json.loads(self.connection.recv(timeout=PATIENCE_S))
            self.said += news.pop("said", [])
            self.view |= news
        return found


class Cell:
    """The page's shell on an in-memory bus, and a motion and a planner that answer."""

    def __init__(self, policy: Policy) -> None:
        self.fabric = MemoryFabric()
        self.motion = MemoryBus(self.fabric, "cell", "motion/1")
        self.planner = MemoryBus(self.fabric, "cell", "planner/1")
        self.holds: dict[str, str] = {}
        self.lifted: list[tuple[str, str]] = []
        self.host = ServiceHost("monitor")
        self.host.attach(MemoryBus(self.fabric, "cell", "monitor/1"))
        self.service = MonitorService(self.host, "127.0.0.1", 0, policy, lambda address: None)
        self.address = self.service.address
        self._held = self.motion.publisher(HOLDS)
        self.motion.serve(HOLD, lambda call: call.reply(self._hold(call.request)))
        self.motion.serve(RESUME, lambda call: call.reply(self._lift(call.request)))
        self.planner.serve(WHY_NOT, lambda call: call.reply(self._why(call.request)))
        self._thread = threading.Thread(target=lambda: self.host.run(self.service.wake))
        self._thread.start()

    def _hold(self, request: Any) -> HoldState:
        self.holds = {**self.holds, request.holder: request.reason}
        return self._told()

    def _lift(self, request: Any) -> HoldState:
        self.lifted.append((request.holder, request.by))
        self.holds = {one: why for one, why in self.holds.items() if one != request.holder}
        return self._told()

    def _told(self) -> HoldState:
        self._held.put(Holds(holds=self.holds))
        return HoldState(holds=self.holds, tick=1)

    def _why(self, request: Any) -> WhyNotReply:
        sentence = f"{request.question} could be grasped, but falls short of b(2,2)."
        return WhyNotReply(
            question=request.question, trial="", request_id="c1", rules=[], sentences=[sentence]
        )

    def control(self, query: str = "", **options: Any) -> ClientConnection:
        address = self.address.replace("http", "ws") + "control" + query
        return connect(address, compression=None, **options)

    def get(self, path: str, **headers: str) -> "Answer":
        connection = http.client.HTTPConnection("127.0.0.1", self.port, timeout=PATIENCE_S)
        connection.request("GET", f"/{path}", headers={**headers, "Connection": "close"})
        answer = connection.getresponse()
        body = answer.read()
        connection.close()
        return Answer(answer.status, dict(answer.headers), body)

    @property
    def port(self) -> int:
        return int(self.address.rpartition(":")[2].rstrip("/"))

    def close(self) -> None:
        self.host.stop()
        self._thread.join()
        self.service.close()
        for bus in (self.host.bus, self.motion, self.planner):
            bus.close()


class Answer(NamedTuple):
    status: int
    headers: dict[str, str]
    body: bytes


@pytest.fixture
def cell(request: pytest.FixtureRequest) -> Iterator[Cell]:
    made = Cell(getattr(request, "param", Policy()))
    yield made
    made.close()


def test_the_page_is_served_and_may_contact_nobody_else(cell: Cell):
    for path in ("", "page.js", "page.css", "plot.js", "scene/0a1b/"):
        answer = cell.get(path)
        assert answer.status == 200
        rules = answer.headers["Content-Security-Policy"]
        assert "default-src 'self'" in rules
        assert "http" not in rules
    assert b'id="stop"' in cell.get("").body


def test_the_scene_comes_without_visers_panel_packed_or_not(cell: Cell):
    for packing in ("", "gzip"):
        answer = cell.get("scene/0a1b/", **{"Accept-Encoding": packing})
        body = gzip.decompress(answer.body) if packing else answer.body
        assert answer.headers["Content-Encoding"] == (packing or "identity")
        head = body.partition(b"</head>")[0]
        assert b"[data-floating-window]" in head
        assert b"display:none" in head


def test_the_scenes_program_is_kept_by_a_browser_and_comes_packed_or_not(cell: Cell):
    name = re.search(rb'href="../(client-\w+\.js)"', cell.get("scene/0a1b/").body)
    assert name is not None
    path = f"scene/{name[1].decode()}"
    plain = cell.get(path)
    packed = cell.get(path, **{"Accept-Encoding": "gzip"})
    assert "immutable" in plain.headers["Cache-Control"]
    assert "javascript" in plain.headers["Content-Type"]
    assert gzip.decompress(packed.body) == plain.body


def test_each_page_asks_for_a_scene_of_its_own(cell: Cell):
    bodies = [cell.get("").body for _ in range(2)]
    scenes = [re.findall(rb'src="(scene/[0-9a-f]{32}/)"', body) for body in bodies]
    (first,), (second,) = scenes
    assert first != second
    assert cell.get(first.decode()).status == 200


def test_nothing_else_is_served(cell: Cell):
    for path in (
        "scene/x/",
        "scene/a/b/",
        "scene/",
        "scene/client-0.js",
        "page.py",
        "../door.py",
        "scene/../../x",
        "static/page.html",
    ):
        assert cell.get(path).status == 404


def test_stop_stops_and_is_lifted_only_as_it_was_shown(cell: Cell):
    with cell.control() as connection:
        page = Open(connection)
        page.send(do="stop")
        page.until(lambda one: one.view.get("stop", {}).get("state") == "acknowledged")
        assert cell.holds.keys() == {"monitor"}
        page.until(lambda one: one.view["held_here"])
        robot = cell.motion.publisher(ROBOT_STATE)
        robot.put(p.robot(phase="held", holds=cell.holds))
        words = page.until(lambda one: one.view["stop"]["state"] == "at_rest" and one.view["stop"])
        assert "arms at rest after" in words["words"]

        page.send(do="resume", holds={"cli": "another"})
        page.until(lambda one: [said for said in one.said if "changed" in said.get("words", "")])
        assert cell.lifted == []
        page.send(do="resume", holds=cell.holds)
        page.until(lambda one: one.view["holds"] == {})
        assert cell.lifted == [("monitor", "monitor")]
        page.until(lambda one: one.view["stop"]["state"] == "none")


def test_a_block_is_asked_about_and_answered_in_words(cell: Cell):
    with cell.control() as connection:
        page = Open(connection)
        page.send(do="why_not", block="b(1,1)")
        page.until(lambda one: one.view.get("question"))
        assert page.view["question"] == "Why not point 1-1?"
        assert page.view["answer"] == ["Point 1-1 could be grasped, but falls short of point 2-2."]


def test_what_no_button_sends_does_nothing_and_breaks_nothing(cell: Cell):
    with cell.control() as bad, cell.control() as good:
        bad.send("{")
        bad.send(b"\x00" * 100)
        page, other = Open(bad), Open(good)
        page.until(lambda one: [said for said in one.said if said.get("good") is False])
        other.send(do="stop")
        other.until(lambda one: one.view.get("stop", {}).get("state") == "acknowledged")
        page.until(lambda one: one.view["stop"]["state"] == "acknowledged")


def test_a_page_that_vanishes_disturbs_no_other(cell: Cell):
    with cell.control() as stays:
        gone = cell.control()
        gone.socket.close()
        page = Open(stays)
        beat = page.until(lambda one: one.view.get("beat"))
        page.until(lambda one: one.view["beat"] > beat + 2)


@pytest.mark.parametrize("cell", [Policy(TOKEN, VIEW)], indirect=True)
def test_without_the_token_there_is_neither_page_nor_socket(cell: Cell):
    for path in ("", "page.js", "scene/0a1b/", "?token=wrong"):
        assert cell.get(path).status == 401
    for place in ("control", "scene"):
        address = cell.address.replace("http", "ws") + place
        with pytest.raises(InvalidStatus) as refused:
            connect(address, subprotocols=[Subprotocol("viser-v1.1.1")])
        assert refused.value.response.status_code == 401


@pytest.mark.parametrize("cell", [Policy(TOKEN, VIEW)], indirect=True)
def test_the_token_in_the_address_becomes_a_cookie_that_opens(cell: Cell):
    moved = cell.get(f"?token={TOKEN}")
    assert moved.status == 303
    assert moved.headers["Location"] == "/"
    cookie = moved.headers["Set-Cookie"]
    assert "HttpOnly" in cookie
    assert "SameSite=Strict" in cookie
    assert cell.get("", Cookie=cookie.partition(";")[0]).status == 200


@pytest.mark.parametrize("cell", [Policy(TOKEN, VIEW)], indirect=True)
def test_who_may_only_look_can_stop_nothing_and_lift_nothing(cell: Cell):
    with cell.control(f"?token={VIEW}") as connection:
        page = Open(connection)
        for command in ({"do": "stop"}, {"do": "resume", "holds": {}}):
            page.send(**command)
        page.until(lambda one: sum("only look" in said.get("words", "") for said in one.said) == 2)
        assert page.said[0]["you"] == "viewer"
    assert cell.holds == {}
    assert cell.lifted == []


def test_another_site_cannot_open_a_socket(cell: Cell):
    with pytest.raises(InvalidStatus) as refused:
        cell.control(origin=Origin("http://evil.example"))
    assert refused.value.response.status_code == 403


def test_who_looks_is_told_and_that_they_have_gone(cell: Cell):
    seen: list[Presence] = []
    changed = threading.Condition()

    def on_presence(presence: Presence) -> None:
        with changed:
            seen.append(presence)
            changed.notify_all()

    cell.motion.subscribe(PRESENCE, on_presence)
    with cell.control() as connection:
        connection.send(json.dumps({"do": "here"}))
        with changed:
            assert changed.wait_for(lambda: seen and seen[-1].viewers == 1, PATIENCE_S)
    with changed:
        assert changed.wait_for(lambda: seen[-1].viewers == 0, PATIENCE_S)


def test_a_cell_that_falls_silent_is_shown_as_old(cell: Cell):
    with cell.control() as connection:
        page = Open(connection)
        page.until(lambda one: one.view.get("live") is False)
        assert page.view["live_words"] == "Waiting for the system to start."
        bus = {name: MemoryBus(cell.fabric, "cell", f"{name}/1") for name in ("sim", "sa")}
        bus["motion"] = cell.motion
        for name, one in bus.items():
            one.announce(f"alive/{name}")
            one.publisher(HEALTH.of(service=name)).put(p.health(name))
        page.until(lambda one: one.view["live"])
        page.until(lambda one: not one.view["live"])
        assert "silent for" in page.view["live_words"]
        for name in ("sim", "sa"):
            bus[name].close()


def test_a_port_that_is_taken_is_named(cell: Cell):
    host = ServiceHost("monitor")
    host.attach(MemoryBus(cell.fabric, "cell", "monitor/2"))
    with pytest.raises(PortInUse, match="--port"):
        MonitorService(host, "127.0.0.1", cell.port, Policy(), lambda address: None)
    host.bus.close()
