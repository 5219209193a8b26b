"""The supervisor's end of the orphan guard (the other one is `guard_main.py`)."""

import os
import subprocess
import sys
from pathlib import Path

from fras_common.errors import FrasError


class GuardDied(FrasError):
    """Somebody ended the orphan guard; nothing is started without it."""

    def __init__(self) -> None:
        super().__init__("the supervisor's orphan guard was killed; start the stack again")


class OrphanGuard:
    """A small process that ends our children should we end without doing so.

    Children end by themselves when their standard input does. The guard is for those that can't
    (frozen, or busy in a library) and for their own children.

    Parameters
    ----------
    grace_s : float [s]
        How long orphans may take to end by themselves.

    Notes
    -----
    Not `prctl(PR_SET_PDEATHSIG)`: it needs code between fork and exec, kills without grace, and
    fires when the *thread* that started the child ends.
    """

    def __init__(self, grace_s: float) -> None:
        script = Path(__file__).with_name("guard_main.py")
        charges, self._charges = os.pipe()
        try:
            self._process = subprocess.Popen(
                # -I -S: no site, no environment; a fraction of the time to start.
                [sys.executable, "-I", "-S", str(script), str(grace_s)],
                stdin=charges,
                stdout=subprocess.DEVNULL,
                stderr=subprocess.DEVNULL,
                start_new_session=True,
            )
        finally:
            os.close(charges)

    @property
    def pid(self) -> int:
        """Process id of the guard."""
        return self._process.pid

    @property
    def is_alive(self) -> bool:
        """Whether nobody has ended it."""
        return self._process.poll() is None

    def watch(self, pid: int) -> None:
        """End the process group that `pid` leads when we are gone.

        Raises
        ------
        GuardDied
            The guard is not there any more.
        """
        try:
            os.write(self._charges, b"%d\n" % pid)
        except BrokenPipeError as error:
            raise GuardDied from error

    def dismiss(self) -> None:
        """End the guard; for when none of its charges lives any more."""
        # Not by closing the pipe: it would wait for an init that is slow to reap what we killed.
        self._process.kill()
        self._process.wait()
        os.close(self._charges)
