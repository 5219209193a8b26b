from typing import Any

import pytest

from fras_sim.stress import Tally, main, stress

WORSE: list[dict[str, Any]] = [{"converged": 998}, {"finite": 999}, {"furthest_m": 2e-4}]


def test_a_short_stress_run_breaks_nothing():
    tally = stress(1200, (9, 11, 2), seed=3)
    assert tally.steps >= 1200
    assert tally.episodes >= 3
    assert tally.passed, str(tally)


def test_the_command_prints_and_says_so(capsys: pytest.CaptureFixture[str]):
    assert main(["--steps", "1", "--nodes", "5", "6", "2", "--seed", "1"]) == 0
    assert "passed" in capsys.readouterr().out


def test_what_breaks_is_not_passed():
    good: dict[str, Any] = {"steps": 1000, "converged": 1000, "finite": 1000, "furthest_m": 1e-5}
    assert Tally(**good).passed
    for worse in WORSE:
        assert not Tally(**{**good, **worse}).passed
