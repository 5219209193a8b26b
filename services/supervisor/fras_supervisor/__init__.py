"""FRAS supervisor: one table of processes, started in order of need, kept, stopped in reverse.

Public: `load_table`, `find_table`, `Stack`, `Supervision`, `Console`, `Exit`, `free_port`, and the
errors.
"""

from fras_supervisor.child import Exit
from fras_supervisor.console import Console
from fras_supervisor.errors import (
    AddressNotHere,
    AlreadyStarted,
    BadAddress,
    BadEndpoint,
    CommandNotFound,
    LimitRefused,
    LogDirUnusable,
    NoAddress,
    NothingOnHost,
    NotReady,
    OnOtherHost,
    PortTaken,
    ServiceDied,
    StartCancelled,
    TableError,
    UnknownHost,
    UnknownProcess,
    Unstoppable,
)
from fras_supervisor.order import start_order
from fras_supervisor.placement import place
from fras_supervisor.ports import Endpoint, free_port
from fras_supervisor.runner import Stack, Status
from fras_supervisor.supervision import Supervision, SupervisionFailed
from fras_supervisor.table import Process, Table, find_table, load_table

__all__ = [
    "AddressNotHere",
    "AlreadyStarted",
    "BadAddress",
    "BadEndpoint",
    "CommandNotFound",
    "Console",
    "Endpoint",
    "Exit",
    "LimitRefused",
    "LogDirUnusable",
    "NoAddress",
    "NotReady",
    "NothingOnHost",
    "OnOtherHost",
    "PortTaken",
    "Process",
    "ServiceDied",
    "Stack",
    "StartCancelled",
    "Status",
    "Supervision",
    "SupervisionFailed",
    "Table",
    "TableError",
    "UnknownHost",
    "UnknownProcess",
    "Unstoppable",
    "find_table",
    "free_port",
    "load_table",
    "place",
    "start_order",
]
