"""How long a fault kept the ticks from going on."""

import pytest

from fras_experiments.chaos.recovery import recovery_s, stalls

TICK_NS = 20_000_000
S = 1_000_000_000
# Ticks each 20 ms up to 1 s, then none for 2 s, then on, then none for 0.5 s.
TIMES_NS = [
    *range(0, S + 1, TICK_NS),
    *range(3 * S, 4 * S + 1, TICK_NS),
    *range(9 * S // 2, 5 * S, TICK_NS),
]


def test_only_what_takes_long_is_a_stall():
    assert [(one.from_ns / S, one.to_ns / S) for one in stalls(TIMES_NS)] == [(1, 3), (4, 4.5)]
    assert stalls(range(0, S, TICK_NS)) == ()
    assert stalls([]) == ()


@pytest.mark.parametrize(
    ("at_s", "until_s", "expected"),
    [
        (1.5, 9.0, 1.5),  # within the stall: from the fault
        (0.9, 9.0, 2.0),  # a little before: from the last tick that was under way
        (3.5, 9.0, 0.5),  # it belongs to the next one
        (4.9, 9.0, None),  # nothing stood still
        (0.1, 0.9, None),  # what comes later is of the next fault
    ],
)
def test_recovery_is_from_the_fault_to_the_next_tick(at_s, until_s, expected):
    found = recovery_s(int(at_s * S), int(until_s * S), stalls(TIMES_NS))
    assert found == (None if expected is None else pytest.approx(expected))
