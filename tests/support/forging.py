"""A log written anew with some of its messages changed: whole, and with checksums that fit."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

from fras_common.bus import RawSample
from fras_common.codec import decode, encode, read_header
from fras_common.topics import topic_of
from fras_log import LogFile, LogReader
from fras_log.attachments import read_attachments

# A message of the key in; what stands in the forged log out, or None to leave it out.
Change = Callable[[Any], Any]


def rewrite(log: Path, out: Path, key: str, change: Change) -> Path:
    """Write a copy of `log` to `out` with each message of `key` changed; returns `out`."""
    topic = topic_of(key)
    assert topic is not None
    reader = LogReader(log)
    attachments = read_attachments(log)
    file: LogFile | None = None
    for message in reader.messages():
        if file is None:
            file = LogFile(out, reader.metadata, attachments, 0)
        payload = message.payload
        if message.key == key:
            changed = change(decode(topic.type, payload, key))
            if changed is None:
                continue
            payload = encode(changed)
        header = read_header(payload)
        arrival_ns = header.stamp_ns if header is not None else 0
        file.write(RawSample(message.key, payload, "application/msgpack"), arrival_ns)
    assert file is not None
    file.close({})
    return out
