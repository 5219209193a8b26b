"""The signature of the domain, as `domain.lp` declares it, and what it admits."""

from collections.abc import Iterable
from dataclasses import dataclass

import clingo

from fras_planner.planning.errors import UnknownArm, UnknownBlock, UnknownFluent

STATIC, SENSED, OPTION = "static", "sensed", "option"


def normalised(atom: str) -> str:
    """Text of an atom without blanks."""
    return "".join(atom.split())


def functor(atom: str) -> str:
    """Name of an atom's predicate."""
    return atom.partition("(")[0]


@dataclass(frozen=True)
class Alphabet:
    """Arms and fluents.

    Attributes
    ----------
    arms : tuple of str
    sorts : dict of str to tuple of str
        Sorts of the arguments (`arm`, `block`) by fluent.
    kinds : dict of str to str
        `static`, `sensed` or `option` by fluent.
    """

    arms: tuple[str, ...]
    sorts: dict[str, tuple[str, ...]]
    kinds: dict[str, str]

    @classmethod
    def from_control(cls, control: clingo.Control) -> "Alphabet":
        """Read `arm/1`, `static/1`, `sensed/1` and `option/1` of a grounded program."""
        sorts: dict[str, tuple[str, ...]] = {}
        kinds: dict[str, str] = {}
        for kind in (STATIC, SENSED, OPTION):
            for atom in control.symbolic_atoms.by_signature(kind, 1):
                form = atom.symbol.arguments[0]
                sorts[form.name] = tuple(sort.name for sort in form.arguments)
                kinds[form.name] = kind
        arms = sorted(
            str(a.symbol.arguments[0]) for a in control.symbolic_atoms.by_signature("arm", 1)
        )
        return cls(tuple(arms), sorts, kinds)

    @property
    def forms(self) -> tuple[str, ...]:
        """The fluents with the sorts of their arguments, for messages."""
        return tuple(
            f"{name}({','.join(sorts)})" if sorts else name for name, sorts in self.sorts.items()
        )

    def kind(self, atom: str) -> str:
        """Kind of a normalised atom, by its name alone; raises `UnknownFluent`."""
        name = functor(atom)
        if name not in self.kinds:
            raise UnknownFluent(atom, self.forms)
        return self.kinds[name]

    def instances(self, kind: str, blocks: Iterable[str]) -> frozenset[str]:
        """All normalised atoms of one kind over some blocks."""
        domains = {"arm": self.arms, "block": tuple(blocks)}
        found: list[str] = []
        for name, sorts in self.sorts.items():
            if self.kinds[name] != kind:
                continue
            rows = [""]
            for sort in sorts:
                rows = [f"{row},{item}" if row else item for row in rows for item in domains[sort]]
            found.extend(f"{name}({row})" if row else name for row in rows)
        return frozenset(found)

    def symbol(self, atom: str, blocks: Iterable[str]) -> clingo.Symbol:
        """Check one atom and make a symbol of it.

        Raises
        ------
        UnknownFluent, UnknownArm, UnknownBlock
        """
        try:
            symbol = clingo.parse_term(atom, logger=_ignore)
        except RuntimeError:
            # clingo says no more than that it is no term; the list of fluents says what is one.
            raise UnknownFluent(atom, self.forms) from None
        wellformed = (
            symbol.type == clingo.SymbolType.Function
            and symbol.positive
            and symbol.name in self.sorts
            and len(symbol.arguments) == len(self.sorts[symbol.name])
        )
        if not wellformed:
            raise UnknownFluent(atom, self.forms)
        for sort, argument in zip(self.sorts[symbol.name], symbol.arguments, strict=True):
            text = str(argument)
            if sort == "arm" and text not in self.arms:
                raise UnknownArm(atom, text, self.arms)
            if sort == "block" and text not in blocks:
                raise UnknownBlock(atom, text, blocks)
        return symbol


def _ignore(_code: clingo.MessageCode, _message: str) -> None:
    """Keep clingo from writing to stderr what an error says."""
