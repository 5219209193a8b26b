"""`fras bench`: what there is, what there is not, and the benchmarks' own options."""

import importlib.util
import runpy
import subprocess
import sys
from types import SimpleNamespace

import pytest
from typer.testing import CliRunner

from fras_cli import bench
from fras_cli.app import app


def test_the_list_names_every_benchmark():
    shown = CliRunner().invoke(app, ["bench"])
    assert shown.exit_code == 0
    assert all(f"fras bench {name}" in shown.output for name in bench.BENCHMARKS)


@pytest.fixture
def here(monkeypatch):
    """Run in this process what has one of its own: what all of them load is loaded once."""

    def run(command, env, check):
        executable, flag, module, *arguments = command
        assert (executable, flag, check) == (sys.executable, "-m", False)
        assert env
        monkeypatch.setattr(sys, "argv", [module, *arguments])
        with pytest.raises(SystemExit) as ended:
            runpy.run_module(module, run_name="__main__")
        return SimpleNamespace(returncode=ended.value.code)

    monkeypatch.setattr(bench, "subprocess", SimpleNamespace(run=run))


# Of one that another one uses too.
@pytest.mark.filterwarnings("ignore:.*found in sys.modules:RuntimeWarning")
@pytest.mark.usefixtures("here")
@pytest.mark.parametrize("name", bench.BENCHMARKS)
def test_each_takes_options_of_its_own(name, capfd):
    if name in ("fe", "motion", "hosts") and importlib.util.find_spec("matplotlib") is None:
        pytest.skip("matplotlib is not installed")
    assert bench.run_benchmark(name, ["--help"]) == 0
    assert f"usage: fras bench {name}" in capfd.readouterr().out


def test_one_of_the_checkout_has_a_process_of_its_own(capfd, monkeypatch, tmp_path):
    monkeypatch.chdir(tmp_path)
    assert bench.run_benchmark("criteria", ["--help"]) == 0
    assert "usage: fras bench criteria" in capfd.readouterr().out


def test_options_reach_it_through_the_command(capfd):
    result = subprocess.run(
        [sys.executable, "-m", "fras_cli", "bench", "stress", "--steps", "1", "--nodes", "x"],
        check=False,
        capture_output=True,
        text=True,
    )
    assert result.returncode == 2
    assert "--nodes" in result.stderr


def test_an_unknown_one_is_named_with_the_known_ones():
    with pytest.raises(
        bench.UnknownBenchmark,
        match=(
            r"'fee'.*fe, mesh, stress, planner, criteria, awareness, motion, recorder, log, "
            r"replay, secure, fuzz, soak, page, loop, start, hosts"
        ),
    ):
        bench.run_benchmark("fee", [])


def test_without_a_checkout_it_says_where_they_are(monkeypatch, tmp_path):
    monkeypatch.setattr(bench, "__file__", str(tmp_path / "fras_cli" / "bench.py"))
    monkeypatch.chdir(tmp_path)
    with pytest.raises(bench.NoCheckout, match="checkout"):
        bench.run_benchmark("fe", [])
