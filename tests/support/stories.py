"""A small trial as its log would hold it, and ways to forge it: for the invariants of chaos."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

import msgspec

from fras_common.codec import encode
from fras_common.messages import (
    ActionState,
    ExecuteReply,
    ExecuteRequest,
    Header,
    RecorderEvent,
    RpcRecord,
    TaskStatus,
)
from fras_experiments.chaos.evidence import Evidence, gather
from support.robots import robot
from support.tissues import tissue
from support.verdicts import verdict

TRIAL = "t-1"
TICK_NS = 20_000_000


def acting(phase: str = "lift", goal_id: str = "g1", name: str = "pull") -> ActionState:
    return ActionState(goal_id=goal_id, name=name, arm="psm1", block="b(1,1)", phase=phase)


def status(outcome: Any, reason: str = "visible", **header: Any) -> TaskStatus:
    return TaskStatus(
        trial=TRIAL, phase="ended", action="", goal_id="", tried=[], plans=1, replans=0,
        scenario_kind="A", actions=[], outcome=outcome, reason=reason, violations=[], **header,
    )  # fmt: skip


def event(kind: Any, subject: str, **header: Any) -> RecorderEvent:
    return RecorderEvent(source="recorder/a", kind=kind, subject=subject, count=0, **header)


def taken(goal_id: str, source: str = "motion/a", accepted: bool = True) -> RpcRecord:
    request = ExecuteRequest(
        trial=TRIAL, goal_id=goal_id, name="pull", arm="psm1", block="b(1,1)", target_m=None
    )
    reply = ExecuteReply(accepted=accepted, reason="" if accepted else "restart")
    return RpcRecord(
        source=source,
        key="motion/execute",
        request=msgspec.Raw(encode(request)),
        reply=msgspec.Raw(encode(reply)),
        fault=None,
        duration_s=0.0,
    )


@dataclass
class Story:
    """Keys and messages in the order of a log; numbers are given per key and publisher."""

    said: list[tuple[str, Header]] = field(default_factory=list[tuple[str, Header]])

    def add(self, key: str, message: Header) -> "Story":
        self.said.append((key, message))
        return self

    def tick(self, number: int, force_n: float = 0.1, **changes: Any) -> "Story":
        fields: dict[str, Any] = {
            "action": acting(),
            "trial": TRIAL,
            "source": "motion/a",
            **changes,
        }
        holds = fields.pop("holds", {})
        arms = robot(number, tip_m=(0.05, 0.03, 0.06 + 1e-3 * number), **fields)
        arms = msgspec.structs.replace(arms, holds=holds, stamp_ns=number * TICK_NS)
        self.add("robot/state", arms)
        self.add("sim/tissue_state", tissue(number, force_n, trial=TRIAL, source="sim/a"))
        return self.add("sa/verdict", verdict(number, TRIAL, source="sa/a", max_force_n=force_n))

    def without(self, kind: type[Header], number: int) -> "Story":
        """Leave out one message of a type, that of a number among them; the others keep theirs."""
        numbered = self.numbered()
        places = [i for i, (_, one) in enumerate(numbered) if isinstance(one, kind)]
        numbered.pop(places[number])
        self.said = numbered
        return self

    def numbered(self) -> list[tuple[str, Header]]:
        """Give each message its number, where it has none."""
        count: dict[tuple[str, str], int] = {}
        numbered: list[tuple[str, Header]] = []
        for key, message in self.said:
            seq = count.setdefault((key, message.source), 0)
            count[key, message.source] += 1
            already = message.seq or seq
            numbered.append((key, msgspec.structs.replace(message, seq=already)))
        return numbered

    @property
    def evidence(self) -> Evidence:
        samples = ((key, encode(one), i) for i, (key, one) in enumerate(self.numbered()))
        return gather(TRIAL, samples)


def alive(services: Sequence[str]) -> list[tuple[str, Header]]:
    return [("recorder/event", event("present", f"alive/{one}")) for one in services]


def story() -> Story:
    """Nothing happens: a goal is taken, ten ticks of a pull, success."""
    told = Story(alive(["motion/a", "sa/a", "sim/a"]))
    told.add("rpc/motion/execute", taken("g1"))
    for number in range(10):
        told.tick(number)
    return told.add("planner/task_status", status("success", source="planner/a"))
