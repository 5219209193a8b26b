"""Exit status of a command that ended in a known error."""

from fras_cli.audit import UnknownService
from fras_cli.keep import DownTimeout
from fras_cli.log_export import NoFormat
from fras_cli.run import (
    EXIT_BAD_INPUT,
    EXIT_INTERRUPTED,
    EXIT_NOT_SUCCESS,
    EXIT_STACK,
    FolderInUse,
)
from fras_cli.runtime import BadCell, NoStack, SeveralStacks, StackExists
from fras_cli.stack import OtherRules, StackIncomplete
from fras_cli.trial import StackDied, TrialRefused
from fras_common.bus import NoAnswer
from fras_common.bus.zenoh_bus import NoRouter
from fras_common.errors import FrasError
from fras_common.scenario import ScenarioError
from fras_common.service.extras import MissingExtra
from fras_log.export import OutputExists, OutputIsLog, OutputUnwritable
from fras_replay.errors import BadKey, BadPlace, BadRate, LiveCell
from fras_supervisor import (
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

BAD_INPUT = (
    BadCell,
    BadEndpoint,
    BadKey,
    BadPlace,
    BadRate,
    FolderInUse,
    LogDirUnusable,
    NoFormat,
    OtherRules,
    OutputExists,
    OutputIsLog,
    OutputUnwritable,
    ScenarioError,
    UnknownService,
)
STACK_ERRORS = (
    CommandNotFound,
    DownTimeout,
    LiveCell,
    MissingExtra,
    NoAnswer,
    NoRouter,
    NoStack,
    SeveralStacks,
    NotReady,
    PortTaken,
    ServiceDied,
    StackDied,
    StackExists,
    StackIncomplete,
    TableError,
    TrialRefused,
    Unstoppable,
)


def exit_status(error: FrasError) -> int:
    """2 for bad input, 3 for a stack that fails, 130 if interrupted, 1 for the rest."""
    if isinstance(error, StartCancelled):
        return EXIT_INTERRUPTED
    if isinstance(error, BAD_INPUT):
        return EXIT_BAD_INPUT
    if isinstance(error, STACK_ERRORS):
        return EXIT_STACK
    return EXIT_NOT_SUCCESS
