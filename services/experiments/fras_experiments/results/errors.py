"""What can be wrong with a results folder or with what is asked of it."""

from pathlib import Path

from fras_common.errors import FrasError, shown


class BadResults(FrasError):
    """A stored result can't be read, or does not hold what is asked of it."""


def bad_cell(path: Path, line: int, column: str, value: str, expected: str) -> BadResults:
    """Name a value that is not what its column holds.

    Parameters
    ----------
    line : int
        From 1, the header's.
    """
    return BadResults(
        f"{path}, line {line}, column {column}: {shown(value)} is not {expected}; leave the cell "
        "empty where there is no value",
        path=path,
        line=line,
        column=column,
        value=value,
    )
