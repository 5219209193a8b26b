"""Arrays on the wire: what `of` takes, `view` gives back; what does not fit is refused."""

from typing import Any

import msgpack
import msgspec
import numpy as np
import pytest
from hypothesis import given
from hypothesis.extra import numpy as hnp
from numpy.typing import NDArray

from fras_common.codec import MalformedMessage, decode, encode
from fras_common.messages import Array, SolverReport, TissueState

SHAPES = hnp.array_shapes(min_dims=0, max_dims=4, min_side=0, max_side=5)


def packed(**change: Any) -> bytes:
    payload = msgpack.packb({"dtype": "<f4", "shape": [2, 1], "data": bytes(8)} | change)
    assert payload is not None
    return payload


@given(hnp.arrays(np.float64, SHAPES))
def test_doubles_come_back_bit_for_bit(values: NDArray[np.float64]):
    array = decode(Array, encode(Array.of(values, "<f8")), "key")
    assert array.shape == values.shape
    assert array.view().tobytes() == values.tobytes()
    np.testing.assert_array_equal(array.floats(), values)


@given(hnp.arrays(np.int32, SHAPES))
def test_integers_come_back_whatever_their_order_in_memory(values: NDArray[np.int32]):
    array = decode(Array, encode(Array.of(values.T, "<i4")), "key")
    np.testing.assert_array_equal(array.ints(), values.T)
    wider = Array.of(values[..., ::-1] if values.ndim else values, "<i8")
    np.testing.assert_array_equal(wider.ints(), values[..., ::-1] if values.ndim else values)


@given(hnp.arrays(np.float32, SHAPES))
def test_floats_keep_their_precision(values: NDArray[np.float32]):
    array = Array.of(values.astype(np.float64), "<f4")
    np.testing.assert_array_equal(array.view(), values)
    assert array.floats().dtype == np.float64


def test_a_view_copies_nothing_and_cannot_be_written():
    array = Array.of(np.arange(6.0).reshape(2, 3), "<f8")
    view = array.view()
    assert not view.flags.writeable
    assert np.shares_memory(view, np.frombuffer(array.data, np.uint8))


def test_of_copies():
    values = np.zeros(3)
    array = Array.of(values, "<f8")
    values[0] = 1.0
    assert array.floats()[0] == 0.0


def test_the_bytes_are_little_endian_in_c_order():
    array = Array.of(np.array([[1, 2], [3, 4]], dtype=">i4", order="F"), "<i4")
    assert array.data == b"".join(n.to_bytes(4, "little") for n in (1, 2, 3, 4))


@pytest.mark.parametrize("values", [[2**31], [-(2**31) - 1], [1.5], [float("nan")]])
def test_what_is_no_fitting_integer_is_not_bent_into_one(values: list[float]):
    with (
        pytest.raises(ValueError, match="not every value is an integer that fits <i4"),
        np.errstate(invalid="ignore"),
    ):
        Array.of(np.array(values), "<i4")


@pytest.mark.parametrize(
    ("change", "problem"),
    [
        ({"data": bytes(7)}, "7 bytes do not fill"),
        ({"data": bytes(9)}, "9 bytes do not fill"),
        ({"data": b""}, "0 bytes do not fill"),
        ({"dtype": "<f8"}, "expected 16"),
        ({"shape": [-1, -2]}, "negative extent"),
        ({"shape": [-2, 0], "data": b""}, "negative extent"),
        ({"shape": [2**62, 2**62]}, "more than"),
        ({"shape": [2**40, 0], "data": b""}, "more than"),
        ({"shape": [2, *[1] * 60]}, "dimensions"),
        ({"shape": [2**63]}, "more than"),
        ({"shape": [1.0, 2]}, "int"),
        ({"dtype": "|O"}, "Invalid enum value"),
        ({"dtype": ">f4"}, "Invalid enum value"),
        ({"data": "12345678"}, "bytes"),
    ],
)
def test_what_does_not_fit_is_malformed(change: dict[str, Any], problem: str):
    decode(Array, packed(), "key")
    with pytest.raises(MalformedMessage, match=problem):
        decode(Array, packed(**change), "key")


@given(hnp.array_shapes(min_dims=0, max_dims=12, min_side=0, max_side=2**20))
def test_whatever_the_codec_lets_through_can_be_viewed(shape: tuple[int, ...]):
    size = 4 * int(np.prod(shape, dtype=object))
    try:
        array = decode(Array, packed(shape=shape, data=bytes(size if size < 1000 else 8)), "key")
    except MalformedMessage:
        return
    assert array.view().shape == shape


@pytest.mark.parametrize(
    ("field", "values", "dtype"),
    [
        ("nodes_m", np.zeros((2, 3)), "<f8"),
        ("nodes_m", np.zeros((2, 2)), "<f4"),
        ("nodal_force_n", np.zeros(3), "<f4"),
        ("patch_force_n", np.zeros((2, 3)), "<f8"),
    ],
)
def test_message_refuses_an_array_of_another_type_or_shape(
    field: str, values: Any, dtype: Any
) -> None:
    good = {"nodes_m": Array.of(np.zeros((2, 3)), "<f4")}
    good["nodal_force_n"] = good["patch_force_n"] = good["nodes_m"]
    raw = msgspec.to_builtins(
        {
            "max_force_n": 0.0,
            "max_node_speed_m_s": 0.0,
            "tool_force_n": {},
            "grasped": {},
            "grasped_force_n": {},
            "balance_residual_n": 0.0,
            "solver": SolverReport(
                iterations=0,
                residual=0.0,
                refactored=False,
                wall_s=0.0,
                converged=True,
                inverted_elements=0,
            ),
            **good,
        },
        builtin_types=(bytes,),
    )
    decode(TissueState, encode(raw), "sim/tissue_state")
    raw[field] = msgspec.to_builtins(Array.of(values, dtype), builtin_types=(bytes,))
    with pytest.raises(MalformedMessage, match=rf"{field} is .*expected <f4"):
        decode(TissueState, encode(raw), "sim/tissue_state")
