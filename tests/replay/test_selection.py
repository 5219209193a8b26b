"""Which keys go out, under which names."""

import pytest

from fras_replay.errors import BadKey
from fras_replay.selection import Selection, fits, parse_remap

KEYS = ["sim/tissue_state", "sim/checkpoint", "robot/state", "health/sim", "rpc/sim/reset"]


@pytest.mark.parametrize(
    ("pattern", "key", "matches"),
    [
        ("robot/state", "robot/state", True),
        ("robot/state", "robot/states", False),
        ("sim/**", "sim/tissue_state", True),
        ("sim/**", "sim", True),
        ("sim/**", "simulated/x", False),
        ("**", "rpc/sim/reset", True),
        ("**/reset", "rpc/sim/reset", True),
        ("rpc/*/reset", "rpc/sim/reset", True),
        ("rpc/*", "rpc/sim/reset", False),
        ("*/state", "robot/state", True),
        ("psm1.x", "psm1ax", False),
    ],
)
def test_patterns(pattern: str, key: str, matches: bool):
    assert fits(pattern, key) == matches


def test_nothing_asked_for_is_everything():
    assert Selection().choose(KEYS) == {key: key for key in KEYS}


def test_included_but_for_what_is_excluded():
    chosen = Selection(include=["sim/**", "robot/state"], exclude=["sim/checkpoint"]).choose(KEYS)
    assert list(chosen) == ["sim/tissue_state", "robot/state"]


def test_keys_and_families_get_other_names():
    selection = Selection(remap=[("sim/tissue_state", "patient/tissue_state"), ("rpc/**", "q/**")])
    chosen = selection.choose(KEYS)
    assert chosen["sim/tissue_state"] == "patient/tissue_state"
    assert chosen["rpc/sim/reset"] == "q/sim/reset"
    assert chosen["sim/checkpoint"] == "sim/checkpoint"


def test_what_an_earlier_replay_said_of_itself_is_left_out():
    keys = ["health/replay", "log/replay", "rpc/replay/control", "replay/plan", "health/replays"]
    assert list(Selection().choose(keys)) == ["replay/plan", "health/replays"]


@pytest.mark.parametrize(
    "selection",
    [
        Selection(include=["sim/tisue_state"]),
        Selection(exclude=["sa/**"]),
        Selection(remap=[("sa/verdict", "x")]),
        Selection(remap=[("sim/checkpoint", "robot/state")]),
        Selection(remap=[("robot/state", "robot/*")]),
        Selection(remap=[("robot/state", "/robot")]),
        Selection(remap=[("robot/state", "health/replay")]),
    ],
    ids=str,
)
def test_a_selection_that_does_not_fit_is_refused(selection: Selection):
    with pytest.raises(BadKey):
        selection.choose(KEYS)


@pytest.mark.parametrize("text", ["a", "a=", "=b", "a/**=b", "a=b/**", "a/*/b=c"])
def test_a_renaming_that_is_none_is_refused(text: str):
    with pytest.raises(BadKey):
        parse_remap(text)


def test_a_renaming():
    assert parse_remap("sim/**=patient/**") == ("sim/**", "patient/**")
