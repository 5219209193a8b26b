"""Whether each rule that forbids something is declared: one that is not would count for nothing."""

from collections.abc import Collection
from typing import Any

from clingo.ast import ASTType, parse_string

from fras_planner.planning.errors import KnowledgeFault
from fras_planner.planning.program import Knowledge, Program

FORBIDDING = {2: 1, 4: 2}
"""Where `forbidden` has the name of its rule, by its number of arguments."""


def refuse_undeclared(knowledge: Knowledge, declared: Collection[str]) -> None:
    """Refuse `forbidden(...)` for a rule without `rule(NAME)`: nothing would enforce it.

    Parameters
    ----------
    knowledge : Knowledge
    declared : collection of str
        Names of the rules that a planner by it enforces.

    Raises
    ------
    KnowledgeFault
        With the file, the line and the name; or a file that no plan needs does not parse.
    """
    for file in knowledge.files:
        Program(knowledge, (file,), ())
    used = [
        (file, line, name) for file, text in knowledge.files.items() for line, name in _names(text)
    ]
    missing = {name for _, _, name in used} - set(declared)
    for file, line, name in used:
        if name in missing:
            problem = (
                f"rule {name} forbids something, but nothing declares it, so it would not count"
            )
            raise KnowledgeFault(
                f"{knowledge.origin}/{file}",
                line,
                problem,
                f"add `rule({name}).` to part base, and its words to words.lp",
            )


def _names(text: str) -> list[tuple[int, str]]:
    """Names of rules that forbid, as constants, each with its line."""
    found: list[tuple[int, str]] = []

    def look(statement: Any) -> None:
        if statement.ast_type != ASTType.Rule or statement.head.ast_type != ASTType.Literal:
            return
        head = statement.head.atom
        atom = head.symbol if head.ast_type == ASTType.SymbolicAtom else None
        if atom is None or atom.ast_type != ASTType.Function or atom.name != "forbidden":
            return
        place = FORBIDDING.get(len(atom.arguments))
        term = None if place is None else atom.arguments[place]
        if term is not None and term.ast_type == ASTType.SymbolicTerm:
            found.append((statement.location.begin.line, str(term.symbol)))

    parse_string(text, look)
    return found
