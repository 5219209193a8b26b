"""Every message that crosses a process boundary, one module per producer.

All are frozen `msgspec.Struct` types, encoded as MessagePack maps: field names travel, units stand
in the names (`_m`, `_n`, `_pa`, `_s`, `_rad`). A published message starts with the five fields of
`Header`; a request or reply of a query has none.
"""

from fras_common.messages.base import Array, Header, Pose, Quaternion, Vec3
from fras_common.messages.crtk import (
    JawState,
    JointState,
    OperatingState,
    ServoJaw,
    ServoJoints,
    StateCommand,
    TipCommand,
    TipState,
)
from fras_common.messages.motion import (
    ActionResult,
    CancelReply,
    CancelRequest,
    ExecuteReply,
    ExecuteRequest,
    HoldRequest,
    Holds,
    HoldState,
    ResumeRequest,
)
from fras_common.messages.planner import (
    HistoryStep,
    NoPlan,
    Plan,
    PlannedAction,
    TaskReply,
    TaskRequest,
    TaskStatus,
    WhyNotReply,
    WhyNotRequest,
)
from fras_common.messages.recorder import (
    CloseReply,
    CloseRequest,
    LastReply,
    LastRequest,
    OpenRequest,
    RecorderStatus,
)
from fras_common.messages.robot import ActionState, ArmState, RobotState
from fras_common.messages.sa import (
    Context,
    ContextRequest,
    Monitored,
    TargetReply,
    TargetRequest,
    Verdict,
)
from fras_common.messages.service import (
    Fault,
    FaultRecord,
    Health,
    LogRecord,
    ResetReply,
    ResetRequest,
    RpcRecord,
)
from fras_common.messages.sim import (
    HeldNodes,
    SimCheckpoint,
    SolverReport,
    TissueModel,
    TissueState,
)

__all__ = [
    "ActionResult",
    "ActionState",
    "ArmState",
    "Array",
    "CancelReply",
    "CancelRequest",
    "CloseReply",
    "CloseRequest",
    "Context",
    "ContextRequest",
    "ExecuteReply",
    "ExecuteRequest",
    "Fault",
    "FaultRecord",
    "Header",
    "Health",
    "HeldNodes",
    "HistoryStep",
    "HoldRequest",
    "HoldState",
    "Holds",
    "JawState",
    "JointState",
    "LastReply",
    "LastRequest",
    "LogRecord",
    "Monitored",
    "NoPlan",
    "OpenRequest",
    "OperatingState",
    "Plan",
    "PlannedAction",
    "Pose",
    "Quaternion",
    "RecorderStatus",
    "ResetReply",
    "ResetRequest",
    "ResumeRequest",
    "RobotState",
    "RpcRecord",
    "ServoJaw",
    "ServoJoints",
    "SimCheckpoint",
    "SolverReport",
    "StateCommand",
    "TargetReply",
    "TargetRequest",
    "TaskReply",
    "TaskRequest",
    "TaskStatus",
    "TipCommand",
    "TipState",
    "TissueModel",
    "TissueState",
    "Vec3",
    "Verdict",
    "WhyNotReply",
    "WhyNotRequest",
]
