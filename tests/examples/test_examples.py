"""The examples that need no service, run as a newcomer runs them; the others: tests/system."""

import ast
import re
import subprocess
import sys
import tokenize
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
FOLDER = ROOT / "examples"
EXAMPLES = [
    "bridge.py",
    "finite_elements.py",
    "own_rule.py",
    "plan_by_hand.py",
    "read_log.py",
    "watch_force.py",
]
MAKES_FILES = {"make_slab.py"}


def run(name: str, folder: Path, *arguments: str) -> str:
    done = subprocess.run(
        [sys.executable, str(FOLDER / name), *arguments],
        cwd=folder,
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    return done.stdout


def test_each_one_is_named_here() -> None:
    assert {path.name for path in FOLDER.glob("*.py")} == {*EXAMPLES, *MAKES_FILES}


@pytest.mark.parametrize("name", EXAMPLES)
def test_it_says_how_it_is_run_and_what_one_sees_and_is_made_of_cells(name: str) -> None:
    text = (FOLDER / name).read_text(encoding="utf-8")
    told = ast.get_docstring(ast.parse(text)) or ""
    assert f"python examples/{name}" in told
    assert re.search(r"\b[Oo]ne sees\b", told)
    assert len(re.findall(r"^ *# %% \S", text, re.MULTILINE)) >= 2


@pytest.mark.parametrize("name", EXAMPLES)
def test_readme_links_to_it(name: str) -> None:
    assert f"examples/{name}" in (ROOT / "README.md").read_text(encoding="utf-8")


def test_a_client_that_watches_the_force_is_twenty_lines() -> None:
    with (FOLDER / "watch_force.py").open("rb") as file:
        tokens = list(tokenize.tokenize(file.readline))
    aside = {tokenize.COMMENT, tokenize.NL, tokenize.NEWLINE, tokenize.INDENT, tokenize.DEDENT}
    aside |= {tokenize.ENCODING, tokenize.ENDMARKER}
    lines = {one.start[0] for one in tokens if one.type not in aside and '"""' not in one.string}
    assert len(lines) <= 20


def test_the_force_grows_faster_than_the_height_and_with_the_stiffness(tmp_path: Path) -> None:
    lines = run("finite_elements.py", tmp_path).splitlines()[1:]
    rows = [[float(number) for number in re.findall(r"\d+(?:\.\d+)?", line)] for line in lines]
    heights_mm, tool_mn, node_mn, stiff_mn = zip(*rows, strict=True)
    assert heights_mm == tuple(range(0, 32, 2))
    assert list(tool_mn) == sorted(tool_mn)
    assert tool_mn[-1] > 4 * tool_mn[7] > 0
    assert all(one > 0 for one in node_mn[1:])
    for soft, stiff in zip(tool_mn, stiff_mn, strict=True):
        # An equilibrium is found to a tolerance, and printed to a thousandth.
        assert stiff == pytest.approx(2 * soft, rel=0.01, abs=2e-3)


def test_a_rule_of_ones_own_holds_from_some_tick_on_with_its_numbers(tmp_path: Path) -> None:
    *told, last = run("own_rule.py", tmp_path).splitlines()
    assert told
    for line in told:
        found = re.fullmatch(
            r"tick (\d+): overstretched\(b\(\d,\d\)\), (\d\.\d\d) of its length at rest; "
            r"force (\d\.\d\d) N, verdict (ok|soft|hard)",
            line,
        )
        assert found, line
        assert int(found[1]) > 0
        assert float(found[2]) >= 1.25
    assert "closed_gripper(psm1)" in last
    assert "in_hand(psm1," in last
    assert "overstretched(" in last


def test_a_context_by_hand_is_planned_for_and_explained(tmp_path: Path) -> None:
    text = run("plan_by_hand.py", tmp_path)
    plan, block, action = re.split(r"\n\nWhy not .*\?\n", text)
    assert [line.split()[1] for line in plan.splitlines()[:3]] == [
        "reach(psm2,b(2,2))",
        "grasp(psm2,b(2,2))",
        "pull(psm2,b(2,2))",
    ]
    assert "best of 7 candidate blocks under the criterion 'capped'" in plan
    assert "attachment point" in block
    assert "psm1 holds no tissue" in action
    assert text.splitlines()[-1] == "At the limit: move(psm2,b(2,2))"
