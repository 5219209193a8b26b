"""The player by itself: whatever is done to it, what goes out is the log's part, in its order."""

from array import array
from itertools import pairwise

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from fras_replay.errors import BadRate
from fras_replay.player import SLIP_NS, UNLIMITED, Player
from fras_replay.timeline import Place, Ticks, Timeline

MS = 1_000_000


def timeline_of(gaps_ms: list[int], per_tick: int = 3) -> Timeline:
    """A log whose every `per_tick` messages are a tick: a state first, a verdict last."""
    due = array("q")
    now_ns = 0
    for gap_ms in gaps_ms:
        now_ns += gap_ms * MS if due else 0
        due.append(now_ns)
    firsts = range(0, len(due), per_tick)
    lasts = range(per_tick - 1, len(due), per_tick)
    return Timeline(
        due_ns=due,
        duration_ns=now_ns,
        starts=Ticks([Place(n, due[n]) for n in firsts], list(range(len(firsts)))),
        verdicts=Ticks([Place(n + 1, due[n]) for n in lasts], list(range(len(lasts)))),
        lasting={key: array("q", found) for key, found in enumerate((firsts, lasts)) if len(found)},
    )


def player_of(timeline: Timeline, **settings: object) -> Player:
    return Player(timeline, timeline.begin, timeline.end, **settings)  # type: ignore[arg-type]


def run(player: Player, since_ns: int = 0, most: int = 4) -> tuple[list[int], Player]:
    """Play to the end, looking exactly when something is due; returns what went out."""
    sent: list[int] = []
    now_ns = since_ns
    while player.state == "playing":
        next_ns = player.next_ns()
        assert next_ns is not None
        now_ns = max(now_ns, next_ns)
        due = player.take(now_ns, most)
        for number in range(due.first, due.stop):
            assert player.rate == UNLIMITED or player.due_at_ns(number) <= now_ns
        sent += range(due.first, due.stop)
        player = due.player
    return sent, player


logs = st.lists(st.integers(0, 60), min_size=1, max_size=40).map(timeline_of)
rates = st.sampled_from([0.1, 0.5, 1.0, 3.0, 100.0, UNLIMITED])


@given(timeline=logs, rate=rates, most=st.integers(1, 9))
@settings(deadline=None)
def test_everything_goes_out_once_and_in_order(timeline: Timeline, rate: float, most: int):
    sent, player = run(player_of(timeline, rate=rate), most=most)
    assert sent == list(range(len(timeline.due_ns)))
    assert player.place(10**15) == timeline.end


@given(timeline=logs, rate=st.sampled_from([0.1, 0.5, 1.0, 3.0, 100.0]), first=st.integers(0, 9**9))
def test_the_schedule_never_falls_and_keeps_the_rate(timeline: Timeline, rate: float, first: int):
    player = player_of(timeline, rate=rate, since_ns=first)
    due = [player.due_at_ns(number) for number in range(len(timeline.due_ns))]
    assert all(one <= other for one, other in pairwise(due))
    for at_ns, clock_ns in zip(timeline.due_ns, due, strict=True):
        assert clock_ns - first == pytest.approx(at_ns / rate, abs=1.0)


@given(timeline=logs, at_ns=st.integers(0, 2_000 * MS), rate=rates)
@settings(deadline=None)
def test_a_seek_anywhere_plays_what_a_play_from_the_start_plays_from_there(
    timeline: Timeline, at_ns: int, rate: float
):
    place = timeline.at(at_ns)
    sent, _ = run(player_of(timeline, rate=rate).seek(place, 0))
    whole, _ = run(player_of(timeline, rate=rate))
    if place == timeline.end:
        assert sent == []
    else:
        assert sent == [number for number in whole if timeline.due_ns[number] >= at_ns]


@given(timeline=logs, at_ns=st.integers(0, 2_000 * MS))
def test_what_a_seek_shows_is_the_last_of_each_key_before(timeline: Timeline, at_ns: int):
    before = timeline.at(at_ns).before
    expected = [
        max(earlier)
        for messages in timeline.lasting.values()
        if (earlier := [number for number in messages if number < before])
    ]
    assert timeline.picture(before) == sorted(expected)
    silent = [key for key, found in timeline.lasting.items() if not set(found) & set(range(before))]
    assert timeline.unsaid(before) == silent


changes = st.lists(
    st.tuples(st.integers(0, 300), st.sampled_from(["pause", "play", "rate", "take"]), rates),
    max_size=30,
)


