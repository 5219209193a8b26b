"""The main function of a service: order of the start, of the end, and exit statuses."""

import json
import signal
import subprocess
import sys
import threading
from pathlib import Path
from typing import Any

import pytest

from fras_common.bus.zenoh_bus import ZenohBus
from fras_common.errors import FrasError
from fras_common.extras import MissingExtra, require_extra
from fras_common.messages import LogRecord
from fras_common.service import ServiceHost, runner
from fras_common.service.runner import CannotStart, parse_arguments, run_service, serve
from fras_common.signals import StopFlag
from fras_common.topics import LOG, VERDICT

NO_ROUTER = "tcp/127.0.0.1:1"

LOGGER = """
import sys
from fras_common.service.logs import configure_logging
records = []
log = configure_logging("sim", "INFO", records.append)
log.debug("unsaid")
log.info("ready", port=7447)
log.warning("late", by_s=0.5)
log.error("gone", who={"sa"})
print([(r.level, r.event, r.fields["by_s"] if "by_s" in r.fields else "") for r in records])
print(records[0].fields["service"])
"""


def reporting() -> set[threading.Thread]:
    """Threads that say how a service is; other tests may have left services that run."""
    return {thread for thread in threading.enumerate() if thread.name == "health"}


class Recorded:
    """A service that notes what is done to it."""

    def __init__(self, host: ServiceHost) -> None:
        self.host = host
        self.events: list[str] = []
        host.subscribe(VERDICT, lambda message: None)

    def wake(self) -> float | None:
        self.events.append("wake")
        return None

    def close(self) -> None:
        self.host.publish_log(LogRecord(level="warning", event="last words", fields={}))
        self.events.append("close")


@pytest.fixture
def handlers() -> Any:
    """Puts back the signal handlers that `run_service` installs."""
    kept = {number: signal.getsignal(number) for number in (signal.SIGINT, signal.SIGTERM)}
    yield
    for number, handler in kept.items():
        signal.signal(number, handler)


def test_a_service_lives_from_alive_to_its_last_words(bench: Any):
    host, stop = ServiceHost("sim"), StopFlag()
    records, tokens, ready = bench.heard(LOG), [], threading.Event()
    bus = bench.bus("sim/1")
    built: list[Recorded] = []

    def on_token(token: str, present: bool) -> None:
        tokens.append(token)
        if token == "ready/sim/1":
            ready.set()

    bench.bus("cli/1").watch_tokens(on_token)
    bench.bus("sa/1").announce("alive/sa")

    def build(host: ServiceHost) -> Recorded:
        built.append(Recorded(host))
        return built[-1]

    thread = threading.Thread(target=serve, args=(host, bus, build, stop))
    thread.start()
    assert ready.wait(10.0)
    stop.set()
    thread.join(10.0)
    assert not thread.is_alive()
    assert tokens == ["alive/sa/1", "alive/sim/1", "ready/sim/1"]
    assert built[0].events[0] == "wake"
    assert built[0].events[-1] == "close"
    assert [record.event for record in records] == ["last words"]


def test_a_stop_before_the_start_is_not_forgotten(bench: Any):
    host, stop = ServiceHost("sim"), StopFlag()
    built: list[Recorded] = []
    stop.set()
    serve(host, bench.bus("sim/1"), lambda host: built.append(Recorded(host)) or built[0], stop)
    assert built[0].events == ["close"]


def test_a_service_that_fails_is_closed_all_the_same(bench: Any):
    host = ServiceHost("sim")
    built: list[Recorded] = []

    class Broken(Recorded):
        def wake(self) -> float | None:
            raise ZeroDivisionError

    def build(host: ServiceHost) -> Recorded:
        built.append(Broken(host))
        return built[0]

    before = reporting()
    with pytest.raises(ZeroDivisionError):
        serve(host, bench.bus("sim/1"), build, StopFlag())
    assert built[0].events == ["close"]
    assert reporting() <= before


@pytest.mark.usefixtures("handlers")
def test_without_a_router_the_exit_status_is_3(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
):
    def impatient(*arguments: Any, **settings: Any) -> ZenohBus:
        return ZenohBus(*arguments, **settings, open_timeout_s=0.1)

    monkeypatch.setattr(runner, "ZenohBus", impatient)
    shell = "fras_common.service.host:ServiceHost"
    assert run_service("sim", shell, ["--connect", NO_ROUTER]) == 3
    assert f"fras sim: no Zenoh router at {NO_ROUTER}" in capsys.readouterr().err


@pytest.mark.usefixtures("handlers")
def test_a_missing_library_is_named_with_its_extra(capsys: pytest.CaptureFixture[str]):
    assert run_service("sim", "a_library_that_is_not_there:Shell", []) == 3
    said = capsys.readouterr().err
    assert "a_library_that_is_not_there" in said
    assert "fras[sim]" in said


def test_a_folder_of_a_service_is_one_of_its_options(capsys: pytest.CaptureFixture[str]):
    paths = {"own_rules": "rules of your own"}
    options = parse_arguments("planner", ["--own-rules", "here"], "Plan.", paths)
    assert options.own_rules == Path("here")
    assert parse_arguments("planner", [], "Plan.", paths).own_rules is None
    with pytest.raises(SystemExit):
        parse_arguments("planner", ["--help"], "Plan.", paths)
    assert "rules of your own" in capsys.readouterr().out


def test_a_shell_that_can_not_be_made_says_why_and_leaves_nothing(bench: Any):
    def build(host: ServiceHost) -> Recorded:
        raise FrasError("rules.lp:3: syntax error")

    before = reporting()
    with pytest.raises(CannotStart, match=r"rules\.lp:3: syntax error"):
        serve(ServiceHost("sim"), bench.bus("sim/1"), build, StopFlag())
    assert reporting() <= before


def test_an_extra_that_is_there_is_no_matter():
    with require_extra("sim"):
        pass
    with pytest.raises(MissingExtra), require_extra("sim"):
        raise ModuleNotFoundError("No module named 'x'", name="x")
    with pytest.raises(ZeroDivisionError), require_extra("sim"):
        _ = 1 / 0


def test_the_arguments_have_defaults_and_reject_the_rest(capsys: pytest.CaptureFixture[str]):
    options = parse_arguments("sim", [], "")
    assert (options.cell, options.connect) == ("local", "tcp/127.0.0.1:7447")
    assert (options.instance, options.log_level) == ("", "INFO")
    with pytest.raises(SystemExit) as caught:
        parse_arguments("sim", ["--log-level", "LOUD"], "")
    assert caught.value.code == 2
    assert "LOUD" in capsys.readouterr().err


def test_logs_are_json_lines_and_warnings_also_messages():
    # In a process of its own: structlog's configuration is global.
    ended = subprocess.run(
        [sys.executable, "-c", LOGGER], capture_output=True, text=True, timeout=60, check=True
    )
    lines = [json.loads(line) for line in ended.stderr.splitlines()]
    assert [line["event"] for line in lines] == ["ready", "late", "gone"]
    assert [line["level"] for line in lines] == ["info", "warning", "error"]
    assert lines[0]["port"] == 7447
    assert all(line["service"] == "sim" and line["timestamp"] for line in lines)
    said = ended.stdout.splitlines()
    assert said == ["[('warning', 'late', '0.5'), ('error', 'gone', '')]", "sim"]
