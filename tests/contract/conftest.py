"""What the contract tests share: both buses behind one fixture, and strategies for messages."""

import re
import socket
import threading
import types
import typing
import uuid
from collections.abc import Callable, Iterator
from typing import Annotated, Any, Literal, Protocol, get_args, get_origin

import msgspec
import numpy as np
import pytest
from hypothesis import strategies as st

from fras_common.bus import Bus, MemoryBus, MemoryFabric, RawSample
from fras_common.bus.contract import OnMalformed
from fras_common.bus.zenoh_bus import ZenohBus
from fras_common.bus.zenoh_router import route
from fras_common.messages import Array

WAIT_S = 10.0

Strategies = Callable[[type[Any]], st.SearchStrategy[Any]]


class Router:
    """A Zenoh router in a thread of this process, on a free port that it keeps over restarts."""

    def __init__(self) -> None:
        with socket.socket() as probe:
            probe.bind(("127.0.0.1", 0))
            self.endpoint = f"tcp/127.0.0.1:{probe.getsockname()[1]}"
        self._end = threading.Event()
        self._thread = threading.Thread()

    def start(self) -> None:
        self._end = threading.Event()
        self._thread = threading.Thread(target=route, args=([self.endpoint], self._end.wait))
        self._thread.start()

    def stop(self) -> None:
        self._end.set()
        self._thread.join(WAIT_S)
        assert not self._thread.is_alive()


class Open(Protocol):
    """Opens a participant: `open_bus("sim/a", cell="other")`; closed at the end of the test."""

    def __call__(
        self,
        source: str,
        *,
        cell: str = "one",
        on_malformed: OnMalformed = ...,
        clock_ns: Callable[[], int] = ...,
    ) -> Bus: ...


@pytest.fixture(scope="session")
def router() -> Iterator[Router]:
    router = Router()
    router.start()
    yield router
    router.stop()


@pytest.fixture
def own_router() -> Iterator[Router]:
    """A router that the test may stop and start."""
    router = Router()
    router.start()
    yield router
    router.stop()


@pytest.fixture(params=["memory", "zenoh"])
def open_bus(request: pytest.FixtureRequest) -> Iterator[Open]:
    buses: list[Bus] = []
    fabric = MemoryFabric()
    run = uuid.uuid4().hex[:8]

    def open_bus(source: str, *, cell: str = "one", **settings: Any) -> Bus:
        if request.param == "memory":
            bus: Bus = MemoryBus(fabric, cell, source, **settings)
        else:
            router: Router = request.getfixturevalue("router")
            bus = ZenohBus(f"{cell}-{run}", router.endpoint, source, **settings)
        buses.append(bus)
        return bus

    yield open_bus
    for bus in buses:
        bus.close()


class Heard(list[Any]):
    """Collects what callbacks deliver, on whatever thread; tests wait for what it holds."""

    def __init__(self) -> None:
        super().__init__()
        self._changed = threading.Condition()

    def __call__(self, *arguments: Any) -> None:
        with self._changed:
            self.append(arguments[0] if len(arguments) == 1 else arguments)
            self._changed.notify_all()

    def until(self, fits: Callable[[list[Any]], bool], timeout_s: float = WAIT_S) -> list[Any]:
        """Wait until the content fits; returns it as it then was."""
        with self._changed:
            assert self._changed.wait_for(lambda: fits(self), timeout_s), f"only heard {self[-5:]}"
            return list(self)

    def count(self, number: int) -> list[Any]:  # type: ignore[override]
        """Wait for at least `number` deliveries."""
        return self.until(lambda heard: len(heard) >= number)


def cached(bus: Bus, key_expr: str = "**") -> list[RawSample]:
    """What publishers still cache."""
    done = Heard()
    bus.cached(key_expr, done, WAIT_S)
    return done.count(1)[0]


@pytest.fixture(name="cached")
def cached_fixture() -> Callable[..., list[RawSample]]:
    """Asks a bus for what publishers still cache."""
    return cached


@pytest.fixture
def listen() -> Callable[[], Heard]:
    """Makes collectors: `heard = listen()` is a callback that one can wait on."""
    return Heard


