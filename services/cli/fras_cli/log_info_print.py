"""`fras log info`, for people."""

import msgspec
from rich.console import Console
from rich.markup import escape
from rich.table import Table

from fras_cli.display import OUTCOME_WORDS
from fras_cli.log_info import LogInfo
from fras_common.topics import may_be_lost


def print_info(info: LogInfo, console: Console) -> None:
    """Print keys with counts and rates, gaps, then how the trial ended and what the log is."""
    table = Table("key", "type", "messages", "a second", "bytes")
    for one in info.keys:
        rate = f"{one.rate_hz:.1f}" if one.rate_hz is not None else "-"
        row = (one.key, one.type or "unknown", str(one.messages), rate, str(one.bytes))
        table.add_row(*map(escape, row))
    console.print(table)
    for gap in info.gaps:
        text = f"{gap.missing} messages of {gap.key} from {gap.publisher} are missing"
        text += ", as telemetry may be." if may_be_lost(gap.key) else "."
        console.print(escape(text))
    console.print(OUTCOME_WORDS[info.outcome], escape(info.reason))
    console.print(
        f"{info.messages} messages, {info.lost} lost, {info.ticks} ticks, "
        f"{info.sim_s:.1f} s simulated in {info.wall_s:.1f} s, "
        f"{'file complete' if info.complete else 'cut off: what was flushed is here'}"
    )
    for one in info.files if len(info.files) > 1 else ():
        ended = {"": "never finished"}.get(one.reason, one.reason)
        text = f"{one.file}: {one.messages} messages, {one.bytes} bytes, ended: {ended}"
        console.print(escape(text))
    facts = Table(show_header=False, box=None)
    for name, value in _facts(info):
        facts.add_row(name, escape(value or "not said"))
    console.print(facts)


def print_json(info: LogInfo) -> None:
    """Print it as JSON."""
    print(msgspec.json.format(msgspec.json.encode(info), indent=2).decode())


def _facts(info: LogInfo) -> list[tuple[str, str]]:
    versions = ", ".join(f"{name} {version}" for name, version in info.versions.items())
    table = {None: "", True: ", as here", False: ", another than here"}[info.own_topics]
    signed = f"with key {info.signed_by}, not verified: fras log verify" if info.signed_by else "no"
    return [
        ("trial", info.trial),
        ("host", info.host),
        ("versions", versions),
        ("build", info.build),
        ("duration", f"{info.duration_s:.1f} s"),
        ("size", f"{info.size_bytes} bytes"),
        ("rules", info.asp_digest),
        ("topics", f"{info.topics_digest}{table}"),
        ("attached", ", ".join(info.attachments) or "nothing"),
        ("head", info.head),
        ("signed", signed),
    ]
