"""Whom of other hosts a start waits for, told once a change."""

from fras_cli.other_hosts import OtherHosts


def test_each_change_is_told_once():
    others = OtherHosts({"sim": "B", "sa": "B", "arms": "C", "router-b": "B"})
    assert others.look(["sim", "sa", "motion", "arms"]) == (
        "waiting for sim, sa of host B; arms of host C"
    )
    assert others.look(["sim", "sa", "motion", "arms"]) == ""
    assert others.look(["sa", "motion"]) == "waiting for sa of host B"
    assert others.look(["motion"]) == ""
    assert others.look([]) == "the services of all hosts are ready"
    assert others.look([]) == ""
    assert others.look(["sim"]) == "waiting for sim of host B"


def test_on_one_machine_there_is_nothing_to_tell():
    others = OtherHosts({})
    assert others.look(["sim"]) == others.look([]) == ""
