"""What a log tells about its trial, as plain values: enough for every figure and number."""

from collections.abc import Mapping
from dataclasses import dataclass

from fras_common.messages import (
    ActionResult,
    Context,
    Plan,
    Pose,
    TaskStatus,
    TissueModel,
    TissueState,
    Verdict,
)
from fras_common.scenario import Scenario


@dataclass(frozen=True)
class RobotTick:
    """The robot at one tick, without joints.

    Parameters
    ----------
    tick, stamp_ns : int
        Logical time, and motion's clock when it first published this tick.
    tips_in_world : mapping of arm to Pose
    goal_id, action, arm, phase : str
        The action under way, or the one that this tick ended; empty before the first.
    held : bool
        Whether anyone held the arms.
    """

    tick: int
    stamp_ns: int
    tips_in_world: Mapping[str, Pose]
    goal_id: str
    action: str
    arm: str
    phase: str
    held: bool


@dataclass(frozen=True)
class TissueTick:
    """The tissue at one tick, without its nodes.

    Parameters
    ----------
    tick : int
    max_force_n : float
        Largest nodal force [N].
    iterations : int
    wall_s : float
        What the time step took to solve [s].
    converged : bool
    """

    tick: int
    max_force_n: float
    iterations: int
    wall_s: float
    converged: bool


@dataclass(frozen=True)
class PatientTick:
    """What the patient bore in truth at one tick.

    Parameters
    ----------
    tick : int
    max_force_n : float
        Largest nodal force [N].
    tool_force_n : float
        Largest force of an instrument on it [N].
    """

    tick: int
    max_force_n: float
    tool_force_n: float


@dataclass(frozen=True)
class TissueViews:
    """Whole states of the tissue that are worth a picture."""

    first: TissueState
    highest: TissueState
    last: TissueState


@dataclass(frozen=True)
class ServiceFacts:
    """Who took part: the last instance of a service that spoke, and what it said of itself."""

    source: str
    facts: Mapping[str, str]


@dataclass(frozen=True)
class Trial:
    """One trial as its log holds it. Lists are in the order of ticks or of publication.

    Parameters
    ----------
    path : str
        Of the log.
    complete : bool
        Whether the file was read to its footer.
    damage : str
        Why not.
    metadata : mapping
        The recorder's own: trial, versions, host, scenario.
    scenario : Scenario
    model : TissueModel or None
    robot, tissue, verdicts : tuple
        One entry a tick.
    views : TissueViews or None
    contexts, plans, statuses, results : tuple
    started_ns : int
        When `fras` was asked for this trial; 0 if the log does not say.
    first_ns, last_ns : int
        Earliest and latest producer's stamp within the trial; 0 if it holds none.
    messages, lost, malformed : int
        Over the whole file: messages, gaps in their numbering, messages that could not be decoded.
    services : mapping of service to ServiceFacts
    warnings : tuple of str
        What the services logged from WARNING up.
    patient : tuple of PatientTick
        One entry a tick; empty where the trial has no patient besides its model.
    """

    path: str
    complete: bool
    damage: str
    metadata: Mapping[str, str]
    scenario: Scenario
    model: TissueModel | None
    robot: tuple[RobotTick, ...]
    tissue: tuple[TissueTick, ...]
    verdicts: tuple[Verdict, ...]
    views: TissueViews | None
    contexts: tuple[Context, ...]
    plans: tuple[Plan, ...]
    statuses: tuple[TaskStatus, ...]
    results: tuple[ActionResult, ...]
    started_ns: int
    first_ns: int
    last_ns: int
    messages: int
    lost: int
    malformed: int
    services: Mapping[str, ServiceFacts]
    warnings: tuple[str, ...]
    patient: tuple[PatientTick, ...] = ()

    @property
    def dt_s(self) -> float:
        """Simulated seconds a tick."""
        return self.scenario.tissue.dt_s

    @property
    def ending(self) -> TaskStatus | None:
        """The status that names the outcome, or None where the log ends before."""
        return next((status for status in reversed(self.statuses) if status.outcome), None)

    @property
    def borne(self) -> tuple[tuple[int, float], ...]:
        """Tick and force of the patient [N], by the scenario's metric."""
        is_tool = self.scenario.awareness.force_metric == "tool"
        return tuple(
            (one.tick, one.tool_force_n if is_tool else one.max_force_n) for one in self.patient
        )

    def robot_at(self, tick: int) -> RobotTick | None:
        """Return the robot at `tick`, or None where its state was not recorded."""
        return next((state for state in self.robot if state.tick == tick), None)
