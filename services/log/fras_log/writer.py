"""One audit log: an MCAP file that holds every sample of a trial verbatim.

Topic = key without the cell, message encoding `msgpack`, schema = JSON Schema of the type,
publish time = producer's stamp, log time = arrival. Readable by any MCAP reader.
"""

import json
import os
import sys
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

from mcap.writer import CompressionType, Writer

from fras_common.bus import RawSample
from fras_common.codec import HeaderFields, json_schema, read_header
from fras_common.topics import may_be_lost, topic_of
from fras_log.chain import (
    Chain,
    Checkpoint,
    closing_to_sign,
    first_head,
    leaf,
    record_digest,
    to_sign,
)
from fras_log.channels import Definition
from fras_log.errors import LogExists
from fras_log.keys import Signer
from fras_log.names import BESIDE, CHECKPOINT, CLOSED, MEDIA_TYPE, METADATA, PROFILE
from fras_log.streams import Streams

CHUNK_BYTES = 1024 * 1024
# What a message takes besides its payload: many empty ones fill a chunk, too.
MESSAGE_BYTES = 64


class LogFile:
    """Writes one file; not thread-safe: its owner calls from one thread.

    Parameters
    ----------
    path : Path
        Must not exist; its directory is made.
    metadata : mapping of str to str
        Written first, as the MCAP metadata record `fras`.
    attachments : mapping of name to bytes
        Files that belong to the trial, e.g. the scenario.
    now_ns : int
        Wall clock for the attachments.
    signer : Signer, optional
        Signs the checkpoints of the chain.
    fsync : bool
        Whether a flush waits until the disk has it.
    streams : Streams, optional
        What the files before this one of the same log hold.

    Raises
    ------
    LogExists
        If there is a file at `path` already.
    """

    def __init__(
        self,
        path: Path,
        metadata: Mapping[str, str],
        attachments: Mapping[str, bytes],
        now_ns: int,
        signer: Signer | None = None,
        *,
        fsync: bool = False,
        streams: Streams | None = None,
    ) -> None:
        path.parent.mkdir(parents=True, exist_ok=True)
        if os.path.lexists(path):
            raise _exists(path)
        # It gets its name when it says what it is: a recorder that is killed before, or whose disk
        # is full, leaves no file of the log that says nothing.
        beside = path.with_name(path.name + ".new")
        beside.unlink(missing_ok=True)
        self._stream = beside.open("xb")
        self.path = path
        self.bytes_written = 0
        self.messages = 0
        self.lost = 0
        self._streams = streams or Streams()
        self._signer = signer
        self._fsync = fsync
        self._chunk_bytes = 0
        opening = dict(metadata)
        if signer is not None:
            opening["public_key"] = signer.public.raw.hex()
        self._chain = Chain(first_head(opening, attachments))
        self._definitions: dict[tuple[str, str], Definition] = {}
        self._channels: dict[bytes, int] = {}
        self._schemas: dict[tuple[str, str, bytes], int] = {}
        self._beside: dict[str, str] = {}
        self._writer = Writer(
            self._stream,
            # Chunks are closed by `flush` alone, each with its checkpoint.
            chunk_size=sys.maxsize,
            compression=CompressionType.ZSTD,
            enable_crcs=True,
            enable_data_crcs=True,
        )
        try:
            self._begin(opening, attachments, now_ns)
            _name(beside, path)
        except (OSError, LogExists):
            self.abandon()
            beside.unlink(missing_ok=True)
            raise

    def _begin(
        self, opening: Mapping[str, str], attachments: Mapping[str, bytes], now_ns: int
    ) -> None:
        self._writer.start(profile=PROFILE, library="fras_recorder")
        self._writer.add_metadata(METADATA, dict(opening))
        for name, data in attachments.items():
            self._writer.add_attachment(
                create_time=now_ns,
                log_time=now_ns,
                name=name,
                media_type=MEDIA_TYPE,
                data=data,
            )
        self.flush()

    def write(self, sample: RawSample, arrival_ns: int) -> HeaderFields | None:
        """Append a sample, unless it is a copy of one that the file holds already.

        Returns
        -------
        HeaderFields or None
            The sample's header; None for a payload without one, which is recorded all the same.
        """
        header = read_header(sample.payload)
        if header is not None:
            missing = self._streams.note(sample.key, header)
            if missing is None:
                return header
            if missing and not may_be_lost(sample.key):
                self.lost += missing
        stamp_ns, sequence = (arrival_ns, 0) if header is None else (header.stamp_ns, header.seq)
        self.append(self._define(sample), arrival_ns, stamp_ns, sequence, sample.payload)
        return header

    def append(
        self, channel: Definition, log_time: int, publish_time: int, sequence: int, payload: bytes
    ) -> None:
        """Append a message as it is, whatever its payload says of itself."""
        self._writer.add_message(
            channel_id=self._channel(channel),
            log_time=log_time,
            data=payload,
            publish_time=publish_time,
            sequence=sequence,
        )
        self._chain.add(leaf(channel.digest, log_time, publish_time, sequence, payload))
        self.messages += 1
        self._chunk_bytes += len(payload) + MESSAGE_BYTES
        if self._chunk_bytes >= CHUNK_BYTES:
            self.flush()

    def flush(self) -> None:
        """Close the chunk under way with its checkpoint, and hand both to the operating system."""
        self._writer.flush()
        if self._chain.open:
            self._writer.add_metadata(CHECKPOINT, self._checkpoint().as_metadata())
        self._stream.flush()
        if self._fsync:
            os.fsync(self._stream.fileno())
        self._chunk_bytes = 0
        self.bytes_written = self._stream.tell()

    @property
    def channels(self) -> int:
        """How many channels there are: keys, and ways in which their payloads travelled."""
        return len(self._channels)

    @property
    def head(self) -> str:
        """Head of the chain after the last message, hexadecimal."""
        return self._chain.head.hex()

    def add_metadata(self, name: str, content: Mapping[str, str]) -> None:
        """Say something about the log, once by each name; the closing record vouches for it."""
        self._writer.add_metadata(name, dict(content))
        self._beside[BESIDE + name] = record_digest(content)

    def close(self, summary: Mapping[str, str]) -> None:
        """Write the closing metadata and the index, and close the file."""
        self.flush()
        vouched = {"head": self.head, "messages": str(self.messages), "signature": ""}
        closing = {**summary, **self._beside, **vouched}
        if self._signer is not None:
            closing["signature"] = self._signer.sign(closing_to_sign(closing)).hex()
        self._writer.add_metadata(CLOSED, closing)
        self._writer.finish()
        self.bytes_written = self._stream.tell()
        self._stream.flush()
        if self._fsync:
            os.fsync(self._stream.fileno())
        self._stream.close()

    def _checkpoint(self) -> Checkpoint:
        checkpoint = self._chain.checkpoint()
        if self._signer is None:
            return checkpoint
        text = to_sign(checkpoint.messages, checkpoint.head)
        return replace(checkpoint, signature=self._signer.sign(text))

    def abandon(self) -> None:
        """Let go of a file that can't be written any more; what was flushed stays readable."""
        # The raw stream: a buffered one would try again to write what just failed.
        self._stream.raw.close()

    def _define(self, sample: RawSample) -> Definition:
        name = (sample.key, sample.encoding)
        if name not in self._definitions:
            self._definitions[name] = _definition(sample)
        return self._definitions[name]

    def _channel(self, channel: Definition) -> int:
        number = self._channels.get(channel.digest)
        if number is None:
            number = self._channels[channel.digest] = self._writer.register_channel(
                topic=channel.topic,
                message_encoding=channel.message_encoding,
                schema_id=self._schema(channel),
                metadata=dict(channel.metadata),
            )
        return number

    def _schema(self, channel: Definition) -> int:
        if not channel.schema:
            return 0
        schema = (channel.schema, channel.schema_encoding, channel.schema_data)
        if schema not in self._schemas:
            self._schemas[schema] = self._writer.register_schema(*schema)
        return self._schemas[schema]


def _name(beside: Path, path: Path) -> None:
    """Give a file its name; another one of that name stays."""
    try:
        os.link(beside, path)
    except FileExistsError as error:
        raise _exists(path) from error
    except OSError as error:
        # Not every file system knows a second name.
        if os.path.lexists(path):
            raise _exists(path) from error
        beside.rename(path)
    else:
        beside.unlink()


def _exists(path: Path) -> LogExists:
    return LogExists(
        f"{path} exists: a log is never written over, choose another directory", path=path
    )


def _definition(sample: RawSample) -> Definition:
    topic = topic_of(sample.key)
    metadata = (("zenoh_encoding", sample.encoding),)
    if topic is None:
        return Definition(sample.key, "msgpack", metadata)
    return Definition(
        sample.key,
        "msgpack",
        metadata,
        schema=f"fras.{topic.type.__name__}",
        schema_encoding="jsonschema",
        schema_data=json.dumps(json_schema(topic.type)).encode(),
    )
