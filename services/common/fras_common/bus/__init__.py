"""The bus: publish, subscribe, ask, serve, be seen. Two implementations of one contract."""

from fras_common.bus.contract import (
    Bus,
    BusClosed,
    Call,
    Latest,
    NoAnswer,
    Publisher,
    RawPublisher,
    RawSample,
    RemoteFault,
)
from fras_common.bus.memory_bus import MemoryBus, MemoryFabric

__all__ = [
    "Bus",
    "BusClosed",
    "Call",
    "Latest",
    "MemoryBus",
    "MemoryFabric",
    "NoAnswer",
    "Publisher",
    "RawPublisher",
    "RawSample",
    "RemoteFault",
]
