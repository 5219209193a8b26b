"""What Zenoh keeps of a key without a word to us, to be looked at now and then."""

# The wheel's stubs leave handler types open.
# pyright: reportUnknownMemberType=false

import threading
from collections.abc import Callable
from typing import Any, Generic, TypeVar, cast

import zenoh

from fras_common.bus.contract import BusClosed

__all__ = ["Ring"]

T = TypeVar("T")


class Ring(Generic[T]):
    """The last samples of a key.

    Parameters
    ----------
    session : zenoh.Session
    key_expr : str
    at_most : int
        How many are kept; then the oldest goes.
    read : callable
        Makes of a sample what `take` gives.
    """

    def __init__(
        self, session: Any, key_expr: str, at_most: int, read: Callable[[zenoh.Sample], T]
    ) -> None:
        self._session = session
        self._key_expr = key_expr
        self._at_most = at_most
        self._read = read
        self._lock = threading.Lock()
        self._subscriber: Any = None
        self._closed = False
        self.resume()

    def take(self) -> list[T]:
        """Give what came since the last time, oldest first."""
        taken: list[zenoh.Sample] = []
        with self._lock:
            # Somebody else may say more as fast as it is taken.
            while self._subscriber is not None and len(taken) < self._at_most:
                if (sample := self._subscriber.try_recv()) is None:
                    break
                taken.append(sample)
        return [self._read(one) for one in taken]

    def pause(self) -> None:
        """Hear nothing, and forget what was not taken."""
        with self._lock:
            if self._subscriber is not None:
                self._subscriber.undeclare()
                self._subscriber = None

    def resume(self) -> None:
        """Hear from now on.

        Raises
        ------
        BusClosed
        """
        with self._lock:
            if self._closed:
                raise BusClosed("this bus is closed: open a new one")
            if self._subscriber is None:
                kept = cast(Any, zenoh.handlers.RingChannel(self._at_most))
                self._subscriber = self._session.declare_subscriber(self._key_expr, kept)

    def undeclare(self) -> None:
        """Hear nothing any more; as the bus is closed."""
        self._closed = True
        self.pause()
