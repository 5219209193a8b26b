"""What a host refuses, and what it owns up to."""

from fras_common.errors import FrasError
from fras_common.messages import FaultRecord


class AnotherTrial(FrasError):
    """A message of another trial than the one that is served."""

    counted_as = "another_trial"

    def __init__(self, trial: str, serves: str) -> None:
        super().__init__(
            f"of trial {trial!r}, and {serves!r} is served: dropped", trial=trial, serves=serves
        )


class InternalFault(FrasError):
    """A query met a mistake of our own; the server's log has the traceback."""


class Sources:
    """Remembers who was told of already; a rogue with many names fills it, and is told no more."""

    MOST = 256

    def __init__(self) -> None:
        self._known: set[tuple[str, str]] = set()

    def is_first(self, what: str, source: str) -> bool:
        """Whether this is the first of its kind from a source."""
        one = (what, source)
        if one in self._known or len(self._known) >= self.MOST:
            return False
        self._known.add(one)
        return True


def record_of(key: str, error: FrasError, trial: str, tick: int) -> FaultRecord:
    """Put what was refused into a message, with the numbers behind it.

    Parameters
    ----------
    key : str
        Where what was refused came in.
    error : FrasError
        Why.
    trial, tick
        Of what was refused.
    """
    return FaultRecord(
        trial=trial,
        tick=tick,
        key=key,
        kind=error.kind,
        text=str(error),
        values={name: str(value) for name, value in error.values.items()},
    )
