"""Bytes that nobody should send, on a live stack: counted, logged, and without effect."""

import json
import random
from collections.abc import Callable
from typing import Any

import zenoh

from fras_cli.trial import TrialView
from fras_common.messages import Health, RpcRecord
from fras_common.topics import HEALTH, QUERIES, TOPICS
from support.logs import assert_same_trial, messages


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


def test_garbage_on_every_key_changes_nothing_and_is_counted(
    trials: Any, wait_until: Callable[..., Any]
) -> None:
    quiet = trials.run("a")[1]
    health: dict[str, Health] = {}
    trials.stack.link.bus.subscribe(HEALTH, lambda one: health.update({one.service: one}))
    chance = random.Random(1)
    replies: list[zenoh.Reply] = []
    with session_in(trials.stack.link.cell, trials.stack.link.connect) as rogue:

        def send_garbage(view: TrialView) -> None:
            for topic in TOPICS:
                if "{" not in topic.key:
                    rogue.put(topic.key, chance.randbytes(chance.randrange(200)))
            for query in QUERIES:
                handler: Any = zenoh.handlers.Callback(replies.append)
                rogue.get(query.key, handler, payload=chance.randbytes(50), timeout=2.0)

        summary, log = trials.run("a", send_garbage)
    assert summary.outcome == "success"
    assert_same_trial(quiet, log, with_garbage=True)
    for service in ("sim", "sa", "motion", "planner", "recorder"):
        wait_until(lambda one=service: health[one].malformed > 0, f"{service} counts")
    wait_until(lambda: replies, "refusals come back")
    assert all(reply.ok is None for reply in replies)
    mirrors: list[RpcRecord] = messages(log, "rpc/motion/execute")
    assert [mirror.fault for mirror in mirrors] == [None] * len(mirrors)
