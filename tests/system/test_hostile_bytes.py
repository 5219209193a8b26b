"""Bytes that nobody should send, on a live stack: counted, logged, and without effect."""

import itertools
import json
import random
from collections.abc import Callable
from pathlib import Path
from typing import Any

import zenoh
from benchmarks.fuzz_genuine import genuine_payloads
from benchmarks.fuzz_payloads import Hostile
from benchmarks.fuzz_rounds import is_refused

from fras_cli.trial import TrialView
from fras_common.messages import Health, RpcRecord
from fras_common.topics import HEALTH, QUERIES, TOPICS
from fras_log import LogReader
from support.logs import assert_same_trial, messages

MESH = "11,13,2"
PAYLOADS = 2_000


def genuine_of(log: Path) -> dict[str, list[bytes]]:
    """What a trial said, by key."""
    said: dict[str, list[bytes]] = {}
    for message in LogReader(log).messages():
        said.setdefault(message.key, []).append(message.payload)
    return genuine_payloads(said)


def session_in(cell: str, connect: str) -> zenoh.Session:
    config = zenoh.Config()
    for key, value in {
        "mode": "client",
        "namespace": f"fras/{cell}",
        "connect/endpoints": [connect],
        "scouting/multicast/enabled": False,
    }.items():
        config.insert_json5(key, json.dumps(value))
    return zenoh.open(config)


def test_garbage_on_every_key_and_two_thousand_hostile_payloads_change_nothing(
    trials: Any, quiet: Path, wait_until: Callable[..., Any]
) -> None:
    """Bytes without sense, and genuine messages, damaged: those that are to be refused.

    On every key, and as questions.
    """
    genuine = genuine_of(quiet)
    # Logs and health are for people and programs to read, and those of a rogue are, too.
    keys = [key for key in sorted(genuine) if not key.startswith(("log/", "health/"))]
    hostile = Hostile(2, genuine)
    payloads = (hostile.payload(key) for key in itertools.cycle(keys))
    refused = list(itertools.islice(filter(is_refused, payloads), PAYLOADS))
    health: dict[str, Health] = {}
    trials.stack.link.bus.subscribe(HEALTH, lambda one: health.update({one.service: one}))
    chance = random.Random(1)
    to_garbage: list[zenoh.Reply] = []
    to_hostile: list[zenoh.Reply] = []
    with session_in(trials.stack.link.cell, trials.stack.link.connect) as rogue:

        def send_garbage() -> None:
            for topic in TOPICS:
                if "{" not in topic.key:
                    rogue.put(topic.key, chance.randbytes(chance.randrange(200)))
            for query in QUERIES:
                handler: Any = zenoh.handlers.Callback(to_garbage.append)
                rogue.get(query.key, handler, payload=chance.randbytes(50), timeout=2.0)

        def send_hostile() -> None:
            for payload in [refused.pop() for _ in range(min(200, len(refused)))]:
                if not payload.key.startswith("?"):
                    rogue.put(payload.key, payload.data)
                    continue
                handler: Any = zenoh.handlers.Callback(to_hostile.append)
                rogue.get(payload.key[1:], handler, payload=payload.data, timeout=2.0)

        def send(view: TrialView) -> None:
            send_garbage()
            send_hostile()

        # Three seconds at least, so that there is time for all of it.
        summary, log = trials.run("a", send, pace=2, mesh=MESH)
    assert refused == []
    assert summary.outcome == "success"
    assert_same_trial(quiet, log, with_garbage=True)
    for service in ("sim", "sa", "motion", "planner", "recorder"):
        wait_until(lambda one=service: health[one].malformed > 0, f"{service} counts")
    for replies in (to_garbage, to_hostile):
        wait_until(lambda replies=replies: replies, "refusals come back")
        assert all(reply.ok is None for reply in replies)
    said: list[RpcRecord] = messages(log, "rpc/motion/execute", with_garbage=True)
    mirrors = [one for one in said if not one.trial.startswith("other-")]
    assert mirrors
    assert [mirror.fault for mirror in mirrors] == [None] * len(mirrors)
