"""Each invariant holds of a quiet trial, and is seen to fail where somebody breaks it."""

from collections.abc import Callable

import msgspec
import pytest

from fras_common.messages import RecorderEvent, RobotState, TaskStatus, TissueState, Verdict
from fras_experiments.chaos.invariants import INVARIANTS, Undisturbed, look
from support.robots import arm
from support.stories import Story, acting, event, status, story, taken

QUIET = Undisturbed("success", 0.1)
HELD = {"recorder": "away"}


def broken(told: Story, undisturbed: Undisturbed = QUIET) -> set[str]:
    return {breach.invariant for breach in look(told.evidence, undisturbed)}


def change(told: Story, kind: type, tick: int, **changes: object) -> Story:
    """Change the message of a type that is of a tick."""
    told.said = [
        (key, msgspec.structs.replace(one, **changes))
        if isinstance(one, kind) and one.tick == tick
        else (key, one)
        for key, one in told.said
    ]
    return told


def test_nothing_is_found_where_nothing_happened():
    assert look(story().evidence, QUIET) == ()


def restarted() -> Story:
    """Motion is killed after tick 4: a new one holds, takes a goal of its own, goes on."""
    told = Story([one for one in story().said if isinstance(one[1], TaskStatus) is False][:3])
    told.add("rpc/motion/execute", taken("g1"))
    for number in range(5):
        told.tick(number)
    told.add("recorder/event", event("absent", "alive/motion/a"))
    told.add("recorder/event", event("present", "alive/motion/b"))
    over = acting("interrupted")
    told.tick(4, source="motion/b", action=over, holds={"restart": "started again"})
    told.add("rpc/motion/execute", taken("g2", "motion/b"))
    for number in range(5, 10):
        told.tick(number, source="motion/b", action=acting(goal_id="g2"))
    return told.add("planner/task_status", status("success", source="planner/a"))


def test_a_restart_of_motion_breaks_nothing():
    assert look(restarted().evidence, QUIET) == ()


def begun_in_mid_stream(*listed: str, later: str = "") -> Story:
    """Each publisher has said much before the log begins; its first recorder tells who is there.

    `later` is told a tick after that.
    """
    told = Story(
        [
            (key, msgspec.structs.replace(one, seq=one.seq + 100))
            for key, one in story().numbered()
            if not isinstance(one, RecorderEvent)
        ]
    )
    first, second = [n for n, (_, one) in enumerate(told.said) if isinstance(one, RobotState)][:2]
    if later:
        told.said.insert(second + 1, ("recorder/event", event("present", later)))
    told.said[first + 1 : first + 1] = [("recorder/event", event("present", one)) for one in listed]
    return told


def test_whom_the_first_recorder_finds_was_there_before_the_log_began():
    """One that was killed before it had written anything leaves the listing to the next one."""
    told = begun_in_mid_stream("alive/motion/a", "alive/recorder/a", "alive/sim/a")
    assert look(told.evidence, QUIET) == ()


def words_of_before_from_one_that_comes_later() -> Story:
    return begun_in_mid_stream("alive/recorder/a", later="alive/motion/a")


def ends_badly() -> Story:
    return change(story(), TaskStatus, -1, outcome="failed", reason="replans")


def aborted_without_a_hold() -> Story:
    return change(story(), TaskStatus, -1, outcome="aborted", reason="no idea")


def ends_nowhere() -> Story:
    return change(story(), TaskStatus, -1, outcome="")


def lost_in_the_middle() -> Story:
    return story().without(Verdict, 4)


def lost_first_words_of_a_new_life() -> Story:
    told = restarted()
    told.said = [
        (key, msgspec.structs.replace(one, seq=one.tick + 1))
        if isinstance(one, RobotState) and one.source == "motion/b"
        else (key, one)
        for key, one in told.said
    ]
    return told


def missed_by_the_recorder() -> Story:
    return story().add("recorder/event", event("gap", "sim/tissue_state of sim/a"))


def on_an_old_verdict() -> Story:
    return change(story(), RobotState, 6, verdict_tick=4)


def on_no_verdict() -> Story:
    told = story()
    told.said = [one for one in told.said if not (isinstance(one[1], Verdict) and one[1].tick == 5)]
    return told


def on_no_tissue() -> Story:
    told = story()
    told.said = [
        one for one in told.said if not (isinstance(one[1], TissueState) and one[1].tick == 5)
    ]
    return told


def a_tick_left_out() -> Story:
    told = Story(story().said[:-1])
    told.tick(11)
    return told.add(*story().said[-1])


def a_tick_taken_back() -> Story:
    told = Story(story().said[:-1])
    told.tick(7)
    return told.add(*story().said[-1])


