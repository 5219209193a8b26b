"""Between messages and the awareness core."""

import math

import msgspec
import numpy as np
from numpy.typing import NDArray

from fras_common import messages as m
from fras_common.scenario import AwarenessSection
from fras_sa.awareness import (
    ActionView,
    ArmView,
    AwarenessParameters,
    ContextView,
    Judgement,
    RobotView,
    TissueModel,
    TissueView,
    believed_where_seen,
)


def parameters_of(section: AwarenessSection) -> AwarenessParameters:
    """Thresholds of the scenario."""
    return AwarenessParameters(**msgspec.structs.asdict(section))


def model_of(model: m.TissueModel) -> TissueModel:
    """Read the scene at rest."""
    return TissueModel(
        nodes_m=model.nodes_m.floats(),
        triangles=model.surface.ints(),
        fixed_points_m=model.fixed_points_m.floats(),
        roi_m=np.array(model.roi_m),
        dt_s=model.dt_s,
    )


def tissue_of(believed: m.TissueState, seen: m.TissueState) -> TissueView:
    """Read the tissue at one tick: what it bears by its model, and where it is seen to be."""
    return believed_where_seen(_view_of(believed), _view_of(seen))


def _view_of(state: m.TissueState) -> TissueView:
    return TissueView(
        tick=state.tick,
        nodes_m=state.nodes_m.floats(),
        max_force_n=state.max_force_n,
        tool_force_n={arm: np.array(force) for arm, force in state.tool_force_n.items()},
        converged=state.solver.converged,
        max_node_speed_m_s=state.max_node_speed_m_s,
    )


def robot_of(state: m.RobotState) -> RobotView:
    """Read the arms at one tick."""
    action = state.action
    return RobotView(
        tick=state.tick,
        arms={
            name: ArmView(np.array(arm.tip_in_world.position_m), arm.jaw_rad)
            for name, arm in state.arms.items()
        },
        action=ActionView(action.name, action.arm, action.block, action.phase) if action else None,
    )


def verdict_of(
    judgement: Judgement, parameters: AwarenessParameters, seen: m.TissueState
) -> m.Verdict:
    """Put a judgement on the wire; what is no number is told as an impossible one."""
    return m.Verdict(
        tick=seen.tick,
        trial=seen.trial,
        level=judgement.level,
        ok=judgement.ok,
        reason=judgement.reason,
        max_force_n=_finite(judgement.force_n),
        limit_n=judgement.limit_n,
        hard_limit_n=parameters.hard_n,
        visibility=_finite(judgement.visibility),
        visible=judgement.visible,
        max_height=list(judgement.max_height),
        force_rate_n_s=judgement.rate_n_s,
        crossing_tick=judgement.crossing_tick,
        max_node_speed_m_s=_finite(seen.max_node_speed_m_s),
        grasped={arm: len(nodes) for arm, nodes in seen.grasped.items()},
    )


def context_of(view: ContextView, state: m.TissueState, request_id: str) -> m.Context:
    """Put a context on the wire."""
    roi = view.roi_m
    return m.Context(
        tick=state.tick,
        trial=state.trial,
        request_id=request_id,
        fluents=list(view.fluents),
        evidence=view.evidence,
        names=list(view.names),
        blocks_m=[(float(x), float(y), float(z)) for x, y, z in view.blocks_m],
        roi_m=(float(roi[0]), float(roi[1]), float(roi[2])),
        fixed_points_m=[(float(x), float(y), float(z)) for x, y, z in view.fixed_points_m],
        monitored=[
            m.Monitored(atom=one.atom, holds=one.holds, evidence=one.evidence)
            for one in view.monitored
        ],
    )


def target_of(position: NDArray[np.float64] | None) -> m.TargetReply:
    """Put a target on the wire, or that there is none."""
    if position is None:
        return m.TargetReply(position_m=None)
    x, y, z = (float(value) for value in position)
    return m.TargetReply(position_m=(x, y, z))


def _finite(value: float) -> float:
    return value if math.isfinite(value) else -1.0
