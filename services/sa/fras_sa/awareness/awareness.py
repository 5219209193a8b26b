"""Situation awareness of one scene: Algorithm 1 as three pure questions.

`judge` answers each tick, `context` and `target` on request. An `Awareness` never changes; what
must be kept from tick to tick is the `Memory` that goes in and comes out.
"""

import math
from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from . import fluents as fl
from .blocks import Blocks, make_blocks
from .errors import MalformedModel, UnusableState
from .failure import (
    binding_limit,
    check_failure,
    measured_force,
    robot_problem,
    staleness,
    tissue_problem,
)
from .memory import Memory, remember
from .monitor import Monitored, Situation, monitor
from .parameters import AwarenessParameters
from .target import compute_target
from .views import Evidence, FloatArray, Level, RobotView, TissueModel, TissueView
from .visibility import make_close_points


@dataclass(frozen=True, slots=True)
class Judgement:
    """The verdict on one tick.

    Parameters
    ----------
    level, reason, force_n
        As in `Failure`.
    ok : bool
        Whether the level is ok.
    limit_n : float [N]
        The soft limit, also where it is not enforced.
    visibility : float
        Fraction of the hiding tissue that is away; NaN if the tissue's positions are unusable.
    visible : bool
        Whether that exceeds delta.
    max_height : tuple of str
        Arms that may not pull on, sorted.
    rate_n_s : float [N/s]
        How fast the force changes; while the state is invalid, how fast it did before.
    crossing_tick : int
        First tick expected above the limit that binds the action; -1 if none is in sight.
    memory : Memory
        For the next tick.
    """

    level: Level
    ok: bool
    reason: str
    force_n: float
    limit_n: float
    visibility: float
    visible: bool
    max_height: tuple[str, ...]
    rate_n_s: float
    crossing_tick: int
    memory: Memory


@dataclass(frozen=True, slots=True, eq=False)
class ContextView:
    """The semantic interpretation of one tick, all that the planner needs.

    Parameters
    ----------
    fluents : tuple of str
        Those that hold.
    evidence : dict of str to dict of str to float
        The numbers behind each fluent, and under `visible_roi` and `force` always.
    names : tuple of str
        The blocks, in row order.
    blocks_m : ndarray, shape (n_blocks, 3), float64 [m]
        Their rest centres.
    roi_m : ndarray, shape (3,), float64 [m]
        The ROI.
    fixed_points_m : ndarray, shape (n_fixed, 3), float64 [m]
        The attachment points.
    monitored : tuple of Monitored
        What became of the expectations asked about.
    """

    fluents: tuple[str, ...]
    evidence: dict[str, Evidence]
    names: tuple[str, ...]
    blocks_m: NDArray[np.float64]
    roi_m: NDArray[np.float64]
    fixed_points_m: NDArray[np.float64]
    monitored: tuple[Monitored, ...]


