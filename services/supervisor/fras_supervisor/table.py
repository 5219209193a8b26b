"""The process table: which processes make a stack, read from TOML and checked as a whole."""

import re
import tomllib
from collections.abc import Collection, Mapping
from itertools import pairwise
from pathlib import Path
from string import Formatter
from typing import Annotated, Final, Literal, cast

import msgspec
from msgspec import Meta

from fras_supervisor.errors import TableError
from fras_supervisor.order import ended_before, find_cycle

Readiness = Literal["token", "alive", "listening"]
Restart = Literal["never", "on-failure", "always"]
Seconds = Annotated[float, Meta(gt=0, le=3600)]

PLACEHOLDERS: Final = ("python", "cell", "connect", "log_dir", "name")
"""What a command may ask for in braces; `Stack` fills them in."""

ALLOWED: Final = {
    "command": "a list of texts, the program first, with the placeholders ",
    "needs": "a list of names of other processes of this table, each once",
    "outlives": "a list of names of other processes of this table, each once",
    "readiness": "token (liveliness token ready/NAME), alive (token alive/NAME), "
    "listening (the port of the endpoint accepts)",
    "ready_timeout_s": "a number of seconds above 0, up to 3600",
    "restart": "never, on-failure, always",
    "host": "the name of a host: letters, digits, dots, dashes",
    "stop_timeout_s": "a number of seconds above 0, up to 3600",
}
"""Keys of a process, and what each may hold, in the words of the error messages."""


class Process(msgspec.Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """One row of the table.

    Attributes
    ----------
    name : str
        Its key in the file; also of its log file and of its liveliness tokens.
    command : tuple of str
        Program and arguments, with placeholders in braces (`{{` and `}}` are literal braces).
    needs : tuple of str
        Processes that must be ready before this one is launched.
    outlives : tuple of str
        Processes that must have ended before this one is asked to stop, besides those that need
        it: the recorder starts beside the others but must hear their last words.
    readiness : {"token", "alive", "listening"}
        The condition that makes it ready.
    ready_timeout_s : float [s]
        Not ready for so long after its launch is a fault.
    restart : {"never", "on-failure", "always"}
        What to do when it ends unasked.
    host : str
        Where it runs.
    stop_timeout_s : float [s]
        What it is given to end after SIGINT, and again after SIGTERM.
    """

    name: str
    command: Annotated[tuple[Annotated[str, Meta(min_length=1)], ...], Meta(min_length=1)]
    needs: tuple[str, ...] = ()
    outlives: tuple[str, ...] = ()
    readiness: Readiness = "token"
    ready_timeout_s: Seconds = 60.0
    restart: Restart = "never"
    host: Annotated[str, Meta(pattern=r"^[A-Za-z0-9][A-Za-z0-9.-]*$")] = "localhost"
    stop_timeout_s: Seconds = 5.0


class Table(msgspec.Struct, frozen=True):
    """All processes of a stack, in the file's order, and where they were read."""

    source: str
    processes: dict[str, Process]

    def with_arguments(self, name: str, *arguments: str) -> "Table":
        """Return the same table with a process that takes some arguments more, as they stand."""
        process = self.processes[name]
        literal = tuple(word.replace("{", "{{").replace("}", "}}") for word in arguments)
        changed = msgspec.structs.replace(process, command=(*process.command, *literal))
        return Table(self.source, {**self.processes, name: changed})


def find_table(name: str = "local") -> Path:
    """Path of `compose/<name>.toml`: in the installed package, else in the checkout."""
    here = Path(__file__).resolve()
    places = (here.parent / "compose", here.parents[3] / "compose")
    for place in places:
        if (path := place / f"{name}.toml").is_file():
            return path
    known = sorted(path.stem for place in places for path in place.glob("*.toml"))
    raise TableError(f"{places[0]} or {places[1]}", "table", name, ", ".join(known) or "none found")


def load_table(path: Path | str, placeholders: Collection[str] = PLACEHOLDERS) -> Table:
    """Read a process table and check all of it.

    Parameters
    ----------
    path : Path or str
        A TOML file with one table `[process.NAME]` a process.
    placeholders : collection of str
        Names that commands may ask for in braces.

    Raises
    ------
    TableError
        The file can't be read or is no TOML, a key is unknown or missing, a value is not
        allowed, a name is unknown, a placeholder is unknown, processes wait for each other.
    """
    try:
        text = Path(path).read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError) as error:
        raise TableError(str(path), "file", str(error), "a readable TOML file") from error
    return parse_table(text, str(path), placeholders)


