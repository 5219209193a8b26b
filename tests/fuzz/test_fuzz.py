"""`fras bench fuzz` in small; and that it finds what it looks for."""

import logging
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
import structlog
from benchmarks import fuzz_rounds as rounds
from benchmarks.fuzz_genuine import TRIAL, genuine_payloads
from benchmarks.fuzz_payloads import DEEP, DEEP_MAP, Hostile, Payload
from benchmarks.fuzz_stack import Heard, Stack, run_trial, stack

from fras_common import codec
from fras_common.codec import MalformedMessage, decode, encode
from fras_common.messages import LastRequest
from fras_common.topics import QUERIES, TOPICS, topic_of

PAYLOADS = 2_000


@pytest.fixture(autouse=True)
def quiet_logs() -> Iterator[None]:
    before = structlog.get_config()
    structlog.configure(wrapper_class=structlog.make_filtering_bound_logger(logging.CRITICAL))
    yield
    structlog.configure(**before)


@pytest.fixture(scope="module")
def heard(tmp_path_factory: pytest.TempPathFactory) -> Heard:
    folder = tmp_path_factory.mktemp("genuine")
    with stack(folder) as one:
        return run_trial(one, TRIAL, folder / "trial", lambda: None)


@pytest.fixture
def one(tmp_path: Path) -> Iterator[Stack]:
    with stack(tmp_path) as made:
        yield made


def test_hostile_input_of_every_kind_breaks_nothing(tmp_path: Path) -> None:
    found = rounds.fuzz(PAYLOADS, 1, tmp_path)
    assert found.wrong == []
    for what in (
        *("decoders: malformed", "decoders: taken", "services: malformed", "services: taken"),
        *("files: refused", "files: read", "beside a trial: refused"),
    ):
        assert found.done[what] > 0, what


def test_every_key_of_the_table_has_a_genuine_payload(heard: Heard) -> None:
    genuine = genuine_payloads(heard)
    for query in QUERIES:
        for payload in genuine[f"?{query.key}"]:
            decode(query.request, payload, query.key, query.max_bytes)
    for topic in TOPICS:
        said = [key for key in genuine if topic_of(key) is topic]
        assert said, topic.key
        for key in said:
            for payload in genuine[key]:
                decode(topic.type, payload, key, topic.max_bytes)


def test_the_same_seed_makes_the_same_payloads_and_of_every_kind(heard: Heard) -> None:
    genuine = genuine_payloads(heard)
    keys = sorted(genuine) * 40
    one, other = Hostile(3, genuine), Hostile(3, genuine)
    made = [one.payload(key) for key in keys]
    assert made == [other.payload(key) for key in keys]
    kinds = {payload.kind for payload in made}
    assert kinds >= {
        "random",
        "cut",
        "flipped",
        "spliced",
        "deep",
        "twice",
        "value",
        "array",
        "old",
    }


@pytest.mark.parametrize("payload", [DEEP, DEEP_MAP, b"\x84" * 9, b""], ids=["", "map", "4", "0"])
def test_nesting_without_end_is_malformed_on_every_key(payload: bytes) -> None:
    for topic in TOPICS:
        with pytest.raises(MalformedMessage):
            decode(topic.type, payload, topic.key)


def test_it_finds_an_exception_that_is_no_fras_error(
    heard: Heard, monkeypatch: pytest.MonkeyPatch
) -> None:
    def decoder(kind: type[Any]) -> Any:
        def broken(payload: bytes) -> Any:
            raise KeyError(kind)

        return broken

    monkeypatch.setattr(codec, "_decoder", decoder)
    found = rounds.Findings()
    genuine = genuine_payloads(heard)
    rounds.fuzz_decoders(Hostile(1, genuine), ["sa/verdict"], 5, found)
    assert len(found.wrong) == 5
    assert "KeyError" in found.wrong[0]


def test_it_finds_a_service_that_breaks_and_one_that_does_not_count(
    one: Stack, monkeypatch: pytest.MonkeyPatch
) -> None:
    found = rounds.Findings()
    payload = Payload("?recorder/last", "genuine", encode(LastRequest(key="k")))
    rounds.send(one, payload, found)
    assert found.wrong == []

    def broken(*_: object) -> bytes:
        raise IndexError("beyond")

    monkeypatch.setattr("fras_recorder.memory.Memory.last", broken)
    rounds.send(one, payload, found)
    assert "an internal fault" in found.wrong[-1]
    garbage = Payload("?recorder/last", "random", b"\xc1")
    rounds.send(one, garbage, found)
    assert len(found.wrong) == 1
    with monkeypatch.context() as patch:
        patch.setattr(Stack, "malformed", 0)
        rounds.send(one, garbage, found)
    assert "counted 0 times, 1 services read it" in found.wrong[-1]


def test_it_finds_a_trial_that_went_another_way(heard: Heard, tmp_path: Path) -> None:
    found = rounds.Findings()
    genuine = genuine_payloads(heard)
    other = {**heard, "robot/state": heard["robot/state"][:-1]}
    rounds.fuzz_trial(Hostile(1, genuine), ["?motion/hold"], 0, other, tmp_path, found)
    (problem,) = found.wrong
    assert "robot/state is not what it is without the noise" in problem
