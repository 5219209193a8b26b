"""A genuine payload of every key of the table: what trials say and ask, and the rest by hand."""

from typing import Any, Final

import msgspec
from benchmarks.fuzz_stack import Heard

from fras_common.codec import encode
from fras_common.messages import (
    ApproveRequest,
    CloseRequest,
    FaultRecord,
    Health,
    HoldRequest,
    Holds,
    LastRequest,
    LogRecord,
    Pose,
    Presence,
    ProcessReport,
    RejectRequest,
    ReplayControl,
    ReplayStatusRequest,
    RestartRequest,
    ResumeRequest,
    ServoJaw,
    ServoJoints,
    SinceRequest,
    StateCommand,
    SupervisorStatus,
    TipCommand,
    WhyNotRequest,
)
from fras_common.topics import CRTK

TRIAL: Final = "t"
_POSE: Final = Pose(position_m=(0.03, 0.03, 0.03), quaternion_xyzw=(0.0, 1.0, 0.0, 0.0))
_PROCESS: Final = ProcessReport(
    name="sim",
    state="ready",
    pid=7,
    restarts=0,
    last_exit="",
    starts_in_s=0.0,
    up_s=1.0,
    cpu_percent=1.0,
    rss_bytes=1,
    log_lost_bytes=0,
)

UNSAID: Final[dict[str, Any]] = {
    "health/sim": Health(
        trial=TRIAL,
        service="sim",
        state="ready",
        rss_bytes=1,
        cpu_percent=1.0,
        received=1,
        published=1,
        malformed=0,
        refused=0,
        wrong_trial=0,
        queue_depth=0,
        queue_dropped=0,
        gaps=0,
        facts={"a": "b"},
        refusals={"c": 1},
    ),
    "log/sim": LogRecord(level="warning", event="e", fields={"a": "b"}),
    "fault/sim": FaultRecord(key="k", kind="FrasError", text="t", values={"a": "b"}),
    "monitor/presence": Presence(viewers=1),
    "motion/holds": Holds(holds={"h": "r"}),
    "supervisor/status": SupervisorStatus(
        verdict="whole", reason="", held=False, log_dir="d", processes=[_PROCESS]
    ),
    **{
        topic.key: message
        for arm in CRTK
        for topic, message in (
            (arm.state_command, StateCommand(command="pause")),
            (arm.servo_jp, ServoJoints(joints=(0.1, 0.1, 0.1, 0.0, 0.0, 0.0))),
            (arm.servo_cp, TipCommand(tip_in_world=_POSE)),
            (arm.move_cp, TipCommand(tip_in_world=_POSE)),
            (arm.jaw_servo_jp, ServoJaw(jaw_rad=0.5)),
        )
    },
}
"""What no trial says."""

UNASKED: Final[dict[str, Any]] = {
    "planner/approve": ApproveRequest(trial=TRIAL, plan="p", by="cli"),
    "planner/reject": RejectRequest(trial=TRIAL, plan="p", by="cli", reason="r"),
    "planner/why_not": WhyNotRequest(question="b(1,1)"),
    "motion/hold": HoldRequest(holder="h", reason="r"),
    "motion/resume": ResumeRequest(holder="h", by="cli"),
    "recorder/close": CloseRequest(trial=TRIAL, last_tick=1, status_seq=1),
    "recorder/last": LastRequest(key="sim/tissue_state"),
    "recorder/since": SinceRequest(key="robot/state", tick=0),
    "replay/control": ReplayControl(command="play"),
    "replay/status": ReplayStatusRequest(),
    "supervisor/restart": RestartRequest(name="sim", by="cli"),
}
"""What no trial asks."""


def genuine_payloads(heard: Heard) -> dict[str, list[bytes]]:
    """Sort what a trial said by key; requests of queries under `?` and their key."""
    found = {key: said[:: max(1, len(said) // 20)] for key, said in heard.items()}
    for key, said in heard.items():
        for one in said if key.startswith("rpc/") else ():
            record = msgspec.msgpack.decode(one)
            request = msgspec.msgpack.encode(record["request"])
            found.setdefault(f"?{record['key']}", []).append(request)
    for key, message in UNSAID.items():
        found.setdefault(key, []).append(encode(message))
    for key, request in UNASKED.items():
        found.setdefault(f"?{key}", []).append(encode(request))
    return found
