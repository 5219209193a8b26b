"""Whose message it may be, key by key."""

import pytest

from fras_common.codec import encode
from fras_common.messages import Holds
from fras_common.provenance import WrongSource, producers_of, require_source, require_speaker
from fras_common.topics import SERVICES, TOPICS


@pytest.mark.parametrize("topic", TOPICS, ids=lambda topic: topic.key)
def test_each_producer_of_the_table_may_speak_and_the_others_may_not(topic):
    expected = {"*": {"sim"}, "arms": {"arms", "motion"}, "client": None}
    allowed = expected.get(topic.producer, {topic.producer})
    key = topic.key.format(service="sim", name="reset")
    assert producers_of(key) == allowed
    for name in ("", "cli", "client", "arms", *SERVICES):
        if allowed is None or name in allowed:
            require_source(key, f"{name}/3f2a")
            continue
        with pytest.raises(WrongSource, match=r"only .* speaks here"):
            require_source(key, f"{name}/3f2a")


def test_a_name_that_only_begins_like_the_producers_is_another_one():
    for source in ("simulator/1", "sim2", "/sim", "x/sim/1"):
        with pytest.raises(WrongSource):
            require_source("sim/tissue_state", source)
    require_source("sim/tissue_state", "sim")


def test_a_key_that_is_not_in_the_table_is_anybodys():
    assert producers_of("weather/today") is None
    require_source("weather/today", "me")


def test_bytes_are_judged_by_their_header_and_those_without_say_nothing_of_themselves():
    require_speaker("motion/holds", encode(Holds(source="motion/1", holds={})))
    require_speaker("motion/holds", b"garbage")
    with pytest.raises(WrongSource) as caught:
        require_speaker("motion/holds", encode(Holds(source="sa/1", holds={})))
    assert caught.value.values["source"] == "sa/1"
    assert caught.value.values["key"] == "motion/holds"
