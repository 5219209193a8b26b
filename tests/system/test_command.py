"""The `fras` command as a person uses it: real processes, real signals, real mistakes."""

import json
import os
import shutil
import signal
import socket
from collections.abc import Callable
from pathlib import Path
from typing import Any

import psutil
import pytest

from fras_cli.report import Summary, read_trial, summarise
from support.logs import assert_same_trial, messages
from support.tables import table_with

# A trial without a patient tells of none.
FIELDS = set(Summary.__struct_fields__) - {"patient", "detail"}
Fras = Callable[..., Any]
# What is to be seen of the command does not hang on the mesh: a coarse one costs less.
COARSE = ("--mesh", "11,13,2")


def summary_of(folder: Path) -> dict[str, Any]:
    return json.loads((folder / "summary.json").read_text())


def test_two_stacks_side_by_side_run_the_same_trial_and_hear_only_themselves(
    fras: Fras, tmp_path: Path
) -> None:
    for name in ("one", "two"):
        (tmp_path / name).mkdir()
    commands = {
        name: fras("run", "a", *COARSE, "--pace", pace, "--cell", name, "--out", name, "--json")
        for name, pace in (("one", "0"), ("two", "3"))  # pacing changes nothing
    }
    assert {name: command.end() for name, command in commands.items()} == {"one": 0, "two": 0}
    for name in ("one", "two"):
        folder = tmp_path / name
        assert set(summary_of(folder)) == FIELDS
        assert summary_of(folder)["outcome"] == "success"
        assert summary_of(folder)["startup_s"] < 60
        assert (folder / "report.html").stat().st_size > 10_000
        assert (folder / "scenario.toml").exists()
        assert {path.stem for path in (folder / "logs").glob("*.log")} >= {"sim", "sa", "motion"}
        states = messages(folder / "audit.mcap", "robot/state")
        assert len({state.source for state in states}) == 1
    assert_same_trial(tmp_path / "one" / "audit.mcap", tmp_path / "two" / "audit.mcap")


def test_ctrl_c_in_mid_pull_leaves_a_readable_log_and_no_process(
    fras: Fras, tmp_path: Path
) -> None:
    command = fras("run", "a", *COARSE, "--out", "out")
    command.until("lifting")
    assert len(command.note_family()) >= 6
    command.process.send_signal(signal.SIGINT)
    assert command.end() == 130
    assert command.alone()
    assert summary_of(tmp_path / "out")["outcome"] == "aborted"
    assert summary_of(tmp_path / "out")["complete"]
    assert (
        messages(tmp_path / "out" / "audit.mcap", "motion/action_result")[-1].reason == "cancelled"
    )
    assert not list((tmp_path / "out").glob(".*"))


def test_killed_command_leaves_no_process_and_what_was_flushed(
    fras: Fras, tmp_path: Path, wait_until: Callable[..., Any]
) -> None:
    command = fras("run", "a", *COARSE, "--out", "out")
    command.until("lifting")
    command.note_family()
    command.process.kill()
    command.end()
    wait_until(command.alone, "all processes gone")
    trial = read_trial(tmp_path / "out" / "audit.mcap")
    assert summarise(trial).outcome == "aborted"
    assert len(trial.robot) > 50


def test_service_that_is_lost_in_mid_trial_is_named_and_the_log_is_readable(
    fras: Fras, tmp_path: Path
) -> None:
    never = table_with(tmp_path, sim={"restart": "never"})
    command = fras("run", "a", *COARSE, "--out", "out", "--compose", never)
    command.until("lifting")
    simulator = next(one for one in command.note_family() if "fras_sim" in one.cmdline())
    simulator.kill()
    assert command.end() == 3
    assert "sim was given up: it ended by signal 9" in command.text
    assert command.alone()
    assert summary_of(tmp_path / "out")["outcome"] == "aborted"
    assert (tmp_path / "out" / "report.html").exists()
    assert len(read_trial(tmp_path / "out" / "audit.mcap").robot) > 50


