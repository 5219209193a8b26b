"""The signature of the domain, as `domain.lp` declares it, and what it admits."""

from collections.abc import Collection, Iterable, Mapping
from dataclasses import dataclass

import clingo

from fras_planner.planning.errors import UnknownAction, UnknownArm, UnknownBlock, UnknownFluent

STATIC, SENSED, OPTION = "static", "sensed", "option"
ACTION = "action"


def normalised(atom: str) -> str:
    """Text of an atom without blanks."""
    return "".join(atom.split())


def functor(atom: str) -> str:
    """Name of an atom's predicate."""
    return atom.partition("(")[0]


def exclusion(name: str, arms: Collection[str]) -> str:
    """Atom that says of a block, or of one of the arms, that a person has excluded it."""
    name = normalised(name)
    return f"barred({name})" if name in arms else f"rejected({name})"


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
    actions : dict of str to tuple of str
        Sorts of the arguments by action.
    """

    arms: tuple[str, ...]
    sorts: dict[str, tuple[str, ...]]
    kinds: dict[str, str]
    actions: dict[str, tuple[str, ...]]

    @classmethod
    def from_control(cls, control: clingo.Control) -> "Alphabet":
        """Read the declarations of a grounded program: `arm/1` and one predicate for each kind."""
        sorts: dict[str, tuple[str, ...]] = {}
        kinds: dict[str, str] = {}
        for kind in (STATIC, SENSED, OPTION):
            for name, arguments in _forms(control, kind):
                sorts[name] = arguments
                kinds[name] = kind
        arms = sorted(
            str(a.symbol.arguments[0]) for a in control.symbolic_atoms.by_signature("arm", 1)
        )
        return cls(tuple(arms), sorts, kinds, dict(_forms(control, ACTION)))

    @property
    def forms(self) -> tuple[str, ...]:
        """The fluents with the sorts of their arguments, for messages."""
        return _written(self.sorts)

    @property
    def action_forms(self) -> tuple[str, ...]:
        """The actions with the sorts of their arguments, for messages."""
        return _written(self.actions)

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

    def symbol(self, atom: str, blocks: Collection[str]) -> clingo.Symbol:
        """Check one fluent and make a symbol of it.

        Raises
        ------
        UnknownFluent, UnknownArm, UnknownBlock
        """
        symbol = _parsed(atom, self.sorts)
        if symbol is None:
            raise UnknownFluent(atom, self.forms)
        self._check_arguments(atom, symbol, self.sorts[symbol.name], blocks)
        return symbol

    def action(self, text: str, blocks: Collection[str]) -> clingo.Symbol:
        """Check one action and make a symbol of it.

        Raises
        ------
        UnknownAction, UnknownArm, UnknownBlock
        """
        symbol = _parsed(text, self.actions)
        if symbol is None:
            raise UnknownAction(text, self.action_forms)
        self._check_arguments(text, symbol, self.actions[symbol.name], blocks)
        return symbol

    def _check_arguments(
        self, atom: str, symbol: clingo.Symbol, sorts: tuple[str, ...], blocks: Collection[str]
    ) -> None:
        for sort, argument in zip(sorts, symbol.arguments, strict=True):
            text = str(argument)
            if sort == "arm" and text not in self.arms:
                raise UnknownArm(atom, text, self.arms)
            if sort == "block" and text not in blocks:
                raise UnknownBlock(atom, text, blocks)


def _parsed(text: str, sorts: Mapping[str, tuple[str, ...]]) -> clingo.Symbol | None:
    """Return a term of one of the forms, or nothing."""
    if not text.isascii():
        # clingo's own words on it may cut a letter in two, and then can't be decoded.
        return None
    try:
        symbol = clingo.parse_term(text, logger=_ignore)
    except RuntimeError:
        # clingo says no more than that it is no term; the list of forms says what is one.
        return None
    # clingo works terms out: `b(0+1,1)` would be another name of a block, unknown to the rest.
    fits = (
        str(symbol) == text
        and symbol.type == clingo.SymbolType.Function
        and symbol.positive
        and symbol.name in sorts
        and len(symbol.arguments) == len(sorts[symbol.name])
    )
    return symbol if fits else None


def _forms(control: clingo.Control, kind: str) -> list[tuple[str, tuple[str, ...]]]:
    """Return what the atoms `kind(name(sort,...))` declare."""
    forms = [atom.symbol.arguments[0] for atom in control.symbolic_atoms.by_signature(kind, 1)]
    return [(form.name, tuple(sort.name for sort in form.arguments)) for form in forms]


def _written(sorts: Mapping[str, tuple[str, ...]]) -> tuple[str, ...]:
    return tuple(f"{name}({','.join(of)})" if of else name for name, of in sorts.items())


def _ignore(_code: clingo.MessageCode, _message: str) -> None:
    """Keep clingo from writing to stderr what an error says."""
