"""The course of one action: along its strokes, or to a stop, back, and to rest."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Literal

from fras_common.errors import FrasError
from fras_motion.drivers import Setpoint
from fras_motion.safety import Reaction, force_relieved, required_reaction
from fras_motion.trajectory import brake, retreat

from .parameters import MotionParameters
from .states import ActionResult, Goal, Verdict
from .strokes import Stroke

__all__ = ["Course", "Ending", "Progress"]

_AT_FLOOR_M = 1e-9


@dataclass(frozen=True)
class Ending:
    """How an action ends.

    Parameters
    ----------
    outcome, reason, text, values
        See `ActionResult`.
    """

    outcome: str
    reason: str
    text: str = ""
    values: Mapping[str, object] = field(default_factory=dict[str, object])

    def result(self, goal: Goal, tick: int) -> ActionResult:
        """Make the result of the action that ended so.

        Parameters
        ----------
        goal : Goal
            What the action was.
        tick : int
            Its last tick.

        Returns
        -------
        ActionResult
            What to tell.
        """
        return ActionResult(
            goal.goal_id, self.outcome, self.reason, tick, self.text, dict(self.values)
        )


@dataclass(frozen=True)
class Progress:
    """One tick of an action.

    Parameters
    ----------
    setpoint : Setpoint
        What to send to its arm.
    phase : str
        What it does in this tick.
    ending : Ending or None
        How it ended, if this was its last tick.
    refused_by : str
        The gate that refused the setpoint which should have been sent instead; "" if none.
    """

    setpoint: Setpoint
    phase: str
    ending: Ending | None
    refused_by: str = ""

    @classmethod
    def refused(cls, before: Setpoint, name: str, fault: FrasError) -> Progress:
        """Stand where the arm stands, and say by name and numbers why."""
        ending = Ending("aborted", f"gate:{name}", str(fault), fault.values)
        return cls(before, "interrupted", ending, name)


class Course:
    """State machine of one action, driven tick by tick.

    Parameters
    ----------
    goal : Goal
        What the action is.
    strokes : tuple of Stroke
        What it consists of; may be empty.
    parameters : MotionParameters
        The numbers of motion.

    Notes
    -----
    ``run -> settle -> end`` is the way of success. `halt` leads from there to
    ``stop [-> retreat] -> end``. The cause that came first names the end; only a graver one
    overrides it: a crossed hard limit, and an invalid verdict. A retreat goes back along the stroke
    it was called in.
    """

    def __init__(
        self, goal: Goal, strokes: tuple[Stroke, ...], parameters: MotionParameters
    ) -> None:
        self.goal = goal
        self._strokes = strokes
        self._parameters = parameters
        self._mode: Literal["run", "settle", "stop", "retreat"] = "run" if strokes else "settle"
        self._index: int = 0
        self._sample: int = 0
        self._s = 0.0
        self._velocity = 0.0
        self._floor = 0.0
        self._settled = 0
        self._ending: Ending | None = None
        self._retreats = False

    @property
    def stopped(self) -> bool:
        """Whether the action was halted and its setpoint is at rest."""
        return self._mode == "stop" and self._velocity == 0.0

    def hold(self) -> None:
        """Stop, for a holder; a retreat stops too, and is not taken up again."""
        self._halt(Ending("interrupted", "hold"))

    def react(self, verdict: Verdict) -> str:
        """Stop, if the verdict asks for it.

        Parameters
        ----------
        verdict : Verdict
            On the present tick.

        Returns
        -------
        str
            The safeguard that changed how the action will end; "" if none did.
        """
        expected = self._ending
        self._heed(verdict)
        if self._ending is expected:
            return ""
        known = verdict.level in ("soft", "hard")
        return f"force_{verdict.level}" if known else "verdict_invalid"

    def _heed(self, verdict: Verdict) -> None:
        reaction = required_reaction(verdict.level, self.goal.name)
        if reaction is Reaction.ABORT:
            aborted = Ending("aborted", f"hold:{verdict.reason or 'solver'}")
            if self._mode in ("run", "settle"):
                self._halt(aborted)
            if self._ending != aborted:
                self._ending = aborted
        elif reaction is Reaction.RETREAT and self._mode in ("run", "settle"):
            self._halt(Ending("interrupted", f"force_{verdict.level}"))
            self._retreats = bool(self._strokes) and self._strokes[self._index].can_retreat
        elif verdict.level == "hard" and self.goal.name != "release":
            self._outrank(Ending("interrupted", "force_hard"))

    def _outrank(self, graver: Ending) -> None:
        """Let a graver cause name the end that a stop under way will have."""
        ending = self._ending
        if ending is not None and ending.outcome == "interrupted" and ending != graver:
            self._ending = graver

    def step(self, verdict: Verdict, before: Setpoint, held: bool) -> Progress:
        """Do the next tick.

        Parameters
        ----------
        verdict : Verdict
            On the present tick.
        before : Setpoint
            The last setpoint of the action's arm.
        held : bool
            Whether somebody holds the arms.

        Returns
        -------
        Progress
            The next setpoint, and the end if this is the last tick.

        Raises
        ------
        Unreachable
            The path left the arm's reach (it was checked, so this is a fault).
        """
        if self._mode == "run":
            return self._run(verdict, before)
        if self._mode == "settle":
            return self._settle(verdict, before)
        if self._mode == "stop":
            return self._stop(verdict, before, held)
        return self._retreat(verdict, before)

    def _halt(self, ending: Ending) -> None:
        self._mode = "stop"
        self._retreats = False
        if self._ending is None:
            self._ending = ending

    def _run(self, verdict: Verdict, before: Setpoint) -> Progress:
        stroke = self._strokes[self._index]
        if self._sample == len(stroke.profile.positions):
            if self._index + 1 == len(self._strokes):
                self._mode = "settle"
                return self._settle(verdict, before)
            self._index, self._sample = self._index + 1, 0
            stroke = self._strokes[self._index]
        self._s = stroke.profile.positions[self._sample]
        self._velocity = stroke.profile.velocities[self._sample]
        self._sample += 1
        return Progress(stroke.setpoint(self._s, before), stroke.phase, None)

    def _settle(self, verdict: Verdict, before: Setpoint) -> Progress:
        parameters = self._parameters
        self._settled += 1
        settled = self._settled >= parameters.settle_ticks
        if self.goal.name == "release":
            calm = verdict.max_node_speed_m_s < parameters.release_settle_speed_m_s
            settled = (settled and calm) or self._settled >= parameters.release_settle_max_ticks
        if not settled:
            return Progress(before, "settle", None)
        if self.goal.name == "grasp" and verdict.grasped.get(self.goal.arm, 0) == 0:
            return Progress(before, "interrupted", Ending("failed", "nothing_in_reach"))
        return Progress(before, "done", Ending("succeeded", ""))

    def _stop(self, verdict: Verdict, before: Setpoint, held: bool) -> Progress:
        if self._velocity == 0.0:
            if self._retreats and not self._relieved(verdict) and self._s > _AT_FLOOR_M:
                self._mode = "retreat"
                self._floor = max(0.0, self._s - self._parameters.retreat_max_m)
                return self._retreat(verdict, before)
            return Progress(before, "interrupted", self._ending)
        setpoint = self._brake(before)
        if self._velocity != 0.0 or self._retreats:
            return Progress(setpoint, "stop", None)
        if held:
            return Progress(setpoint, "held", None)
        return Progress(setpoint, "interrupted", self._ending)

    def _retreat(self, verdict: Verdict, before: Setpoint) -> Progress:
        stroke, parameters = self._strokes[self._index], self._parameters
        if self._relieved(verdict):
            setpoint = self._brake(before)
        else:
            self._s, self._velocity = retreat(
                self._s,
                self._velocity,
                self._floor,
                parameters.holding_speed_m_s,
                stroke.stop_deceleration,
                parameters.dt_s,
            )
            setpoint = stroke.setpoint(self._s, before)
        if self._velocity != 0.0:
            return Progress(setpoint, "retreat", None)
        return Progress(setpoint, "interrupted", self._ending)

    def _brake(self, before: Setpoint) -> Setpoint:
        stroke = self._strokes[self._index]
        self._s, self._velocity = brake(
            self._s, self._velocity, stroke.stop_deceleration, self._parameters.dt_s
        )
        # The last piece of a stop may pass the start of its path by a rounding.
        self._s = max(0.0, self._s)
        return stroke.setpoint(self._s, before)

    def _relieved(self, verdict: Verdict) -> bool:
        return force_relieved(
            verdict.max_force_n, verdict.limit_n, self._parameters.retreat_force_ratio
        )
