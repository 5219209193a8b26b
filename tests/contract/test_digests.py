"""One number for the topic table and one for rules: what changes them, and what does not."""

from dataclasses import replace
from typing import Any

import msgspec
import pytest

from fras_common import messages as m
from fras_common.digests import own_table_digest, rules_digest, table_digest
from fras_common.topics import HOLDS, PLAN, QUERIES, TOPICS, VERDICT, WHY_NOT, Qos, Topic

OWN = table_digest(TOPICS, QUERIES)


def with_topic(**changes: Any) -> str:
    changed = replace(VERDICT, **changes)
    return table_digest([changed if one is VERDICT else one for one in TOPICS], QUERIES)


def with_query(**changes: Any) -> str:
    changed = replace(WHY_NOT, **changes)
    return table_digest(TOPICS, [changed if one is WHY_NOT else one for one in QUERIES])


def test_the_digest_is_that_of_the_table() -> None:
    assert own_table_digest() == OWN
    assert len(bytes.fromhex(OWN)) == 32


@pytest.mark.parametrize(
    "changes",
    [
        {"key": "sa/verdicts"},
        {"type": m.Holds},
        {"producer": "sim"},
        {"qos": Qos.TELEMETRY},
        {"in_trial": False},
    ],
)
def test_what_a_topic_promises_counts(changes: dict[str, Any]) -> None:
    assert with_topic(**changes) != OWN


@pytest.mark.parametrize(
    "changes",
    [
        {"key": "planner/why"},
        {"request": m.HoldRequest},
        {"reply": m.HoldState},
        {"server": "sa"},
    ],
)
def test_what_a_query_promises_counts(changes: dict[str, Any]) -> None:
    assert with_query(**changes) != OWN


def test_a_row_more_or_less_counts_and_their_order_does_not() -> None:
    assert table_digest(TOPICS[1:], QUERIES) != OWN
    assert table_digest(TOPICS, QUERIES[1:]) != OWN
    assert table_digest([*TOPICS, replace(PLAN, key="planner/other")], QUERIES) != OWN
    assert table_digest(TOPICS[::-1], QUERIES[::-1]) == OWN


def test_how_it_is_explained_does_not_count() -> None:
    assert with_topic(when="now and then") == OWN


class Told(m.Header, frozen=True, kw_only=True):
    """First."""

    description: str


def variant(doc: str, **fields: Any) -> str:
    kind = msgspec.defstruct(
        "Told", list(fields.items()), bases=(m.Header,), namespace={"__doc__": doc}, frozen=True,
        kw_only=True,
    )  # fmt: skip
    one: Topic[Any] = replace(HOLDS, type=kind)
    return table_digest([one], [])


def test_each_field_counts_and_no_docstring_does() -> None:
    told = table_digest([replace(HOLDS, type=Told)], [])
    assert variant("Other words.", description=str) == told
    assert variant("First.", description=int) != told
    assert variant("First.") != told, "a field called description is a field"


def test_each_rule_file_counts_by_name_and_text() -> None:
    files = {"a.lp": "x.", "preferences/b.lp": "y."}
    digest = rules_digest(files)
    assert rules_digest(dict(reversed(files.items()))) == digest
    assert rules_digest({"a.lp": "x.", "preferences/b.lp": "y. "}) != digest
    assert rules_digest({"a.lp": "x.", "preferences/c.lp": "y."}) != digest
    assert rules_digest({"a.lp": "x."}) != digest
    assert rules_digest({"a.lpx": ".", "preferences/b.lp": "y."}) != digest
