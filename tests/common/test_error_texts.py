"""Every error's text has one form: it goes on after `fras: `, and says can't."""

import ast
import re
from collections.abc import Iterator
from pathlib import Path

import pytest

SERVICES = Path(__file__).parents[2] / "services"
TREES = {path: ast.parse(path.read_text()) for path in sorted(SERVICES.rglob("*.py"))}
CAPITAL = re.compile(r"[A-Z][a-z]")


def last_name(node: ast.expr) -> str:
    return ast.unparse(node).rpartition(".")[2]


def errors() -> set[str]:
    """Names of `FrasError` and all that derive from it."""
    bases = {
        node.name: {last_name(base) for base in node.bases}
        for tree in TREES.values()
        for node in ast.walk(tree)
        if isinstance(node, ast.ClassDef)
    }
    found = {"FrasError"}
    while more := {name for name, its in bases.items() if its & found} - found:
        found |= more
    return found


def text_of(node: ast.expr) -> str:
    """Text of a literal, each value in it as `{}`; empty for anything else."""
    if isinstance(node, ast.JoinedStr):
        return "".join(text_of(one) or "{}" for one in node.values)
    return node.value if isinstance(node, ast.Constant) and isinstance(node.value, str) else ""


def texts() -> Iterator[tuple[str, str]]:
    """Where a text stands, and it: what errors are made with, here or in their own `__init__`."""
    names = errors()
    for path, tree in TREES.items():
        for node in ast.walk(tree):
            if not isinstance(node, ast.Call):
                continue
            if last_name(node.func) in names or ast.unparse(node.func) == "super().__init__":
                for text in map(text_of, node.args):
                    if " " in text:
                        yield f"{path.relative_to(SERVICES)}:{node.lineno}", text


def faults(text: str) -> list[str]:
    return [
        what
        for what, wrong in {
            "begins with a capital": CAPITAL.match(text),
            "ends with a full stop": text.endswith("."),
            "says cannot": "cannot" in text,
            "a command without backquotes": re.search(r"(?<!`)\b(chmod|pip install) ", text),
        }.items()
        if wrong
    ]


def test_texts_have_one_form() -> None:
    found = dict(texts())
    assert len(found) > 300
    assert [(where, text, faults(text)) for where, text in found.items() if faults(text)] == []


@pytest.mark.parametrize(
    "text", ["No log here", "no log here.", "it cannot be read", "{}: others may: chmod 600 it"]
)
def test_another_form_is_found(text: str) -> None:
    assert len(faults(text)) == 1
