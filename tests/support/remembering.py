"""A client that remembers what was said and tells it, as the recorder does."""

from collections.abc import Callable
from typing import Any

import msgspec

from fras_common.bus import Call, MemoryBus, MemoryFabric, RawSample
from fras_common.codec import encode
from fras_common.messages import (
    LastReply,
    LastRequest,
    RpcRecord,
    SinceReply,
    SinceRequest,
    TaskStatus,
)
from fras_common.messages.planner import TaskPhase
from fras_common.topics import RECORDER_LAST, RECORDER_SINCE, RPC, TASK_STATUS, Query
from fras_recorder.memory import Memory


class Remembering:
    """The recorder's memory on a fabric that outlives the services of a test."""

    def __init__(self, fabric: MemoryFabric) -> None:
        self.memory = Memory()
        self.asked: list[str] = []
        self.silent = False
        # By key: what happens once its last message has been told.
        self.then: dict[str, Callable[[], object]] = {}
        self._unanswered: list[Call[LastRequest, LastReply]] = []
        self.bus = MemoryBus(fabric, "cell", "recorder/test")
        self.bus.subscribe_raw("**", self._note)
        self.bus.serve(RECORDER_LAST, self._last)
        self.bus.serve(RECORDER_SINCE, self._since)
        self.bus.announce("alive/recorder")
        self._statuses = self.bus.publisher(TASK_STATUS)
        self._mirrors: dict[str, Any] = {}

    def _note(self, sample: RawSample) -> None:
        self.memory.note(sample.key, sample.payload)

    def _last(self, call: Call[LastRequest, LastReply]) -> None:
        self.asked.append(call.request.key)
        if self.silent:
            self._unanswered.append(call)
            return
        call.reply(LastReply(payload=self.memory.last(call.request.key)))
        if (then := self.then.pop(call.request.key, None)) is not None:
            then()

    def _since(self, call: Call[SinceRequest, SinceReply]) -> None:
        self.asked.append(call.request.key)
        call.reply(self.memory.since(call.request.key, call.request.tick))

    def speak(self) -> None:
        """Answer what was asked while it was silent, and what is asked from now on."""
        self.silent = False
        unanswered, self._unanswered = self._unanswered, []
        for call in unanswered:
            self._last(call)

    def forget_questions(self) -> None:
        """Leave unanswered what was asked by one that is no more, and answer from now on."""
        self.silent = False
        self._unanswered.clear()

    def say_status(self, trial: str, phase: TaskPhase, **fields: Any) -> TaskStatus:
        """Say what the planner would."""
        settings: dict[str, Any] = {
            "action": "",
            "goal_id": "",
            "tried": [],
            "plans": 0,
            "replans": 0,
            "scenario_kind": "A",
            "actions": [],
            "outcome": "",
            "reason": "",
            "violations": [],
            **fields,
        }
        return self._statuses.put(TaskStatus(trial=trial, phase=phase, **settings))

    def say_asked(self, query: Query[Any, Any], request: Any, reply: Any, trial: str) -> None:
        """Mirror a query, as its server would have."""
        _, server, name = query.mirror.split("/", 2)
        if query.mirror not in self._mirrors:
            self._mirrors[query.mirror] = self.bus.publisher(RPC.of(service=server, name=name))
        self._mirrors[query.mirror].put(
            RpcRecord(
                trial=trial,
                key=query.key,
                request=msgspec.Raw(encode(request)),
                reply=msgspec.Raw(encode(reply)),
                fault=None,
                duration_s=0.0,
            )
        )

    def close(self) -> None:
        self.bus.close()
