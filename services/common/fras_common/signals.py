"""When to stop: SIGINT, SIGTERM, or the end of the parent that started us."""

import os
import queue
import signal
import threading
from collections.abc import Generator
from contextlib import contextmanager

GRACE_S = 10.0


@contextmanager
def silent_interrupt() -> Generator[None]:
    """Let SIGINT end the process at once within the block, without a traceback.

    For as long as libraries are loaded and nothing is open yet: a KeyboardInterrupt would come up
    anywhere in them. Whoever installs a handler within the block has it until the block's end.
    """
    before = signal.getsignal(signal.SIGINT)
    if before is signal.default_int_handler:
        signal.signal(signal.SIGINT, signal.SIG_DFL)
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, before)


class StopFlag:
    """Set by a signal or by the parent's death; wakes whoever waits.

    No `threading.Event`: its lock is not reentrant, so a second signal that interrupts the handler
    of the first would block the process for ever.
    """

    def __init__(self) -> None:
        self._asked = False
        self._wake: queue.SimpleQueue[None] = queue.SimpleQueue()
        self.on_set = lambda: None

    def install(self) -> None:
        """Catch SIGINT and SIGTERM; under a supervisor also watch its end of our stdin."""
        signal.signal(signal.SIGINT, self._on_signal)
        signal.signal(signal.SIGTERM, self._on_signal)
        if os.environ.get("FRAS_PARENT") == "stdin":
            threading.Thread(target=self._watch_parent, name="parent", daemon=True).start()

    def set(self) -> None:
        """Ask for the stop."""
        self._asked = True
        self._wake.put(None)
        self.on_set()

    def is_set(self) -> bool:
        """Whether the stop was asked for."""
        return self._asked

    def wait(self) -> None:
        """Block until the stop is asked for."""
        self._wake.get()
        self._wake.put(None)

    def _on_signal(self, number: int, frame: object) -> None:
        self.set()

    def _watch_parent(self) -> None:
        # Not sys.stdin: its lock, held by a daemon thread, aborts the interpreter at exit.
        while os.read(0, 4096):
            pass
        self.set()
        # An orphan must not linger, whatever its main thread is stuck in.
        timer = threading.Timer(GRACE_S, os._exit, (1,))
        timer.daemon = True
        timer.start()
