"""The rules of the router: default deny, and the topic table."""

from typing import Any

import pytest

from fras_common.access import PARTICIPANTS, access_control, rights_of
from fras_common.router import main as router
from fras_common.topics import CRTK, QUERIES, TOPICS

CONTROL: Any = access_control("or-1")
RULES = {rule["id"]: rule for rule in CONTROL["rules"]}
CELL = "fras/or-1/"


def rules_of(name: str) -> list[Any]:
    return [
        RULES[rule]
        for policy in CONTROL["policies"]
        if name in policy["subjects"]
        for rule in policy["rules"]
    ]


def keys_of(name: str, message: str) -> set[str]:
    """Key expressions, within the cell, on which a participant may send a kind of message."""
    return {
        key.removeprefix(CELL)
        for rule in rules_of(name)
        if message in rule["messages"] and "ingress" in rule["flows"]
        for key in rule["key_exprs"]
    }


def plain(keys: set[str]) -> set[str]:
    return {key for key in keys if "@adv" not in key}


def test_what_is_not_allowed_is_refused_and_nothing_is_forbidden_besides():
    assert CONTROL["enabled"] is True
    assert CONTROL["default_permission"] == "deny"
    assert {rule["permission"] for rule in RULES.values()} == {"allow"}


def test_rules_are_of_one_cell_and_none_reaches_zenohs_own_keys():
    keys = {key for rule in RULES.values() for key in rule["key_exprs"]}
    assert all(key.startswith(CELL) for key in keys)
    assert not [key for key in keys if "@" in key and "/@adv/**" not in key]


def test_a_subject_is_a_certificates_name():
    assert [(one["id"], one["cert_common_names"]) for one in CONTROL["subjects"]] == [
        (name, [name]) for name in PARTICIPANTS
    ]
    assert "router" not in PARTICIPANTS


@pytest.mark.parametrize("topic", TOPICS, ids=lambda topic: topic.key)
def test_a_key_is_published_by_its_producer_alone(topic: Any):
    key = topic.key.format(service="sim", name="reset")
    allowed = {
        name
        for name in PARTICIPANTS
        if {key, key.replace("rpc/sim/reset", "rpc/sim/**")} & keys_of(name, "put")
    }
    expected = {
        "*": {"sim"},
        "arms": {"arms", "motion"},
        "client": {"motion", "client"},
    }.get(topic.producer, {topic.producer})
    assert allowed == expected


@pytest.mark.parametrize("query", QUERIES, ids=lambda query: query.key)
def test_a_query_is_answered_by_its_server_and_asked_by_those_the_table_names(query: Any):
    assert query.askers, "each row says who may ask"
    for name in PARTICIPANTS:
        may_serve = query.key in keys_of(name, "declare_queryable")
        assert may_serve == (query.server == name)
        assert (query.key in keys_of(name, "reply")) == may_serve
        may_ask = query.key in keys_of(name, "query")
        assert may_ask == (query.askers == ("*",) or name in query.askers)


def test_the_askers_of_the_table_are_participants():
    named = {asker for query in QUERIES for asker in query.askers}
    assert named - {"*"} <= set(PARTICIPANTS)


def test_who_may_stop_start_and_lift():
    def askers(key: str) -> set[str]:
        return {name for name in PARTICIPANTS if key in rights_of(name).asks}

    assert askers("motion/hold") == set(PARTICIPANTS)
    assert askers("motion/execute") == {"planner"}
    assert askers("motion/reset") == {"planner"}
    assert askers("motion/resume") == {"planner", "cli", "monitor"}
    assert askers("planner/task") == {"cli", "monitor", "supervisor"}


@pytest.mark.parametrize("name", PARTICIPANTS)
def test_everybody_reads_everything_and_shows_itself_as_itself_alone(name: str):
    for message in ("declare_subscriber", "declare_liveliness_subscriber", "liveliness_query"):
        assert keys_of(name, message) == {"**", "**/@adv/**"}
    assert plain(keys_of(name, "liveliness_token")) == {f"alive/{name}/*", f"ready/{name}/*"}
    assert not keys_of(name, "delete")


@pytest.mark.parametrize("name", PARTICIPANTS)
def test_the_keys_behind_a_key_are_its_publishers_too(name: str):
    rights = rights_of(name)
    behind = {f"{key}/@adv/**" for key in rights.kept}
    assert set(rights.kept) <= set(rights.publishes)
    assert keys_of(name, "put") == {*rights.publishes, *behind}
    assert {key for key in keys_of(name, "declare_queryable") if "@adv" in key} == behind


def test_commands_are_not_kept():
    commands = {topic.key for arm in CRTK for topic in (arm.servo_jp, arm.move_cp)}
    assert commands <= set(rights_of("client").publishes)
    assert not commands & set(rights_of("client").kept)


def test_a_replay_speaks_for_everybody_where_logs_are_looked_at_and_only_there():
    def said(control: Any) -> set[str]:
        mine = {
            rule
            for policy in control["policies"]
            if policy["subjects"] == ["replay"]
            for rule in policy["rules"]
        }
        rules = [rule for rule in control["rules"] if rule["id"] in mine]
        return {key for rule in rules if "put" in rule["messages"] for key in rule["key_exprs"]}

    everything = {f"{CELL}**", f"{CELL}**/@adv/**"}
    assert not everything & said(CONTROL)
    looking: Any = access_control("or-1", replays=True)
    assert everything <= said(looking)
    others = [p for p in looking["policies"] if "replay" not in p["subjects"]]
    assert others == [p for p in CONTROL["policies"] if "replay" not in p["subjects"]]


def rules_named(control: Any, subject: str) -> set[str]:
    return {
        rule
        for policy in control["policies"]
        if subject in policy["subjects"]
        for rule in policy["rules"]
    }


def test_another_router_may_what_those_behind_it_may_and_no_more():
    control: Any = access_control("or-1", links={"router-b": ["sim", "sa"]})
    of_both = rules_named(control, "sim") | rules_named(control, "sa")
    assert rules_named(control, "router-b") == of_both
    assert {"id": "router-b", "cert_common_names": ["router-b"]} in control["subjects"]
    # And nobody else may anything for it.
    assert control["rules"] == CONTROL["rules"]
    assert {name: rules_named(control, name) for name in PARTICIPANTS} == {
        name: rules_named(CONTROL, name) for name in PARTICIPANTS
    }


def test_after_a_revocation_the_name_of_before_is_nobodys():
    control: Any = access_control("or-1", names={"sim": "sim.2"})
    said = [one["cert_common_names"] for one in control["subjects"]]
    assert ["sim.2"] in said
    assert ["sim"] not in said
    assert rules_named(control, "sim") == rules_named(CONTROL, "sim")


@pytest.mark.parametrize("text", ["router-b", "=sim", "b=sim", "router-b=sim,surgeon", "sim=sim"])
def test_a_link_that_says_nothing_sensible_is_refused(
    text: str, capsys: pytest.CaptureFixture[str]
):
    with pytest.raises(SystemExit) as caught:
        router(["--link", text])
    assert caught.value.code == 2
    assert "--link" in capsys.readouterr().err