@given(timeline=logs, changes=changes)
@settings(deadline=None)
def test_rate_pause_and_play_keep_the_position_and_lose_nothing(
    timeline: Timeline, changes: list[tuple[int, str, float]]
):
    player, sent, now_ns = player_of(timeline), [], 0
    for later_ms, what, rate in changes:
        now_ns += later_ms * MS
        before = player.place(now_ns)
        if what == "take":
            due = player.take(now_ns, 4)
            sent += range(due.first, due.stop)
            player = due.player
            continue
        match what:
            case "pause":
                player = player.pause(now_ns)
            case "play" if player.state == "paused":
                player = player.play(now_ns)
            case "rate":
                player = player.at_rate(rate, now_ns)
            case _:
                pass
        assert player.place(now_ns) == before
    rest, _ = run(player.play(now_ns) if player.state == "paused" else player, now_ns)
    assert sent + rest == list(range(len(timeline.due_ns)))


@given(timeline=logs)
def test_steps_go_from_verdict_to_verdict_and_back(timeline: Timeline):
    player = player_of(timeline, state="paused")
    stops: list[Place] = [player.place(0)]
    sent: list[int] = []
    while player.state != "ended":
        due = player.step(0)
        sent += range(due.first, due.stop)
        player = due.player
        stops.append(player.place(0))
    assert sent == list(range(len(timeline.due_ns)))
    verdicts = timeline.verdicts.places
    assert stops[1:] == [*verdicts, *([] if verdicts[-1:] == [timeline.end] else [timeline.end])]
    for number in range(len(stops) - 2, -1, -1):
        player = player.back(0)
        assert player.place(0) == stops[number]
    assert player.back(0).place(0) == timeline.begin


def test_a_step_out_of_play_ends_with_the_next_verdict():
    timeline = timeline_of([20] * 9)
    player = player_of(timeline).take(75 * MS, 9).player  # within the second tick
    due = player.step(75 * MS)
    assert (due.first, due.stop) == (4, 6)
    assert due.player.state == "paused"
    assert timeline.tick(due.player.place(0)) == 1


@given(timeline=logs.filter(lambda one: one.duration_ns > 0), laps=st.integers(1, 3), rate=rates)
@settings(deadline=None)
def test_a_loop_plays_the_same_again(timeline: Timeline, laps: int, rate: float):
    player, sent, now_ns = player_of(timeline, loop=True, rate=rate), list[int](), 0
    while player.laps < laps:
        now_ns = max(now_ns, player.next_ns() or 0)
        due = player.take(now_ns, 5)
        sent += range(due.first, due.stop)
        player = due.player
    assert sent == list(range(len(timeline.due_ns))) * laps
    assert player.state == "playing"
    rest, _ = run(player.looping(loop=False), now_ns)
    assert rest == list(range(len(timeline.due_ns)))


def test_a_part_is_played_from_its_begin_to_its_end():
    timeline = timeline_of([20] * 30)
    begin, end = timeline.before_tick(3), timeline.after_tick(5)
    player = Player(timeline, begin, end, index=begin.before, at_ns=begin.at_ns)
    sent, player = run(player)
    assert sent == list(range(9, 18))
    assert player.seek(timeline.begin, 0).place(0) == begin
    assert player.seek(timeline.end, 0).place(0) == end


def test_who_can_not_keep_up_does_not_owe_for_ever():
    timeline = timeline_of([10] * 100)
    now_ns = SLIP_NS + 200 * MS
    player = player_of(timeline).take(now_ns, 1).player
    assert player.place(now_ns).at_ns == timeline.due_ns[1]
    late = SLIP_NS // 2
    kept = player_of(timeline).take(late, 1).player
    assert kept.place(late).at_ns == late


def test_play_at_the_end_begins_anew():
    timeline = timeline_of([20] * 6)
    _, ended = run(player_of(timeline))
    assert ended.take(10**12, 9).stop == ended.index
    assert ended.next_ns() is None
    again, _ = run(ended.play(5), 5)
    assert again == list(range(6))


@pytest.mark.parametrize("rate", [0.09, 100.1, -1.0, float("nan")])
def test_a_rate_that_can_not_be_kept_is_refused(rate: float):
    with pytest.raises(BadRate, match=r"0\.1 to 100"):
        player_of(timeline_of([1])).at_rate(rate, 0)


def test_places_of_ticks():
    timeline = timeline_of([20] * 9)
    assert timeline.before_tick(1) == Place(3, 60 * MS)
    assert timeline.after_tick(1) == Place(6, 100 * MS)
    assert timeline.before_tick(7) == timeline.end
    assert timeline.after_tick(7) == timeline.end
    assert timeline.after_tick(-1) == timeline.begin
    assert [timeline.tick(place) for place in (Place(0, 0), Place(1, 0), Place(6, 100 * MS))] == [
        -1,
        0,
        1,
    ]
    assert timeline.last_tick == 2
