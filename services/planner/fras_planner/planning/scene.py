"""What a plan is made for: the context as sensed, and the part of it that lasts."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field

from fras_planner.planning.errors import EmptyContext
from fras_planner.planning.program import Knowledge
from fras_planner.planning.signature import STATIC, normalised

Point = tuple[float, ...]


def _points(rows: Iterable[Iterable[float]]) -> tuple[Point, ...]:
    return tuple(tuple(float(value) for value in row) for row in rows)


@dataclass(frozen=True)
class Context:
    """What the situation awareness reports, with the options of planning.

    Attributes
    ----------
    names : tuple of str
        Blocks, `b(i,j)`.
    blocks_m : tuple of points
        Their rest centres [m], in the order of `names`.
    roi_m : point
        Region of interest [m].
    fluents : tuple of str
        Atoms that hold, static and sensed mixed.
    fixed_points_m : tuple of points
        Attachment points [m]; planning itself goes by the `fixed` atoms.
    ignore_ap : bool
        Plan as if there were no attachments.
    tried : tuple of str
        Blocks that are no candidates any more.
    rejected : tuple of str
        Blocks, and arms, that a person has excluded from grasping.
    reason : str
        Why a plan is made now; only told.
    evidence : mapping of str to mapping of str to float
        The numbers behind each atom; only told.
    """

    names: tuple[str, ...]
    blocks_m: tuple[Point, ...]
    roi_m: Point
    fluents: tuple[str, ...]
    fixed_points_m: tuple[Point, ...] = ()
    ignore_ap: bool = False
    tried: tuple[str, ...] = ()
    rejected: tuple[str, ...] = ()
    reason: str = "initial"
    evidence: Mapping[str, Mapping[str, float]] = field(default_factory=dict[str, dict[str, float]])


@dataclass(frozen=True)
class PlanningScene:
    """The part of a context that lasts; one `Planner` serves one scene.

    Attributes
    ----------
    names : tuple of str
        Blocks, `b(i,j)`.
    blocks_m : tuple of points
        Their rest centres [m], in the order of `names`.
    roi_m : point
        Region of interest [m].
    statics : frozenset of str
        The `reachable`, `fixed` and `above_roi` atoms, without blanks.
    """

    names: tuple[str, ...]
    blocks_m: tuple[Point, ...]
    roi_m: Point
    statics: frozenset[str]

    @classmethod
    def make(
        cls,
        names: Sequence[str],
        blocks_m: Iterable[Iterable[float]],
        roi_m: Iterable[float],
        statics: Iterable[str],
    ) -> "PlanningScene":
        """Take lists or arrays, shape (n, 3) and (3,) [m]."""
        return cls(
            tuple(normalised(name) for name in names),
            _points(blocks_m),
            tuple(float(value) for value in roi_m),
            frozenset(normalised(atom) for atom in statics),
        )

    @classmethod
    def from_context(cls, context: Context, knowledge: Knowledge) -> "PlanningScene":
        """Pick the static atoms out of a context.

        Raises
        ------
        EmptyContext
            If there are no blocks or no fluents.
        UnknownFluent
            If an atom's name is not in the signature.
        """
        if not context.names:
            raise EmptyContext("blocks")
        if not context.fluents:
            raise EmptyContext("fluents")
        atoms = [normalised(atom) for atom in context.fluents]
        statics = [atom for atom in atoms if knowledge.alphabet.kind(atom) == STATIC]
        return cls.make(context.names, context.blocks_m, context.roi_m, statics)
