"""Exit status of a command that ended in a known error."""

from fras_cli.audit import UnknownService
from fras_cli.confirm import NoTerminal
from fras_cli.keep import DownTimeout
from fras_cli.keys import BadKeys, KeysExist
from fras_cli.layout import OtherRules
from fras_cli.log_export import NoFormat
from fras_cli.log_verify import NotAHead
from fras_cli.own_rules import UnusableRules
from fras_cli.patient import NoPatient
from fras_cli.run import (
    EXIT_BAD_INPUT,
    EXIT_INTERRUPTED,
    EXIT_NOT_SUCCESS,
    EXIT_STACK,
    FolderInUse,
)
from fras_cli.runtime import BadCell, BadRuntimeFolder, NoStack, SeveralStacks, StackExists
from fras_cli.service_logs import NoLog
from fras_cli.stack import StackIncomplete
from fras_cli.trial import NobodyRunsTrials, StackDied, TrialRefused
from fras_cli.viewing import NoPage
from fras_common.bus import NoAnswer
from fras_common.bus.zenoh_bus import NoRouter
from fras_common.errors import FrasError
from fras_common.extras import MissingExtra
from fras_common.identity import BadIdentity
from fras_common.scenario import ScenarioError
from fras_log.attachments import InTheWay
from fras_log.export import OutputExists, OutputIsLog, OutputUnwritable
from fras_replay.errors import BadKey, BadPlace, BadRate, LiveCell
from fras_supervisor import (
    AddressNotHere,
    BadAddress,
    BadEndpoint,
    CommandNotFound,
    LimitRefused,
    LogDirUnusable,
    NoAddress,
    NothingOnHost,
    NotReady,
    PortTaken,
    ServiceDied,
    StartCancelled,
    SupervisionFailed,
    TableError,
    UnknownHost,
    Unstoppable,
)

BAD_INPUT = (
    AddressNotHere,
    BadAddress,
    BadCell,
    BadEndpoint,
    BadIdentity,
    BadKey,
    BadKeys,
    BadPlace,
    BadRate,
    BadRuntimeFolder,
    FolderInUse,
    InTheWay,
    KeysExist,
    LogDirUnusable,
    NoAddress,
    NoFormat,
    NoLog,
    NoPatient,
    NoTerminal,
    NotAHead,
    NothingOnHost,
    OtherRules,
    OutputExists,
    OutputIsLog,
    OutputUnwritable,
    ScenarioError,
    UnknownHost,
    UnknownService,
    UnusableRules,
)
STACK_ERRORS = (
    CommandNotFound,
    DownTimeout,
    LimitRefused,
    LiveCell,
    MissingExtra,
    NoAnswer,
    NoPage,
    NoRouter,
    NoStack,
    NobodyRunsTrials,
    SeveralStacks,
    NotReady,
    PortTaken,
    ServiceDied,
    StackDied,
    StackExists,
    StackIncomplete,
    SupervisionFailed,
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
