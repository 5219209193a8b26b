"""What is cached is asked for piece by piece, none of them large."""

from collections import Counter
from collections.abc import Callable

import pytest

from fras_common.bus import RawSample
from fras_common.bus.past import AT_ONCE, PIECE_BYTES, PIECE_SAMPLES, PIECE_SHARE, Cached, Past
from fras_common.keeping import kept_of

TIMEOUT_S = 20.0
LARGE, SMALL, ONE = "sim/tissue_state", "sa/verdict", "sim/tissue_model"


class Cell:
    """Publishers with full caches; an answer comes when `answer` says so."""

    def __init__(self) -> None:
        self.now_s = 0.0
        self.caches = {
            (LARGE, "a/1"): [bytes(40_000)] * 1500,
            (SMALL, "b/1"): [bytes(100)] * 700,
            (SMALL, "b/2"): [bytes(100)] * 3,
            (ONE, "a/2"): [bytes(10)],
        }
        self.open: list[tuple[str, Callable[[Cached], None], Callable[[], None], float]] = []
        self.answered: list[tuple[str, int, int]] = []
        self.most_open = 0
        self.full = False

    def get(
        self,
        selector: str,
        note: Callable[[Cached], None],
        on_end: Callable[[], None],
        timeout_s: float,
    ) -> None:
        self.open.append((selector, note, on_end, timeout_s))
        self.most_open = max(self.most_open, len(self.open))

    def answer(self, place: int = 0) -> None:
        selector, note, on_end, timeout_s = self.open.pop(place)
        assert 0.0 < timeout_s <= TIMEOUT_S * PIECE_SHARE
        where, _, which = selector.partition("?")
        said: list[bytes] = []
        for (key, publisher), cache in self.caches.items():
            if which == "_max=1":
                numbers = range(len(cache) - 1, len(cache))
            elif where == f"{key}/@adv/pub/{publisher}/**":
                first, last = map(int, which.removeprefix("_sn=").split(".."))
                numbers = range(max(first, len(cache) - kept_of(key)), last + 1)
            else:
                continue
            # A link that is too full takes every second one.
            for number in numbers[:: 2 if self.full else 1]:
                note(Cached(RawSample(key, cache[number], ""), publisher, number))
                said.append(cache[number])
        self.answered.append((selector, len(said), sum(map(len, said))))
        on_end()

    def answer_first(self) -> None:
        """Answer what the latest is, until nobody new is among them."""
        while self.open and self.open[0][0].endswith("?_max=1"):
            self.answer()


def asked(cell: Cell) -> list[list[RawSample]]:
    done: list[list[RawSample]] = []
    Past(cell.get, done.append, TIMEOUT_S, lambda: cell.now_s).ask("**")
    return done


def test_all_comes_and_no_piece_is_large():
    cell = Cell()
    for number, key in enumerate(cell.caches):
        cell.caches[key] = [
            payload[:-8] + bytes([number]) + count.to_bytes(7, "big")
            for count, payload in enumerate(cell.caches[key])
        ]
    done = asked(cell)
    while cell.open:
        assert not done
        # The later of those under way may be answered first.
        cell.answer(-1)
    (found,) = done
    expected = [one for (key, _), cache in cell.caches.items() for one in cache[-kept_of(key) :]]
    assert [sample.payload for sample in found] == expected
    assert cell.most_open == AT_ONCE
    first, *pieces = cell.answered
    assert first[0] == "**/@adv/pub/**?_max=1"
    assert len(pieces) > 1000 * 40_000 // PIECE_BYTES
    assert all(0 < count <= PIECE_SAMPLES and size <= PIECE_BYTES for _, count, size in pieces)


@pytest.mark.parametrize("answers", [1, 5, 20])
def test_what_came_in_time_is_told_when_time_is_over(answers: int):
    cell = Cell()
    done = asked(cell)
    cell.answer_first()
    begun = len(cell.answered)
    for _ in range(answers):
        cell.answer()
    cell.now_s = TIMEOUT_S + 0.1
    while cell.open:
        cell.answer()
    assert len(cell.answered) == begun + answers + AT_ONCE
    (found,) = done
    # The latest of each was told twice.
    assert len(found) == sum(count for _, count, _ in cell.answered) - len(cell.caches)


def test_an_empty_cell_answers_at_once():
    cell = Cell()
    cell.caches = {}
    done = asked(cell)
    cell.answer()
    assert done == [[]]


def test_a_piece_that_is_not_answered_in_time_is_asked_for_again_behind_the_others():
    cell = Cell()
    done = asked(cell)
    cell.answer_first()
    selector, _, on_end, _ = cell.open.pop(0)
    cell.now_s += TIMEOUT_S * PIECE_SHARE
    on_end()
    while cell.open:
        cell.answer()
    assert cell.answered[-1][0] == selector
    (found,) = done
    assert len(found) == sum(min(len(one), kept_of(key)) for (key, _), one in cell.caches.items())


@pytest.mark.parametrize("took_s", [TIMEOUT_S * PIECE_SHARE, 0.0], ids=["late", "link too full"])
def test_who_does_not_tell_the_latest_is_asked_again(took_s: float):
    cell = Cell()
    everyone = cell.caches
    cell.caches = {name: cache for name, cache in everyone.items() if name[0] != LARGE}
    done = asked(cell)
    cell.now_s += took_s
    cell.answer()
    cell.caches = everyone
    while cell.open:
        cell.answer()
    (found,) = done
    assert Counter(one.key for one in found) == {LARGE: kept_of(LARGE), SMALL: 703, ONE: 1}


def test_who_has_gone_meanwhile_is_asked_twice_and_no_more():
    cell = Cell()
    done = asked(cell)
    cell.answer_first()
    cell.caches = {}
    while cell.open:
        cell.answer()
    assert len(done) == 1
    pieces = [selector for selector, *_ in cell.answered if "_sn=" in selector]
    assert pieces
    assert all(pieces.count(one) == 2 for one in pieces)


def test_what_a_full_link_let_drop_is_asked_for_until_nothing_more_comes():
    cell = Cell()
    done = asked(cell)
    cell.full = True
    for _ in range(20):
        cell.answer()
    cell.full = False
    while cell.open:
        cell.answer()
    (found,) = done
    assert len(found) == sum(min(len(one), kept_of(key)) for (key, _), one in cell.caches.items())
