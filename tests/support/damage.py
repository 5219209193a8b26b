"""A signed log that a real `LogFile` wrote, to be damaged, and what is in it."""

import io
from collections.abc import Callable
from pathlib import Path
from typing import Any, NamedTuple

import msgspec
import numpy as np
from mcap.reader import make_reader

from fras_common.bus import RawSample
from fras_common.codec import encode
from fras_common.messages import (
    Header,
    LogRecord,
    RobotState,
    TissueState,
    Verdict,
)
from fras_log import AuditLog, LogFile, Signer, Verification
from support import verdicts
from support.forger import ChunkPiece, chunks, take_apart
from support.tissues import let_alone

Verify = Callable[[bytes], Verification]
"""Verifies bytes as a file of a log whose signer is known."""

TRIAL = "t-1"
START_NS = 1_760_000_000_000_000_000
OPENING = {"trial": TRIAL, "fras_version": "0.0.1", "scenario": 'name = "ä"\n'}
ATTACHMENTS = {"scenario.toml": b"seed = 1\n" * 20, "mesh": bytes(range(256)) * 3}
TICKS = 42
PER_CHUNK = 5
"""Ticks between two flushes."""


class Message(NamedTuple):
    """All that the stock reader says of a message."""

    topic: str
    log_time: int
    publish_time: int
    sequence: int
    payload: bytes
    schema: tuple[str, str, bytes] | None
    channel: tuple[str, tuple[tuple[str, str], ...]]


def verdict(tick: int, **changes: Any) -> Verdict:
    told: dict[str, Any] = {"max_force_n": 0.01 * tick, "visibility": 0.1, **changes}
    return verdicts.verdict(tick, **told)


def robot(tick: int) -> RobotState:
    return RobotState(tick=tick, arms={}, action=None, holds={}, verdict_tick=tick - 1)


def tissue(tick: int, nodes: int = 16) -> TissueState:
    places = np.random.default_rng(tick).normal(size=(nodes, 3))
    return let_alone(tick, places, places * 0.01, max_force_n=0.01 * tick)


class Recording:
    """Stamps messages and writes them as they would arrive."""

    def __init__(self, file: LogFile | AuditLog) -> None:
        self.file = file
        self.now_ns = START_NS
        self._seqs: dict[str, int] = {}

    def put(self, key: str, message: Header, skip: int = 0) -> None:
        self.now_ns += 500_000
        seq = self._seqs.get(key, 0) + skip
        self._seqs[key] = seq + 1
        stamped = msgspec.structs.replace(
            message,
            stamp_ns=self.now_ns - 1000,
            seq=seq,
            source=f"{key.partition('/')[0]}/1",
            trial=TRIAL,
        )
        self.file.write(RawSample(key, encode(stamped), "application/msgpack"), self.now_ns)

    def tick(self, tick: int) -> None:
        self.put("robot/state", robot(tick))
        self.put("sim/tissue_state", tissue(tick))
        self.put("sa/verdict", verdict(tick))

    def raw(self, key: str, payload: bytes, encoding: str = "") -> None:
        self.now_ns += 500_000
        self.file.write(RawSample(key, payload, encoding), self.now_ns)


def write_log(path: Path, signer: Signer | None, **opening: str) -> LogFile:
    """A whole log of `TICKS` ticks: nine chunks, keys that come late, one that nobody knows."""
    file = LogFile(path, OPENING | opening, ATTACHMENTS, START_NS, signer)
    recording = Recording(file)
    for tick in range(TICKS):
        recording.tick(tick)
        if tick % 7 == 3:
            fields = {"note": "x" * tick}
            record = LogRecord(tick=tick, level="info", event="noted", fields=fields)
            recording.put(f"log/{'sim' if tick < 30 else 'late'}", record)
        if tick % 11 == 5:
            recording.raw("someone/else", bytes([tick]) * tick, "text/plain")
        if tick % PER_CHUNK == PER_CHUNK - 1:
            file.flush()
    file.close({"reason": "closed", "lost": "0"})
    return file


def read_stock(data: bytes) -> list[Message]:
    """What the library's own reader finds, in the order of the file, its checks on."""
    reader = make_reader(io.BytesIO(data), validate_crcs=True)
    return [
        Message(
            channel.topic,
            message.log_time,
            message.publish_time,
            message.sequence,
            message.data,
            (schema.name, schema.encoding, schema.data) if schema is not None else None,
            (channel.message_encoding, tuple(channel.metadata.items())),
        )
        for schema, channel, message in reader.iter_messages(log_time_order=False)
    ]


class Whole:
    """The log as it was written: its bytes, its chunks, and the messages of each."""

    def __init__(self, data: bytes) -> None:
        self.data = data
        self.messages = read_stock(data)
        self.pieces = take_apart(data)
        self.chunks: list[ChunkPiece] = chunks(self.pieces)
        self.per_chunk: list[list[Message]] = []
        rest = list(self.messages)
        for chunk in self.chunks:
            count = len(chunk.messages)
            self.per_chunk.append(rest[:count])
            rest = rest[count:]
        assert not rest

    def before(self, end: int) -> list[Message]:
        """The messages of all chunks that end there at the latest."""
        return [
            message
            for chunk, messages in zip(self.chunks, self.per_chunk, strict=True)
            if chunk.end <= end
            for message in messages
        ]

    def undamaged(self, position: int) -> list[Message]:
        """The messages of all chunks that this byte is not in.

        A chunk's first two fields say when its messages arrived, as they say themselves.
        """
        return [
            message
            for chunk, messages in zip(self.chunks, self.per_chunk, strict=True)
            if not chunk.offset <= position < chunk.end
            or chunk.offset + 9 <= position < chunk.offset + 9 + 16
            for message in messages
        ]
