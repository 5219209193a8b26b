"""Hostile payloads from a seed: bytes that nobody should send, and where they hurt most.

Half of them are genuine messages that were damaged in one or a few places, for random bytes alone
hardly come past the first byte of a decoder.
"""

import random
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Final, cast

import msgspec

Tree = dict[str, Any]

NESTED: Final = 10_000
LONG_TEXT: Final = 10 * 2**20
DEEP: Final = b"\x91" * NESTED + b"\x90"
DEEP_MAP: Final = b"\x81\xa1a" * NESTED + b"\x80"

NUMBERS: Final[tuple[Any, ...]] = (
    *(float("nan"), float("inf"), float("-inf"), 1e308, -1e308, 5e-324, -0.0, 0.5),
    *(0, 1, -1, 2, 7, 255, 2**31 - 1, 2**31, 2**32, 2**53, 2**63 - 1, -(2**63), 2**64 - 1),
)
TEXTS: Final[tuple[str, ...]] = (
    *("", "\0", "a\nb", "../../etc/passwd", "/", "psm1", "psm3", "b(1,1)", "b(0,0)", "b(9,9)"),
    *("b(99999999999,1)", "b(1,", "visible_roi", "-visible_roi", "x" * 70_000, "\u202e\U0001f600"),
    *("reach(psm1,b(1,1))", "#const n=1.", "**", "@", "sim/tissue_state", "client:cancel"),
)
OTHERS: Final[tuple[Any, ...]] = (None, True, False, b"", b"\xff" * 9, [], {}, [[]], {"a": {}})
DTYPES: Final = ("<f4", "<f8", "<i4", "<i8", "<U1000000", ">f8", "O", "")
SHAPES: Final[tuple[list[int], ...]] = (
    *([], [0], [-1, 3], [3, -1], [2**31, 2**31], [2**62, 0], [1] * 70, [1, 3], [3], [7, 3]),
)


@dataclass(frozen=True)
class Payload:
    """Bytes for a key, and in a word what was done to them."""

    key: str
    kind: str
    data: bytes


