"""The page of the rules: what each file of asp/ says of itself, and where predicates come from."""

from collections import defaultdict
from collections.abc import Iterator
from pathlib import Path
from typing import Any, Final

from clingo import ast

from manual.markdown import block, code, page, prose, table

FOLDER: Final = Path(__file__).parents[1] / "asp"
KINDS: Final = {
    "static": "true while a scene lasts",
    "sensed": "sensed before each plan, or told by a person",
    "option": "asked for",
    "action": "what an arm can do",
}
Predicate = tuple[str, int]


def rules_page() -> str:
    """Return the page: a section for each file, and a table of all predicates."""
    files = {path.relative_to(FOLDER).as_posix(): path for path in sorted(FOLDER.rglob("*.lp"))}
    return page(
        "Rules",
        prose(
            """What each file of [`asp/`](../../asp) knows, in its own words, and which
            predicates it derives and reads. A folder of your own is laid out alike:
            [planning](../planning.md#rules-of-your-own). Steps are numbered from 1; a block
            is `b(I,J)`, an arm `psm1` or `psm2`, a length in whole millimetres."""
        ),
        *(_file(name, path) for name, path in files.items()),
        "## Alphabet",
        "What `domain.lp` declares: a plan is made of these atoms.",
        table(("", "atoms"), _alphabet(files["domain.lp"])),
        "## Predicates",
        prose(
            """`derived in`: as the head of a rule, a fact or an `#external`; `read in`: in a
            body or a condition. What nobody derives comes from outside: the scene, a plan,
            or what was sensed. The number behind the name counts its arguments."""
        ),
        table(("predicate", "derived in", "read in"), _predicates(files)),
    )


def header_of(text: str) -> str:
    """Return the comment that a file begins with, without its signs."""
    lines: list[str] = []
    for line in text.splitlines():
        if not line.startswith("%"):
            break
        lines.append(line.removeprefix("%").removeprefix(" ").rstrip())
    return "\n".join(lines)


def _file(name: str, path: Path) -> str:
    first, _, rest = header_of(path.read_text(encoding="utf-8")).partition("\n")
    about = first.partition(": ")[2]
    return "\n\n".join(
        (
            f"## {name}",
            f"{about[0].upper()}{about[1:]} ([the file](../../asp/{name}))",
            block(rest, "text"),
        )
    )


def _alphabet(path: Path) -> Iterator[tuple[str, str]]:
    """Yield what each kind of atom is, and the atoms that the file declares as such."""
    declared: defaultdict[str, list[str]] = defaultdict(list)

    def statement(node: Any) -> None:
        if node.ast_type is ast.ASTType.Rule and not node.body:
            fact = node.head.atom.symbol
            declared[fact.name].extend(code(str(argument)) for argument in fact.arguments)

    ast.parse_files([str(path)], statement)
    for kind, what in KINDS.items():
        yield what, ", ".join(declared[kind])


def _predicates(files: dict[str, Path]) -> Iterator[tuple[str, str, str]]:
    derived: defaultdict[Predicate, list[str]] = defaultdict(list)
    read: defaultdict[Predicate, list[str]] = defaultdict(list)
    for name, path in files.items():
        heads, bodies = _of_file(path)
        for found, kept in ((heads, derived), (bodies, read)):
            for predicate in found:
                kept[predicate].append(name)
    for predicate in sorted(derived.keys() | read.keys()):
        yield (
            code(f"{predicate[0]}/{predicate[1]}"),
            ", ".join(derived[predicate]),
            ", ".join(read[predicate]),
        )


def _of_file(path: Path) -> tuple[set[Predicate], set[Predicate]]:
    """Return the predicates that a file derives, and those that it reads."""
    derived, read = set[Predicate](), set[Predicate]()

    def statement(node: Any) -> None:
        if node.ast_type is ast.ASTType.Rule:
            head, body = node.head, node.body
        elif node.ast_type is ast.ASTType.External:
            head, body = node.atom, node.body
        else:
            head, body = None, getattr(node, "body", [])
        if head is not None:
            heads, conditions = _heads(head)
            derived.update(heads)
            read.update(conditions)
        for part in body:
            read.update(_atoms(part))

    ast.parse_files([str(path)], statement)
    return derived, read


def _heads(head: Any) -> tuple[set[Predicate], set[Predicate]]:
    """Return what a head derives, and what the conditions of its choices read."""
    elements = getattr(head, "elements", None)
    if elements is None:
        return _atoms(head), set()
    heads, conditions = set[Predicate](), set[Predicate]()
    for element in elements:
        heads |= _atoms(element.literal)
        for condition in element.condition:
            conditions |= _atoms(condition)
    return heads, conditions


def _atoms(node: Any) -> set[Predicate]:
    """Return the predicates of all atoms below a node, those of aggregates among them."""
    found = set[Predicate]()

    class Finder(ast.Transformer):
        def visit_SymbolicAtom(self, atom: Any) -> Any:
            symbol = atom.symbol
            if symbol.ast_type is ast.ASTType.UnaryOperation:
                symbol = symbol.argument
            each = symbol.arguments if symbol.ast_type is ast.ASTType.Pool else [symbol]
            found.update((one.name, len(one.arguments)) for one in each)
            return atom

    Finder()(node)
    return found
