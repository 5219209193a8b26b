"""What two processes must share to understand each other, each as one number: rules, and table."""

import hashlib
import json
from collections.abc import Iterable, Mapping, Sequence
from functools import cache
from typing import Any, cast

from fras_common.codec import json_schema
from fras_common.topics import QUERIES, TOPICS, Query, Topic

# Under these the names in a schema are fields and types, not words of JSON Schema.
_NAMED = ("properties", "$defs")
_EXPLAINS = "description"


def rules_digest(files: Mapping[str, str]) -> str:
    """SHA-256 over rule files, by name and text, in the order of their paths.

    Parameters
    ----------
    files : mapping of str to str
        Text by path below `asp/`.

    Returns
    -------
    str
        Hexadecimal.
    """
    digest = hashlib.sha256()
    for name in sorted(files, key=lambda path: path.split("/")):
        for part in (name.encode(), files[name].encode()):
            digest.update(len(part).to_bytes(8, "little") + part)
    return digest.hexdigest()


def table_digest(topics: Iterable[Topic[Any]], queries: Iterable[Query[Any, Any]]) -> str:
    """SHA-256 over a topic table: what travels on which key, from whom, and how.

    Keys, the types' JSON Schemas, producers, QoS and whether a key belongs to a trial; of a query
    its key, both schemas and who serves it. How a field is explained does not count, nor the
    order of the rows.

    Returns
    -------
    str
        Hexadecimal.
    """
    rows: list[list[Any]] = [
        ["topic", one.key, one.producer, one.qos.value, one.in_trial, _schema(one.type)]
        for one in topics
    ]
    rows += [
        ["query", one.key, one.server, _schema(one.request), _schema(one.reply)] for one in queries
    ]
    text = "\n".join(sorted(json.dumps(row, sort_keys=True) for row in rows))
    return hashlib.sha256(text.encode()).hexdigest()


@cache
def own_table_digest() -> str:
    """Digest of the table of this version."""
    return table_digest(TOPICS, QUERIES)


def _schema(kind: type[Any]) -> Any:
    return _unexplained(json_schema(kind))


def _unexplained(schema: Any) -> Any:
    """Leave the descriptions out of a schema."""
    if isinstance(schema, list):
        return [_unexplained(one) for one in cast("Sequence[Any]", schema)]
    if not isinstance(schema, dict):
        return schema
    bare: dict[str, Any] = {}
    for word, value in cast("Mapping[str, Any]", schema).items():
        if word in _NAMED:
            bare[word] = {name: _unexplained(one) for name, one in value.items()}
        elif word != _EXPLAINS:
            bare[word] = _unexplained(value)
    return bare
