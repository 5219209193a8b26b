"""viser's client, as a browser starts it soonest.

viser ships its client as one page, whose script unpacks the program, 2.5 MB, and hands it to the
browser as text: compiled only then, on the thread that draws. Here the program is a file of its
own, which the page announces, so that a browser compiles it while it arrives and keeps the result.
"""

import gzip
import hashlib
import re
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Final

import numpy as np
import viser
import zstandard

_SHIPPED: Final = Path(viser.__file__).parent / "client" / "build" / "index.html"
# What viser's script unpacks: style and program, how long they are, packed in text.
_PACKED: Final = re.compile(r'data-p="([^"]*)" data-ss="(\d+)" data-cs="(\d+)"')
_DIGITS: Final = (
    "!#$%()*+,-./0123456789:;=?@ABCDEFGHIJKLMNOPQRSTUVWXYZ[\\]^_abcdefghijklmnopqrstuvwxyz{|}~"
)
_CHARACTERS: Final = 5  # of the text, for each four bytes
_BYTES: Final = 4
# viser can't be told to leave out its panel, which hides an instrument and opens developers'
# settings: a window of its own, or on a narrow screen a sheet.
_WITHOUT_PANEL: Final = (
    "<style>[data-floating-window],[data-dock-region],.mantine-ScrollArea-root"
    "{display:none !important}</style></head>"
)
_LEVEL: Final = 6


@dataclass(frozen=True)
class Text:
    """What a browser is sent, as it is and packed.

    Attributes
    ----------
    plain : bytes
    """

    plain: bytes

    @cached_property
    def packed(self) -> bytes:
        """The same by gzip."""
        return gzip.compress(self.plain, _LEVEL)


@dataclass(frozen=True)
class Client:
    """A page, and the program that it asks for.

    Attributes
    ----------
    page : Text
    program : Text or None
        None: it is still in the page, since this viser packs it in a way that is not known here.
    name : str
        The program's path below the folder in which that of the page is.
    """

    page: Text
    program: Text | None
    name: str


def take_apart(shipped: str) -> Client:
    """Make page and program of viser's one page.

    Parameters
    ----------
    shipped : str
        `index.html`, as viser ships it.
    """
    shown = shipped.replace("</head>", _WITHOUT_PANEL, 1)
    found = _PACKED.search(shown)
    if found is None:
        return Client(Text(shown.encode()), None, "")
    style_bytes = int(found[2])
    unpacked = zstandard.ZstdDecompressor().decompress(to_bytes(found[1]))
    program = unpacked[style_bytes:]
    name = f"client-{hashlib.sha256(program).hexdigest()[:16]}.js"
    # viser's script does all that it did, with a program of one line.
    call = f'import("../{name}")'.encode()
    packed = zstandard.ZstdCompressor(19).compress(unpacked[:style_bytes] + call)
    attributes = f'data-p="{to_text(packed)}" data-ss="{style_bytes}" data-cs="{len(call)}"'
    before, after = shown[: found.start()], shown[found.end() :]
    announced = f'<link rel="modulepreload" href="../{name}">'
    head, script, rest = before.rpartition("<script ")
    page = head + announced + script + rest + attributes + after
    return Client(Text(page.encode()), Text(program), name)


def read_client() -> Client:
    """Return the client of the viser that is installed, packed already."""
    client = take_apart(_SHIPPED.read_text("utf-8"))
    for one in (client.page, client.program):
        if one is not None:
            _ = one.packed
    return client


def to_bytes(text: str) -> bytes:
    """Decode as viser's script does: each group is a number to base 88, its bytes big-endian."""
    table = np.zeros(128, dtype=np.int64)
    table[np.frombuffer(_DIGITS.encode(), dtype=np.uint8)] = np.arange(len(_DIGITS))
    digits = table[np.frombuffer(text.encode("ascii"), dtype=np.uint8)]
    whole = len(digits) // _CHARACTERS
    base = len(_DIGITS) ** np.arange(_CHARACTERS - 1, -1, -1, dtype=np.int64)
    numbers = digits[: whole * _CHARACTERS].reshape(whole, _CHARACTERS) @ base
    left = digits[whole * _CHARACTERS :]
    last = int(left @ base[len(base) - len(left) :]) if len(left) else 0
    return numbers.astype(">u4").tobytes() + last.to_bytes(max(len(left) - 1, 0), "big")


def to_text(data: bytes) -> str:
    """Encode what viser's script decodes."""
    groups = (data[at : at + _BYTES] for at in range(0, len(data), _BYTES))
    return "".join(_group(int.from_bytes(group, "big"), len(group) + 1) for group in groups)


def _group(number: int, count: int) -> str:
    digits: list[str] = []
    for _ in range(count):
        number, digit = divmod(number, len(_DIGITS))
        digits.append(_DIGITS[digit])
    return "".join(reversed(digits))
