"""What was lost on the way is asked for, and told in its place."""

from collections import Counter

from hypothesis import given
from hypothesis import strategies as st

from fras_common.bus import RawSample
from fras_common.bus.past import Cached
from fras_common.bus.recovery import (
    ALL_OF_WHO_BEGINS,
    GIVE_UP_S,
    PATIENCE_S,
    PUBLISHERS,
    RETRY_S,
    SETTLING_S,
    WAITING,
    WAITING_BYTES,
    Ask,
    Earlier,
    Recovery,
)
from fras_common.keeping import kept_of

VERDICTS, SHORT = "sa/verdict", "sim/tissue_model"
ONE, OTHER = "a/1", "b/10"


def numbered(number: int, publisher: str = ONE, key: str = VERDICTS, size: int = 0) -> Cached:
    payload = number.to_bytes(size or len(publisher), "big")
    return Cached(RawSample(key, payload, ""), publisher, number)


class Wire:
    """One that listens; what is said to it may be lost, and caches answer when they are told to."""

    def __init__(self, earlier: Earlier = ALL_OF_WHO_BEGINS) -> None:
        self.now_s = 100.0
        self.recovery = Recovery(lambda: self.now_s, earlier)
        self.now_s += SETTLING_S

    def say(self, *numbers: int, publisher: str = ONE, key: str = VERDICTS) -> None:
        for number in numbers:
            self.recovery.note(numbered(number, publisher, key))

    def wait(self, span_s: float) -> None:
        self.now_s += span_s

    def asks(self) -> list[Ask]:
        """What is asked for, as soon as anything is."""
        if (due_s := self.recovery.due_s()) is None:
            return []
        self.now_s = max(self.now_s, due_s)
        return self.recovery.questions()

    def answer(
        self,
        ask: Ask,
        highest: int,
        publisher: str = ONE,
        key: str = VERDICTS,
        lost: frozenset[int] = frozenset(),
    ) -> None:
        """Answer as a cache does that holds all up to a number, but for what is lost on the way."""
        for number in asked_for(ask):
            if number not in lost and highest - kept_of(key) < number <= highest:
                ask.found.append(numbered(number, publisher, key))
        self.recovery.answered(ask)

    def told(self) -> list[int]:
        return [int.from_bytes(sample.payload, "big") for sample in self.recovery.told]


def asked_for(ask: Ask) -> range:
    first, last = map(int, ask.selector.partition("_sn=")[2].split(".."))
    return range(first, last + 1)


def test_a_hole_is_filled_in_its_place_and_what_is_behind_it_waits():
    wire = Wire()
    wire.say(0, 1, 4, 5, 7)
    assert wire.told() == [0, 1]
    (ask,) = wire.asks()
    assert ask.selector == f"{VERDICTS}/@adv/pub/{ONE}/**?_sn=2..3"
    wire.answer(ask, 7)
    assert wire.told() == [0, 1, 2, 3, 4, 5]
    (ask,) = wire.asks()
    wire.answer(ask, 7)
    assert wire.told() == list(range(8))
    assert wire.recovery.due_s() is None


def test_what_is_lost_while_an_earlier_loss_is_asked_for_is_recovered_too():
    """Zenoh's own recovery gives it up: number 20 was missing in a log of `fras chaos`."""
    wire = Wire()
    wire.recovery.note_latest(VERDICTS, ONE, 19)
    (ask,) = wire.asks()
    wire.say(21)
    wire.answer(ask, 21)
    (ask,) = wire.asks()
    assert list(asked_for(ask)) == [20]
    wire.answer(ask, 21)
    assert wire.told() == list(range(22))


def test_the_last_word_is_missed_by_its_number():
    wire = Wire()
    wire.say(0, 1)
    wire.recovery.note_latest(VERDICTS, ONE, 1)
    assert wire.recovery.due_s() is None
    wire.recovery.note_latest(VERDICTS, ONE, 2)
    (ask,) = wire.asks()
    wire.answer(ask, 2)
    assert wire.told() == [0, 1, 2]


