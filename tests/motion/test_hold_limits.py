"""Stops without end: each is taken, and none makes what motion says grow without end."""

from hypothesis import given
from hypothesis import strategies as st

from fras_motion.holds import (
    HOLDER_LENGTH,
    MAX_HOLDS,
    OTHERS,
    REASON_LENGTH,
    Holds,
    clients_name,
)


def test_a_stop_for_which_there_is_no_place_stands_among_others() -> None:
    holds = Holds()
    for number in range(10 * MAX_HOLDS):
        assert holds.hold_for_client(f"rogue {number}", "no reason")
    held = holds.current()
    assert len(held) == MAX_HOLDS + 1
    assert OTHERS in held
    assert holds.look()[1] == 10 * MAX_HOLDS
    left = holds.resume_for_client(OTHERS, "cli")
    assert OTHERS not in left
    # One that stands already is renewed under its own name.
    assert holds.hold_for_client("rogue 3", "again")["rogue 3"] == "again"


@given(holder=st.text(max_size=300), reason=st.text(max_size=1000))
def test_names_and_reasons_are_cut_and_their_owner_lifts_them_all_the_same(
    holder: str, reason: str
) -> None:
    holds = Holds()
    ((name, said),) = holds.hold_for_client(holder, reason).items()
    assert name == clients_name(holder)
    assert len(name) <= HOLDER_LENGTH + len("client:")
    assert said == reason[:REASON_LENGTH]
    assert holds.resume_for_client(holder, holder) == {}


def test_a_stop_said_again_is_told_once() -> None:
    told: list[dict[str, str]] = []
    holds = Holds(told.append)
    holds.restore({})
    for _ in range(1000):
        holds.hold_for_client("page", "pressed")
    assert told == [{}, {"page": "pressed"}]
    assert holds.look()[1:] == (1000, ("page", "pressed"))
    holds.hold_for_client("page", "pressed harder")
    assert told[-1] == {"page": "pressed harder"}
