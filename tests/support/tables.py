"""Process tables that differ from the usual one in some rows."""

import tomllib
from pathlib import Path
from typing import Any

import tomlkit

from fras_supervisor import find_table


def table_with(folder: Path, **rows: dict[str, Any]) -> str:
    """Write a table like `compose/local.toml` with other settings for some processes."""
    table = tomllib.loads(find_table("local").read_text(encoding="utf-8"))
    for name, settings in rows.items():
        table["process"][name].update(settings)
    path = folder / "table.toml"
    path.write_text(tomlkit.dumps(table), encoding="utf-8")
    return str(path)
