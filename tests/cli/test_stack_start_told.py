"""A start that takes long says who is waited for, once."""

from typing import Any, cast

import pytest

from fras_cli import stack
from fras_cli.link import Link


class OneMissing:
    is_open = True

    def missing(self) -> list[str]:
        return ["sim"]


def watched(monkeypatch: pytest.MonkeyPatch, link: Any, clock: list[float]) -> Any:
    monkeypatch.setattr(stack.time, "monotonic", lambda: clock[0])
    told: list[str] = []
    return stack.told_when_slow(cast("Link", link), lambda: clock[0] > 100.0, told.append), told


def test_a_slow_start_names_who_is_missing_once(monkeypatch: pytest.MonkeyPatch) -> None:
    clock = [0.0]
    cancelled, told = watched(monkeypatch, OneMissing(), clock)
    assert not cancelled()
    assert told == []
    clock[0] = stack.PATIENCE_S + 0.1
    assert not cancelled()
    assert not cancelled()
    assert len(told) == 1
    assert "waiting for sim" in told[0]
    clock[0] = 101.0
    assert cancelled()


def test_before_the_router_is_there_nobody_is_asked(monkeypatch: pytest.MonkeyPatch) -> None:
    clock = [0.0]
    link = OneMissing()
    link.is_open = False
    cancelled, told = watched(monkeypatch, link, clock)
    clock[0] = 50.0
    assert not cancelled()
    assert told == []
