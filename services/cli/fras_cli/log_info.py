"""`fras log info`: what is in a log."""

from dataclasses import dataclass
from pathlib import Path

from rich.console import Console
from rich.table import Table

from fras_cli.display import OUTCOME_WORDS
from fras_cli.report import read_trial, summarise
from fras_common.codec import read_header
from fras_common.topics import topic_of
from fras_log.reader import LogReader


@dataclass
class KeyTally:
    """What one key holds."""

    messages: int = 0
    size_bytes: int = 0
    first_ns: int = 0
    last_ns: int = 0

    def add(self, payload: bytes) -> None:
        """Count one message."""
        header = read_header(payload)
        if header is not None:
            self.first_ns = self.first_ns or header.stamp_ns
            self.last_ns = header.stamp_ns
        self.messages += 1
        self.size_bytes += len(payload)

    @property
    def rate_hz(self) -> float | None:
        """Mean rate, where there are two messages or more."""
        span_ns = self.last_ns - self.first_ns
        return (self.messages - 1) * 1e9 / span_ns if span_ns > 0 else None


def tally(path: Path) -> dict[str, KeyTally]:
    """Count messages, bytes and rates of each key."""
    keys: dict[str, KeyTally] = {}
    for message in LogReader(path).messages():
        keys.setdefault(message.key, KeyTally()).add(message.payload)
    return keys


def print_info(path: Path, console: Console) -> None:
    """Print keys, counts and rates, then outcome and gaps."""
    trial = read_trial(path)
    table = Table("key", "type", "messages", "a second", "bytes")
    for key, counted in sorted(tally(path).items()):
        topic = topic_of(key)
        rate = f"{counted.rate_hz:.1f}" if counted.rate_hz is not None else "-"
        kind = topic.type.__name__ if topic is not None else "unknown"
        table.add_row(key, kind, str(counted.messages), rate, str(counted.size_bytes))
    console.print(table)
    summary = summarise(trial)
    console.print(OUTCOME_WORDS[summary.outcome], summary.reason)
    console.print(
        f"{summary.messages} messages, {summary.lost} lost, {summary.ticks} ticks, "
        f"{summary.sim_s:.1f} s simulated in {summary.wall_s:.1f} s, "
        f"{'file complete' if summary.complete else 'cut off: what was flushed is here'}"
    )