BAD_SCENARIOS = {
    "[tissue]\nyoung_modulus_kpa = 3\n": ("tissue.young_modulus_kpa", "young_modulus_pa"),
    "[tissue]\nsize_m = [100, 120, 5]\n": ("tissue.size_m", "<= 1.0"),
    "[tissue]\nnode_counts = [1, 1, 1]\n": ("tissue.node_counts", ">= 2"),
    "[scene]\nroi_m = [0.2, 0.06, 0.0]\n": ("scene.roi_m", "0.1"),
    "[planner]\ncriterion = 'best'\n": ("planner.criterion", "weighted"),
    "pace = 1\n": ("pace", "unknown key"),
    "[run\n": ("file", "not TOML"),
}


@pytest.mark.parametrize("text", BAD_SCENARIOS, ids=lambda text: text.replace("\n", " "))
def test_bad_scenario_is_named_before_anything_starts(
    fras_here: Fras, tmp_path: Path, text: str
) -> None:
    (tmp_path / "bad.toml").write_text(text)
    command = fras_here("run", "bad.toml", "--out", "out")
    assert command.status == 2
    key, hint = BAD_SCENARIOS[text]
    assert "bad.toml" in command.text
    assert key in command.text
    assert hint in command.text
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize(
    "arguments",
    [
        ("--mesh", "21,25"),
        ("--seeds", "3"),
        ("--seeds", "1..2", "--seed", "3"),
        ("--pace", "-1"),
        ("nowhere.toml",),
        ("nothing",),
        ("--cell", "a b"),
        ("--connect", "localhost:7447"),
    ],
)
def test_bad_option_is_named_before_anything_starts(
    fras_here: Fras, tmp_path: Path, arguments: tuple[str, ...]
) -> None:
    command = fras_here("run", *arguments, "--out", "out")
    assert command.status == 2
    assert arguments[-1] in command.text
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize(
    "arguments", [("run", "a", "--out", "file"), ("report", "file/audit.mcap", "--out", "file")]
)
def test_folder_that_can_not_be_written_is_one_line(
    fras_here: Fras, tmp_path: Path, arguments: tuple[str, ...]
) -> None:
    (tmp_path / "file").write_text("in the way")
    command = fras_here(*arguments)  # another error than those it knows would be raised here
    assert command.status in {1, 2}
    assert "Traceback" not in command.text
    assert "file" in command.text


def test_taken_port_is_named(fras: Fras) -> None:
    with socket.socket() as listener:
        listener.bind(("127.0.0.1", 0))
        listener.listen()
        port = listener.getsockname()[1]
        command = fras("run", "a", "--port", str(port))
        assert command.end() == 3
    assert str(port) in command.text
    assert not psutil.Process(os.getpid()).children()[1:] or command.alone()


def test_missing_extra_is_named_and_everything_stopped(
    fras: Fras, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "clingo.py").write_text("raise ModuleNotFoundError('none', name='clingo')\n")
    monkeypatch.setenv("PYTHONPATH", str(tmp_path))
    command = fras("run", "a")
    assert command.end() == 3
    assert "fras[planner]" in command.text


def test_up_status_stop_resume_run_down(fras: Fras, fras_here: Fras, tmp_path: Path) -> None:
    from fras_supervisor import free_port

    stack = fras("up", "--cell", "here", "--port", str(free_port()))
    stack.until("ready after")
    stack.note_family()
    status = fras("status", "--cell", "here")
    assert status.end() == 0
    assert status.text.count("ready") == 6
    again = fras_here("up", "--cell", "here")
    assert again.status == 3
    assert "has a stack already" in again.text
    seeds = ("--seeds", "1..2", *COARSE, "--pace", "0")
    many = fras("run", *seeds, "--cell", "here", "--out", "out", "--json")
    assert many.end() == 0
    assert [json.loads(one)["seed"] for one in many.text.splitlines() if one[0] == "{"] == [1, 2]
    assert summary_of(tmp_path / "out" / "seed-2")["outcome"] == "success"
    why_not = fras("why-not", "b(1,1)", "--cell", "here")
    assert why_not.end() == 0
    assert "Why not b(1,1)" in why_not.text
    unknown = fras_here("why-not", "fly(psm1)", "--cell", "here")
    assert unknown.status == 1
    assert "release(arm)" in unknown.text
    stop = fras("stop", "--cell", "here", "--reason", "look first")
    assert stop.end() == 0
    assert "held by cli: look first" in stop.text
    resume = fras("resume", "--cell", "here")
    assert resume.end() == 0
    assert "no hold" in resume.text
    down = fras("down", "--cell", "here")
    assert down.end() == 0
    assert stack.end() == 0
    assert stack.alone()
    assert fras_here("down", "--cell", "here").status == 3


