"""A checked scene as ASP facts."""

from collections.abc import Iterable

from fras_planner.planning.measures import check_bounds, measures
from fras_planner.planning.scene import PlanningScene
from fras_planner.planning.signature import STATIC, Alphabet


class SceneFacts:
    """Facts about a scene, and about some of its blocks.

    Parameters
    ----------
    alphabet : Alphabet
    scene : PlanningScene
    sums : bool
        Whether the sums of distances to all attachments are wanted.

    Attributes
    ----------
    blocks : frozenset of str
    statics : tuple of str
        The static atoms, sorted.
    above_roi : tuple of str
        Those of them that tell the block above the region of interest.
    fixed_count : int
        Blocks over attachment points.
    all : tuple of str
        Every fact about the scene.

    Raises
    ------
    EmptyContext, SceneOutOfBounds, UnknownFluent, UnknownArm, UnknownBlock
    """

    def __init__(self, alphabet: Alphabet, scene: PlanningScene, *, sums: bool) -> None:
        check_bounds(scene)
        self.blocks = frozenset(scene.names)
        self._known = alphabet.instances(STATIC, scene.names)
        self._alphabet = alphabet
        self.check(scene.statics)
        self._statics = scene.statics
        self.statics = tuple(sorted(scene.statics))
        self.above_roi = tuple(atom for atom in self.statics if atom.startswith("above_roi("))
        self._fixed = frozenset(n for n in scene.names if f"fixed({n})" in scene.statics)
        self.fixed_count = len(self._fixed)
        found = measures(scene, sorted(self._fixed), sums=sums)
        self._measured = {
            name: [f"{kind}({name},{values[row]})" for kind, values in found.items()]
            for row, name in enumerate(scene.names)
        }
        self.all = (
            *(f"block({name})" for name in scene.names),
            *self.statics,
            *(fact for name in scene.names for fact in self._measured[name]),
        )

    def check(self, statics: Iterable[str]) -> None:
        """Raise on the first atom, in alphabetical order, that this scene cannot have."""
        for atom in sorted(frozenset(statics) - self._known):
            self._alphabet.symbol(atom, self.blocks)

    def about(self, names: Iterable[str]) -> list[str]:
        """Describe some blocks: their distances, and which of them are fixed."""
        found: list[str] = []
        for name in sorted(self.blocks.intersection(names)):
            found += self._measured[name]
            if name in self._fixed:
                found.append(f"fixed({name})")
        return found

    def reachable(self, name: str) -> list[str]:
        """Say which arms reach a block."""
        atoms = (f"reachable({arm},{name})" for arm in self._alphabet.arms)
        return [atom for atom in atoms if atom in self._statics]
