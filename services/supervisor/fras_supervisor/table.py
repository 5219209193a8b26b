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

from fras_common.files import TEXT_BYTES, read_at_most
from fras_common.shipped import shipped_places
from fras_supervisor.errors import TableError
from fras_supervisor.hosts import check_hosts, placeholder, read_hosts, services_placeholder
from fras_supervisor.order import ended_before, find_cycle
from fras_supervisor.policy import Restart, Rules
from fras_supervisor.producers import check_producers
from fras_supervisor.watchdog import Patience

Readiness = Literal["token", "alive", "listening"]
Seconds = Annotated[float, Meta(gt=0, le=3600)]
SecondsOrOff = Annotated[float, Meta(ge=0, le=3600)]

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
    "backoff_s": "a number of seconds above 0, up to 3600",
    "backoff_cap_s": "a number of seconds above 0, up to 3600, not less than backoff_s",
    "stable_s": "a number of seconds above 0, up to 3600",
    "restart_budget": "a whole number from 1 to 1000",
    "restart_window_s": "a number of seconds above 0, up to 3600",
    "watchdog_s": "0 (off) or a number of seconds from 2 to 3600",
    "loop_watchdog_s": "0 (off) or a number of seconds from 2 to 3600",
    "memory_limit_mb": "0 (none) or a whole number from 16",
    "open_files_limit": "0 (as inherited) or a whole number from 64",
    "nice": "a whole number from -20 to 19",
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
        What to do when it ends unasked; on-failure: unless with exit status 0.
    backoff_s, backoff_cap_s : float [s]
        Pause before the first restart, doubled with every failure in a row, and the longest pause.
    stable_s : float [s]
        Who ran for so long begins with the first pause again.
    restart_budget : int
        So many restarts within `restart_window_s`; one more, and it is given up.
    restart_window_s : float [s]
    watchdog_s : float [s]
        No sign of life for so long, and it is killed; 0: never.
    loop_watchdog_s : float [s]
        Its loop stuck for so long, and it is killed; 0: never.
    memory_limit_mb : int [MB]
        Resident memory beyond it, and it is killed; 0: no limit.
    open_files_limit : int
        Files it may have open at a time; 0: as many as the supervisor.
    nice : int
        Added to its niceness.
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
    ready_timeout_s: Seconds = 180.0
    restart: Restart = "never"
    host: Annotated[str, Meta(pattern=r"^[A-Za-z0-9][A-Za-z0-9.-]*$")] = "localhost"
    stop_timeout_s: Seconds = 5.0
    backoff_s: Seconds = 0.5
    backoff_cap_s: Seconds = 10.0
    stable_s: Seconds = 30.0
    restart_budget: Annotated[int, Meta(ge=1, le=1000)] = 5
    restart_window_s: Seconds = 60.0
    watchdog_s: SecondsOrOff = 5.0
    loop_watchdog_s: SecondsOrOff = 60.0
    memory_limit_mb: Annotated[int, Meta(ge=0)] = 0
    open_files_limit: Annotated[int, Meta(ge=0)] = 0
    nice: Annotated[int, Meta(ge=-20, le=19)] = 0

    @property
    def rules(self) -> Rules:
        """How often, and after what pause, it is started again."""
        return Rules(
            self.restart,
            self.backoff_s,
            self.backoff_cap_s,
            self.stable_s,
            self.restart_budget,
            self.restart_window_s,
        )

    @property
    def patience(self) -> Patience:
        """How long it may give no sign of life."""
        return Patience(self.watchdog_s, self.loop_watchdog_s)


SMALLEST: Final = {
    "watchdog_s": 2.0,
    "loop_watchdog_s": 2.0,
    "memory_limit_mb": 16,
    "open_files_limit": 64,
}
"""What a limit may be besides 0: health comes twice a second, and a service must be able to run."""