def test_an_interrupt_while_services_load_is_silent_and_leaves_nobody(
    fras: Fras, tmp_path: Path, wait_until: Callable[[Callable[[], Any], str], Any]
) -> None:
    from fras_supervisor import free_port

    stack = fras("up", "--cell", "hasty", "--port", str(free_port()))
    logs = tmp_path / "runs" / "up-hasty" / "logs"
    wait_until((logs / "planner.log").exists, "all are launched")
    stack.note_family()
    stack.process.send_signal(signal.SIGINT)
    assert stack.end() == 130
    assert stack.alone()
    said = stack.text + "".join(one.read_text() for one in logs.iterdir())
    assert "Traceback" not in said
    assert "KeyboardInterrupt" not in said


def test_log_is_never_written_over(fras: Fras, tmp_path: Path) -> None:
    (tmp_path / "out").mkdir()
    (tmp_path / "out" / "audit.mcap").write_text("precious")
    command = fras("run", "a", "--out", "out")
    assert command.end() == 2
    assert "never written over" in command.text
    assert (tmp_path / "out" / "audit.mcap").read_text() == "precious"


def test_service_that_dies_in_mid_trial_comes_back_and_the_trial_has_a_named_end(
    fras: Fras, tmp_path: Path
) -> None:
    command = fras("run", "a", *COARSE, "--out", "out")
    command.until("lifting")
    next(one for one in command.note_family() if "fras_sa" in one.cmdline()).kill()
    command.until("supervisor: sa ended by signal 9: starts again")
    command.until("supervisor: sa ready")
    command.note_family()
    assert command.end() in {0, 1}
    assert command.alone()
    assert summary_of(tmp_path / "out")["outcome"] in {"success", "aborted"}
    assert summary_of(tmp_path / "out")["complete"]


def test_run_on_a_stack_that_goes_away_ends_and_says_so(fras: Fras, tmp_path: Path) -> None:
    from fras_supervisor import free_port

    never = table_with(tmp_path, sim={"restart": "never"})
    stack = fras("up", "--cell", "doomed", "--port", str(free_port()), "--compose", never)
    stack.until("ready after")
    run = fras("run", "a", *COARSE, "--cell", "doomed", "--out", "out")
    run.until("lifting")
    next(one for one in stack.note_family() if "fras_sim" in one.cmdline()).kill()
    assert run.end() == 3
    assert "in mid-trial: sim was given up, it ended by signal 9" in run.text
    # The stack stays, for whoever mends it; that it was not whole is its exit status.
    stack.until("supervisor: motion holds the arms")
    stack.process.send_signal(signal.SIGINT)
    assert stack.end() == 3
    assert stack.alone()
    assert summary_of(tmp_path / "out")["outcome"] == "aborted"


def test_scenario_new_is_one_that_runs_the_same(
    fras: Fras, fras_here: Fras, tmp_path: Path
) -> None:
    new = fras("scenario", "new", "--seed", "11", "--out", "mine.toml")
    assert new.end() == 0
    check = fras("scenario", "check", "mine.toml")
    assert check.end() == 0
    assert "seed 11" in check.text
    assert fras_here("scenario", "new", "--seed", "12", "--out", "mine.toml").status == 2
    assert "seed = 11" in (tmp_path / "mine.toml").read_text()


