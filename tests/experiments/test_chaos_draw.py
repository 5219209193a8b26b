"""The draw: the same for the same seed, and in time everything comes."""

from collections import Counter

import pytest

from fras_experiments.chaos.draw import CARDS, draw
from fras_experiments.chaos.faults import KINDS, VICTIMS, WATCHDOG_S, Stretch
from fras_supervisor import find_table, load_table

COURSE = (
    Stretch("reach/traverse", 1, 100),
    Stretch("grasp/close", 101, 4),
    Stretch("pull/lift", 105, 200),
)
TOLD = [
    "kill planner at tick 101 (grasp/close)",
    "clock of sim -697 s at tick 27 (reach/traverse)",
    "kill router at tick 163 (pull/lift)",
    "disk full in 145 kB at tick 196 (pull/lift)",
    "delay sim 78 ms for 1.6 s at tick 6 (reach/traverse)",
    "pause sim 1.1 s at tick 102 (grasp/close)",
    "delay sim 65 ms for 2.0 s at tick 104 (grasp/close)",
    "disk full in 149 kB at tick 164 (pull/lift)",
]


def test_the_same_seed_draws_the_same_faults():
    first = [draw(7, number, KINDS, COURSE) for number in range(50)]
    assert first == [draw(7, number, tuple(reversed(KINDS)), COURSE) for number in range(50)]
    assert first != [draw(8, number, KINDS, COURSE) for number in range(50)]


def test_this_is_what_a_seed_draws():
    # A change here draws other faults for every campaign that somebody has noted by its seed.
    told = [fault.in_words() for number in range(6) for fault in draw(1, number, KINDS, COURSE)]
    assert told == TOLD


@pytest.mark.parametrize("seed", range(20))
def test_ten_trials_meet_every_kind(seed: int):
    drawn = {fault.kind for number in range(10) for fault in draw(seed, number, KINDS, COURSE)}
    assert drawn == set(KINDS)


@pytest.mark.parametrize("seed", range(5))
def test_a_hundred_trials_meet_every_victim_of_every_kind(seed: int):
    faults = [fault for number in range(100) for fault in draw(seed, number, KINDS, COURSE)]
    drawn = {(fault.kind, fault.victim) for fault in faults}
    assert drawn == {(kind, victim) for kind, cards in CARDS.items() for victim, _ in cards}
    pauses = [fault.lasts_s for fault in faults if fault.kind == "pause"]
    assert min(pauses) < WATCHDOG_S < max(pauses)
    jumps = [fault.amount for fault in faults if fault.kind == "clock"]
    assert min(jumps) < 0 < max(jumps)


def test_a_phase_is_hit_however_short_it_is():
    phases = Counter(f.phase for n in range(300) for f in draw(3, n, KINDS, COURSE))
    assert min(phases[one.name] for one in COURSE) > 0.2 * phases.total()


def test_faults_come_in_order_within_their_phase_and_each_kind_once():
    several = 0
    for number in range(200):
        faults = draw(4, number, KINDS, COURSE)
        assert [fault.tick for fault in faults] == sorted(fault.tick for fault in faults)
        assert len({fault.kind for fault in faults}) == len(faults)
        several += len(faults) > 1
        for fault in faults:
            (stretch,) = [one for one in COURSE if one.name == fault.phase]
            assert stretch.first <= fault.tick < stretch.first + stretch.ticks
    assert 40 < several < 120


def test_only_what_is_asked_for_is_drawn():
    faults = [fault for number in range(30) for fault in draw(1, number, ("kill",), COURSE)]
    assert {(fault.kind, fault.victim) for fault in faults} == {("kill", one) for one in VICTIMS}


@pytest.mark.parametrize(("kinds", "course"), [((), COURSE), (KINDS, ())])
def test_nothing_to_draw_is_refused(kinds, course):
    with pytest.raises(ValueError, match="at least one"):
        draw(1, 0, kinds, course)


def test_pauses_are_long_by_the_watchdog_of_the_table():
    processes = load_table(find_table("local")).processes
    assert {process.watchdog_s for process in processes.values()} == {WATCHDOG_S}
    assert set(processes) == {*VICTIMS, "router"}
