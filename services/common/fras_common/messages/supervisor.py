"""What the supervisor says of the processes it keeps, and what it can be told."""

from typing import Literal

from fras_common.messages.base import Header, Wire

ProcessState = Literal[
    "pending", "starting", "ready", "stopping", "waiting", "ended", "given_up", "stopped"
]
StackVerdict = Literal["whole", "incomplete", "safe_hold"]


class ProcessReport(Wire, frozen=True, kw_only=True):
    """Where one process of the table stands.

    Attributes
    ----------
    state : str
        `pending`: not launched yet; `starting`; `ready`; `stopping`: to be started again, because
        somebody asked; `waiting`: ended, and starts again after its back-off and when what it needs
        is ready; `ended`: with exit status 0, and stays so; `given_up`; `stopped`: with the stack.
    pid : int
        0 while it does not run.
    restarts : int
        How often it was started again since the stack was started.
    last_exit : str
        How it last ended, in words; empty if it never did.
    starts_in_s : float
        What is left of its back-off; 0 if it does not wait.
    up_s : float
        Since it was launched; 0 while it does not run.
    cpu_percent, rss_bytes : float, int
        Processor share (100 = one core) since the last report, and resident memory.
    log_lost_bytes : int
        Output that could not be written to its log.
    """

    name: str
    state: ProcessState
    pid: int
    restarts: int
    last_exit: str
    starts_in_s: float
    up_s: float
    cpu_percent: float
    rss_bytes: int
    log_lost_bytes: int


class SupervisorStatus(Header, frozen=True, kw_only=True):
    """The stack as its supervisor sees it.

    Attributes
    ----------
    verdict : str
        `whole`: every process is ready; `incomplete`: one is not; `safe_hold`: one was given up.
    reason : str
        Which process, and why; empty while the stack is whole.
    held : bool
        Whether motion has acknowledged the supervisor's hold.
    log_dir : str
        Folder of the logs, on the supervisor's machine.
    host : str
        Whose processes these are, where a table has several hosts; else empty.
    """

    verdict: StackVerdict
    reason: str
    held: bool
    log_dir: str
    host: str = ""
    processes: list[ProcessReport]


class RestartRequest(Wire, frozen=True, kw_only=True):
    """Start a process of the table again; what counted against it is forgotten. `by`: who asks."""

    name: str
    by: str


class RestartReply(Wire, frozen=True, kw_only=True):
    """It will be; where it stood, and how often it had been started again."""

    name: str
    state: ProcessState
    restarts: int