def _number(kind: type[Any], metas: list[msgspec.Meta]) -> st.SearchStrategy[Any]:
    bounds: dict[str, Any] = {}
    for meta in metas:
        if kind is int:
            low = meta.ge if meta.ge is not None else (None if meta.gt is None else meta.gt + 1)
            high = meta.le if meta.le is not None else (None if meta.lt is None else meta.lt - 1)
            bounds |= {"min_value": low, "max_value": high}
        else:
            low = meta.gt if meta.ge is None else meta.ge
            high = meta.lt if meta.le is None else meta.le
            bounds |= {"min_value": low, "max_value": high}
            bounds |= {"exclude_min": meta.gt is not None, "exclude_max": meta.lt is not None}
    bounds = {name: value for name, value in bounds.items() if value is not None}
    if kind is int:
        return st.integers(**{"min_value": -(2**31), "max_value": 2**53} | bounds)
    return st.floats(**bounds, allow_nan=False, allow_infinity=False)


@st.composite
def _arrays(draw: st.DrawFn) -> Array:
    shape = tuple(draw(st.lists(st.integers(0, 4), max_size=3)))
    dtype: Any = draw(st.sampled_from(["<f4", "<f8", "<i4", "<i8"]))
    values = draw(
        st.lists(
            st.integers(-1000, 1000), min_size=int(np.prod(shape)), max_size=int(np.prod(shape))
        )
    )
    return Array.of(np.array(values, dtype=np.int64).reshape(shape), dtype)


@st.composite
def _shaped(draw: st.DrawFn, dtype: Any, columns: int | str | None) -> Array:
    rows = draw(st.integers(0, 3))
    width: Any = draw(st.integers(0, 4)) if columns == "any" else columns
    shape = (rows,) if width is None else (rows, width)
    values = draw(st.lists(st.integers(-9, 9), min_size=12, max_size=12))
    return Array.of(np.resize(np.array(values), shape), dtype)


def _text(metas: list[msgspec.Meta]) -> st.SearchStrategy[str]:
    patterns = [re.compile(meta.pattern) for meta in metas if meta.pattern]
    return st.text(max_size=6).filter(lambda text: all(one.search(text) for one in patterns))


def _of(annotation: Any, metas: list[msgspec.Meta] | None = None) -> st.SearchStrategy[Any]:
    """Strategy for a field's annotation; fails on a kind of field that it does not know."""
    origin, arguments = get_origin(annotation), get_args(annotation)
    if origin is Annotated:
        return _of(arguments[0], [part for part in arguments[1:] if isinstance(part, msgspec.Meta)])
    if origin is Literal:
        return st.sampled_from(arguments)
    if origin in (typing.Union, types.UnionType):
        return st.one_of(*[_of(part) for part in arguments])
    if origin is tuple and arguments[-1] is not Ellipsis:
        return st.tuples(*[_of(part) for part in arguments])
    if origin in (list, tuple):
        return st.lists(_of(arguments[0]), max_size=2).map(origin)
    if origin is dict:
        return st.dictionaries(*[_of(part) for part in arguments], max_size=2)
    if annotation is msgspec.UnsetType:
        return st.just(msgspec.UNSET)
    if annotation is Array:
        return _arrays()
    if annotation is msgspec.Raw:
        return st.dictionaries(st.text(max_size=3), st.integers(0, 9), max_size=2).map(
            lambda content: msgspec.Raw(msgspec.msgpack.encode(content))
        )
    if isinstance(annotation, type) and issubclass(annotation, msgspec.Struct):
        fields = msgspec.structs.fields(annotation)
        shaped = getattr(annotation, "ARRAYS", {})
        return st.builds(
            annotation,
            **{
                field.name: _shaped(*shaped[field.name])
                if field.name in shaped
                else _of(field.type)
                for field in fields
            },
        )
    simple: dict[Any, st.SearchStrategy[Any]] = {
        type(None): st.none(),
        bool: st.booleans(),
        str: _text(metas or []),
        bytes: st.binary(max_size=8),
    }
    return simple[annotation] if annotation in simple else _number(annotation, metas or [])


@pytest.fixture(scope="session")
def instances() -> Strategies:
    """Strategy of valid instances of a Struct type, from its annotations alone."""
    return _of
