"""`fras --version`."""

import json
import re
import subprocess
import sys

import pytest

from fras_cli import version
from fras_cli.version import print_version, version_facts
from fras_planner.knowledge import load_knowledge

FRAS = [sys.executable, "-m", "fras_cli"]


def test_it_names_what_it_was_built_from_and_runs_on() -> None:
    facts = version_facts()
    assert facts["rules"] == load_knowledge().digest
    assert facts["python"] == ".".join(map(str, sys.version_info[:3]))
    assert list(facts["libraries"]) == ["zenoh", "clingo", "pinocchio", "numpy", "mcap"]
    assert all(facts["libraries"].values())
    assert facts["commit"] is None or re.fullmatch(r"[0-9a-f]{40}(-dirty)?", facts["commit"])


def test_its_first_line_is_the_version_alone(capsys: pytest.CaptureFixture[str]) -> None:
    print_version(as_json=False)
    lines = capsys.readouterr().out.splitlines()
    assert lines[0] == f"fras {version_facts()['version']}"
    assert [line.split()[0] for line in lines[1:4]] == ["commit", "rules", "Python"]


def test_what_is_not_there_is_said_to_be_so(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(version, "commit", lambda: "")
    monkeypatch.setattr(version, "LIBRARIES", {"clingo": "no-such-distribution"})
    assert version_facts()["commit"] is None
    print_version(as_json=False)
    text = capsys.readouterr().out
    assert "commit     not known" in text
    assert "clingo     not installed" in text
    print_version(as_json=True)
    assert json.loads(capsys.readouterr().out)["libraries"] == {"clingo": None}


@pytest.mark.parametrize("order", [("--version", "--json"), ("--json", "--version")])
def test_as_json_in_either_order(order: tuple[str, ...]) -> None:
    done = subprocess.run([*FRAS, *order], check=True, capture_output=True, text=True)
    assert json.loads(done.stdout) == version_facts()


def test_json_alone_says_where_it_belongs() -> None:
    done = subprocess.run([*FRAS, "--json", "status"], check=False, capture_output=True, text=True)
    assert done.returncode == 2
    assert "it goes with --version, or behind a command" in " ".join(done.stderr.split())