def parse_table(text: str, source: str, placeholders: Collection[str] = PLACEHOLDERS) -> Table:
    """Make a table of TOML text; `source` names it in errors. See `load_table`."""
    try:
        raw = tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        # A process or a key that is there twice ends here; tomllib names it and its line.
        raise TableError(source, "file", str(error), "TOML, each key once") from error
    for key in raw:
        if key != "process":
            raise TableError(source, key, raw[key], "only tables [process.NAME]")
    rows = _as_table(raw.get("process"))
    if not rows:
        raise TableError(source, "process", raw.get("process"), "at least one table [process.NAME]")
    processes = {name: _read_row(source, name, row) for name, row in rows.items()}
    for process in processes.values():
        _check_names(source, process, processes)
        check_placeholders(source, process, placeholders)
    _check_cycles(source, processes)
    return Table(source=source, processes=processes)


def check_placeholders(source: str, process: Process, known: Collection[str]) -> None:
    """Raise `TableError` if a command asks for a placeholder that nobody fills in."""
    for word in process.command:
        if not _fills(word, known):
            key = f"process.{process.name}.command"
            raise TableError(source, key, word, _allowed("command", known))


def expand(process: Process, values: Mapping[str, str]) -> tuple[str, ...]:
    """Fill the placeholders of a command in."""
    return tuple(word.format_map(values) for word in process.command)


def _read_row(source: str, name: str, row: object) -> Process:
    where = f"process.{name}"
    if not re.fullmatch(r"[a-z][a-z0-9_-]*", name):
        allowed = "a name of lower-case letters, digits, - and _, a letter first"
        raise TableError(source, where, name, allowed)
    fields = _as_table(row)
    if fields is None:
        raise TableError(source, where, row, "a table of " + ", ".join(ALLOWED))
    for key in fields:
        if key not in ALLOWED:
            raise TableError(source, f"{where}.{key}", fields[key], "keys " + ", ".join(ALLOWED))
    if "command" not in fields:
        raise TableError(source, f"{where}.command", None, _allowed("command", PLACEHOLDERS))
    try:
        return msgspec.convert({**fields, "name": name}, Process)
    except msgspec.ValidationError as error:
        found = re.search(r"`\$\.(\w+)", str(error))
        if found is None:
            raise
        key = found[1]
        allowed = _allowed(key, PLACEHOLDERS)
        raise TableError(source, f"{where}.{key}", fields[key], allowed) from error


def _as_table(value: object) -> dict[str, object] | None:
    """Give a TOML table as what it is, or nothing if the value is no table."""
    return cast("dict[str, object]", value) if isinstance(value, dict) else None


def _allowed(key: str, placeholders: Collection[str]) -> str:
    listed = ", ".join(f"{{{one}}}" for one in placeholders)
    return ALLOWED[key] + listed if key == "command" else ALLOWED[key]


def _check_names(source: str, process: Process, known: Collection[str]) -> None:
    for key, names in (("needs", process.needs), ("outlives", process.outlives)):
        for index, name in enumerate(names):
            if name not in known or name == process.name or name in names[:index]:
                others = ", ".join(one for one in known if one != process.name)
                allowed = f"names of other processes, each once: {others or 'there is no other'}"
                raise TableError(source, f"process.{process.name}.{key}", name, allowed)


def _fills(word: str, known: Collection[str]) -> bool:
    """Tell whether a word's braces hold known placeholders and nothing else."""
    try:
        parts = list(Formatter().parse(word))
    except ValueError:
        return False
    return all(
        field is None or (field in known and not spec and not conversion)
        for _, field, spec, conversion in parts
    )


def _check_cycles(source: str, processes: Mapping[str, Process]) -> None:
    ring = find_cycle({name: process.needs for name, process in processes.items()})
    if ring:
        allowed = "no process that waits, directly or not, for itself"
        raise TableError(source, f"process.{ring[0]}.needs", " -> ".join(ring), allowed)
    ring = find_cycle(ended_before(processes))
    if ring:
        key = f"process.{_outliver(ring, processes)}.outlives"
        allowed = "no process that outlives, directly or not, one that it needs"
        raise TableError(source, key, " -> ".join(ring), allowed)


def _outliver(ring: tuple[str, ...], processes: Mapping[str, Process]) -> str:
    return next(name for name, other in pairwise(ring) if other in processes[name].outlives)
