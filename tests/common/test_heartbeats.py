"""How often a publisher repeats its number: often where somebody waits for the message."""

import pytest

from fras_common.keeping import BEAT_S, UNHURRIED_BEAT_S, beat_s_of
from fras_common.topics import (
    ACTION_RESULT,
    CONTEXT,
    CRTK,
    HOLDS,
    PATIENT,
    PLAN,
    QUERIES,
    RECORDER_STATUS,
    ROBOT_STATE,
    SIM_CHECKPOINT,
    TASK_STATUS,
    TISSUE_MODEL,
    TISSUE_STATE,
    VERDICT,
)

AWAITED = [
    *(ROBOT_STATE, TISSUE_STATE, PATIENT.state, VERDICT),
    *(TISSUE_MODEL, TASK_STATUS, ACTION_RESULT, RECORDER_STATUS, CRTK[0].operating_state),
]
UNHURRIED = [
    *(SIM_CHECKPOINT.key, CRTK[0].measured_js.key, CRTK[1].jaw_setpoint_js.key),
    *(PLAN.key, CONTEXT.key, HOLDS.key),
    *(query.mirror for query in QUERIES),
    *("log/sim", "fault/motion"),
]


@pytest.mark.parametrize("key", [one.key for one in AWAITED])
def test_what_somebody_waits_for_is_repeated_often(key: str) -> None:
    assert beat_s_of(key) == BEAT_S


@pytest.mark.parametrize("key", UNHURRIED)
def test_what_nobody_waits_for_is_repeated_less_often(key: str) -> None:
    assert beat_s_of(key) == UNHURRIED_BEAT_S


def test_a_key_that_nobody_knows_is_repeated_often() -> None:
    assert beat_s_of("somebody/elses") == BEAT_S
