"""Two halves of a piece of work at once.

The work falls into the same halves on every machine, so the numbers do not depend on how many
cores there are or how busy they are: only their time does.
"""

import threading
from collections.abc import Callable

Work = Callable[[], object]


class SecondCore:
    """A thread that waits for work.

    Notes
    -----
    Handing over and back takes some 30 µs: for work that lets go of the interpreter's lock
    (compiled loops) and takes a multiple of that. The thread starts with the first work and ends
    with the process; a forked process starts one of its own.
    """

    def __init__(self) -> None:
        self._thread: threading.Thread | None = None
        self._free = threading.Lock()
        self._given, self._done = _closed(), _closed()
        self._work: Work | None = None
        self._failure: BaseException | None = None

    def run(self, here: Work, there: Work) -> None:
        """Do both and return when both are done; what either raises is raised, `here` first.

        While it is in use, by another thread or from within, they are done one after the other.
        """
        if not self._free.acquire(blocking=False):
            here()
            there()
            return
        try:
            self._run(here, there)
        finally:
            self._free.release()

    def _run(self, here: Work, there: Work) -> None:
        if self._thread is None or not self._thread.is_alive():
            self._given, self._done = _closed(), _closed()
            self._thread = threading.Thread(target=self._serve, name="second-core", daemon=True)
            self._thread.start()
        self._work = there
        self._given.release()
        try:
            here()
        finally:
            self._done.acquire()
            failure, self._failure = self._failure, None
        if failure is not None:
            raise failure

    def _serve(self) -> None:
        while True:
            self._given.acquire()
            try:
                if self._work is not None:
                    self._work()
            except BaseException as failure:  # noqa: BLE001 - raised again by `run`
                self._failure = failure
            self._done.release()


def _closed() -> threading.Lock:
    """Return a lock that the other side opens."""
    lock = threading.Lock()
    lock.acquire()
    return lock


second_core = SecondCore()
