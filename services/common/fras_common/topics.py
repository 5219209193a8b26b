"""THE table: every key, its type, who produces it, how it travels.

Publishers, subscribers, recorder, documentation and contract tests are all generated from it.
A key may hold one placeholder, `{name}`, for a family of keys (`health/{service}`).
"""

from dataclasses import dataclass
from typing import Any, Final, TypeVar

from fras_common import messages as m
from fras_common.rows import BULK, FEW, SMALL, SOME, WORDY, Qos, Query, Topic

M = TypeVar("M", bound=m.Header)

ANYONE: tuple[str, ...] = ("*",)
PEOPLE: tuple[str, ...] = ("cli", "monitor")
"""Where a person stands behind the question."""
EXECUTIVE: tuple[str, ...] = ("planner",)


@dataclass(frozen=True)
class TissueTopics:
    """A simulator's keys: what it says of its tissue, and the question that puts it to rest.

    Attributes
    ----------
    service : str
        Who speaks there; first chunk of each key.
    """

    service: str
    model: Topic[m.TissueModel]
    state: Topic[m.TissueState]
    checkpoint: Topic[m.SimCheckpoint]
    reset: Query[m.ResetRequest, m.ResetReply]

    @classmethod
    def of(cls, service: str) -> "TissueTopics":
        """Make the rows of a simulator."""
        model = Topic(
            f"{service}/tissue_model", m.TissueModel, service, Qos.EVENT, "each reset",
            max_bytes=BULK, kept=FEW, awaited=True,
        )  # fmt: skip
        state = Topic(
            f"{service}/tissue_state", m.TissueState, service, Qos.STATE, "each tick",
            max_bytes=BULK, awaited=True,
        )  # fmt: skip
        checkpoint = Topic(
            f"{service}/checkpoint", m.SimCheckpoint, service, Qos.STATE, "every 10 ticks",
            max_bytes=BULK, kept=SOME,
        )  # fmt: skip
        reset = Query(
            f"{service}/reset", m.ResetRequest, m.ResetReply, service, EXECUTIVE,
            max_bytes=BULK, kept=FEW,
        )  # fmt: skip
        return cls(service, model, state, checkpoint, reset)


TWIN: Final = TissueTopics.of("sim")
"""The model of the tissue: what is believed of it."""
PATIENT: Final = TissueTopics.of("patient")
"""The tissue itself, where a trial has one besides its model: what is seen of it."""

TISSUE_MODEL, TISSUE_STATE, SIM_CHECKPOINT = TWIN.model, TWIN.state, TWIN.checkpoint
ROBOT_STATE = Topic("robot/state", m.RobotState, "motion", Qos.STATE, "each tick", awaited=True)
VERDICT = Topic("sa/verdict", m.Verdict, "sa", Qos.STATE, "each tick", awaited=True)
CONTEXT = Topic("sa/context", m.Context, "sa", Qos.EVENT, "on request", max_bytes=WORDY, kept=SOME)
PLAN = Topic("planner/plan", m.Plan, "planner", Qos.EVENT, "each plan", max_bytes=WORDY, kept=SOME)
TASK_STATUS = Topic(
    "planner/task_status", m.TaskStatus, "planner", Qos.EVENT, "each change", in_trial=False,
    awaited=True,
)  # fmt: skip
ACTION_RESULT = Topic(
    "motion/action_result", m.ActionResult, "motion", Qos.EVENT, "end of each action", awaited=True
)
HOLDS = Topic("motion/holds", m.Holds, "motion", Qos.EVENT, "each change", in_trial=False)
RECORDER_STATUS = Topic(
    "recorder/status", m.RecorderStatus, "recorder", Qos.EVENT, "each change", in_trial=False,
    awaited=True,
)  # fmt: skip
RECORDER_EVENT = Topic(
    "recorder/event", m.RecorderEvent, "recorder", Qos.STATE, "each", in_trial=False
)
SUPERVISOR_STATUS = Topic(
    "supervisor/status",
    m.SupervisorStatus,
    "supervisor",
    Qos.TELEMETRY,
    "each change, 1 Hz",
    in_trial=False,
)
PRESENCE = Topic(
    "monitor/presence", m.Presence, "monitor", Qos.TELEMETRY, "each change, 4 Hz", in_trial=False
)
HEALTH = Topic("health/{service}", m.Health, "*", Qos.TELEMETRY, "2 Hz", in_trial=False)
LOG = Topic("log/{service}", m.LogRecord, "*", Qos.STATE, "from WARNING up", in_trial=False)
FAULT = Topic(
    "fault/{service}", m.FaultRecord, "*", Qos.STATE, "each refused message", in_trial=False
)
RPC = Topic(
    "rpc/{service}/{name}",
    m.RpcRecord,
    "*",
    Qos.STATE,
    "each query",
    in_trial=False,
    max_bytes=BULK,
)

