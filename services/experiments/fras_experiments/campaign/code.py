"""Which code computes: two processes with the same digest give the same results."""

import hashlib
from functools import cache
from importlib.util import find_spec
from pathlib import Path
from typing import Final

from fras_common.service.build import build_of_this_process
from fras_common.shipped import shipped
from fras_supervisor import find_table

PACKAGES: Final = (
    "fras_common",
    "fras_log",
    "fras_motion",
    "fras_planner",
    "fras_recorder",
    "fras_sa",
    "fras_sim",
    "fras_supervisor",
)
RECORD: Final = "2"
"""To be raised when `measure` makes other numbers of the same log."""


@cache
def code_digest() -> str:
    """SHA-256 over the services' code, the rules and the process table.

    Returns
    -------
    str
        Hexadecimal.
    """
    digest = hashlib.sha256(RECORD.encode())
    for name, file in _files():
        for part in (name.encode(), file.read_bytes()):
            digest.update(len(part).to_bytes(8, "little") + part)
    return digest.hexdigest()


@cache
def code_version() -> str:
    """Name the code and what it runs on: results under one name are equal to the last digit."""
    return f"{code_digest()[:16]}; {build_of_this_process()}"


def _files() -> list[tuple[str, Path]]:
    """Files with names that do not depend on where they are installed."""
    rules = shipped("asp")
    found = [("local.toml", find_table("local"))]
    found += [(f"asp/{_name(one, rules)}", one) for one in rules.rglob("*.lp")]
    for package in PACKAGES:
        spec = find_spec(package)
        for place in (spec.submodule_search_locations or []) if spec else []:
            folder = Path(place)
            found += [(f"{package}/{_name(one, folder)}", one) for one in folder.rglob("*.py")]
    return sorted(found)


def _name(file: Path, folder: Path) -> str:
    return file.relative_to(folder).as_posix()