def test_log_info_and_report_from_the_log_alone(
    fras: Fras, fras_here: Fras, trials: Any, tmp_path: Path
) -> None:
    summary, log = trials.kept("a", mesh=COARSE[1])
    info = fras("log", "info", str(log))
    assert info.end() == 0
    assert "sim/tissue_state" in info.text
    assert f"{summary.messages} messages, 0 lost" in info.text
    report = fras("report", str(log), "--out", "again")
    assert report.end() == 0
    again = summary_of(tmp_path / "again")
    assert again["actions"] == summary.actions
    assert again["messages"] == summary.messages
    verify = fras("log", "verify", str(log))
    assert verify.end() == 0
    assert "3 actions verified: all specifications kept" in verify.text
    missing = fras_here("log", "info", "nothing.mcap")
    assert missing.status == 1
    assert "nothing.mcap" in missing.text


def test_plan_from_a_file_of_contexts(fras: Fras, fras_here: Fras, tmp_path: Path) -> None:
    examples = Path(__file__).resolve().parents[2] / "examples" / "contexts.json"
    plain = fras("plan", str(examples), "--why-not", "b(3,3)", "--criterion", "lex")
    assert plain.end() == 0
    assert "Timetable" in plain.text
    assert plain.text.count("Why not b(3,3)?") == 3
    as_json = fras_here("plan", str(examples), "--json")
    assert as_json.status == 0
    rows = json.loads(as_json.text)
    assert [row["actions"][0]["name"] for row in rows] == ["reach", "move", "release"]
    (tmp_path / "bad.json").write_text('{"names": []}')
    bad = fras_here("plan", "bad.json")
    assert bad.status == 2
    assert "bad.json: Object missing required field `blocks_m`" in bad.text
    rules = tmp_path / "rules"
    shutil.copytree(examples.parents[1] / "asp", rules)
    (rules / "goal.lp").write_text("#program check(t).\n:- query(t), not visible_roi(t.\n")
    faulty = fras_here("plan", str(examples), "--asp-dir", "rules")
    assert faulty.status == 2
    assert "rules/goal.lp:2: " in faulty.text
    assert "syntax error" in faulty.text


def test_closed_terminal_ends_a_trial_by_rules_of_ones_own_in_order(
    fras: Fras, trials: Any, tmp_path: Path
) -> None:
    """The criterion turned round: another block, and no Python touched."""
    rules = tmp_path / "rules"
    shutil.copytree(Path(__file__).resolve().parents[2] / "asp", rules)
    weighted = rules / "preferences" / "weighted.lp"
    weighted.write_text(weighted.read_text().replace("2*Gap-Roi", "Roi-2*Gap"))
    command = fras("run", "a", *COARSE, "--out", "out", "--asp-dir", "rules")
    command.until("reaching")
    command.note_family()
    command.process.send_signal(signal.SIGHUP)
    assert command.end() == 130
    assert command.alone()
    assert summary_of(tmp_path / "out")["reason"] == "interrupted at the terminal"
    _, usual = trials.kept("a", mesh=COARSE[1])
    plans = [messages(log, "planner/plan")[0] for log in (usual, tmp_path / "out" / "audit.mcap")]
    assert plans[0].actions[0].text != plans[1].actions[0].text
    (rules / "goal.lp").write_text("#program check(t).\nfoo(\n")
    faulty = fras("run", "a", "--out", "faulty", "--asp-dir", "rules")
    # Before anything starts.
    assert faulty.end() == 2
    assert "rules/goal.lp:2: syntax error" in faulty.text
    assert "died" not in faulty.text


def test_stop_reaches_the_stack_that_a_run_started_for_itself(
    fras: Fras, fras_here: Fras, tmp_path: Path
) -> None:
    run = fras("run", "a", *COARSE, "--pace", "0.5", "--out", "out", "--json")
    run.until("reaching")
    stop = fras("stop", "--reason", "look first")
    assert stop.end() == 0
    assert "stop acknowledged" in stop.text
    assert "held by cli: look first" in stop.text
    run.until("stopped by cli: look first")
    resume = fras("resume")
    assert resume.end() == 0
    assert run.end() == 0
    assert summary_of(tmp_path / "out")["outcome"] == "success"
    assert fras_here("stop").status == 3