ARMS: tuple[str, ...] = ("psm1", "psm2")


@dataclass(frozen=True)
class ArmTopics:
    """An arm's keys by CRTK: what it says, and what it can be told.

    Attributes
    ----------
    arm : str
        First chunk of each key.
    """

    arm: str

    @property
    def measured_js(self) -> Topic[m.JointState]:
        """Joints as measured."""
        return self._said("measured_js", m.JointState)

    @property
    def setpoint_js(self) -> Topic[m.JointState]:
        """Joints as last sent to the servos."""
        return self._said("setpoint_js", m.JointState)

    @property
    def measured_cp(self) -> Topic[m.TipState]:
        """Tip by the measured joints."""
        return self._said("measured_cp", m.TipState)

    @property
    def setpoint_cp(self) -> Topic[m.TipState]:
        """Tip by the setpoint."""
        return self._said("setpoint_cp", m.TipState)

    @property
    def jaw_measured_js(self) -> Topic[m.JawState]:
        """Jaw as measured."""
        return self._said("jaw/measured_js", m.JawState)

    @property
    def jaw_setpoint_js(self) -> Topic[m.JawState]:
        """Jaw as last sent to its servo."""
        return self._said("jaw/setpoint_js", m.JawState)

    @property
    def operating_state(self) -> Topic[m.OperatingState]:
        """State of the state machine."""
        return Topic(
            f"{self.arm}/operating_state",
            m.OperatingState,
            "arms",
            Qos.EVENT,
            "each change, 2 Hz",
            in_trial=False,
            awaited=True,
        )

    @property
    def state_command(self) -> Topic[m.StateCommand]:
        """Ask the state machine for a transition."""
        return self._told("state_command", m.StateCommand)

    @property
    def servo_jp(self) -> Topic[m.ServoJoints]:
        """Joints at once."""
        return self._told("servo_jp", m.ServoJoints)

    @property
    def servo_cp(self) -> Topic[m.TipCommand]:
        """Tip at once."""
        return self._told("servo_cp", m.TipCommand)

    @property
    def move_cp(self) -> Topic[m.TipCommand]:
        """Tip along a straight line."""
        return self._told("move_cp", m.TipCommand)

    @property
    def jaw_servo_jp(self) -> Topic[m.ServoJaw]:
        """Jaw at once."""
        return self._told("jaw/servo_jp", m.ServoJaw)

    @property
    def all(self) -> tuple[Topic[Any], ...]:
        """Every key of the arm."""
        return (
            self.measured_js,
            self.measured_cp,
            self.setpoint_js,
            self.setpoint_cp,
            self.jaw_measured_js,
            self.jaw_setpoint_js,
            self.operating_state,
            self.state_command,
            self.servo_jp,
            self.servo_cp,
            self.move_cp,
            self.jaw_servo_jp,
        )

    def _said(self, name: str, kind: type[M]) -> Topic[M]:
        key = f"{self.arm}/{name}"
        return Topic(key, kind, "arms", Qos.STATE, "up to 100 Hz in motion, 2 Hz", in_trial=False)

    def _told(self, name: str, kind: type[M]) -> Topic[M]:
        key = f"{self.arm}/{name}"
        return Topic(
            key, kind, "client", Qos.COMMAND, "on request", in_trial=False, max_bytes=SMALL
        )


CRTK: tuple[ArmTopics, ...] = tuple(ArmTopics(arm) for arm in ARMS)

TOPICS: tuple[Topic[Any], ...] = (
    TISSUE_MODEL,
    TISSUE_STATE,
    SIM_CHECKPOINT,
    PATIENT.model,
    PATIENT.state,
    PATIENT.checkpoint,
    ROBOT_STATE,
    VERDICT,
    CONTEXT,
    PLAN,
    TASK_STATUS,
    ACTION_RESULT,
    HOLDS,
    RECORDER_STATUS,
    RECORDER_EVENT,
    SUPERVISOR_STATUS,
    PRESENCE,
    HEALTH,
    LOG,
    FAULT,
    RPC,
    *(topic for arm in CRTK for topic in arm.all),
)