class Hostile:
    """Makes payloads; the same ones of the same seed.

    Parameters
    ----------
    seed : int
    genuine : mapping of str to sequence of bytes
        What travels on each key.
    """

    def __init__(self, seed: int, genuine: Mapping[str, Sequence[bytes]]) -> None:
        self._chance = random.Random(seed)
        self._genuine = genuine
        self._bytes: dict[str, Callable[[bytes], bytes]] = {
            "random": lambda _: self._chance.randbytes(self._chance.randrange(200)),
            "cut": lambda data: data[: self._chance.randrange(len(data) + 1)],
            "flipped": self._flip,
            "longer": lambda data: data + self._chance.randbytes(1 + self._chance.randrange(8)),
            "spliced": self._splice,
            "deep": lambda _: self._chance.choice((DEEP, DEEP_MAP)),
            "twice": _repeat_keys,
        }
        self._trees: dict[str, Callable[[Any], Any]] = {
            "value": self._change,
            "values": lambda tree: self._change(self._change(self._change(tree))),
            "left out": self._leave_out,
            "unknown": self._add_unknown,
            "array": self._change_array,
            "deep value": lambda tree: self._put(tree, msgspec.Raw(DEEP_MAP)),
            "old": self._age,
            "other trial": lambda tree: {**tree, "trial": f"other-{self._chance.randrange(9)}"},
        }

    def payload(self, key: str) -> Payload:
        """Make one for a key."""
        data = self._chance.choice(self._genuine[key])
        if self._chance.randrange(2_000) == 0:
            return Payload(key, "long text", msgspec.msgpack.encode({"source": "x" * LONG_TEXT}))
        if self._chance.random() < 0.4:
            kind = self._chance.choice(list(self._bytes))
            return Payload(key, kind, self._bytes[kind](data))
        tree = msgspec.msgpack.decode(data)
        kind = self._chance.choice(list(self._trees))
        return Payload(key, kind, msgspec.msgpack.encode(self._trees[kind](tree)))

    # --- bytes ----------------------------------------------------------------------------

    def _flip(self, data: bytes) -> bytes:
        changed = bytearray(data)
        for _ in range(self._chance.choice((1, 1, 2, 8))):
            if changed:
                changed[self._chance.randrange(len(changed))] ^= 1 << self._chance.randrange(8)
        return bytes(changed)

    def _splice(self, data: bytes) -> bytes:
        other = self._chance.choice(self._genuine[self._chance.choice(list(self._genuine))])
        cut = self._chance.randrange(len(data) + 1)
        return data[:cut] + other[self._chance.randrange(len(other) + 1) :]

    # --- values ---------------------------------------------------------------------------

    def _value(self, before: Any) -> Any:
        kinds = (NUMBERS, TEXTS, OTHERS)
        if isinstance(before, bool):
            return not before
        if isinstance(before, int | float) and self._chance.random() < 0.8:
            return self._chance.choice(NUMBERS)
        if isinstance(before, str) and self._chance.random() < 0.8:
            return self._chance.choice(TEXTS)
        if isinstance(before, list) and self._chance.random() < 0.8:
            return self._lengthen(cast("list[Any]", before))
        return self._chance.choice(self._chance.choice(kinds))

    def _lengthen(self, before: list[Any]) -> list[Any]:
        return self._chance.choice((before[:-1], before + before, before[:1] * 200, before[::-1]))

    def _change(self, tree: Any) -> Any:
        """Replace one value somewhere in a tree."""
        if not isinstance(tree, dict | list) or not tree or self._chance.random() < 0.05:
            return self._value(tree)
        if isinstance(tree, list):
            items = cast("list[Any]", tree)
            index = self._chance.randrange(len(items))
            return [self._change(one) if index == at else one for at, one in enumerate(items)]
        fields = cast("Tree", tree)
        name = self._chance.choice(list(fields))
        if self._chance.random() < 0.03:
            return {**fields, self._chance.choice(TEXTS): fields[name]}
        return {**fields, name: self._change(fields[name])}

    def _put(self, tree: Any, value: Any) -> Any:
        if not isinstance(tree, dict) or not tree:
            return value
        fields = cast("Tree", tree)
        name = self._chance.choice(list(fields))
        return {**fields, name: self._put(fields[name], value)}

    def _leave_out(self, tree: Any) -> Any:
        name = self._chance.choice(list(tree))
        return {key: value for key, value in tree.items() if key != name}

    def _add_unknown(self, tree: Any) -> Any:
        return {**tree, self._chance.choice(TEXTS): self._chance.choice(NUMBERS)}

    def _change_array(self, tree: Any) -> Any:
        arrays = [name for name, value in tree.items() if _is_array(value)]
        if not arrays:
            return self._change(tree)
        name = self._chance.choice(arrays)
        array, field = dict(tree[name]), self._chance.choice(("dtype", "shape", "data", "numbers"))
        if field == "dtype":
            array["dtype"] = self._chance.choice(DTYPES)
        elif field == "shape":
            array["shape"] = self._chance.choice((*SHAPES, array["shape"][::-1]))
        elif field == "data":
            array["data"] = array["data"][: self._chance.randrange(len(array["data"]) + 1)]
        else:
            # It fits, and says what can't be: NaN, or nodes that there are not.
            array["data"] = self._chance.choice((b"\xff", b"\x7f", b"\0")) * len(array["data"])
        return {**tree, name: array}

    def _age(self, tree: Any) -> Any:
        aged = {name: tree[name] for name in ("seq", "tick", "stamp_ns") if name in tree}
        return {**tree, **{name: self._chance.choice((0, -1, 1, 2**31)) for name in aged}}


def _is_array(value: Any) -> bool:
    return isinstance(value, dict) and set(cast("Tree", value)) == {"dtype", "shape", "data"}


def _repeat_keys(data: bytes) -> bytes:
    """Have each field of a map stand in it twice."""
    tree = msgspec.msgpack.decode(data)
    if not isinstance(tree, dict):
        return data + data
    pairs = [
        msgspec.msgpack.encode(name) + msgspec.msgpack.encode(value)
        for name, value in cast("Tree", tree).items()
    ]
    return b"\xde" + (2 * len(pairs)).to_bytes(2, "big") + b"".join(pairs + pairs)
