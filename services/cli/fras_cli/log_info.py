"""`fras log info`: what is in a log, in numbers."""

from collections import Counter
from dataclasses import dataclass, field
from pathlib import Path

import msgspec

from fras_cli.report import Summary, read_trial, summarise
from fras_common.codec import read_header
from fras_common.digests import own_table_digest
from fras_common.topics import topic_of
from fras_log.attachments import read_attachments
from fras_log.keys import PublicKey
from fras_log.reader import LogReader

VERSION = "_version"


class KeyInfo(msgspec.Struct, frozen=True, kw_only=True):
    """What one key holds; `type` is None for a key that FRAS does not know."""

    key: str
    type: str | None
    messages: int
    bytes: int
    rate_hz: float | None


class GapInfo(msgspec.Struct, frozen=True, kw_only=True):
    """How many messages of a publisher are missing on a key, by their numbers."""

    key: str
    publisher: str
    missing: int


class FileInfo(msgspec.Struct, frozen=True, kw_only=True):
    """One file of the log; `reason` says why it ended, and is empty where nobody finished it."""

    file: str
    messages: int
    bytes: int
    reason: str


class LogInfo(msgspec.Struct, frozen=True, kw_only=True):
    """What `fras log info --json` tells; empty text or None where the log does not say.

    Attributes
    ----------
    size_bytes : int
        Of all its files.
    complete : bool
        Whether it was read to its end; else `damage` says why not.
    duration_s : float
        From the arrival of the first message to that of the last, by the recorder's clock.
    asp_digest, topics_digest : str
        SHA-256 of the planner's rules, and of the topic table.
    own_topics : bool or None
        Whether that table is the one of this FRAS.
    head : str
        Of the chain, from the closing record.
    signed_by : str
        Fingerprint of the key that the log names and is signed with, if that is true: nothing is
        verified here.
    attachments : dict of str to int
        Bytes by name.
    """

    log: str
    size_bytes: int
    trial: str
    outcome: str
    reason: str
    complete: bool
    damage: str
    messages: int
    lost: int
    duration_s: float
    ticks: int
    sim_s: float
    wall_s: float
    host: str
    versions: dict[str, str]
    build: str
    asp_digest: str
    topics_digest: str
    own_topics: bool | None
    head: str
    signed_by: str
    attachments: dict[str, int]
    files: list[FileInfo]
    keys: list[KeyInfo]
    gaps: list[GapInfo]


@dataclass
class KeyTally:
    """What one key holds, and the numbers of its publishers."""

    messages: int = 0
    size_bytes: int = 0
    first_ns: int = 0
    last_ns: int = 0
    missing: dict[str, int] = field(default_factory=dict[str, int])
    _last: dict[str, int] = field(default_factory=dict[str, int])

    def add(self, payload: bytes) -> None:
        """Count one message."""
        self.messages += 1
        self.size_bytes += len(payload)
        header = read_header(payload)
        if header is None:
            return
        self.first_ns = self.first_ns or header.stamp_ns
        self.last_ns = header.stamp_ns
        last = self._last.get(header.source, header.seq)
        if header.seq > last + 1:
            self.missing[header.source] = self.missing.get(header.source, 0) + header.seq - last - 1
        self._last[header.source] = max(header.seq, last)

    @property
    def rate_hz(self) -> float | None:
        """Mean rate, where there are two messages or more."""
        span_ns = self.last_ns - self.first_ns
        return (self.messages - 1) * 1e9 / span_ns if span_ns > 0 else None


def tally(path: Path) -> dict[str, KeyTally]:
    """Count messages, bytes, rates and gaps of each key."""
    return _count(LogReader(path)).keys


@dataclass
class _Counted:
    """Tallies by key, messages by file, and how long messages arrived."""

    keys: dict[str, KeyTally]
    files: Counter[str]
    duration_s: float


def _count(reader: LogReader) -> _Counted:
    tallies: dict[str, KeyTally] = {}
    files: Counter[str] = Counter()
    first_ns = last_ns = 0
    for message in reader.messages():
        tallies.setdefault(message.key, KeyTally()).add(message.payload)
        files[reader.file] += 1
        first_ns = first_ns or message.arrival_ns
        last_ns = message.arrival_ns
    return _Counted(dict(sorted(tallies.items())), files, (last_ns - first_ns) / 1e9)


def read_info(path: Path) -> LogInfo:
    """Count what a log holds, whole or cut.

    Raises
    ------
    NoSuchLog, NotAnMcap, ForeignLog, ScenarioError
    """
    summary = summarise(read_trial(path))
    reader = LogReader(path)
    return _info(path, summary, reader, _count(reader))


def _info(path: Path, summary: Summary, reader: LogReader, counted: _Counted) -> LogInfo:
    said = reader.metadata
    table = said.get("topics_digest", "")
    return LogInfo(
        log=str(path),
        size_bytes=reader.size,
        trial=said["trial"],
        outcome=summary.outcome,
        reason=summary.reason,
        complete=summary.complete,
        damage=reader.damage,
        messages=summary.messages,
        lost=summary.lost,
        duration_s=counted.duration_s,
        ticks=summary.ticks,
        sim_s=summary.sim_s,
        wall_s=summary.wall_s,
        host=said.get("host", ""),
        versions={k.removesuffix(VERSION): v for k, v in said.items() if k.endswith(VERSION)},
        build=said.get("build", ""),
        asp_digest=said.get("asp_digest", ""),
        topics_digest=table,
        own_topics=table == own_table_digest() if table else None,
        head=reader.closing.get("head", ""),
        signed_by=_signer(reader),
        attachments={name: len(data) for name, data in read_attachments(path).items()},
        files=[
            FileInfo(
                file=file.name,
                messages=counted.files[file.name],
                bytes=file.stat().st_size,
                reason=reader.ends.get(file.name, ""),
            )
            for file in reader.files
            if file.is_file()
        ],
        keys=[_key(key, tally) for key, tally in counted.keys.items()],
        gaps=[
            GapInfo(key=key, publisher=publisher, missing=missing)
            for key, tally in counted.keys.items()
            for publisher, missing in sorted(tally.missing.items())
        ],
    )


def _key(key: str, tally: KeyTally) -> KeyInfo:
    topic = topic_of(key)
    return KeyInfo(
        key=key,
        type=topic.type.__name__ if topic is not None else None,
        messages=tally.messages,
        bytes=tally.size_bytes,
        rate_hz=tally.rate_hz,
    )


def _signer(reader: LogReader) -> str:
    """Name the key that the opening record names, if the closing record bears a signature."""
    if not reader.closing.get("signature"):
        return ""
    try:
        raw = bytes.fromhex(reader.metadata.get("public_key", ""))
    except ValueError:
        return ""
    return PublicKey(raw).fingerprint if raw else ""