def test_what_is_only_late_is_not_asked_for():
    wire = Wire()
    wire.say(0)
    wire.recovery.note_latest(VERDICTS, ONE, 1)
    wire.wait(PATIENCE_S / 2)
    assert wire.recovery.questions() == []
    wire.say(1)
    wire.wait(1.0)
    assert wire.asks() == []
    assert wire.told() == [0, 1]


def test_who_was_there_before_is_heard_from_now_on_and_who_comes_later_from_the_first():
    wire = Wire()
    wire.now_s -= SETTLING_S
    wire.say(500, 501)
    wire.recovery.note_latest(VERDICTS, OTHER, 700)
    wire.wait(SETTLING_S)
    wire.say(701, publisher=OTHER)
    assert wire.told() == [500, 501, 701]
    wire.say(3, publisher="c/1")
    (ask,) = wire.asks()
    assert list(asked_for(ask)) == [0, 1, 2]
    wire.recovery.note_latest(VERDICTS, "d/1", 900)
    (ask,) = wire.asks()
    assert list(asked_for(ask)) == list(range(901 - ALL_OF_WHO_BEGINS.of_who_comes, 901))


def test_of_a_short_cache_nothing_is_waited_for_that_it_cannot_hold():
    wire = Wire()
    kept = kept_of(SHORT)
    wire.say(3 * kept, 5 * kept, key=SHORT)
    (ask,) = wire.asks()
    assert asked_for(ask)[0] == 4 * kept + 1
    wire.answer(ask, 5 * kept, key=SHORT)
    assert wire.told() == [3 * kept, *range(4 * kept + 1, 5 * kept + 1)]
    later = Wire()
    later.say(3 * kept, key=SHORT)
    (ask,) = later.asks()
    assert list(asked_for(ask)) == list(range(2 * kept + 1, 3 * kept))


def test_what_a_cache_holds_no_more_is_passed_over_at_once():
    wire = Wire()
    kept = kept_of(VERDICTS)
    wire.say(0, 5, kept + 10)
    # 1 to 4 and some more have left the cache, which keeps what is told after 10.
    assert wire.told() == [0, 5]
    (ask,) = wire.asks()
    assert asked_for(ask)[0] == 11
    while True:
        wire.answer(ask, kept + 10)
        if not (asks := wire.asks()):
            break
        (ask,) = asks
    assert wire.told() == [0, 5, *range(11, kept + 11)]


def test_what_an_answer_lost_on_its_way_is_asked_for_again():
    wire = Wire()
    wire.say(0, 9)
    (ask,) = wire.asks()
    ask.found.extend(numbered(number) for number in (3, 6, 7))
    wire.recovery.answered(ask)
    assert wire.told() == [0]
    (ask,) = wire.asks()
    assert list(asked_for(ask)) == [1, 2]
    wire.answer(ask, 9)
    (ask,) = wire.asks()
    assert list(asked_for(ask)) == [4, 5]
    wire.answer(ask, 9)
    (ask,) = wire.asks()
    wire.answer(ask, 9)
    assert wire.told() == list(range(10))


def test_a_latched_key_tells_its_latest_whoever_came_first():
    wire = Wire(Earlier(1, 1))
    wire.recovery.note_earlier(numbered(5))
    wire.recovery.note_earlier(numbered(5))
    wire.recovery.note_latest(VERDICTS, ONE, 5)
    assert wire.told() == [5]
    assert wire.asks() == []
    # One that begins later, and of which only the heartbeat is heard.
    wire.recovery.note_latest(VERDICTS, OTHER, 9)
    (ask,) = wire.asks()
    assert list(asked_for(ask)) == [9]
    wire.answer(ask, 9, publisher=OTHER)
    assert wire.told() == [5, 9]


def test_what_is_said_meanwhile_is_not_told_behind_what_was_said_before():
    wire = Wire(Earlier(1, 1))
    wire.say(6)
    wire.recovery.note_earlier(numbered(5))
    wire.say(8)
    wire.recovery.note_earlier(numbered(7))
    assert wire.told() == [6, 7, 8]


