"""`fras --version`: which FRAS this is, what it was built from, and on what it runs."""

import json
import platform
from importlib.metadata import PackageNotFoundError, version
from typing import Any, Final

from fras_common.commit import commit
from fras_common.digests import rules_digest
from fras_common.shipped import shipped

LIBRARIES: Final = {
    "zenoh": "eclipse-zenoh",
    "clingo": "clingo",
    "pinocchio": "pin",
    "numpy": "numpy",
    "mcap": "mcap",
}
"""Those that a person asks for, by the names they are known by, and their distributions."""


def version_facts() -> dict[str, Any]:
    """Return the facts, as JSON has them.

    Returns
    -------
    dict
        ``version``, ``commit`` (None if it is not known, with `-dirty` behind it if files were
        changed since), ``rules`` (SHA-256 of the rules that come with this version; logs name
        theirs in the same way), ``python``, ``platform``, ``libraries`` (None for one that is not
        installed).
    """
    return {
        "version": version("fras"),
        "commit": commit() or None,
        "rules": _shipped_rules(),
        "python": platform.python_version(),
        "platform": f"{platform.system()} {platform.machine()}",
        "libraries": {name: _installed(library) for name, library in LIBRARIES.items()},
    }


def print_version(*, as_json: bool) -> None:
    """Print them: the first line is the version alone."""
    facts = version_facts()
    if as_json:
        print(json.dumps(facts))
        return
    print(f"fras {facts['version']}")
    rows = {
        "commit": facts["commit"] or "not known",
        "rules": facts["rules"],
        "Python": f"{facts['python']}, {facts['platform']}",
        **{name: found or "not installed" for name, found in facts["libraries"].items()},
    }
    for name, value in rows.items():
        print(f"  {name:<10} {value}")


def _shipped_rules() -> str:
    folder = shipped("asp")
    files = sorted(folder.rglob("*.lp"))
    return rules_digest(
        {path.relative_to(folder).as_posix(): path.read_text(encoding="utf-8") for path in files}
    )


def _installed(library: str) -> str | None:
    try:
        return version(library)
    except PackageNotFoundError:
        return None
