"""What the recorder remembers of each key, and how it tells it."""

import pytest

from fras_common.bus import RawSample
from fras_common.codec import decode, encode
from fras_common.messages import Holds, RecorderEvent, ServoJaw, SinceReply
from fras_common.topics import CRTK, HOLDS, SOME
from fras_recorder import memory
from fras_recorder.memory import Memory

KEY = "sa/verdict"


def absent(source: str) -> bool:
    """Nobody is here."""
    del source
    return False


def said(tick: int, trial: str = "t-1", subject: str = "") -> bytes:
    return encode(RecorderEvent(tick=tick, trial=trial, kind="gap", subject=subject, count=0))


def ticks(reply: SinceReply) -> list[int]:
    return [decode(RecorderEvent, payload, KEY).tick for payload in reply.payloads]


def filled(last_tick: int, memory: Memory | None = None) -> Memory:
    memory = memory or Memory()
    for tick in range(last_tick + 1):
        memory.note(KEY, said(tick))
    return memory


def test_nothing_was_said():
    assert Memory().last(KEY) == b""
    assert Memory().since(KEY, 0) == SinceReply(payloads=[], forgotten=False, more=False)


def test_messages_from_a_tick_on_come_as_they_travelled():
    reply = filled(9).since(KEY, 7)
    assert reply.payloads == [said(7), said(8), said(9)]
    assert not reply.forgotten
    assert not reply.more


def test_another_trial_is_left_out():
    memory = filled(9)
    memory.note(KEY, said(8, "t-2"))
    assert memory.since(KEY, 7).payloads == [said(8, "t-2")]


def test_what_has_no_header_is_passed_over():
    memory = filled(1)
    memory.note(KEY, b"\xc1")
    assert ticks(memory.since(KEY, 0)) == [0, 1]
    assert memory.last(KEY) == b"\xc1"


@pytest.mark.parametrize(("tick", "forgotten"), [(4, True), (5, True), (6, False), (9, False)])
def test_what_was_forgotten_is_told_if_it_was_asked_for(tick: int, forgotten: bool):
    reply = filled(9, Memory(kept=lambda key: 5)).since(KEY, tick)
    assert ticks(reply) == list(range(max(5, tick), 10))
    assert reply.forgotten == forgotten


def test_after_another_trial_nothing_of_this_one_is_forgotten():
    memory = filled(9, Memory(kept=lambda key: 5))
    memory.note(KEY, said(0, "t-2"))
    reply = memory.since(KEY, 0)
    assert ticks(reply) == [0]
    assert not reply.forgotten


def test_it_is_bounded_by_bytes_and_keeps_the_last_message_however_large():
    memory = Memory(bytes_=1000)
    filled(99, memory)
    assert 1 < len(memory.since(KEY, 0).payloads) < 40
    large = said(100, subject="x" * 5000)
    memory.note(KEY, large)
    assert memory.since(KEY, 0).payloads == [large]
    assert memory.last(KEY) == large


