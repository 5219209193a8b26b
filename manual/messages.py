"""The page of all messages, from their types and docstrings."""

import importlib
import pkgutil
from types import ModuleType
from typing import Final

from msgspec.inspect import Field

from fras_common import messages
from fras_common.messages.base import Header, Wire
from fras_common.topics import QUERIES, TOPICS
from manual.markdown import code, page, prose, table
from manual.schema import default_of, fields_of, in_words, told, unit_of

_HEADER: Final = {field.name for field in fields_of(Header)}


def messages_page() -> str:
    """Return the page: every message with its fields, a section for each module."""
    names = sorted(module.name for module in pkgutil.iter_modules(messages.__path__))
    modules = [importlib.import_module(f"{messages.__name__}.{name}") for name in names]
    return page(
        "Messages",
        prose(
            """What stands on the [keys](keys.md). A message is a MessagePack map from its
            fields' names to values; a field that is not named here is refused. A field
            without a default has to be there. Units stand in the names: `_m` metres, `_s`
            seconds, `_n` newtons, `_pa` pascals, `_rad` radians. Each published message
            begins with the fields of [Header](#header); questions and answers have none."""
        ),
        *(part for module in modules for part in _module(module)),
    )


def _module(module: ModuleType) -> list[str]:
    own = [
        kind
        for kind in vars(module).values()
        if isinstance(kind, type) and issubclass(kind, Wire) and kind.__module__ == module.__name__
    ]
    sections = [_message(kind) for kind in own if kind is not Wire]
    name = module.__name__.rpartition(".")[2]
    return [f"## {name}", module.__doc__ or "", *sections] if sections else []


def _message(kind: type[Wire]) -> str:
    text, meanings = told(kind)
    parts = [f"### {kind.__name__}", text, _where(kind)]
    rows: list[tuple[str, ...]] = []
    for field in fields_of(kind):
        if field.name in _HEADER and issubclass(kind, Header) and kind is not Header:
            continue
        form, meaning = meanings.get(field.name, ("", ""))
        words = in_words(field.type)
        shape = "" if form in {"str", "int", "float", "bool", "dict"} or "`" in words else form
        rows.append(
            (code(field.name), shape or words, unit_of(field.name), _default(field), meaning)
        )
    if rows:
        parts.append(table(("field", "type", "unit", "default", "what"), rows))
    return "\n\n".join(part for part in parts if part)


def _default(field: Field) -> str:
    return code(default_of(field))


def _where(kind: type[Wire]) -> str:
    """Return on which keys a message stands, as a sentence."""
    said = [code(topic.key) for topic in TOPICS if topic.type is kind]
    asked = [code(query.key) for query in QUERIES if query.request is kind]
    answered = [code(query.key) for query in QUERIES if query.reply is kind]
    parts = [
        f"{how} {', '.join(keys)}."
        for how, keys in (("On", said), ("Asks", asked), ("Answers", answered))
        if keys
    ]
    return " ".join(parts)
