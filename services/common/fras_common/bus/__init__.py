"""The bus: publish, subscribe, ask, serve, be seen. Two implementations of one contract."""

from fras_common.bus.contract import (
    Bus,
    BusClosed,
    Call,
    NoAnswer,
    Publisher,
    RawPublisher,
    RawSample,
    Recent,
    RemoteFault,
)
from fras_common.bus.memory_bus import MemoryBus, MemoryFabric

__all__ = [
    "Bus",
    "BusClosed",
    "Call",
    "MemoryBus",
    "MemoryFabric",
    "NoAnswer",
    "Publisher",
    "RawPublisher",
    "RawSample",
    "Recent",
    "RemoteFault",
]
