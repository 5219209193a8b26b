"""The topic table: one row a key, each type travels and is described."""

import base64
from collections import Counter
from collections.abc import Callable
from typing import Any

import jsonschema
import msgpack
import msgspec
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from fras_common import messages
from fras_common.codec import decode, encode, json_schema
from fras_common.messages import Header
from fras_common.topics import (
    GUESTS,
    HEALTH,
    QUERIES,
    RPC,
    SERVICES,
    TOOLS,
    TOPICS,
    Query,
    Topic,
    topic_of,
)

Strategies = Callable[[type[Any]], st.SearchStrategy[Any]]

few = settings(max_examples=10, deadline=None, suppress_health_check=[HealthCheck.too_slow])
each_topic = pytest.mark.parametrize("topic", TOPICS, ids=lambda topic: topic.key)
each_query = pytest.mark.parametrize("query", QUERIES, ids=lambda query: query.key)


def as_json(value: Any) -> Any:
    """What a MessagePack value is in JSON: bytes as base64 text, keys as text."""
    if isinstance(value, bytes):
        return base64.b64encode(value).decode()
    if isinstance(value, dict):
        return {str(key): as_json(item) for key, item in value.items()}
    if isinstance(value, list):
        return [as_json(item) for item in value]
    return value


def test_each_key_stands_once():
    assert [key for key, n in Counter(topic.key for topic in TOPICS).items() if n > 1] == []


def test_no_key_is_matched_by_two_rows():
    names = {"service": "sim", "name": "reset"}
    for topic in TOPICS:
        concrete = topic.key.format(**names)
        matching = [
            other.key
            for other in TOPICS
            if concrete == other.key
            or (other.wildcard.endswith("**") and concrete.startswith(other.wildcard[:-2]))
        ]
        assert matching == [topic.key]


def test_each_query_key_stands_once():
    assert [key for key, n in Counter(query.key for query in QUERIES).items() if n > 1] == []
    assert [key for key, n in Counter(query.mirror for query in QUERIES).items() if n > 1] == []


@each_topic
def test_the_producer_is_a_known_service(topic: Topic[Any]):
    assert topic.producer in {*SERVICES, *GUESTS, *TOOLS, "*", "client"}
    assert (topic.producer == "*") == ("{" in topic.key)


@each_query
def test_the_server_is_a_known_service_and_owns_the_key(query: Query[Any, Any]):
    assert query.server in {*SERVICES, *GUESTS, *TOOLS}
    assert query.key.startswith(f"{query.server}/")


@each_topic
def test_no_key_uses_zenohs_verbatim_chunks_or_wildcards(topic: Topic[Any]):
    # `**` would miss an `@` chunk, so the log would too.
    assert not set(topic.key) & set("@*$#?")


@each_topic
def test_the_header_comes_first(topic: Topic[Any]):
    header = Header.__struct_fields__
    assert topic.type.__struct_fields__[: len(header)] == header


@each_topic
def test_the_table_finds_the_row_of_each_concrete_key(topic: Topic[Any]):
    assert topic_of(topic.key.format(service="sim", name="reset")) is topic


def test_the_table_knows_no_other_key():
    for key in ("", "sim", "sim/tissue_state/x", "healthy/sim", "heal"):
        assert topic_of(key) is None


def test_a_family_member_keeps_everything_but_its_key():
    member = RPC.of(service="sim", name="reset")
    assert member.key == "rpc/sim/reset"
    assert (member.type, member.qos, member.in_trial) == (RPC.type, RPC.qos, RPC.in_trial)
    assert HEALTH.wildcard == "health/**"
    assert member.wildcard == member.key


@each_query
def test_the_mirror_is_a_key_of_the_rpc_row(query: Query[Any, Any]):
    assert topic_of(query.mirror) is RPC


@each_topic
def test_a_message_round_trips(topic: Topic[Any], instances: Strategies):
    @given(message=instances(topic.type))
    @few
    def check(message: Header):
        again = decode(topic.type, encode(message), topic.key)
        assert encode(again) == encode(message)
        if topic is not RPC:  # msgspec.Raw compares by identity
            assert again == message

    check()


@each_query
def test_request_and_reply_round_trip(query: Query[Any, Any], instances: Strategies):
    @given(request=instances(query.request), reply=instances(query.reply))
    @few
    def check(request: Any, reply: Any):
        assert decode(query.request, encode(request), query.key) == request
        assert decode(query.reply, encode(reply), query.key) == reply

    check()


@each_topic
def test_plain_msgpack_yields_what_the_schema_describes(topic: Topic[Any], instances: Strategies):
    schema = json_schema(topic.type)
    jsonschema.Draft202012Validator.check_schema(schema)
    validator = jsonschema.Draft202012Validator(schema)

    @given(message=instances(topic.type))
    @few
    def check(message: Header):
        plain = msgpack.unpackb(encode(message))
        assert list(plain)[:5] == list(Header.__struct_fields__)
        validator.validate(as_json(plain))
        with pytest.raises(jsonschema.ValidationError):
            validator.validate(as_json(plain) | {"seq": "one"})
        with pytest.raises(jsonschema.ValidationError):
            validator.validate(as_json(plain) | {"unheard_of": 1})

    check()


def test_every_message_type_is_in_the_table_or_part_of_one():
    known: set[str] = set()
    for kind in [topic.type for topic in TOPICS]:
        known |= set(json_schema(kind).get("$defs", {}))
    for query in QUERIES:
        known |= set(json_schema(query.request).get("$defs", {}))
        known |= set(json_schema(query.reply).get("$defs", {}))
    public = {
        name
        for name in messages.__all__
        if isinstance(kind := getattr(messages, name), type) and issubclass(kind, msgspec.Struct)
    }
    assert public - {"Header"} - known == set()
