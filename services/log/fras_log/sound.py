"""What a message must hold beside its type, for whoever draws or counts by it."""

from fras_common.codec import MalformedMessage
from fras_common.messages import TissueModel, TissueState
from fras_common.topics import TISSUE_MODEL, TISSUE_STATE


def require_surface(model: TissueModel) -> None:
    """Refuse a surface of nodes that there are not.

    Raises
    ------
    MalformedMessage
    """
    surface, n_nodes = model.surface.ints(), len(model.nodes_m.view())
    if surface.size and not 0 <= surface.min() <= surface.max() < n_nodes:
        problem = f"names a node outside 0..{n_nodes - 1}"
        raise MalformedMessage(TISSUE_MODEL.key, "$.surface", problem)


def require_forces(state: TissueState) -> None:
    """Refuse forces that are not one a node.

    Raises
    ------
    MalformedMessage
    """
    if state.nodal_force_n.shape != state.nodes_m.shape:
        problem = f"{state.nodal_force_n.shape[0]} for {state.nodes_m.shape[0]} nodes"
        raise MalformedMessage(TISSUE_STATE.key, "$.nodal_force_n", problem)
