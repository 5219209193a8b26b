"""What all messages share: the header, arrays, and poses."""

import math
from collections.abc import Mapping
from typing import TYPE_CHECKING, Annotated, Literal, Self

import msgspec

if TYPE_CHECKING:
    # Loaded where an array is made or looked at: who only hands messages on needs none of it.
    import numpy as np
    from numpy.typing import NDArray

Vec3 = tuple[float, float, float]
Quaternion = tuple[float, float, float, float]
DType = Literal["<f4", "<f8", "<i4", "<i8"]
TrialName = Annotated[str, msgspec.Meta(max_length=200, pattern=r"^[^\x00-\x1f\x7f]*$")]
"""Of who begins a trial; it stands in each message, in logs and on screens."""

MAX_ARRAY_BYTES = 64 * 1024 * 1024
MAX_DIMENSIONS = 8


class Wire(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Base of everything on the wire: immutable, named fields, nothing unknown accepted."""


class Header(Wire, frozen=True, kw_only=True):
    """First fields of every published message; `stamp_ns`, `seq` and `source` are the bus's.

    Attributes
    ----------
    stamp_ns : int
        Producer's clock when it published [ns since the Unix epoch].
    tick : int
        Simulation tick that the content belongs to, or -1.
    seq : int
        Count of this publisher on this key, without gaps, from 0.
    source : str
        Service name and instance, `sim/3f2a`.
    trial : str
        Trial that the content belongs to, or "".
    """

    stamp_ns: int = 0
    tick: int = -1
    seq: int = 0
    source: str = ""
    trial: str = ""


class Array(Wire, frozen=True, kw_only=True):
    """A numeric array as raw little-endian bytes in C order."""

    dtype: DType
    shape: tuple[int, ...]
    data: bytes

    def __post_init__(self) -> None:
        if any(extent < 0 for extent in self.shape):
            raise ValueError(f"shape {self.shape} has a negative extent")
        if len(self.shape) > MAX_DIMENSIONS:
            raise ValueError(f"{len(self.shape)} dimensions, more than {MAX_DIMENSIONS}")
        item = int(self.dtype[2])
        # NumPy refuses extents that would overflow even where another one is zero.
        if (largest := math.prod(max(1, extent) for extent in self.shape) * item) > MAX_ARRAY_BYTES:
            raise ValueError(f"{largest} bytes, more than the {MAX_ARRAY_BYTES} allowed")
        expected = math.prod(self.shape) * item
        if len(self.data) != expected:
            raise ValueError(
                f"{len(self.data)} bytes do not fill shape {self.shape} of {self.dtype}: "
                f"expected {expected}"
            )

    @classmethod
    def of(cls, values: "NDArray[np.generic]", dtype: DType) -> Self:
        """Copy `values` into a message field, converted to `dtype`.

        Raises
        ------
        ValueError
            If `dtype` is an integer type that can't hold every value exactly.
        """
        import numpy as np

        array = np.asarray(values, dtype=np.dtype(dtype), order="C")
        if array.dtype.kind == "i" and not np.array_equal(array, values):
            raise ValueError(f"not every value is an integer that fits {dtype}")
        return cls(dtype=dtype, shape=array.shape, data=array.tobytes())

    def view(self) -> "NDArray[np.generic]":
        """Read-only view on the received bytes, shape and dtype as sent."""
        import numpy as np

        return np.frombuffer(self.data, dtype=np.dtype(self.dtype)).reshape(self.shape)

    def floats(self) -> "NDArray[np.float64]":
        """Content as a float64 array of the same shape."""
        return self.view().astype("f8")

    def ints(self) -> "NDArray[np.int32]":
        """Content as an int32 array of the same shape."""
        return self.view().astype("i4")


class Pose(Wire, frozen=True, kw_only=True):
    """Position and orientation in the frame that the field's name says."""

    position_m: Vec3
    quaternion_xyzw: Quaternion


Columns = int | Literal["any"] | None
"""Columns of a two-dimensional array, `any` number of them, or None for a plain list."""


def require_arrays(message: Wire, allowed: Mapping[str, tuple[DType, Columns]]) -> None:
    """Refuse arrays of another type or shape than their fields promise.

    Raises
    ------
    ValueError
        Naming the field; the codec turns it into a `MalformedMessage`.
    """
    for name, (dtype, columns) in allowed.items():
        array: Array = getattr(message, name)
        rank = 1 if columns is None else 2
        width_fits = not isinstance(columns, int) or array.shape[1:] == (columns,)
        if array.dtype != dtype or len(array.shape) != rank or not width_fits:
            wanted = "(n,)" if columns is None else f"(n, {columns})"
            raise ValueError(
                f"{name} is {array.dtype} of shape {array.shape}: expected {dtype}, {wanted}"
            )


def require_finite(what: str, *values: float) -> None:
    """Refuse NaN and infinity in a command.

    Raises
    ------
    ValueError
        Naming the field; the codec turns it into a `MalformedMessage` with the field's path.
    """
    if not all(math.isfinite(value) for value in values):
        raise ValueError(f"{what} is not finite: {values}")
