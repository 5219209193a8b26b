"""CRTK's state machine: every command in every state."""

import pytest

from fras_motion.crtk import COMMANDS, STATES, ArmStatus, CommandRefused, follow, way_back

# psm.md: enable is invalid from PAUSED, disable is legal from any state; homing moves nothing.
LEGAL = {
    ("DISABLED", "enable"): "ENABLED",
    ("FAULT", "enable"): "ENABLED",
    ("DISABLED", "disable"): "DISABLED",
    ("ENABLED", "disable"): "DISABLED",
    ("PAUSED", "disable"): "DISABLED",
    ("FAULT", "disable"): "DISABLED",
    ("ENABLED", "pause"): "PAUSED",
    ("PAUSED", "resume"): "ENABLED",
    ("ENABLED", "home"): "ENABLED",
    ("ENABLED", "unhome"): "ENABLED",
    ("DISABLED", "unhome"): "DISABLED",
}


@pytest.mark.parametrize("state", STATES)
@pytest.mark.parametrize("command", COMMANDS)
def test_each_command_leads_where_it_shall_or_is_refused(state: str, command: str) -> None:
    before = ArmStatus(state, is_homed=True)
    if (state, command) in LEGAL:
        after = follow("psm1", before, command)
        assert after.state == LEGAL[state, command]
        assert after.is_homed == (command != "unhome")
        return
    with pytest.raises(CommandRefused) as refused:
        follow("psm1", before, command)
    assert (refused.value.arm, refused.value.command) == ("psm1", "state_command")
    assert refused.value.reason == "wrong_state"
    legal = {before for before, asked in LEGAL if asked == command}
    assert state in str(refused.value)
    assert all(name in str(refused.value) for name in legal)


def test_homing_is_told_and_forgotten() -> None:
    unhomed = follow("psm1", ArmStatus(), "unhome")
    assert not unhomed.is_homed
    assert not follow("psm1", unhomed, "pause").is_homed
    assert follow("psm1", unhomed, "home") == ArmStatus()


@pytest.mark.parametrize("state", STATES)
@pytest.mark.parametrize("is_homed", [True, False])
def test_the_way_back_is_legal_and_leads_to_an_arm_that_may_move(
    state: str, is_homed: bool
) -> None:
    status = ArmStatus(state, is_homed)
    assert bool(way_back(status)) != status.may_move
    for command in way_back(status):
        status = follow("psm1", status, command)
    assert status.may_move
