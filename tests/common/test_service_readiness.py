"""When a service is ready, and what it says about itself."""

import os
import threading
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from fras_common.messages import LogRecord
from fras_common.service import ServiceHost
from fras_common.service.build import build_of_this_process
from fras_common.service.health import ProcessMeter
from fras_common.topics import HEALTH, LOG, VERDICT
from support.verdicts import verdict


def ready(bench: Any, name: str) -> bool:
    bench.settle()
    tokens: list[str] = []
    bench.bus("witness/1").watch_tokens(lambda token, present: tokens.append(token))
    return f"ready/{name}/1" in tokens


def test_a_service_without_inputs_is_ready_once_it_is_alive(bench: Any):
    host = bench.host("sim")
    assert host.state == "starting"
    assert not ready(bench, "sim")
    host.announce_alive()
    assert ready(bench, "sim")
    assert host.state == "ready"
    assert host.present("alive/sim")


def test_a_service_is_ready_only_when_its_inputs_are_there(bench: Any):
    motion, sa, sim = bench.host("motion"), bench.host("sa"), bench.host("sim")
    motion.subscribe(VERDICT, lambda message: None)
    motion.require("sim")
    motion.announce_alive()
    assert not ready(bench, "motion")
    sa.announce_alive()
    assert not ready(bench, "motion")
    sim.announce_alive()
    assert ready(bench, "motion")
    assert motion.state == "ready"


def test_own_and_everybodys_topics_are_no_inputs(bench: Any):
    host = bench.host("sa")
    host.subscribe(VERDICT, lambda message: None)
    host.subscribe(HEALTH, lambda message: None)
    host.announce_alive()
    assert ready(bench, "sa")


def test_an_input_that_was_there_before_counts(bench: Any):
    bench.host("sa").announce_alive()
    motion = bench.host("motion")
    motion.subscribe(VERDICT, lambda message: None)
    motion.announce_alive()
    assert ready(bench, "motion")


def test_presence_lasts_as_long_as_one_instance(bench: Any):
    host = bench.host("motion")
    old, new = bench.bus("sa/old"), bench.bus("sa/new")
    old.announce("alive/sa")
    new.announce("alive/sa")
    bench.settle()
    old.close()
    bench.settle()
    assert host.present("alive/sa")
    new.close()
    bench.settle()
    assert not host.present("alive/sa")


def test_health_tells_what_the_service_does(bench: Any):
    host = bench.host("sim")
    host.enter_trial("t-1")
    host.tick = 12
    host.facts["linear_solver"] = "block tridiagonal"
    host.publisher(VERDICT).put(verdict(12))
    host.announce_alive()
    bench.settle()
    meter = ProcessMeter()
    health = host.health(meter)
    assert (health.service, health.state, health.tick) == ("sim", "ready", 12)
    assert (health.published, health.trial) == (1, "t-1")
    assert health.facts == {
        "build": build_of_this_process(),
        "linear_solver": "block tridiagonal",
    }
    assert f"numpy {np.__version__}; " in health.facts["build"]
    pages = int(Path("/proc/self/statm").read_text(encoding="ascii").split()[1])
    assert health.rss_bytes == pytest.approx(pages * os.sysconf("SC_PAGE_SIZE"), rel=0.2)
    assert health.cpu_percent >= 0.0
    host.waiting_for = "sa"
    assert host.health(meter).state == "waiting: sa"


def test_health_is_published_until_told_to_stop(bench: Any):
    host, beats, enough, stop = bench.host("sim"), [], threading.Event(), threading.Event()

    def beat(message: Any) -> None:
        beats.append(message)
        if len(beats) == 2:
            enough.set()

    bench.bus("witness/1").subscribe(HEALTH, beat)
    thread = threading.Thread(target=host.report_health, args=(stop,))
    thread.start()
    assert enough.wait(10.0)
    stop.set()
    thread.join(10.0)
    first, second = beats[:2]
    assert second.seq == first.seq + 1
    assert 0.3e9 < second.stamp_ns - first.stamp_ns < 3e9


def test_a_log_record_bears_the_trial(bench: Any):
    host, records = bench.host("sim"), bench.heard(LOG)
    host.enter_trial("t-1")
    host.publish_log(LogRecord(level="error", event="solver", fields={"residual": "1"}))
    (record,) = records
    assert (record.trial, record.source, record.event) == ("t-1", "sim/1", "solver")
    ServiceHost("sa").publish_log(LogRecord(level="error", event="too early", fields={}))