class Table(msgspec.Struct, frozen=True):
    """Processes of a stack, in the file's order, and where they were read.

    Attributes
    ----------
    source : str
    processes : dict of name to Process
    hosts : dict of name to str
        Hosts, each with the address of its router, or none; empty: all is on one machine.
    here : str
        The host that `processes` are of; empty: those of all.
    elsewhere : dict of name to str
        Processes of other hosts, and whose they are; see `place`.
    """

    source: str
    processes: dict[str, Process]
    hosts: dict[str, str] = {}
    here: str = ""
    elsewhere: dict[str, str] = {}

    def with_arguments(self, name: str, *arguments: str) -> "Table":
        """Return the same table with a process that takes some arguments more, as they stand."""
        process = self.processes[name]
        literal = tuple(word.replace("{", "{{").replace("}", "}}") for word in arguments)
        changed = msgspec.structs.replace(process, command=(*process.command, *literal))
        return msgspec.structs.replace(self, processes={**self.processes, name: changed})


def find_table(name: str = "local") -> Path:
    """Path of `compose/<name>.toml`: in the installed package, else in the checkout."""
    places = shipped_places("compose")
    for place in places:
        if (path := place / f"{name}.toml").is_file():
            return path
    known = sorted(path.stem for place in places for path in place.glob("*.toml"))
    raise TableError(" or ".join(map(str, places)), "table", name, ", ".join(known) or "none found")


def load_table(path: Path | str, placeholders: Collection[str] = PLACEHOLDERS) -> Table:
    """Read a process table and check all of it.

    Parameters
    ----------
    path : Path or str
        A TOML file with one table `[process.NAME]` a process, and, if there are several hosts, one
        table `[host.NAME]` a host.
    placeholders : collection of str
        Names that commands may ask for in braces.

    Raises
    ------
    TableError
        The file can't be read or is no TOML, a key is unknown or missing, a value is not
        allowed, a name is unknown, a placeholder is unknown, processes wait for each other.
    """
    try:
        text = read_at_most(Path(path), TEXT_BYTES).decode()
    except (OSError, UnicodeDecodeError) as error:
        raise TableError(str(path), "file", str(error), "a readable TOML file") from error
    return parse_table(text, str(path), placeholders)


def parse_table(text: str, source: str, placeholders: Collection[str] = PLACEHOLDERS) -> Table:
    """Make a table of TOML text; `source` names it in errors. See `load_table`."""
    try:
        raw = tomllib.loads(text)
    except (ValueError, RecursionError) as error:
        # A process or a key that is there twice ends here; tomllib names it and its line. It also
        # lets through what int() says of too many digits, and nesting without end.
        raise TableError(source, "file", str(error), "TOML, each key once") from error
    for key in raw:
        if key not in ("process", "host"):
            raise TableError(source, key, raw[key], "only tables [process.NAME] and [host.NAME]")
    rows = _as_table(raw.get("process"))
    if not rows:
        raise TableError(source, "process", raw.get("process"), "at least one table [process.NAME]")
    processes = {name: _read_row(source, name, row) for name, row in rows.items()}
    hosts = read_hosts(source, raw.get("host", {}))
    of_hosts = (*map(placeholder, hosts), *map(services_placeholder, hosts))
    known = (*placeholders, *of_hosts)
    for process in processes.values():
        _check_names(source, process, processes)
        _check_limits(source, process)
        check_placeholders(source, process, known)
    check_hosts(source, processes, hosts)
    _check_cycles(source, processes)
    check_producers(source, processes)
    return Table(source, processes, hosts)


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


def _check_limits(source: str, process: Process) -> None:
    for key, smallest in SMALLEST.items():
        value = getattr(process, key)
        if 0 < value < smallest:
            raise TableError(source, f"process.{process.name}.{key}", value, ALLOWED[key])
    if process.backoff_cap_s < process.backoff_s:
        key = f"process.{process.name}.backoff_cap_s"
        raise TableError(source, key, process.backoff_cap_s, ALLOWED["backoff_cap_s"])


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
