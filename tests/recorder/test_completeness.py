"""A close waits until every per-tick key and the status have come in."""

from fras_recorder.completeness import PER_TICK, STATUS, WITH_PATIENT, Completeness


def complete(last_tick: int = 5, status_seq: int = 3) -> Completeness:
    seen = Completeness("t-1")
    for key in PER_TICK:
        seen.note(key, "t-1", last_tick, 0)
    seen.note(STATUS, "t-1", -1, status_seq)
    return seen


def test_it_is_complete_when_all_is_there():
    assert complete().reached(5, 3)
    assert complete().reached(4, 2)


def test_each_key_and_the_status_must_have_come():
    assert not complete().reached(6, 3)
    assert not complete().reached(5, 4)
    for late in PER_TICK:
        seen = Completeness("t-1")
        for key in PER_TICK:
            seen.note(key, "t-1", 4 if key == late else 5, 0)
        seen.note(STATUS, "t-1", -1, 3)
        assert not seen.reached(5, 3)
        seen.note(late, "t-1", 5, 1)
        assert seen.reached(5, 3)


def test_a_trial_that_never_ticked_needs_its_status_only():
    seen = Completeness("t-1")
    assert not seen.reached(-1, 0)
    seen.note(STATUS, "t-1", -1, 0)
    assert seen.reached(-1, 0)


def test_other_trials_and_other_keys_do_not_count():
    seen = Completeness("t-1")
    for key in PER_TICK:
        seen.note(key, "t-0", 9, 0)
    seen.note(STATUS, "t-0", -1, 9)
    seen.note("health/sim", "t-1", 9, 9)
    assert not seen.reached(0, 0)


def test_what_comes_late_takes_nothing_back():
    seen = complete()
    seen.note(PER_TICK[0], "t-1", 2, 7)
    seen.note(STATUS, "t-1", -1, 1)
    assert seen.reached(5, 3)


def test_a_trial_with_a_patient_is_complete_with_its_last_state():
    seen = Completeness("t-1", per_tick=WITH_PATIENT)
    for key in PER_TICK:
        seen.note(key, "t-1", 5, 0)
    seen.note(STATUS, "t-1", -1, 3)
    assert not seen.reached(5, 3)
    seen.note("patient/tissue_state", "t-1", 5, 0)
    assert seen.reached(5, 3)