class Awareness:
    """Situation awareness of one scene.

    Parameters
    ----------
    parameters : AwarenessParameters
        The thresholds.
    model : TissueModel
        The scene at rest.

    Raises
    ------
    MalformedModel
        If the model's arrays do not fit together.
    NoTissueNearRoi
        If nothing hides the ROI.
    NoBlocks
        If the tissue has no candidate grasping point.
    """

    def __init__(self, parameters: AwarenessParameters, model: TissueModel) -> None:
        _check(model)
        self._parameters = parameters
        self._n_nodes = len(model.nodes_m)
        self._model = model
        self._roi_m = np.array(model.roi_m, dtype=np.float64)
        self._fixed_points_m = np.array(model.fixed_points_m, dtype=np.float64)
        # Every context hands these two out again.
        self._roi_m.setflags(write=False)
        self._fixed_points_m.setflags(write=False)
        self._blocks = make_blocks(model, parameters.blocks)
        self._close = make_close_points(
            model, parameters.visible_distance_m, parameters.sample_edge_m
        )
        self._scene = fl.scene_fluents(self._blocks, model)

    @property
    def blocks(self) -> Blocks:
        """The candidate grasping points."""
        return self._blocks

    def judge(self, tissue: TissueView, robot: RobotView, memory: Memory) -> Judgement:
        """Return the verdict on one tick; never raises on a bad state, it is `invalid`.

        Parameters
        ----------
        tissue, robot : TissueView, RobotView
            Both of the tick to judge, which is the one after the memory's.
        memory : Memory
            After the tick before; `Memory()` at the start of a trial.

        Returns
        -------
        Judgement
        """
        parameters = self._parameters
        last = memory.trend
        failure = check_failure(
            parameters, tissue, robot, n_nodes=self._n_nodes, last_tick=last.tick
        )
        valid = failure.level != "invalid"
        visibility = math.nan
        if valid or not tissue_problem(tissue, self._n_nodes):
            visibility = self._close.visible_fraction(tissue.nodes_m)
        visible = visibility > parameters.visible_fraction
        trend = last.after(tissue.tick, failure.force_n if valid else None, self._model.dt_s)
        memory = remember(memory, parameters, robot, failure.level, visible=visible, trend=trend)
        return Judgement(
            level=failure.level,
            ok=failure.level == "ok",
            reason=failure.reason,
            force_n=failure.force_n,
            limit_n=parameters.force_limit_n,
            visibility=visibility,
            visible=visible,
            max_height=tuple(sorted(memory.max_height)),
            rate_n_s=trend.rate_n_s,
            crossing_tick=trend.crossing_tick(binding_limit(parameters, robot), self._model.dt_s),
            memory=memory,
        )

    def context(
        self,
        tissue: TissueView,
        robot: RobotView,
        memory: Memory,
        expected: Iterable[str] = (),
    ) -> ContextView:
        """Return the fluents that hold, with their evidence.

        Parameters
        ----------
        tissue, robot : TissueView, RobotView
            Both of the same tick.
        memory : Memory
            After that tick's judgement.
        expected : iterable of str
            Fluents that the last action should have brought; a leading `-`: ended.

        Returns
        -------
        ContextView

        Raises
        ------
        UnusableState
            If a position, force or angle is not finite, an arm is missing, or the ticks differ:
            a fluent left out would be told false.
        UnknownAtom
            If a fluent, arm or block expected does not exist.
        """
        self._require_usable(tissue, robot)
        parameters = self._parameters
        fraction = self._close.visible_fraction(tissue.nodes_m)
        visibility = fl.visibility_evidence(parameters, fraction)
        force = fl.force_evidence(parameters, measured_force(parameters, tissue))
        holding: fl.Fluents = {}
        if visibility["holds"]:
            holding["visible_roi"] = visibility
        holding |= fl.gripper_fluents(parameters, robot)
        holding |= fl.max_height_fluents(memory.max_height, visibility, force)
        holding |= fl.location_fluents(parameters, self._blocks, tissue.nodes_m, robot)
        holding |= {text: dict(evidence) for text, evidence in self._scene.items()}
        situation = Situation(
            parameters,
            self._blocks,
            self._model,
            tissue,
            robot,
            holding,
            visibility=visibility,
            force=force,
        )
        return ContextView(
            fluents=tuple(holding),
            evidence=holding | {"visible_roi": visibility, "force": force},
            names=self._blocks.names,
            blocks_m=self._blocks.rest_m,
            roi_m=self._roi_m,
            fixed_points_m=self._fixed_points_m,
            monitored=monitor(expected, situation),
        )

    def target(
        self, tissue: TissueView, robot: RobotView, *, action: str, arm: str, block: str
    ) -> NDArray[np.float64] | None:
        """Return where `action` is to bring its arm; see `compute_target`.

        Raises
        ------
        UnknownName
            If the action, arm or block does not exist.
        UnusableState
            As for a context.
        """
        self._require_usable(tissue, robot)
        return compute_target(
            self._blocks, tissue.nodes_m, robot, action=action, arm=arm, block=block
        )

    def _require_usable(self, tissue: TissueView, robot: RobotView) -> None:
        if problem := tissue_problem(tissue, self._n_nodes):
            raise UnusableState(f"tissue state of tick {tissue.tick}", problem)
        if problem := staleness(tissue, robot) or robot_problem(robot):
            raise UnusableState(f"robot state of tick {tissue.tick}", problem)


def _check(model: TissueModel) -> None:
    shapes: tuple[tuple[str, FloatArray, tuple[int, ...]], ...] = (
        ("nodes_m", model.nodes_m, (len(model.nodes_m), 3)),
        ("fixed_points_m", model.fixed_points_m, (len(model.fixed_points_m), 3)),
        ("roi_m", model.roi_m, (3,)),
    )
    for field, array, shape in shapes:
        if array.shape != shape:
            raise MalformedModel(field, f"shape {array.shape}, expected {shape}")
        if not np.isfinite(array).all():
            raise MalformedModel(field, "not finite")
    if not (math.isfinite(model.dt_s) and model.dt_s > 0.0):
        raise MalformedModel("dt_s", f"{model.dt_s}, must be finite and > 0")
    triangles = model.triangles
    if triangles.ndim != 2 or triangles.shape[1] != 3 or len(triangles) == 0:
        raise MalformedModel("triangles", f"shape {triangles.shape}, expected (n, 3), n > 0")
    n_nodes = len(model.nodes_m)
    wrong = np.flatnonzero(((triangles < 0) | (triangles >= n_nodes)).any(axis=1))
    if len(wrong):
        text = f"triangle {wrong[0]} names a node outside 0..{n_nodes - 1}"
        raise MalformedModel("triangles", text)
