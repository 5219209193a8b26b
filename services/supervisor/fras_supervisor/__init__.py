"""FRAS supervisor: one table of processes, started in order of need, watched, stopped in reverse.

Public: `load_table`, `find_table`, `Stack`, `Console`, `Exit`, `free_port`, and the errors.
"""

from fras_supervisor.child import Exit
from fras_supervisor.console import Console
from fras_supervisor.errors import (
    AlreadyStarted,
    BadEndpoint,
    CommandNotFound,
    LogDirUnusable,
    NotReady,
    PortTaken,
    ServiceDied,
    StartCancelled,
    TableError,
    Unstoppable,
)
from fras_supervisor.order import start_order
from fras_supervisor.ports import Endpoint, free_port
from fras_supervisor.runner import Stack, Status
from fras_supervisor.table import Process, Table, find_table, load_table

__all__ = [
    "AlreadyStarted",
    "BadEndpoint",
    "CommandNotFound",
    "Console",
    "Endpoint",
    "Exit",
    "LogDirUnusable",
    "NotReady",
    "PortTaken",
    "Process",
    "ServiceDied",
    "Stack",
    "StartCancelled",
    "Status",
    "Table",
    "TableError",
    "Unstoppable",
    "find_table",
    "free_port",
    "load_table",
    "start_order",
]
