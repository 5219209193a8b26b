"""How often a publisher repeats its number: at once where a trial waits for the message."""

import pytest

from fras_common.keeping import BEAT_S, LOGGED_BEAT_S, beat_s_of
from fras_common.topics import (
    ACTION_RESULT,
    CRTK,
    HOLDS,
    PATIENT,
    PLAN,
    QUERIES,
    ROBOT_STATE,
    SIM_CHECKPOINT,
    TASK_STATUS,
    TISSUE_STATE,
    VERDICT,
)

AWAITED = [
    *(ROBOT_STATE, TISSUE_STATE, PATIENT.state, VERDICT),
    *(PLAN, TASK_STATUS, ACTION_RESULT, HOLDS, CRTK[0].operating_state),
]
LOGGED = [
    *(SIM_CHECKPOINT.key, CRTK[0].measured_js.key, CRTK[1].jaw_setpoint_js.key),
    *(query.mirror for query in QUERIES),
    *("log/sim", "fault/motion"),
]


@pytest.mark.parametrize("key", [one.key for one in AWAITED])
def test_what_a_trial_waits_for_is_repeated_often(key: str) -> None:
    assert beat_s_of(key) == BEAT_S


@pytest.mark.parametrize("key", LOGGED)
def test_what_only_a_log_waits_for_is_repeated_less_often(key: str) -> None:
    assert beat_s_of(key) == LOGGED_BEAT_S


def test_a_key_that_nobody_knows_is_repeated_often() -> None:
    assert beat_s_of("somebody/elses") == BEAT_S