# A stop from anybody is safe; what lifts one or begins a motion is not.
TASK = Query(
    "planner/task",
    m.TaskRequest,
    m.TaskReply,
    "planner",
    (*PEOPLE, "supervisor"),
    max_bytes=BULK,
    kept=FEW,
)
WHY_NOT = Query("planner/why_not", m.WhyNotRequest, m.WhyNotReply, "planner", ANYONE)
APPROVE = Query("planner/approve", m.ApproveRequest, m.DecisionReply, "planner", PEOPLE)
REJECT = Query("planner/reject", m.RejectRequest, m.DecisionReply, "planner", PEOPLE)
EXECUTE = Query("motion/execute", m.ExecuteRequest, m.ExecuteReply, "motion", EXECUTIVE)
CANCEL = Query("motion/cancel", m.CancelRequest, m.CancelReply, "motion", (*PEOPLE, *EXECUTIVE))
HOLD = Query("motion/hold", m.HoldRequest, m.HoldState, "motion", ANYONE)
RESUME = Query("motion/resume", m.ResumeRequest, m.HoldState, "motion", (*PEOPLE, *EXECUTIVE))
MOTION_RESET = Query(
    "motion/reset", m.ResetRequest, m.ResetReply, "motion", EXECUTIVE, max_bytes=BULK, kept=FEW
)
SIM_RESET = TWIN.reset
SA_RESET = Query(
    "sa/reset", m.ResetRequest, m.ResetReply, "sa", EXECUTIVE, max_bytes=BULK, kept=FEW
)
SA_CONTEXT = Query("sa/context", m.ContextRequest, m.Context, "sa", EXECUTIVE, kept=SOME)
SA_TARGET = Query("sa/target", m.TargetRequest, m.TargetReply, "sa", EXECUTIVE)
RECORDER_OPEN = Query(
    "recorder/open", m.OpenRequest, m.ResetReply, "recorder", EXECUTIVE, max_bytes=BULK, kept=FEW
)
RECORDER_CLOSE = Query("recorder/close", m.CloseRequest, m.CloseReply, "recorder", EXECUTIVE)
RECORDER_LAST = Query("recorder/last", m.LastRequest, m.LastReply, "recorder", ANYONE, kept=FEW)
RECORDER_SINCE = Query("recorder/since", m.SinceRequest, m.SinceReply, "recorder", ANYONE, kept=FEW)
REPLAY_CONTROL = Query("replay/control", m.ReplayControl, m.ReplayStatus, "replay", PEOPLE)
REPLAY_STATUS = Query("replay/status", m.ReplayStatusRequest, m.ReplayStatus, "replay", ANYONE)
SUPERVISOR_RESTART = Query(
    "supervisor/restart", m.RestartRequest, m.RestartReply, "supervisor", PEOPLE
)

QUERIES: tuple[Query[Any, Any], ...] = (
    TASK,
    WHY_NOT,
    APPROVE,
    REJECT,
    EXECUTE,
    CANCEL,
    HOLD,
    RESUME,
    MOTION_RESET,
    SIM_RESET,
    PATIENT.reset,
    SA_RESET,
    SA_CONTEXT,
    SA_TARGET,
    RECORDER_OPEN,
    RECORDER_CLOSE,
    RECORDER_LAST,
    RECORDER_SINCE,
    REPLAY_CONTROL,
    REPLAY_STATUS,
    SUPERVISOR_RESTART,
)

SERVICES: tuple[str, ...] = ("sim", "sa", "planner", "motion", "recorder")
GUESTS: tuple[str, ...] = ("patient", "arms")
"""Who is part of some stacks only."""
TOOLS: tuple[str, ...] = ("replay", "supervisor", "monitor")
"""Who publishes and serves queries, too, but is no part of a stack: none waits for them."""


def topic_of(key: str) -> Topic[Any] | None:
    """Find the table's row for a concrete key, or None for a key that is not in the table."""
    if (topic := _CONCRETE.get(key)) is not None:
        return topic
    return next((family for head, family in _FAMILIES if key.startswith(head)), None)


def may_be_lost(key: str) -> bool:
    """Whether a message that never arrives is not missed: on this key the next replaces it."""
    topic = topic_of(key)
    return topic is not None and topic.qos is Qos.TELEMETRY


_CONCRETE = {topic.key: topic for topic in TOPICS if "{" not in topic.key}
_FAMILIES = tuple((topic.key.partition("{")[0], topic) for topic in TOPICS if "{" in topic.key)
