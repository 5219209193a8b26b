"""`fras log show`: the messages of a key, readable or as JSON lines."""

import base64
import json
import math
from collections.abc import Iterator
from pathlib import Path
from typing import Any, cast

import msgpack
from rich.console import Console
from rich.markup import escape

from fras_common.codec import read_header
from fras_common.errors import FrasError
from fras_log.events import Broken, Cut, Recorded
from fras_log.pieces import scan_log

MOST_ITEMS = 8
MOST_BYTES = 16


class NoSuchKey(FrasError):
    """The log holds no message of that key. Attributes: ``key``."""


class NoSuchTicks(FrasError):
    """The log holds no message of that key in these ticks. Attributes: ``key``."""


def show_log(
    path: Path,
    key: str,
    console: Console,
    *,
    as_json: bool,
    first_tick: int | None,
    last_tick: int | None,
) -> None:
    """Print the messages of a key.

    Parameters
    ----------
    path : Path
    key : str
        Without the cell.
    console : Console
        For people; JSON goes to standard output.
    as_json : bool
        One object a line, all of it, bytes as base64 text.
    first_tick, last_tick : int or None
        Show only messages of these ticks, both included.

    Raises
    ------
    NoSuchLog, NotAnMcap
    NoSuchKey
        Names the keys that there are.
    NoSuchTicks
        Names the ticks that the key has.
    """
    keys: set[str] = set()
    ticks: list[int] = []
    shown = 0
    for event in scan_log(path):
        if isinstance(event, Broken | Cut):
            console.print(f"damaged at offset {event.offset}: {escape(event.text)}", style="red")
        if not isinstance(event, Recorded):
            continue
        keys.add(event.topic)
        if event.topic != key:
            continue
        content = _decode(event.payload)
        header = read_header(event.payload)
        tick = header.tick if header is not None else -1
        ticks.append(tick)
        if (first_tick is not None and tick < first_tick) or (
            last_tick is not None and tick > last_tick
        ):
            continue
        shown += 1
        if as_json:
            print(json.dumps(_plain(content)))
        else:
            console.print("\n".join(_lines(content)), markup=False, highlight=False)
            console.print()
    if key not in keys:
        known = ", ".join(sorted(keys)) or "none at all"
        raise NoSuchKey(f"{path} holds no message of {key!r}; its keys: {known}", key=key)
    if not shown:
        there = f"{min(ticks)} to {max(ticks)}"
        raise NoSuchTicks(
            f"{path} holds no message of {key!r} in these ticks; it has {there}", key=key
        )


def _decode(payload: bytes) -> Any:
    """Decode MessagePack with no knowledge of its type, which the library has none of either.

    What is no MessagePack stays the bytes that it is.
    """
    try:
        return cast(Any, msgpack).unpackb(payload, strict_map_key=False)
    except (ValueError, OverflowError, RecursionError, msgpack.UnpackException):
        return payload


def _plain(value: Any) -> Any:
    """Return a value as JSON has it."""
    if isinstance(value, bytes):
        return base64.b64encode(value).decode()
    if isinstance(value, dict):
        return {str(name): _plain(one) for name, one in cast(dict[Any, Any], value).items()}
    if isinstance(value, list):
        return [_plain(one) for one in cast(list[Any], value)]
    if isinstance(value, float) and not math.isfinite(value):
        return str(value)  # JSON has no such number
    if not isinstance(value, str | int | float | None):
        return str(value)  # MessagePack's extensions
    return value


def _lines(value: Any, name: str = "", depth: int = 0) -> Iterator[str]:
    """Tell a value in lines; long lists and bytes by their beginning and size."""
    margin = "  " * depth + (f"{name}: " if name else "")
    if isinstance(value, dict) and value:
        if name:
            yield margin.rstrip()
        for key, one in cast(dict[Any, Any], value).items():
            yield from _lines(one, str(key), depth + bool(name))
    elif isinstance(value, bytes):
        more = "..." if len(value) > MOST_BYTES else ""
        yield f"{margin}{len(value)} bytes {value[:MOST_BYTES].hex()}{more}"
    elif isinstance(value, list):
        items = cast(list[Any], value)
        shown = ", ".join(str(_plain(one)) for one in items[:MOST_ITEMS])
        more = f", ... ({len(items)} in all)" if len(items) > MOST_ITEMS else ""
        yield f"{margin}[{shown}{more}]"
    else:
        yield f"{margin}{value}"
