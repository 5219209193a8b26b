"""The page of a scenario's fields: types from the code, words from the file with all defaults."""

import re
from pathlib import Path
from typing import Any, Final

from msgspec import inspect

from fras_common.scenario.model import Scenario, Section
from manual.markdown import code, page, prose, table
from manual.schema import default_of, fields_of, in_words, told, unit_of

FILE: Final = Path(__file__).parents[1] / "compose" / "scenarios" / "default.toml"
_HEADING: Final = re.compile(r"(?:# )?\[{1,2}([\w.]+)\]{1,2}(?:\s+# (?P<about>.*))?$")
_FIELD: Final = re.compile(r"(?:# )?(?P<name>\w+) = (?P<value>.*?)\s+# (?P<about>.*)$")
_MORE: Final = re.compile(r"\s{8,}# (.*)$")


def scenario_page() -> str:
    """Return the page: every field with type, bounds, default, unit and meaning."""
    about = meanings(FILE.read_text(encoding="utf-8"))
    top = [field for field in fields_of(Scenario) if not _section(field.type)]
    parts = [
        prose(
            """Everything that decides a trial, and how fast to run it. A file needs only what
            differs from the defaults; unknown fields are refused. The same with its
            comments, to be copied:
            [`compose/scenarios/default.toml`](../../compose/scenarios/default.toml). `fras
            scenario check FILE` says whether a file of yours is one."""
        ),
        _table("", top, about),
    ]
    for field in fields_of(Scenario):
        if (kind := _section(field.type)) is not None:
            text = told(kind)[0]
            parts += [f"## {field.name}", text, _table(field.name, fields_of(kind), about)]
            parts += [
                f"Each of `{field.name}.{inner.name}`:\n\n"
                + _table(f"{field.name}.{inner.name}", fields_of(entry), about)
                for inner in fields_of(kind)
                if (entry := _entry(inner.type)) is not None
            ]
    return page("A scenario's fields", *parts)


def meanings(text: str) -> dict[str, str]:
    """Return the comment of each field of a scenario file, by its path."""
    found = dict[str, str]()
    section = last = ""
    for line in text.splitlines():
        if heading := _HEADING.match(line):
            section, last = f"{heading[1]}.", ""
            if heading["about"]:
                found[heading[1]] = heading["about"]
        elif field := _FIELD.match(line):
            last = section + field["name"]
            found[last] = field["about"]
        elif last and (more := _MORE.match(line)):
            found[last] += f" {more[1]}"
        else:
            last = ""
    return found


def _table(section: str, fields: Any, about: dict[str, str]) -> str:
    rows = [
        (
            code(field.name),
            in_words(field.type),
            unit_of(field.name),
            code(default_of(field)),
            about.get(f"{section}.{field.name}".strip("."), ""),
        )
        for field in fields
    ]
    return table(("field", "type", "unit", "default", "what"), rows)


def _section(kind: inspect.Type) -> type[Section] | None:
    """Return the section that a field is, or None for a plain field."""
    if isinstance(kind, inspect.UnionType):
        return next((found for one in kind.types if (found := _section(one))), None)
    if isinstance(kind, inspect.StructType) and issubclass(kind.cls, Section):
        return kind.cls
    return None


def _entry(kind: inspect.Type) -> type[Section] | None:
    """Return the section that a field is a list of."""
    return _section(kind.item_type) if isinstance(kind, inspect.VarTupleType) else None
