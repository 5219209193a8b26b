"""Holding what was recorded against what is derived again, field by field."""

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, TypeVar, cast

import msgspec
import numpy as np

from fras_common.codec import encode
from fras_common.messages import Array, Header

H = TypeVar("H", bound=Header)

Leaf = tuple[str, object, object]
Dict = dict[str, Any]
Row = Sequence[Any]
_MISSING = "nothing"


@dataclass(frozen=True)
class Difference:
    """One message that is not what it should be, by its first field that differs.

    Parameters
    ----------
    where : str
        Which message, in words: `tick 41`, `context c3`.
    seq : int
        Its number on its key; -1 where nothing was recorded.
    path : str
        The field, `arms.psm1.setpoint_joints[2]`; empty where a whole message is missing.
    recorded, derived : object
        Both values.
    """

    where: str
    seq: int
    path: str
    recorded: object
    derived: object


@dataclass(frozen=True)
class Tolerance:
    """How far numbers may be apart that another build computed.

    Parameters
    ----------
    otherwise : float
        Absolute, and relative to the larger magnitude, for every field not named.
    fields : mapping of str to float
        Absolute, by a field's path or the first part of it; infinite: not looked at.
    """

    otherwise: float
    fields: Mapping[str, float] = field(default_factory=dict[str, float])

    def admits(self, path: str, recorded: object, derived: object) -> bool:
        """Whether a difference is none."""
        root = path.partition(".")[0].partition("[")[0]
        allowed = self.fields.get(path, self.fields.get(root))
        if allowed is not None and math.isinf(allowed):
            return True
        if not (_is_number(recorded) and _is_number(derived)):
            return False
        a, b = float(str(recorded)), float(str(derived))
        if allowed is not None:
            return abs(a - b) <= allowed
        return math.isclose(a, b, rel_tol=self.otherwise, abs_tol=self.otherwise)


@dataclass
class Tally:
    """How many messages of one kind were compared, and what came of it.

    Parameters
    ----------
    service, what : str
        Whose they are, and which.
    total : int
        How many the log holds.
    tolerance : Tolerance or None
        None: every bit counts.

    Attributes
    ----------
    seen : int
        How many of those in the log were compared.
    tolerated : int
        Messages that are equal within the tolerance, not by the last bit; among `equal`.
    first : Difference or None
    notes : list of str
        What could not be derived, from where on, and why.
    """

    service: str
    what: str
    total: int
    tolerance: Tolerance | None = None
    seen: int = 0
    compared: int = 0
    equal: int = 0
    tolerated: int = 0
    first: Difference | None = None
    notes: list[str] = field(default_factory=list[str])

    @property
    def differences(self) -> int:
        """Messages that differ."""
        return self.compared - self.equal

    @property
    def skipped(self) -> int:
        """Messages of the log that nothing could be held against."""
        return max(0, self.total - self.seen)

    @property
    def is_clean(self) -> bool:
        """Whether every message of the log was compared, and none differs."""
        return self.differences == 0 == self.skipped

    def compare(self, where: str, recorded: object, derived: object, seq: int = -1) -> bool:
        """Compare two values of one type, headers as they are; True if they are equal."""
        self.seen += 1
        self.compared += 1
        if encode(recorded) == encode(derived):
            self.equal += 1
            return True
        apart = list(leaves(recorded, derived))
        tolerance = self.tolerance
        beyond = [leaf for leaf in apart if tolerance is None or not tolerance.admits(*leaf)]
        if beyond:
            self._note(Difference(where, seq, *beyond[0]))
            return False
        self.equal += 1
        self.tolerated += bool(apart)
        return True

    def compare_messages(self, where: str, recorded: H, derived: H) -> bool:
        """Compare two published messages; number, stamp and source are the publisher's own."""
        return self.compare(where, unstamped(recorded), unstamped(derived), recorded.seq)

    def lacks(self, where: str, derived: object) -> None:
        """Note a message that must have been recorded and was not."""
        self.compared += 1
        self._note(Difference(where, -1, "", _MISSING, derived))

    def surplus(self, where: str, recorded: object, seq: int = -1) -> None:
        """Note a message that was recorded and must not have been."""
        self.seen += 1
        self.compared += 1
        self._note(Difference(where, seq, "", recorded, _MISSING))

    def _note(self, difference: Difference) -> None:
        if self.first is None:
            self.first = difference


def unstamped(message: H) -> H:
    """Return a message without what its publisher fills in."""
    return msgspec.structs.replace(message, stamp_ns=0, seq=0, source="")


def leaves(recorded: Any, derived: Any, path: str = "") -> Iterator[Leaf]:
    """Yield path and both values of everything in which two values differ."""
    if isinstance(recorded, Array) and isinstance(derived, Array):
        yield from _array_leaves(recorded, derived, path)
    elif isinstance(recorded, msgspec.Struct) and type(recorded) is type(derived):
        for name in recorded.__struct_fields__:
            inside = f"{path}.{name}" if path else name
            yield from leaves(getattr(recorded, name), getattr(derived, name), inside)
    elif isinstance(recorded, dict) and isinstance(derived, dict):
        yield from _dict_leaves(cast("Dict", recorded), cast("Dict", derived), path)
    elif isinstance(recorded, list | tuple) and isinstance(derived, list | tuple):
        yield from _list_leaves(cast("Row", recorded), cast("Row", derived), path)
    elif recorded is msgspec.UNSET or derived is msgspec.UNSET:
        # A field that is left out of the message; it has no encoding of its own.
        if recorded is not derived:
            yield path, recorded, derived
    elif encode(cast("object", recorded)) != encode(cast("object", derived)):
        yield path, recorded, derived


def _dict_leaves(recorded: Dict, derived: Dict, path: str) -> Iterator[Leaf]:
    for key in recorded | derived:
        inside = f"{path}.{key}" if path else key
        if key in recorded and key in derived:
            yield from leaves(recorded[key], derived[key], inside)
        else:
            yield inside, recorded.get(key, _MISSING), derived.get(key, _MISSING)


def _list_leaves(recorded: Row, derived: Row, path: str) -> Iterator[Leaf]:
    shared = min(len(recorded), len(derived))
    for index in range(shared):
        yield from leaves(recorded[index], derived[index], f"{path}[{index}]")
    if len(recorded) != len(derived):
        rows = [row[shared] if len(row) > shared else _MISSING for row in (recorded, derived)]
        yield f"{path}[{shared}]", rows[0], rows[1]


def _array_leaves(recorded: Array, derived: Array, path: str) -> Iterator[Leaf]:
    if (recorded.dtype, recorded.shape) != (derived.dtype, derived.shape):
        yield path, f"{recorded.dtype} {recorded.shape}", f"{derived.dtype} {derived.shape}"
        return
    a, b = recorded.view(), derived.view()
    item = a.dtype.itemsize
    # Bit by bit: a NaN is equal to itself here, and -0.0 is not 0.0.
    bits = [
        np.frombuffer(one.data, dtype=f"<u{item}").reshape(one.shape) for one in (recorded, derived)
    ]
    for index in np.argwhere(bits[0] != bits[1]).tolist():
        place = "".join(f"[{number}]" for number in index)
        yield f"{path}{place}", a[tuple(index)].item(), b[tuple(index)].item()


def _is_number(value: object) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool)
