"""Liveliness tokens: who is there, who is ready, who has gone; the same on both buses."""

from collections.abc import Callable
from typing import Any

from fras_common.bus import Bus

Open = Callable[..., Bus]
Listen = Callable[[], Any]


def test_a_token_appears_and_goes_with_its_bus(open_bus: Open, listen: Listen):
    seen = listen()
    open_bus("cli/1").watch_tokens(seen)
    service = open_bus("sim/3f")
    service.announce("alive/sim")
    assert seen.count(1) == [("alive/sim/3f", True)]
    service.announce("ready/sim")
    assert seen.count(2)[1] == ("ready/sim/3f", True)
    service.close()
    assert sorted(seen.count(4)[2:]) == [("alive/sim/3f", False), ("ready/sim/3f", False)]


def test_tokens_present_come_first(open_bus: Open, listen: Listen):
    first, late = listen(), listen()
    open_bus("cli/1").watch_tokens(first)
    open_bus("sim/1").announce("alive/sim")
    open_bus("sa/1").announce("ready/sa")
    first.count(2)
    open_bus("cli/2").watch_tokens(late)
    assert sorted(late.count(2)) == [("alive/sim/1", True), ("ready/sa/1", True)]
    open_bus("motion/1").announce("alive/motion")
    assert late.count(3)[2] == ("alive/motion/1", True)


def test_a_bus_sees_its_own_token(open_bus: Open, listen: Listen):
    seen = listen()
    bus = open_bus("sim/1")
    bus.watch_tokens(seen)
    bus.announce("alive/sim")
    assert seen.count(1) == [("alive/sim/1", True)]


def test_two_instances_are_told_apart(open_bus: Open, listen: Listen):
    seen = listen()
    open_bus("cli/1").watch_tokens(seen)
    old, new = open_bus("sim/old"), open_bus("sim/new")
    old.announce("alive/sim")
    seen.count(1)
    new.announce("alive/sim")
    seen.count(2)
    old.close()
    assert seen.count(3) == [
        ("alive/sim/old", True),
        ("alive/sim/new", True),
        ("alive/sim/old", False),
    ]


def test_tokens_stay_within_their_cell(open_bus: Open, listen: Listen):
    here, there = listen(), listen()
    open_bus("cli/1", cell="one").watch_tokens(here)
    open_bus("cli/2", cell="two").watch_tokens(there)
    open_bus("sim/1", cell="one").announce("alive/sim")
    here.count(1)
    open_bus("sim/2", cell="two").announce("alive/sim")
    assert there.count(1) == [("alive/sim/2", True)]
    assert here == [("alive/sim/1", True)]


def test_a_watcher_that_left_hears_no_more(open_bus: Open, listen: Listen):
    gone, stays = listen(), listen()
    leaver = open_bus("cli/1")
    leaver.watch_tokens(gone)
    open_bus("cli/2").watch_tokens(stays)
    leaver.close()
    open_bus("sim/1").announce("alive/sim")
    stays.count(1)
    assert gone == []
