"""`fras chaos` on a real stack: ten fixed seeds that meet every kind of fault."""

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from fras_experiments.chaos.faults import KINDS
from fras_log import verify_file

# Chosen for what it draws: every kind, sim and motion killed, one pause beyond the watchdog.
SEED, TRIALS = "251", "10"
PATIENT = """
name = "A: pull, with patience for a busy machine"
seed = 2
[run]
peer_timeout_s = 60.0
"""
GOOD_S = 250.0


@pytest.mark.timeout(600)
def test_everything_holds_in_ten_disturbed_trials(tmp_path: Path, fras: Callable[..., Any]):
    (tmp_path / "patient.toml").write_text(PATIENT, encoding="utf-8")
    out = tmp_path / "chaos"
    options = ["--trials", TRIALS, "--seed", SEED, "--mesh", "11,13,2", "--out", str(out)]
    command = fras("chaos", "patient.toml", *options, "--json")
    status = command.process.wait(580.0)
    campaign = json.loads((out / "chaos.json").read_bytes())
    trials = campaign["trials"]
    assert [one["breaches"] for one in trials] == [[]] * int(TRIALS), command.text
    assert status == 0, command.text
    drawn = [fault for trial in trials for fault in trial["faults"]]
    assert {one["fault"]["kind"] for one in drawn if one["at_ns"]} == set(KINDS)
    # Where a disk was full the log says so, and so does the trial's end; the rest goes on.
    for trial in trials:
        full = any(one["fault"]["kind"] == "disk" and one["at_ns"] for one in trial["faults"])
        held = trial["reason"].startswith("hold:")
        assert trial["outcome"] == ("aborted" if held else "success")
        assert held or not full or trial["ticks"] >= campaign["undisturbed_ticks"]
    assert sum(one["outcome"] == "success" for one in trials) >= int(TRIALS) // 2
    # Whoever was killed is noticed: ticks stood still, and went on.
    killed = [
        one
        for trial in trials
        if trial["outcome"] == "success"
        for one in trial["faults"]
        if one["fault"]["kind"] == "kill" and one["fault"]["victim"] in ("sim", "motion")
    ]
    assert killed
    assert all(0.0 < one["recovery_s"] < GOOD_S for one in killed if one["at_ns"])
    assert json.loads(command.text.splitlines()[-1])["seed"] == int(SEED)
    for trial in trials:
        assert verify_file(out / trial["log"]).intact
    told = (out / "summary.md").read_text(encoding="utf-8")
    assert "every invariant held in each" in told
    assert (out / "recovery.png").read_bytes().startswith(b"\x89PNG")


def test_bad_input_is_named_before_anything_starts(tmp_path: Path, fras: Callable[..., Any]):
    (tmp_path / "used").mkdir()
    (tmp_path / "used" / "chaos.json").write_text("{}", encoding="utf-8")
    for arguments, said in (
        (["--faults", "kill,flood"], "some of kill,pause,router,delay,disk,clock"),
        (["--out", "used"], "used is not empty"),
        (["--mesh", "3"], "three node counts"),
    ):
        command = fras("chaos", "a", "--trials", "1", *arguments)
        assert command.end() == 2
        assert said in command.text.replace("\n", " ")
    assert sorted(one.name for one in tmp_path.iterdir() if one.is_dir()) == ["used"]
