"""A CSV table as named columns; each fault with its file, line and column."""

import csv
import io
import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Final, SupportsIndex

import numpy as np
from numpy.typing import NDArray

from fras_common.files import read_at_most
from fras_experiments.results.errors import BadResults, bad_cell

TABLE_BYTES: Final = 512 * 2**20
"""A million trials have about half of it."""
TRUTH: Final = {"true": True, "1": True, "yes": True, "false": False, "0": False, "no": False}


@dataclass(frozen=True)
class Cells:
    """A table as it stands in its file.

    Attributes
    ----------
    names : tuple of str
        Columns, in the file's order.
    rows : tuple of tuple of str
    lines : tuple of int
        Line of each row in the file, from 1.
    """

    path: Path
    names: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]
    lines: tuple[int, ...]

    def line_of(self, row: SupportsIndex) -> int:
        """Return the line of a row in the file."""
        return self.lines[row]

    def texts(self, name: str) -> NDArray[np.str_]:
        """Return a column as it stands there, shape (n,)."""
        place = self.names.index(name)
        return np.array([row[place].strip() for row in self.rows], dtype=np.str_)

    def numbers(self, name: str) -> NDArray[np.float64]:
        """Return a column of finite numbers, NaN where the cell is empty, shape (n,).

        Raises
        ------
        BadResults
            A cell holds text, NaN or infinity.
        """
        return np.array(self._each(name, _number, "a finite number"), dtype=np.float64)

    def integers(self, name: str) -> NDArray[np.int64]:
        """Return a column of whole numbers, shape (n,).

        Raises
        ------
        BadResults
            A cell holds something else, or is empty.
        """
        return np.array(self._each(name, _integer, "a whole number"), dtype=np.int64)

    def truths(self, name: str) -> NDArray[np.bool_]:
        """Return a column of true or false, shape (n,); an empty cell is false.

        Raises
        ------
        BadResults
            A cell holds something else.
        """
        return np.array(self._each(name, _truth, "true or false"), dtype=np.bool_)

    def _each(
        self, name: str, convert: Callable[[str], float | bool], expected: str
    ) -> list[float | bool]:
        place, values = self.names.index(name), list[float | bool]()
        for row, line in zip(self.rows, self.lines, strict=True):
            try:
                values.append(convert(row[place].strip()))
            except (ValueError, KeyError, OverflowError) as error:
                raise bad_cell(self.path, line, name, row[place], expected) from error
        return values


def read_cells(path: Path, needed: Sequence[str]) -> Cells:
    """Read a table that has at least the columns needed.

    Raises
    ------
    BadResults
        There is no such file, it is no UTF-8 text or no CSV, has no row, lacks a column, has one
        twice, or a row is shorter or longer than the header.
    OSError
        It can't be read.
    """
    try:
        text = read_at_most(path, TABLE_BYTES).decode("utf-8-sig")
    except FileNotFoundError as error:
        raise BadResults(
            f"{path}: no such file; name the folder that `fras experiment` wrote", path=path
        ) from error
    except UnicodeDecodeError as error:
        raise BadResults(
            f"{path}: no UTF-8 text at byte {error.start}; the file was cut or changed", path=path
        ) from error
    return parse_cells(text, path, needed)


def parse_cells(text: str, path: Path, needed: Sequence[str]) -> Cells:
    """Do as `read_cells`, on what was read.

    Parameters
    ----------
    path : Path
        Named in faults.

    Raises
    ------
    BadResults
    """
    reader = csv.reader(io.StringIO(text, newline=""), strict=True)
    rows, lines = list[tuple[str, ...]](), list[int]()
    try:
        names = tuple(name.strip() for name in next(reader, list[str]()))
        _check_header(names, path, needed)
        for row in reader:
            if not row:
                continue
            if len(row) != len(names):
                raise BadResults(
                    f"{path}, line {reader.line_num}: {len(row)} cells, where the header has "
                    f"{len(names)}; the file was cut or changed",
                    path=path,
                    line=reader.line_num,
                )
            rows.append(tuple(row))
            lines.append(reader.line_num)
    except csv.Error as error:
        raise BadResults(
            f"{path}, line {reader.line_num}: no CSV: {error}; the file was cut or changed",
            path=path,
            line=reader.line_num,
        ) from error
    if not rows:
        raise BadResults(f"{path}: a header without a row; no trial has ended yet", path=path)
    return Cells(path, names, tuple(rows), tuple(lines))


def _check_header(names: tuple[str, ...], path: Path, needed: Sequence[str]) -> None:
    if not names:
        raise BadResults(
            f"{path}, line 1: empty, not even a header; the file was cut", path=path, line=1
        )
    missing = [name for name in needed if name not in names]
    if missing:
        raise BadResults(
            f"{path}, line 1: no column {', '.join(missing)}; it was written by another version, "
            "or changed",
            path=path,
            line=1,
            columns=missing,
        )
    twice = sorted({name for name in names if names.count(name) > 1})
    if twice:
        raise BadResults(
            f"{path}, line 1: column {', '.join(twice)} stands there twice",
            path=path,
            line=1,
            columns=twice,
        )


def _number(text: str) -> float:
    if not text:
        return math.nan
    value = float(text)
    if not math.isfinite(value):
        raise ValueError(text)
    return value


def _integer(text: str) -> int:
    value = int(text)
    if abs(value) >= 2**63:
        raise OverflowError(text)
    return value


def _truth(text: str) -> bool:
    return TRUTH[text.lower()] if text else False