def test_where_nothing_of_before_is_wanted_nothing_is_asked_for():
    wire = Wire(Earlier(0, 0))
    wire.recovery.note_latest(VERDICTS, ONE, 5)
    wire.say(9, publisher=OTHER)
    assert wire.told() == [9]
    assert wire.asks() == []
    wire.say(7)
    (ask,) = wire.asks()
    assert list(asked_for(ask)) == [6]


def test_who_does_not_answer_is_asked_again_and_given_up_in_time():
    wire = Wire()
    wire.say(0, 2)
    began_s, asked = wire.now_s, 0
    while asks := wire.asks():
        wire.recovery.answered(asks[0])
        asked += 1
    assert wire.told() == [0, 2]
    assert GIVE_UP_S <= wire.now_s - began_s <= GIVE_UP_S + 2 * RETRY_S
    assert asked >= GIVE_UP_S / RETRY_S - 2
    wire.say(3)
    assert wire.told() == [0, 2, 3]


def test_a_number_that_nobody_said_keeps_nobody_from_being_heard():
    wire = Wire()
    wire.say(0)
    wire.recovery.note_latest(VERDICTS, ONE, 2**24 - 1)
    wire.say(1, 2)
    wire.say(2**24 - 1)
    while asks := wire.asks():
        wire.recovery.answered(asks[0])
    wire.say(3, 4)
    assert {0, 1, 2, 3, 4} <= set(wire.told())


def test_what_waits_is_bounded_in_number_and_bytes():
    wire = Wire()
    wire.say(0, *range(2, WAITING + 3))
    assert wire.told() == [0, *range(2, WAITING + 3)]
    wire = Wire()
    wire.say(0)
    large = WAITING_BYTES // 4
    for number in range(2, 7):
        wire.recovery.note(numbered(number, size=large))
        assert (
            sum(len(one.payload) for one in wire.recovery.told) + 4 * large
            >= number * large - large
        )
    assert wire.told() == [0, *range(2, 7)]


def test_who_is_forgotten_among_too_many_is_told_before():
    wire = Wire()
    wire.say(0, 2)
    for number in range(PUBLISHERS):
        wire.say(0, publisher=f"c/{number}")
    assert 2 in wire.told()
    assert wire.recovery.due_s() is None


@given(st.data())
def test_whatever_is_lost_all_is_told_in_order_and_once(data: st.DataObject):
    """Two publishers with caches; samples, latest numbers and answers are lost at random."""
    wire = Wire()
    said = Counter[str]()
    open_asks: list[tuple[Ask, str]] = []
    lossy = st.booleans()
    for _ in range(data.draw(st.integers(1, 40))):
        wire.wait(data.draw(st.sampled_from([0.0, 0.01, 0.3])))
        publisher = data.draw(st.sampled_from([ONE, OTHER]))
        if not data.draw(lossy):
            wire.say(said[publisher], publisher=publisher)
        said[publisher] += 1
        if not data.draw(lossy):
            wire.recovery.note_latest(VERDICTS, publisher, said[publisher] - 1)
        for ask in wire.recovery.questions():
            open_asks.append((ask, ONE if ONE in ask.selector else OTHER))
        if open_asks and data.draw(st.booleans()):
            ask, of = open_asks.pop(data.draw(st.integers(0, len(open_asks) - 1)))
            wire.answer(
                ask, said[of] - 1, of, lost=frozenset(data.draw(st.sets(st.integers(0, 40))))
            )
    # At last the network is good again.
    for publisher, count in said.items():
        wire.recovery.note_latest(VERDICTS, publisher, count - 1)
    while True:
        open_asks += [(ask, ONE if ONE in ask.selector else OTHER) for ask in wire.asks()]
        if not open_asks:
            break
        ask, of = open_asks.pop()
        wire.answer(ask, said[of] - 1, of)
    told: dict[int, list[int]] = {len(ONE): [], len(OTHER): []}
    for sample in wire.recovery.told:
        told[len(sample.payload)].append(int.from_bytes(sample.payload, "big"))
    for publisher in (ONE, OTHER):
        assert told[len(publisher)] == list(range(said[publisher])), publisher
