"""Knowledge as text, and clingo programs made of it; every fault is traced to file and line."""

import re
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property

import clingo

from fras_planner.planning.errors import KnowledgeFault, UnknownCriterion
from fras_planner.planning.signature import Alphabet

PLAN_FILES = ("domain.lp", "target.lp", "actions.lp", "effects.lp", "constraints.lp", "goal.lp")
TELL_FILES = ("history.lp", "explain.lp", "because.lp")
NO_PLAN_FILES = ("words.lp", "no_plan.lp", "because.lp")
WHY_NOT_BLOCK_FILES = ("words.lp", "why_not_block.lp")
WHY_NOT_ACTION_FILES = ("words.lp", "why_not_action.lp")
VERIFY_FILES = ("verify.lp",)
PREFERENCES = "preferences/"
HINTS = {
    "syntax error": "often the rule before lacks its full stop",
    "unsafe variables": "each variable has to stand in a condition of the rule that is not negated",
    "atom does not occur in any rule head": "misspelt, or with another number of arguments?",
}
"""What is likely, by how clingo's message begins."""

_PLACE = re.compile(r"<block>:(\d+):[^ ]*\s*(.*)", re.DOTALL)
_OWN_PLACE = re.compile(r" <block>:[0-9:-]+: note: ")
_OWN_PART = re.compile(r"\[#inc_[a-z_]+\];?|#inc_[a-z_]+(?:\([^()]*\))?;")


@dataclass(frozen=True)
class Knowledge:
    """The rule files, by value.

    Attributes
    ----------
    files : mapping of str to str
        Text by path below `asp/`, with forward slashes.
    digest : str
        SHA-256 over all of them, hexadecimal.
    origin : str
        Where they were read, for messages.
    """

    files: Mapping[str, str]
    digest: str
    origin: str = "asp"

    @property
    def criteria(self) -> tuple[str, ...]:
        """Names of the criteria, one file each."""
        return tuple(
            sorted(
                name.removeprefix(PREFERENCES).removesuffix(".lp")
                for name in self.files
                if name.startswith(PREFERENCES)
            )
        )

    def preference_file(self, criterion: str) -> str:
        """Name of a criterion's file; raises `UnknownCriterion`."""
        if criterion not in self.criteria:
            raise UnknownCriterion(criterion, self.criteria)
        return f"{PREFERENCES}{criterion}.lp"

    @cached_property
    def alphabet(self) -> Alphabet:
        """The signature, read from part `signature` of `domain.lp`."""
        program = Program(self, ("domain.lp",), ())
        program.ground(("signature", ()))
        return Alphabet.from_control(program.control)


class Program:
    """A clingo Control over some of the files.

    Any message of clingo counts as a fault, an undefined atom too: that is how a misspelt
    predicate shows.

    Parameters
    ----------
    knowledge : Knowledge
    names : sequence of str
        Files to add, in order.
    arguments : sequence of str
        Clingo's command line.

    Raises
    ------
    KnowledgeFault
        If a file is missing or does not parse.
    """

    def __init__(
        self, knowledge: Knowledge, names: Sequence[str], arguments: Sequence[str]
    ) -> None:
        self._origin = knowledge.origin
        self._starts: list[tuple[int, str]] = []
        self._messages: list[str] = []
        self.control = clingo.Control(list(arguments), logger=_keeping(self._messages))
        lines = 0
        texts: list[str] = []
        for name in names:
            if name not in knowledge.files:
                raise KnowledgeFault(f"{knowledge.origin}/{name}", 0, "this file is missing")
            text = f"#program base.\n{knowledge.files[name].rstrip()}\n"
            # One block for all files: clingo names blocks alike, but counts lines through.
            self._starts.append((lines + 1, name))
            texts.append(text)
            lines += text.count("\n")
        self._guard(lambda: self.control.add("base", [], "".join(texts)))

    def ground(self, *parts: tuple[str, Sequence[int]], facts: Iterable[str] = ()) -> None:
        """Add `facts` and ground them together with `parts`.

        Raises
        ------
        KnowledgeFault
            If a rule is unsafe, an atom is undefined, or an operation is not.
        """
        wanted = [(name, [clingo.Number(value) for value in values]) for name, values in parts]
        text = "".join(f"{fact}.\n" for fact in facts)
        if text:
            self._guard(lambda: self.control.add("facts", [], text))
            wanted.insert(0, ("facts", []))
        self._guard(lambda: self.control.ground(wanted))

    def rows(self, predicate: str, arity: int) -> list[Sequence[clingo.Symbol]]:
        """Return the arguments of all atoms of a predicate.

        Raises
        ------
        KnowledgeFault
            If it is also there with another number of arguments: those would be overlooked.
        """
        atoms = self.control.symbolic_atoms
        others = {n for name, n, _ in atoms.signatures if name == predicate} - {arity}
        if others:
            problem = f"{predicate}/{others.pop()} is not understood, only {predicate}/{arity}"
            raise KnowledgeFault(self._origin, 0, problem)
        return [atom.symbol.arguments for atom in atoms.by_signature(predicate, arity)]

    def _guard(self, step: Callable[[], None]) -> None:
        try:
            step()
        except RuntimeError as error:
            self._raise_fault(str(error))
        if self._messages:
            self._raise_fault("")

    def _raise_fault(self, fallback: str) -> None:
        message = self._messages[0] if self._messages else fallback
        self._messages.clear()
        place = _PLACE.match(message)
        if place is None:
            raise KnowledgeFault(self._origin, 0, message.strip())
        line = int(place.group(1))
        started = [entry for entry in sorted(self._starts) if entry[0] <= line]
        start, name = started[-1]
        if line == start and len(started) > 1:
            # What is open at the end of a file is noticed at the line put before the next one.
            line, (start, name) = line - 1, started[-2]
        # The first line of each file's text is the `#program base.` put before it.
        raise KnowledgeFault(f"{self._origin}/{name}", line - start, _in_words(place.group(2)))


def _in_words(said: str) -> str:
    """Take out of what clingo says what only clingo knows, and put in what it leaves unsaid."""
    words = " ".join(said.split()).removeprefix("error: ").removeprefix("info: ")
    words = _OWN_PART.sub("", _OWN_PLACE.sub(" ", words))
    for begins, hint in HINTS.items():
        if words.startswith(begins):
            return f"{words} ({hint})"
    return words


def _keeping(messages: list[str]) -> Callable[[clingo.MessageCode, str], None]:
    """Return a logger; not a method, or a program could only be freed by the cycle collector."""

    def log(_code: clingo.MessageCode, message: str) -> None:
        messages.append(message)

    return log