def moved_while_sim_was_away() -> Story:
    told = story()
    at = next(i for i, (_, one) in enumerate(told.said) if one.tick == 3)
    told.said.insert(at, ("recorder/event", event("absent", "alive/sim/a")))
    return told


def moved_while_held() -> Story:
    told = story()
    for tick in range(3, 9):
        change(told, RobotState, tick, holds=HELD)
    return told


def more_force_while_held() -> Story:
    told = story()
    for tick in (4, 5):
        change(told, RobotState, tick, holds=HELD)
    return change(told, Verdict, 5, max_force_n=0.16)


def a_goal_of_the_life_before() -> Story:
    told = restarted()
    told.said = [
        (key, msgspec.structs.replace(one, action=acting(goal_id="g1")))
        if isinstance(one, RobotState) and one.tick >= 7
        else (key, one)
        for key, one in told.said
    ]
    return told


def a_goal_that_was_refused() -> Story:
    told = story()
    told.said = [
        (key, taken("g1", accepted=False)) if key == "rpc/motion/execute" else (key, one)
        for key, one in told.said
    ]
    return told


def a_goal_taken_by_two() -> Story:
    return restarted().add("rpc/motion/execute", taken("g1", "motion/b"))


def arms_elsewhere() -> Story:
    arms = {"psm1": arm((0.0, 0.0, 0.0), 60.0), "psm2": arm((0.05, 0.09, 0.06), 60.0)}
    told = restarted()
    places = [
        i for i, (_, one) in enumerate(told.said) if isinstance(one, RobotState) and one.tick == 4
    ]
    key, again = told.said[places[1]]
    told.said[places[1]] = (key, msgspec.structs.replace(again, arms=arms))
    return told


def another_verdict() -> Story:
    told = restarted()
    places = [i for i, (_, one) in enumerate(told.said) if isinstance(one, Verdict)]
    key, again = told.said[places[5]]
    told.said[places[5]] = (key, msgspec.structs.replace(again, max_force_n=0.2))
    return told


BROKEN: list[tuple[Callable[[], Story], str]] = [
    (ends_badly, "ends"),
    (aborted_without_a_hold, "ends"),
    (ends_nowhere, "ends"),
    (lost_in_the_middle, "complete"),
    (lost_first_words_of_a_new_life, "complete"),
    (words_of_before_from_one_that_comes_later, "complete"),
    (missed_by_the_recorder, "complete"),
    (on_an_old_verdict, "interlocked"),
    (on_no_verdict, "interlocked"),
    (on_no_tissue, "interlocked"),
    (a_tick_left_out, "interlocked"),
    (a_tick_taken_back, "interlocked"),
    (moved_while_sim_was_away, "still_while_missing"),
    (moved_while_held, "held_still"),
    (more_force_while_held, "force_kept"),
    (a_goal_of_the_life_before, "fresh_commands"),
    (a_goal_that_was_refused, "fresh_commands"),
    (a_goal_taken_by_two, "fresh_commands"),
    (arms_elsewhere, "said_twice_equal"),
    (another_verdict, "said_twice_equal"),
]


@pytest.mark.parametrize(("forge", "invariant"), BROKEN, ids=[one.__name__ for one, _ in BROKEN])
def test_what_is_broken_is_found(forge: Callable[[], Story], invariant: str):
    assert invariant in broken(forge())


def test_each_invariant_is_seen_to_fail():
    assert {invariant for _, invariant in BROKEN} == set(INVARIANTS)


def test_a_named_hold_is_an_end_and_so_is_that_of_the_undisturbed_trial():
    held = change(story(), TaskStatus, -1, outcome="aborted", reason="hold:sim")
    assert broken(held) == set()
    assert broken(ends_badly(), Undisturbed("failed", 0.1)) == set()


def test_what_was_under_way_may_arrive():
    told = story()
    at = next(i for i, (_, one) in enumerate(told.said) if one.tick == 8)
    told.said.insert(at, ("recorder/event", event("absent", "alive/sim/a")))
    assert broken(told) == set()


def test_a_stop_takes_two_ticks_and_the_one_under_way_and_a_release_goes_on():
    told = story()
    for tick in range(3, 7):
        change(told, RobotState, tick, holds=HELD)
    assert broken(told) == set()
    opening = moved_while_held()
    for tick in range(3, 9):
        change(opening, RobotState, tick, action=acting(name="release"))
    assert broken(opening) == set()


def test_without_a_state_there_is_nothing_complete():
    told = Story(story().said[:3] + story().said[-1:])
    assert broken(told) == {"complete"}