def test_a_long_answer_comes_in_parts(monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setattr(memory, "REPLY_BYTES", 4 * len(said(0)))
    kept = filled(9)
    found: list[int] = []
    more, tick = True, 0
    while more:
        reply = kept.since(KEY, tick)
        found += ticks(reply)
        more, tick = reply.more, found[-1] + 1
    assert found == list(range(10))
    # One that does not fit comes alone.
    monkeypatch.setattr(memory, "REPLY_BYTES", 1)
    assert ticks(kept.since(KEY, 3)) == [3]


def test_keys_that_nobody_of_ours_has_are_few_and_share_their_room():
    kept = filled(3)
    for number in range(3 * memory.OTHER_KEYS):
        kept.note(f"rogue/{number}", said(number))
        kept.note("guest/here", said(number))
    remembered = [n for n in range(3 * memory.OTHER_KEYS) if kept.last(f"rogue/{n}")]
    # The last ones, beside the guest, who spoke all the time.
    assert remembered == list(range(2 * memory.OTHER_KEYS + 1, 3 * memory.OTHER_KEYS))
    assert kept.last("guest/here") == said(3 * memory.OTHER_KEYS - 1)
    assert ticks(kept.since(KEY, 0)) == [0, 1, 2, 3]


def test_what_is_said_on_keys_of_others_is_bounded_together(monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setattr(memory, "OTHER_BYTES", 10_000)
    kept = filled(3)
    for number in range(30):
        kept.note(f"rogue/{number % 20}", bytes([number]) * 1000)
    kept.note("rogue/large", b"x" * 20_000)
    assert [n for n in range(20) if kept.last(f"rogue/{n}")] == []
    assert len(kept.last("rogue/large")) == 20_000
    for number in range(30):
        kept.note(f"rogue/{number % 20}", bytes([number]) * 1000)
    # Twenty keys of 1 or 2 kB are in turn; the ten that spoke last are there.
    assert sum(len(kept.since(f"rogue/{n}", -1).payloads) for n in range(20)) == 0
    assert [n for n in range(20) if kept.last(f"rogue/{n}")] == list(range(10))
    assert ticks(kept.since(KEY, 0)) == [0, 1, 2, 3]


def test_no_more_is_kept_than_a_publisher_keeps():
    kept, key = Memory(), "sim/checkpoint"
    for tick in range(2 * SOME):
        kept.note(key, said(tick))
    assert ticks(kept.since(key, 0)) == list(range(SOME, 2 * SOME))


def test_the_past_precedes_what_was_noted_on_any_key():
    kept = Memory()
    for key in (KEY, "guest/here"):
        kept.note(key, said(2))
        kept.note(key, said(3))
    kept.precede([RawSample(k, said(n), "") for n in (1, 2) for k in (KEY, "guest/here")])
    assert ticks(kept.since(KEY, 0)) == ticks(kept.since("guest/here", 0)) == [1, 2, 3]


def holds(seq: int, stamp_ns: int, source: str = "motion/a", **held: str) -> bytes:
    return encode(Holds(seq=seq, stamp_ns=stamp_ns, source=source, holds=held))


def test_what_is_sent_again_is_not_the_last() -> None:
    memory, key = Memory(), HOLDS.key
    free, held = holds(0, 10), holds(1, 20, cli="stop")
    assert memory.note(key, free, absent)
    assert memory.note(key, held, absent)
    assert not memory.note(key, free, absent)
    assert not memory.note(key, held, absent)
    assert memory.last(key) == held
    assert memory.since(key, -1).payloads == [free, held]


def test_the_one_who_starts_again_is_believed_and_the_one_before_no_more() -> None:
    memory, key = Memory(), HOLDS.key
    memory.note(key, holds(7, 20, cli="stop"), absent)
    again = holds(0, 30, "motion/b", cli="stop", restart="started again")
    assert memory.note(key, again, absent)
    assert not memory.note(key, holds(7, 20, cli="stop"), absent)
    # Of one whom this recorder never heard: yesterday's.
    assert not memory.note(key, holds(3, 5, "motion/yesterday"), absent)
    assert memory.last(key) == again


def test_one_who_is_here_is_believed_though_its_clock_was_set_back() -> None:
    memory, key = Memory(), HOLDS.key
    memory.note(key, holds(7, 20), absent)
    late = holds(0, 5, "motion/b", cli="stop")
    assert memory.note(key, late, lambda source: source == "motion/b")
    assert memory.last(key) == late


def test_where_anybody_may_speak_everything_is_noted() -> None:
    memory, key = Memory(), CRTK[0].jaw_servo_jp.key
    command = encode(ServoJaw(seq=0, stamp_ns=1, source="client/x", jaw_rad=0.1))
    assert memory.note(key, command, absent)
    assert memory.note(key, command, absent)


def test_who_has_spoken_is_forgotten_before_memory_grows_without_end() -> None:
    small, key = Memory(), HOLDS.key
    for number in range(2 * memory.SOURCES):
        small.note(key, holds(0, number, f"motion/{number}"))
    assert not small.note(key, holds(0, 3, "motion/3"), absent)
