"""The rules taken one by one: some files as a program of their own, one statement left out."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import cast

from clingo import ast

from fras_planner.planning import Knowledge
from fras_planner.planning.program import Program

Part = tuple[str, Sequence[int]]

# Statements without which the same plans hold: declarations, and advice to the solver.
NO_RULES = {
    ast.ASTType.Program,
    ast.ASTType.Comment,
    ast.ASTType.Defined,
    ast.ASTType.Definition,
    ast.ASTType.Heuristic,
    ast.ASTType.ShowSignature,
    ast.ASTType.ShowTerm,
}


@dataclass(frozen=True)
class Mutant:
    """Knowledge that lacks one statement."""

    file: str
    place: str
    text: str
    knowledge: Knowledge

    def __str__(self) -> str:
        return f"{self.place} {self.text[:50]}"


def statements(text: str) -> list[ast.AST]:
    """Parse a rule file; its first statement is the `#program base` that clingo puts there."""
    found: list[ast.AST] = []
    ast.parse_string(text, found.append)
    return found


def reprinted(nodes: Iterable[ast.AST]) -> str:
    return "".join(f"{node}\n" for node in nodes if node.ast_type != ast.ASTType.Comment)


def mutants(knowledge: Knowledge, files: Iterable[str]) -> list[Mutant]:
    """Knowledge without each of the rules of some files in turn."""
    found: list[Mutant] = []
    for file in files:
        nodes = statements(knowledge.files[file])
        for index, node in enumerate(nodes):
            if node.ast_type in NO_RULES:
                continue
            rest = reprinted(nodes[:index] + nodes[index + 1 :])
            line = cast(ast.Location, node.location).begin.line
            without = Knowledge({**knowledge.files, file: rest}, "", origin="mutant")
            found.append(Mutant(file, f"{file}:{line}", str(node), without))
    return found


def models(
    knowledge: Knowledge,
    files: Sequence[str],
    facts: str = "",
    parts: Sequence[Part] = (),
    *options: str,
    best: bool = False,
) -> list[frozenset[str]]:
    """All models of some files, facts and parts, each as all its atoms; or the best ones only."""
    mode = "optN" if best else "ignore"
    program = Program(knowledge, files, ["0", f"--opt-mode={mode}", *options])
    program.ground(("base", ()), *parts, facts=[facts.strip().removesuffix(".")] if facts else [])
    found: list[frozenset[str]] = []
    with program.control.solve(yield_=True) as handle:
        for model in handle:
            if model.optimality_proven or not best:
                found.append(frozenset(str(atom) for atom in model.symbols(atoms=True)))
    return found
