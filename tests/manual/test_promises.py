"""docs/promises.md: each sentence stands in the README, each proof exists."""

import ast
import re
from functools import cache
from pathlib import Path

import pytest

from fras_cli.bench import BENCHMARKS
from support.pages import ROOT

PAGE = ROOT / "docs" / "promises.md"
ROW = re.compile(r"^\| (?P<promise>.+?) \| (?P<proofs>`.+`) \|$", re.MULTILINE)
ROWS = [(row["promise"], row["proofs"]) for row in ROW.finditer(PAGE.read_text())]


def plain(markdown: str) -> str:
    """Words without emphasis, links, comment signs and line ends."""
    linked = re.sub(r"\[([^\]]*)\]\([^)]*\)", r"\1", markdown)
    return " ".join(re.sub(r"[*`]|(?<=\s)#(?=\s)", "", linked).split())


README = plain((ROOT / "README.md").read_text(encoding="utf-8"))


@cache
def names_in(path: Path) -> set[str]:
    tree = ast.parse(path.read_text(encoding="utf-8"))
    return {node.name for node in tree.body if isinstance(node, ast.FunctionDef)}


@pytest.mark.parametrize("promise", [promise for promise, _ in ROWS])
def test_the_readme_says_so(promise: str):
    assert plain(promise) in README


@pytest.mark.parametrize(("promise", "proofs"), ROWS)
def test_each_proof_exists(promise: str, proofs: str):
    found = re.findall(r"`([^`]+)`", proofs)
    assert found, promise
    for proof in found:
        path, _, name = proof.partition("::")
        if proof.startswith("fras bench "):
            assert proof.removeprefix("fras bench ") in BENCHMARKS, proof
        else:
            assert (ROOT / path).is_file(), proof
            assert not name or name in names_in(ROOT / path), proof


def test_every_row_is_read():
    rows = [line for line in PAGE.read_text().splitlines() if line.startswith("| ")]
    heads = [line for line in rows if line == "| promise | held by |"]
    assert len(heads) > 4
    assert len(rows) - len(heads) == len(ROWS) > 40
