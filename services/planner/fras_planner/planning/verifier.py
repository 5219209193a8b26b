"""Holds a history, planned or executed, against the safety specifications in `verify.lp`."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass

import clingo

from fras_planner.planning.errors import KnowledgeFault
from fras_planner.planning.program import VERIFY_FILES, Knowledge, Program
from fras_planner.planning.signature import STATIC, functor, normalised


@dataclass(frozen=True)
class Violation:
    """A specification that a history breaks.

    Attributes
    ----------
    rule : str
        Name of the specification.
    t : int
        Step at which it was broken.
    sentence : str
        The same in words.
    """

    rule: str
    t: int
    sentence: str


def verify(knowledge: Knowledge, history: Mapping[int, Iterable[str]]) -> tuple[Violation, ...]:
    """Check a history.

    Parameters
    ----------
    knowledge : Knowledge
    history : mapping of int to iterable of str
        For each step what was sensed before it, and what was done at it, as in `Plan.history`.
        Atoms of the scene may stand at any step and count for all.

    Returns
    -------
    tuple of Violation
        In the order of the steps; empty if the history keeps to the specifications.

    Raises
    ------
    UnknownFluent
        If an atom is neither a fluent nor an action of the signature.
    KnowledgeFault
        If clingo finds fault with `verify.lp`.
    """
    forms = _Forms(knowledge)
    scene: set[str] = set()
    facts: list[str] = []
    for t, atoms in history.items():
        for text in atoms:
            form, atom = forms[text]
            if form:
                facts.append(f"{form}({atom},{t})")
            else:
                scene.add(atom)
    program = Program(knowledge, VERIFY_FILES, ())
    program.ground(("base", ()), facts=[*sorted(scene), *facts])
    atoms = program.control.symbolic_atoms
    words = {
        str(atom.symbol.arguments[0]): atom.symbol.arguments[1].string
        for atom in atoms.by_signature("specification", 2)
    }
    for atom in atoms.by_signature("violation", 3):
        rule = str(atom.symbol.arguments[0])
        if rule not in words:
            problem = f"violation({rule},...) has no specification({rule},Text)"
            raise KnowledgeFault(f"{knowledge.origin}/{VERIFY_FILES[0]}", 0, problem)
    found = [_violation(atom.symbol, words) for atom in atoms.by_signature("violation", 3)]
    return tuple(sorted(found, key=lambda one: (one.t, one.rule, one.sentence)))


class _Forms(dict[str, tuple[str, str]]):
    """How each atom is told to the rules: as `done`, `now`, or, of the scene, as it is."""

    def __init__(self, knowledge: Knowledge) -> None:
        super().__init__()
        self._alphabet = knowledge.alphabet

    def __missing__(self, text: str) -> tuple[str, str]:
        atom = normalised(text)
        if functor(atom) in self._alphabet.actions:
            form = "done"
        else:
            form = "" if self._alphabet.kind(atom) == STATIC else "now"
        self[text] = form, atom
        return self[text]


def _violation(symbol: clingo.Symbol, words: Mapping[str, str]) -> Violation:
    rule, t, about = symbol.arguments
    values = [str(value) for value in about.arguments]
    sentence = words[str(rule)].format(*values)
    return Violation(str(rule), t.number, f"step {t.number}: {sentence}.")
