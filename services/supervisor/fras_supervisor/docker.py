"""A process table as a Docker Compose file: one image, one container a process. Pure."""

from collections.abc import Mapping, Sequence
from typing import Any, Final

import yaml

from fras_supervisor.child import ENVIRONMENT
from fras_supervisor.errors import TableError
from fras_supervisor.logs import KEPT_FILES, MAX_BYTES
from fras_supervisor.table import Process, Table, expand

IMAGE: Final = "fras"
PORT: Final = 7447
FOLDER: Final = "/fras"
PROBE: Final = ("python", "-m", "fras_supervisor.probe")
SECRETS: Final = "/run/secrets"
KEYS: Final = "FRAS_KEYS"
CLI: Final = "cli"
AUTHORITY: Final = "ca.pem"
NAMES: Final = "names.json"
"""For the router: which names of certificates count."""

HEADER: Final = """\
# Made by `fras compose docker` from {source}; change that, and make this anew.
#   docker compose up --build --wait        from the root of the checkout
#   {run} fras run --connect {connect} --out runs/first
# {keys}Audit logs and reports are in ./runs, which user 1000 has to be able to write. Compose
# starts again who ends, and no more: it knows no watchdog, no pauses, no nice, and holds no arms.
"""

SECURE: Final = """\
Each container gets the certificate and the key of its own service, read-only, out of the folder
# that FRAS_KEYS names: FRAS_KEYS="$HOME/.local/share/fras/keys". User 1000 has to own the files,
# and the router's certificate to name it: `fras keys rotate router --host {router}`.
# """


def compose_file(
    table: Table, cell: str = "local", port: int = PORT, *, secure: bool = False
) -> str:
    """Write a table as a Compose file.

    Parameters
    ----------
    table : Table
    cell : str
    port : int
        Of the router, on the containers' network and on the loopback of the host.
    secure : bool
        The table's commands show certificates.

    Raises
    ------
    TableError
        The table is for several hosts.
    """
    if table.hosts:
        allowed = "no hosts: a Compose file is for one machine"
        raise TableError(table.source, "host", ", ".join(table.hosts), allowed)
    router = router_of(table)
    header = HEADER.format(
        source=table.source.rpartition("/")[2],
        connect=f"{_protocol(secure)}/{router}:{port}",
        run=f"docker compose run --rm {CLI}" if secure else "docker compose exec planner",
        keys=SECURE.format(router=router) if secure else "",
    )
    made = compose(table, cell, port, secure=secure)
    return header + yaml.safe_dump(made, sort_keys=False, width=100)


def router_of(table: Table) -> str:
    """Name the process that listens; containers reach it under that name."""
    listening = (one.name for one in table.processes.values() if one.readiness == "listening")
    return next(listening, "router")


def compose(table: Table, cell: str, port: int, *, secure: bool = False) -> dict[str, Any]:
    """Make the content of a Compose file; see `compose_file`."""
    services = {
        name: _service(process, table, cell, port, secure)
        for name, process in table.processes.items()
    }
    made: dict[str, Any] = {"name": f"fras-{cell.lower()}", "services": services}
    if secure:
        services[CLI] = _people(table)
        asked = sorted({one["source"] for given in services.values() for one in given["secrets"]})
        folder = f"${{{KEYS}:?the folder of fras keys}}"
        made["secrets"] = {name: {"file": f"{folder}/{name}"} for name in asked}
    return made


def _people(table: Table) -> dict[str, Any]:
    """Make the container in which people type, with their certificate; started by hand alone."""
    return {
        "image": IMAGE,
        "profiles": ["tools"],
        "environment": {KEYS: SECRETS},
        "working_dir": FOLDER,
        "volumes": [f"./runs:{FOLDER}/runs"],
        "secrets": _secrets(CLI),
        "depends_on": {router_of(table): {"condition": "service_healthy"}},
    }


def _secrets(*names: str, more: Sequence[str] = ()) -> list[dict[str, str]]:
    """Mount the CA's certificate, and the certificates and keys of these."""
    files = [AUTHORITY, *(f"{name}{kind}" for name in names for kind in (".pem", ".key")), *more]
    return [{"source": one, "target": one} for one in files]


def _protocol(secure: bool) -> str:
    return "tls" if secure else "tcp"


def _service(process: Process, table: Table, cell: str, port: int, secure: bool) -> dict[str, Any]:
    router = router_of(table)
    listens = process.name == router
    connect = f"{_protocol(secure)}/{'0.0.0.0' if listens else router}:{port}"
    values = {
        "python": "python",
        "cell": cell,
        "connect": connect,
        "log_dir": f"{FOLDER}/runs/logs",
        "name": process.name,
        **({"keys": SECRETS} if secure else {}),
    }
    made: dict[str, Any] = {
        "image": IMAGE,
        "build": {"context": ".", "dockerfile": "compose/Dockerfile"},
        # A dollar would be Compose's own placeholder.
        "command": [word.replace("$", "$$") for word in expand(process, values)],
        "init": True,
        "environment": {
            name: value for name, value in ENVIRONMENT.items() if name != "FRAS_PARENT"
        },
        "working_dir": FOLDER,
        "volumes": [f"./runs:{FOLDER}/runs"],
        "restart": _restart(process),
        "stop_signal": "SIGINT",
        "stop_grace_period": _duration(process.stop_timeout_s),
        "healthcheck": _healthcheck(process, cell, f"{_protocol(secure)}/{router}:{port}"),
        "logging": {
            "driver": "json-file",
            "options": {"max-size": str(MAX_BYTES), "max-file": str(KEPT_FILES)},
        },
    }
    if listens:
        made["ports"] = [f"127.0.0.1:{port}:{port}"]
    if secure:
        made["secrets"] = _secrets(process.name, more=[NAMES] if listens else [])
    if depends := _depends_on(process, table.processes):
        made["depends_on"] = depends
    if process.memory_limit_mb:
        made["mem_limit"] = f"{process.memory_limit_mb * 1_000_000}b"
    if process.open_files_limit:
        limit = process.open_files_limit
        made["ulimits"] = {"nofile": {"soft": limit, "hard": limit}}
    return made


def _restart(process: Process) -> str:
    if process.restart == "never":
        return "no"
    # Compose knows a budget, but no window.
    many = f":{process.restart_budget}" if process.restart == "on-failure" else ""
    return f"{process.restart}{many}"


def _healthcheck(process: Process, cell: str, connect: str) -> dict[str, Any]:
    token = "" if process.readiness == "listening" else f"{_token(process)}/{process.name}"
    asked = [*PROBE, "--cell", cell, "--connect", connect, *([token] if token else [])]
    if connect.startswith("tls/"):
        asked += ["--tls", SECRETS, "--name", process.name]
    return {
        "test": ["CMD", *asked],
        "start_period": _duration(process.ready_timeout_s),
        "start_interval": "1s",
        "interval": "10s",
        "timeout": "10s",
        "retries": 3,
    }


def _token(process: Process) -> str:
    return "ready" if process.readiness == "token" else "alive"


def _duration(seconds: float) -> str:
    """Write a time in whole units: the specification knows no fractions."""
    return f"{round(seconds * 1000)}ms"


def _depends_on(process: Process, processes: Mapping[str, Process]) -> dict[str, Any]:
    """Whom it needs, and whom it must not outlast: Compose stops in reverse order of these."""
    outlasted = [other.name for other in processes.values() if process.name in other.outlives]
    return {
        **{name: {"condition": "service_started"} for name in outlasted},
        **{name: {"condition": "service_healthy"} for name in process.needs},
    }
