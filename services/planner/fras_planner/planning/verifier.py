"""Holds a history, planned or executed, against the safety specifications in `verify.lp`."""

from collections.abc import Iterable, Mapping, Sequence
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
    # The rules count steps one by one; what was refused may have left a gap.
    steps = sorted(history)
    for place, t in enumerate(steps, start=1):
        for text in history[t]:
            form, atom = forms[text]
            if form:
                facts.append(f"{form}({atom},{place})")
            else:
                scene.add(atom)
    program = Program(knowledge, VERIFY_FILES, ())
    program.ground(("base", ()), facts=[*sorted(scene), *facts])
    words = {str(rule): text for rule, text in program.rows("specification", 2)}
    found: list[Violation] = []
    for row in program.rows("violation", 3):
        try:
            found.append(_violation(row, words, steps))
        except (LookupError, RuntimeError, ValueError) as error:
            problem = (
                f"violation({','.join(map(str, row))}) does not fit its specification "
                f"({type(error).__name__}: {error})"
            )
            raise KnowledgeFault(f"{knowledge.origin}/{VERIFY_FILES[0]}", 0, problem) from error
    return tuple(sorted(found, key=lambda one: (one.t, one.rule, one.sentence)))


class _Forms(dict[str, tuple[str, str]]):
    """How each atom is told to the rules: as `done`, `now`, or, of the scene, as it is."""

    def __init__(self, knowledge: Knowledge) -> None:
        super().__init__()
        self._alphabet = knowledge.alphabet

    def __missing__(self, text: str) -> tuple[str, str]:
        atom = normalised(text)
        if functor(atom) in self._alphabet.actions:
            self._alphabet.action(atom, _EVERY_BLOCK)
            form = "done"
        else:
            self._alphabet.symbol(atom, _EVERY_BLOCK)
            form = "" if self._alphabet.kind(atom) == STATIC else "now"
        self[text] = form, atom
        return self[text]


class _EveryBlock(frozenset[str]):
    """A history may be of any scene: that a block is in it is not ours to check."""

    def __contains__(self, block: object) -> bool:
        return True


_EVERY_BLOCK = _EveryBlock()


def _violation(
    row: Sequence[clingo.Symbol], words: Mapping[str, clingo.Symbol], steps: Sequence[int]
) -> Violation:
    rule, place, about = row
    t = steps[place.number - 1]
    values = [str(value) for value in about.arguments]
    sentence = words[str(rule)].string.format(*values)
    return Violation(str(rule), t, f"step {t}: {sentence}.")
