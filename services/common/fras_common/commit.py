"""Which commit this code is: written into a distribution as it is built, else asked of git."""

import subprocess
from pathlib import Path
from typing import Final

FILE: Final = "commit.txt"
"""Beside this module in a wheel; `hatch_build.py` writes it."""
_GIT: Final = ("git", "describe", "--always", "--dirty", "--abbrev=40", "--exclude=*")


def commit() -> str:
    """Name the commit, with `-dirty` behind it where files were changed since; empty if unknown."""
    package = Path(__file__).resolve().parent
    written = package / FILE
    if written.is_file():
        return written.read_text(encoding="utf-8").strip()
    return commit_of(package.parents[2])


def commit_of(checkout: Path) -> str:
    """Ask git for the commit of a checkout; empty if that is none, or there is no git.

    Parameters
    ----------
    checkout : Path
        Its root: a folder that only lies in another project's checkout is not asked for.
    """
    if not (checkout / ".git").exists():
        return ""
    try:
        found = subprocess.run(
            [*_GIT], cwd=checkout, capture_output=True, text=True, check=True, timeout=10
        )
    except (OSError, subprocess.SubprocessError):
        return ""
    return found.stdout.strip()
