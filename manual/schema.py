"""Types and docstrings of messages and scenarios, in words."""

from typing import Any, Final

import griffe
import msgspec
from msgspec import inspect

from fras_common.scenario import Scenario
from fras_common.scenario.model import Section
from manual.markdown import code

UNITS: Final = {
    "_kg_m3": "kg/m³",
    "_m_s2": "m/s²",
    "_m_s3": "m/s³",
    "_m_s": "m/s",
    "_rad_s": "rad/s",
    "_n_s": "N/s",
    "_ns": "ns",
    "_pa": "Pa",
    "_rad": "rad",
    "_s": "s",
    "_m": "m",
    "_n": "N",
    "_hz": "Hz",
    "_bytes": "bytes",
    "_percent": "%",
}
"""Suffix of a field's name to its unit; the first that fits counts."""

_NAMES: Final[dict[type[inspect.Type], str]] = {
    inspect.StrType: "text",
    inspect.IntType: "int",
    inspect.FloatType: "float",
    inspect.BoolType: "bool",
    inspect.BytesType: "bytes",
    inspect.AnyType: "anything",
    inspect.RawType: "any message",
}


def unit_of(name: str) -> str:
    """Return the unit that a field's name says; empty for none."""
    return next((unit for suffix, unit in UNITS.items() if name.endswith(suffix)), "")


def told(kind: type) -> tuple[str, dict[str, tuple[str, str]]]:
    """Return what a docstring says of its class, and of each field: its type and its meaning."""
    text, fields = "", dict[str, tuple[str, str]]()
    for section in griffe.Docstring(kind.__doc__ or "", parser="numpy").parse():
        if section.kind is griffe.DocstringSectionKind.text:
            text = f"{text}\n\n{section.value}".strip()
        elif section.kind is griffe.DocstringSectionKind.attributes:
            for one in section.value:
                for name in one.name.split(","):
                    fields[name.strip()] = (str(one.annotation), one.description)
    return text, fields


def fields_of(kind: type) -> tuple[inspect.Field, ...]:
    """Return the fields of a struct with their types and bounds."""
    said = inspect.type_info(kind)
    if not isinstance(said, inspect.StructType):
        raise TypeError(f"{kind} is no struct")
    return said.fields


def in_words(kind: inspect.Type) -> str:
    """Return a type with its bounds: `int, 2 .. 200`."""
    match kind:
        case inspect.Metadata(type=inner):
            return in_words(inner)
        case inspect.UnionType(types=types):
            several = [in_words(one) for one in types if not isinstance(one, inspect.NoneType)]
            some = [one for one in several if one]
            return " or ".join(some) + (" or none" if len(types) > len(several) else "")
        case inspect.LiteralType(values=values):
            return " ".join(
                f"`{value}`" if value else "(empty)" for value in sorted(map(str, values))
            )
        case inspect.TupleType(item_types=items):
            each = [in_words(one) for one in items]
            return f"{len(each)} x {each[0]}" if len(set(each)) == 1 else ", ".join(each)
        case inspect.ListType(item_type=item) | inspect.VarTupleType(item_type=item):
            return f"list of {in_words(item)}"
        case inspect.DictType(key_type=key, value_type=value):
            return f"map of {in_words(key)} to {in_words(value)}"
        case inspect.StructType(cls=struct):
            return _struct(struct)
        case inspect.CustomType():
            return ""
        case _:
            return _NAMES[type(kind)] + _bounds(kind)


def default_of(field: inspect.Field) -> str:
    """Return a field's default as a file would write it; empty where it has none or a table."""
    value: Any = field.default
    if value is msgspec.NODEFAULT or isinstance(value, msgspec.Struct):
        return ""
    if value is None or value is msgspec.UNSET:
        return "none"
    return msgspec.json.encode(value).decode()


def _struct(struct: type) -> str:
    if struct is Scenario:
        return "[scenario](scenario.md)"
    if issubclass(struct, Section):
        return code(", ".join(field.name for field in fields_of(struct)))
    return f"[{struct.__name__}](messages.md#{struct.__name__.lower()})"


def _bounds(kind: inspect.Type) -> str:
    if not isinstance(kind, inspect.IntType | inspect.FloatType):
        return ""
    low = _end(kind.ge, kind.gt, "from ", "above ")
    high = _end(kind.le, kind.lt, "to ", "below ")
    ends = " ".join(end for end in (low, high) if end)
    return f", {ends}" if ends else ""


def _end(closed: float | None, opened: float | None, reaches: str, excludes: str) -> str:
    if closed is not None:
        return f"{reaches}{closed:.16g}"
    return "" if opened is None else f"{excludes}{opened:.16g}"
