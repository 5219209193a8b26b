"""One child process: launched in a session of its own, signalled as a group, reaped once."""

import os
import subprocess
import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from signal import SIGCONT, SIGKILL, Signals
from typing import Final

from fras_common.threads import ONE_THREAD
from fras_supervisor.errors import CommandNotFound
from fras_supervisor.logs import Echo, LogPump, RotatingFile
from fras_supervisor.table import Process

ENVIRONMENT: Final[dict[str, str]] = {
    **ONE_THREAD,
    "PYTHONUNBUFFERED": "1",
    # The service runner then ends the process when its standard input ends.
    "FRAS_PARENT": "stdin",
}


@dataclass(frozen=True)
class Exit:
    """How a process ended.

    Attributes
    ----------
    name : str
        Its name in the table.
    returncode : int
        Its exit status, or minus the signal that ended it.
    by : str
        "itself", or the last signal that we had sent: "SIGINT", "SIGTERM", "SIGKILL".
    took_s : float [s]
        From our first signal to its end; 0 if it ended by itself.
    last_lines : tuple of str
        How its log ends.
    """

    name: str
    returncode: int
    by: str
    took_s: float
    last_lines: tuple[str, ...]


class Child:
    """A process of the table that was launched.

    It leads its own session and process group: a Ctrl-C at the terminal reaches the supervisor
    alone, and a signal sent here reaches the child's own children too. Its standard input is a
    pipe that nobody writes to: it ends when we do.

    Attributes
    ----------
    has_started : bool
        Whether it was seen to be ready: it then answers SIGINT in order.

    Raises
    ------
    CommandNotFound
        The command can't be run.
    LogDirUnusable
        Its log can't be opened.
    """

    def __init__(
        self, process: Process, command: Sequence[str], log: RotatingFile, echo: Echo | None
    ) -> None:
        self.process = process
        self.launched_at = time.monotonic()
        self.exit: Exit | None = None
        self.has_started = False
        self._signals: list[tuple[Signals, float]] = []
        # Pipes of our own and not Popen's: the pump owns the output's end, no file object does.
        child_in, self._stdin = os.pipe()
        output, child_out = os.pipe()
        try:
            self._popen = subprocess.Popen(
                command,
                stdin=child_in,
                stdout=child_out,
                stderr=child_out,
                env=child_environment(os.environ),
                start_new_session=True,
            )
        except OSError as error:
            log.close()
            os.close(self._stdin)
            os.close(output)
            raise CommandNotFound(process.name, command[0], error.strerror or "") from error
        finally:
            os.close(child_in)
            os.close(child_out)
        self.pump = LogPump(process.name, output, log, echo)

    @property
    def pid(self) -> int:
        """Process id, also of its group and its session."""
        return self._popen.pid

    def poll(self) -> Exit | None:
        """Tell how it ended, or nothing while it lives; what is left of its group is killed."""
        if self.exit is None:
            # Look before reaping: as long as the dead leader is there, its id is no one else's,
            # and the group can be signalled without hitting a stranger.
            options = os.WEXITED | os.WNOHANG | os.WNOWAIT
            if os.waitid(os.P_PID, self.pid, options) is None:
                return None
            ended_at = time.monotonic()
            os.killpg(self.pid, SIGKILL)
            self.pump.finish()
            returncode = self._popen.wait()
            os.close(self._stdin)
            self.exit = Exit(
                name=self.process.name,
                returncode=returncode,
                by=self._signals[-1][0].name if self._signals else "itself",
                took_s=ended_at - self._signals[0][1] if self._signals else 0.0,
                last_lines=self.pump.last_lines(),
            )
        return self.exit

    def send(self, number: Signals) -> None:
        """Send a signal to the process and its group, unless it has ended."""
        if self.poll() is None:
            self._signals.append((number, time.monotonic()))
            os.killpg(self.pid, number)
            # One that was frozen (SIGSTOP) gets to see it and ends in order.
            os.killpg(self.pid, SIGCONT)

    def last_signal(self) -> tuple[Signals, float] | None:
        """Give the newest signal that we sent and when (monotonic clock), if any."""
        return self._signals[-1] if self._signals else None


def child_environment(inherited: Mapping[str, str]) -> dict[str, str]:
    """Environment of every child: what we were given, then what a trial must not vary in."""
    return {**inherited, **ENVIRONMENT}
