"""Sdist and wheel: what they hold, and that FRAS runs from a wheel, far from its checkout."""

import json
import os
import subprocess
import sys
import tarfile
import zipfile
from collections.abc import Iterator
from dataclasses import dataclass
from email.message import Message
from email.parser import Parser
from pathlib import Path

import pytest
from release.pins import ROOT, extras_of_fras

from fras_common.commit import FILE, commit, commit_of
from fras_common.shipped import shipped
from support.environments import environment_without_fras, install_wheel

PLACES = {"asp": "fras_planner/asp", "compose": "fras_supervisor/compose"}
COMMIT = f"fras_common/{FILE}"


@dataclass(frozen=True)
class Built:
    """A checkout's distributions.

    Parameters
    ----------
    wheel_of_sdist : Path
        Made from the sdist, as a distributor does.
    """

    sdist: Path
    wheel: Path
    wheel_of_sdist: Path


def build(source: Path, out: Path, *kinds: str) -> None:
    command = [sys.executable, "-m", "build", "--no-isolation", "--outdir", str(out), *kinds]
    subprocess.run([*command, str(source)], check=True, capture_output=True)


@pytest.fixture(scope="module")
def built(tmp_path_factory: pytest.TempPathFactory) -> Built:
    folder = tmp_path_factory.mktemp("dist")
    build(ROOT, folder, "--sdist", "--wheel")
    (sdist,), (wheel,) = folder.glob("*.tar.gz"), folder.glob("*.whl")
    with tarfile.open(sdist) as archive:
        archive.extractall(folder, filter="data")
    build(folder / sdist.name.removesuffix(".tar.gz"), folder / "again", "--wheel")
    return Built(sdist, wheel, folder / "again" / wheel.name)


def files(folder: Path) -> Iterator[Path]:
    for path in folder.rglob("*"):
        if path.is_file() and "__pycache__" not in path.parts and path.suffix != ".pyc":
            yield path.relative_to(folder)


@pytest.fixture(scope="module")
def metadata(built: Built) -> Message:
    with zipfile.ZipFile(built.wheel) as wheel:
        (name,) = (name for name in wheel.namelist() if name.endswith(".dist-info/METADATA"))
        return Parser().parsestr(wheel.read(name).decode())


def test_a_wheel_holds_all_of_the_services_the_rules_and_what_starts_them(built: Built) -> None:
    expected = {str(path) for folder in (ROOT / "services").iterdir() for path in files(folder)} | {
        f"{to}/{path}" for name, to in PLACES.items() for path in files(ROOT / name)
    }
    with zipfile.ZipFile(built.wheel) as wheel:
        inside = {name for name in wheel.namelist() if ".dist-info/" not in name}
    assert inside - {COMMIT} == expected
    # Of each kind one, should the folders themselves be empty one day.
    assert {
        "fras_planner/asp/domain.lp",
        "fras_supervisor/compose/local.toml",
        "fras_supervisor/compose/scenarios/default.toml",
        "fras_supervisor/compose/meshes/slab.vtu",
        "fras_experiments/campaign/shipped/retraction.toml",
        "fras_monitor/page/static/page.html",
        "fras_cli/report/template.html.j2",
    } <= inside


def test_the_sdist_makes_the_same_wheel_to_the_byte(built: Built) -> None:
    assert built.wheel.read_bytes() == built.wheel_of_sdist.read_bytes()


def test_the_sdist_holds_what_tests_and_checks_need(built: Built) -> None:
    with tarfile.open(built.sdist) as archive:
        inside = {name.partition("/")[2] for name in archive.getnames()}
    for folder in ("asp", "benchmarks", "compose", "docs", "examples", "release", "tests"):
        here = {f"{folder}/{path}" for path in files(ROOT / folder)}
        assert here <= inside | {name for name in here if name.endswith((".mcap", ".nbi", ".nbc"))}
    assert {"Makefile", "constraints.txt", "CHANGELOG.md", "README.md", "LICENSE"} <= inside


def test_both_know_their_commit_where_the_checkout_does(built: Built) -> None:
    known = commit_of(ROOT)
    assert commit() == known
    with zipfile.ZipFile(built.wheel) as wheel:
        written = wheel.read(COMMIT).decode().strip() if COMMIT in wheel.namelist() else ""
    assert written == known


def test_no_commit_is_made_up(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    assert commit_of(tmp_path) == ""
    (tmp_path / ".git").mkdir()
    assert commit_of(tmp_path) == ""
    monkeypatch.setenv("PATH", str(tmp_path))
    (tmp_path / "git").write_text("not a program")
    assert commit_of(tmp_path) == ""


def test_its_metadata_names_python_licence_command_and_extras(
    built: Built, metadata: Message
) -> None:
    assert metadata["Requires-Python"] == ">=3.11"
    assert metadata["License-Expression"] == "Apache-2.0"
    assert metadata["License-File"] == "LICENSE"
    assert set(metadata.get_all("Provides-Extra", [])) == set(extras_of_fras()) - {""}
    with zipfile.ZipFile(built.wheel) as wheel:
        (name,) = (name for name in wheel.namelist() if name.endswith("entry_points.txt"))
        assert "fras = fras_cli.__main__:main" in wheel.read(name).decode()


def test_a_shipped_folder_that_is_nowhere_is_where_a_wheel_would_have_it(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    assert (shipped("asp") / "domain.lp").is_file()
    monkeypatch.setattr(Path, "is_dir", lambda path: False)
    assert shipped("asp").parts[-2:] == ("fras_planner", "asp")


def test_a_wheel_runs_a_trial_by_the_rules_and_scenarios_that_it_brought(
    built: Built, tmp_path: Path
) -> None:
    python = environment_without_fras(tmp_path / "venv")
    install_wheel(python, built.wheel)
    home = tmp_path / "home"
    home.mkdir()
    environment = {"HOME": str(home), "PATH": os.defpath, "COLUMNS": "200"}

    def fras(*arguments: str) -> str:
        done = subprocess.run(
            [python.parent / "fras", *arguments],
            cwd=home,
            env=environment,
            capture_output=True,
            text=True,
            check=False,
        )
        assert done.returncode == 0, done.stdout + done.stderr
        return done.stdout

    where = "import fras_common.shipped as s; print(s.__file__, s.shipped('asp'), sep='\\n')"
    here = subprocess.run([python, "-c", where], env=environment, capture_output=True, text=True)
    assert here.stdout.count(str(tmp_path / "venv")) == 2
    facts = json.loads(fras("--version", "--json"))
    assert facts["commit"] == (commit_of(ROOT) or None)
    scenario = fras("scenario", "new", "--seed", "3")
    (home / "mine.toml").write_text(scenario)
    fras("scenario", "check", "mine.toml")
    assert "retraction" in fras("experiment", "--list")
    summary = json.loads(
        fras("run", "a", "--mesh", "11,13,2", "--pace", "0", "--out", "out", "--json")
    )
    assert summary["outcome"] == "success"
    about = fras("log", "info", "out", "--json")
    assert facts["rules"] in about
    assert str(ROOT) not in about
    assert {path.name for path in (home / "out").iterdir()} >= {"report.html", "audit.mcap"}
