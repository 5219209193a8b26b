"""What the scene shows, from what is known: places and kinds, no drawing library."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Final, Literal

import numpy as np
from numpy.typing import NDArray

from fras_common.messages import Context, TissueModel, TissueState
from fras_common.scenario import AwarenessSection, MotionSection
from fras_monitor.outline import outline
from fras_monitor.picture import Picture
from fras_monitor.shapes import FloatArray, dashes

BlockKind = Literal["free", "fixed", "chosen", "held", "out_of_reach"]

CLEAR_M: Final = AwarenessSection().visible_distance_m
LIFT_M: Final = MotionSection().lift_height_m
_WITHIN: Final = -1e-9
ABOVE_M: Final = np.array([0.0, 0.0, 0.0008])


@dataclass(frozen=True, eq=False)
class Followers:
    """Points that the tissue carries: each follows the node nearest to it.

    Attributes
    ----------
    nodes : ndarray of int, shape (n,)
    offsets_m : ndarray, shape (n, 3) [m]
        From that node to the point.
    """

    nodes: NDArray[np.int64]
    offsets_m: FloatArray

    @classmethod
    def of(cls, points_m: FloatArray, nodes_m: FloatArray) -> "Followers":
        """Tie points to the nodes nearest to them now."""
        if not len(points_m):
            return cls(np.zeros(0, dtype=np.int64), np.zeros((0, 3)))
        away = points_m[:, None, :] - nodes_m[None, :, :]
        nearest = np.argmin(np.einsum("ijk,ijk->ij", away, away), axis=1)
        return cls(nearest, points_m - nodes_m[nearest])

    def places_m(self, nodes_m: FloatArray) -> FloatArray:
        """Where they are on the tissue as it is."""
        return nodes_m[self.nodes] + self.offsets_m


@dataclass(frozen=True, eq=False)
class OnFaces:
    """Points that lie on faces of the tissue, and stay there however it bends.

    Attributes
    ----------
    corners : ndarray of int, shape (n, 3)
        Nodes of the face on which each lies.
    weights : ndarray, shape (n, 3)
        How near it is to each of them; their sum is 1.
    """

    corners: NDArray[np.int32]
    weights: FloatArray

    @classmethod
    def over(
        cls, points_m: FloatArray, nodes_m: FloatArray, surface: NDArray[np.int32]
    ) -> "OnFaces":
        """Project points along the vertical onto the highest face that looks up.

        Notes
        -----
        Barycentric coordinates seen from above. One beside the tissue goes to the edge of the face
        that is nearest to it in those.
        """
        corners_m = nodes_m[surface]
        first, second = (corners_m[:, i, :2] - corners_m[:, 0, :2] for i in (1, 2))
        twice_area = first[:, 0] * second[:, 1] - first[:, 1] * second[:, 0]
        up = np.flatnonzero(twice_area > 0.0)
        if not len(up):
            return cls(np.zeros((0, 3), dtype=np.int32), np.zeros((0, 3)))

        def weights_of(points: NDArray[np.intp], faces: NDArray[np.intp]) -> FloatArray:
            away = points_m[points, :2] - corners_m[faces, 0, :2]
            one = away[..., 0] * second[faces, 1] - away[..., 1] * second[faces, 0]
            two = away[..., 1] * first[faces, 0] - away[..., 0] * first[faces, 1]
            one, two = one / twice_area[faces], two / twice_area[faces]
            return np.stack([1.0 - one - two, one, two], axis=-1)

        chosen = np.full(len(points_m), -1, dtype=np.intp)
        lower, upper = corners_m[up, :, :2].min(axis=1), corners_m[up, :, :2].max(axis=1)
        here = points_m[:, None, :2]
        points, faces = np.nonzero(((here >= lower) & (here <= upper)).all(axis=-1))
        faces = up[faces]
        weights = weights_of(points, faces)
        heights_m = np.einsum("ij,ij->i", weights, corners_m[faces, :, 2])
        # The last that is written for a point stays: the highest of those within.
        within = weights.min(axis=-1) >= _WITHIN
        order = np.flatnonzero(within)[np.argsort(heights_m[within], kind="stable")]
        chosen[points[order]] = faces[order]
        if len(beside := np.flatnonzero(chosen < 0)):
            least = weights_of(beside[:, None], up[None, :]).min(axis=-1)
            chosen[beside] = up[np.argmax(least, axis=1)]
        inside = np.clip(weights_of(np.arange(len(points_m)), chosen), 0.0, None)
        return cls(surface[chosen], inside / inside.sum(axis=1, keepdims=True))

    def places_m(self, nodes_m: FloatArray) -> FloatArray:
        """Where they are on the tissue as it is."""
        return np.einsum("ij,ijk->ik", self.weights, nodes_m[self.corners])


@dataclass(frozen=True, eq=False)
class Ground:
    """What of a trial's tissue stays as it is.

    Attributes
    ----------
    rest_m : ndarray, shape (n, 3) [m]
    surface : ndarray of int, shape (m, 3)
    edges : OnFaces
        Where the attachments end, two points a piece, on the upper face over where they are.
    roi_m : ndarray, shape (3,) [m]
    top_m : float
        Height of the upper face at rest.
    """

    trial: str
    rest_m: FloatArray
    surface: NDArray[np.int32]
    edges: OnFaces
    roi_m: FloatArray
    top_m: float


def ground_of(model: TissueModel) -> Ground:
    """Read the tissue at rest."""
    rest_m, fixed_m = model.nodes_m.floats(), model.fixed_points_m.floats()
    top_m = float(rest_m[:, 2].max())
    ends_m = outline(fixed_m).reshape(-1, 3)
    surface = model.surface.ints()
    return Ground(
        trial=model.trial,
        rest_m=rest_m,
        surface=surface,
        edges=OnFaces.over(ends_m, rest_m, surface),
        roi_m=np.array(model.roi_m),
        top_m=top_m,
    )


@dataclass(frozen=True, eq=False)
class Blocks:
    """The possible points for a grasp: points of the material, the same through a trial.

    Attributes
    ----------
    names : tuple of str
    carried : Followers
    exact : bool
        Tied to the tissue as it was when SA said where they are.
    """

    names: tuple[str, ...]
    carried: Followers
    exact: bool


def blocks_of(context: Context, ground: Ground, tissue: TissueState) -> Blocks:
    """Tie the blocks of a context to the tissue.

    Notes
    -----
    A page that is opened late knows a context of one tick and the tissue of another. It ties the
    blocks to the tissue at rest then, at the middles of their cells.
    """
    if context.tick == tissue.tick:
        places_m = np.array(context.blocks_m, dtype=np.float64).reshape(-1, 3)
        carried = Followers.of(places_m, tissue.nodes_m.floats())
        return Blocks(tuple(context.names), carried, exact=True)
    carried = Followers.of(_cell_middles_m(context.names, ground), ground.rest_m)
    return Blocks(tuple(context.names), carried, exact=False)


def _cell_middles_m(names: Sequence[str], ground: Ground) -> FloatArray:
    cells = [one.removeprefix("b(").removesuffix(")").split(",") for one in names]
    numbers = np.array(cells, dtype=np.float64).reshape(-1, 2)
    lower, upper = ground.rest_m.min(axis=0), ground.rest_m.max(axis=0)
    of = numbers.max(initial=1.0)
    middles = lower[:2] + (numbers - 0.5) / of * (upper - lower)[:2]
    return np.column_stack([middles, np.full(len(middles), ground.top_m)])


def kinds_of(context: Context, target: str) -> tuple[BlockKind, ...]:
    """Say what each block is: held before chosen, chosen before attached.

    Parameters
    ----------
    context : Context
    target : str
        Block that the latest plan grasps; empty if it grasps none.
    """
    fluents = set(context.fluents)
    reachable = {one.partition(",")[2][:-1] for one in fluents if one.startswith("reachable(")}
    held = {one.partition(",")[2][:-1] for one in fluents if one.startswith("in_hand(")}
    kinds: list[BlockKind] = []
    for name in context.names:
        if name in held:
            kinds.append("held")
        elif name == target:
            kinds.append("chosen")
        elif f"fixed({name})" in fluents:
            kinds.append("fixed")
        else:
            kinds.append("free" if name in reachable else "out_of_reach")
    return tuple(kinds)


def path_of(picture: Picture, block_m: Mapping[str, FloatArray]) -> FloatArray:
    """Return the dashes along which the current action will go, shape (n, 2, 3) [m].

    Parameters
    ----------
    picture : Picture
    block_m : mapping of block to where it is [m]

    Notes
    -----
    Straight from the tip to the action's end: its waypoints above the tissue are motion's own.
    """
    robot = picture.of_trial(picture.robot)
    none = np.zeros((0, 2, 3))
    if robot is None or robot.action is None:
        return none
    action = robot.action
    arm = robot.arms.get(action.arm)
    if arm is None or action.phase in ("done", "interrupted"):
        return none
    tip = arm.tip_in_world.position_m
    match action.name:
        case "reach" | "move" if action.block in block_m:
            end = block_m[action.block].tolist()
            return dashes(tip, [*end[:2], tip[2] if action.name == "move" else end[2]])
        case "pull" if arm.grasp_height_m is not None:
            return dashes(tip, (tip[0], tip[1], arm.grasp_height_m + LIFT_M))
        case _:
            return none


def magnitudes_n(tissue: TissueState) -> FloatArray:
    """Return the magnitude of each node's force, shape (n,) [N]."""
    return np.linalg.norm(tissue.nodal_force_n.floats(), axis=1)
