"""What is missing in a stream, and how many streams are remembered."""

from fras_common.service.gaps import STREAMS, Gaps

KEY = "sa/verdict"


def test_what_is_missing_is_counted_once_and_by_publisher():
    gaps = Gaps()
    assert [gaps.before(KEY, "sa/1", seq) for seq in (7, 8, 11, 9, 12)] == [0, 0, 2, 0, 0]
    assert gaps.before(KEY, "sa/2", 0) == 0
    assert gaps.before("sa/context", "sa/1", 20) == 0
    assert gaps.before(KEY, "sa/1", 14) == 1


def test_names_without_end_take_no_memory_and_who_speaks_is_not_forgotten():
    gaps = Gaps()
    for number in range(3 * STREAMS):
        gaps.before(KEY, f"rogue/{number}", 0)
        assert gaps.before(KEY, "sa/1", 2 * number) == (1 if number else 0)
    assert gaps.known == STREAMS
