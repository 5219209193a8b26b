"""A stack that has started, kept by a thread of its own that takes part in the cell."""

import threading
import uuid
from pathlib import Path
from typing import Final, Self, TextIO, cast

from fras_common.bus.zenoh_bus import ZenohBus
from fras_common.errors import FrasError
from fras_common.identity import Identity
from fras_common.service import ServiceHost, run_shell
from fras_common.service.logs import logger_to
from fras_common.signals import StopFlag
from fras_supervisor.logs import RotatingFile
from fras_supervisor.runner import GONE, Stack
from fras_supervisor.service import SupervisorService, Tell

NAME: Final = "supervisor"


class SupervisionFailed(FrasError):
    """The thread that keeps the stack has ended by a mistake of ours."""


class Supervision:
    """Keeps a stack within a `with` block; afterwards nothing is started again.

    Parameters
    ----------
    stack : Stack
        One that has started. Within the block it belongs to the supervision's thread.
    cell, connect : str
    tell : callable
        Gets what there is to say, on that thread.
    identity : Identity, optional
        What it shows to a router at a `tls/` endpoint.
    """

    def __init__(
        self, stack: Stack, cell: str, connect: str, tell: Tell, identity: Identity | None = None
    ) -> None:
        self._log_file = _LogFile(stack.log_dir / f"{NAME}.log")
        self._host = ServiceHost(NAME)
        self._host.log = logger_to(NAME, cast(TextIO, self._log_file), self._host.publish_log)
        source = f"{NAME}/{uuid.uuid4().hex[:4]}"
        self._bus = ZenohBus(
            cell,
            connect,
            source,
            on_malformed=self._host.count_malformed,
            identity=identity,
        )
        self._host.attach(self._bus)
        self._service = SupervisorService(self._host, stack, tell)
        self._stop = StopFlag()
        self._failure: Exception | None = None
        self._thread = threading.Thread(target=self._run, name=NAME, daemon=True)

    def gone(self) -> str:
        """Tell which processes have gone for good, in words; empty while all may come back.

        Raises
        ------
        SupervisionFailed
        """
        if self._failure is not None:
            raise SupervisionFailed(
                f"the supervisor itself failed ({self._failure!r}): stop the stack and start it "
                f"again; {self._log_file.path} has the traceback"
            ) from self._failure
        return "; ".join(
            f"{one.name} {one.reason}" for one in self._service.latest if one.state in GONE
        )

    def __enter__(self) -> Self:
        self._thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._stop.set()
        self._thread.join()
        self._bus.close()
        self._log_file.close()

    def _run(self) -> None:
        try:
            run_shell(self._host, self._service, self._stop)
        except Exception as error:
            # For `gone` to raise where somebody looks.
            self._failure = error
            self._host.log.exception("the supervisor failed")


class _LogFile:
    """A rotated file that a logger prints to."""

    def __init__(self, path: Path) -> None:
        self.path = path
        self._file = RotatingFile(path)

    def write(self, text: str) -> int:
        """Append."""
        self._file.write(text.encode())
        return len(text)

    def flush(self) -> None:
        """Nothing waits to be written."""

    def close(self) -> None:
        """Close the file."""
        self._file.close()
