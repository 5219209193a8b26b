"""What an audit found."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from fras_audit.comparison import Tally


@dataclass(frozen=True)
class Report:
    """All tallies of one log.

    Parameters
    ----------
    path, trial : str
    damage : str
        Why the file was not read to its end; empty if it was.
    malformed : int
        Messages that could not be understood.
    gaps : mapping of str to int
        Messages missing by their numbers, by key.
    tallies : tuple of Tally
    took_s : float
    """

    path: str
    trial: str
    damage: str
    malformed: int
    gaps: Mapping[str, int]
    tallies: tuple[Tally, ...]
    took_s: float

    @property
    def compared(self) -> int:
        """Messages compared, over all services."""
        return sum(tally.compared for tally in self.tallies)

    @property
    def passed(self) -> bool:
        """Whether each service audited was compared to its end, and nothing differs."""
        services = {tally.service for tally in self.tallies}
        compared = {tally.service for tally in self.tallies if tally.compared}
        clean = all(tally.is_clean for tally in self.tallies)
        return (
            clean and services == compared and not (self.damage or self.malformed or not services)
        )

    def plain(self) -> dict[str, Any]:
        """Return it as JSON has it."""
        return {
            "log": self.path,
            "trial": self.trial,
            "passed": self.passed,
            "damage": self.damage,
            "malformed": self.malformed,
            "gaps": dict(self.gaps),
            "took_s": self.took_s,
            "tallies": [_plain(tally) for tally in self.tallies],
        }


def _plain(tally: Tally) -> dict[str, Any]:
    first = tally.first
    return {
        "service": tally.service,
        "what": tally.what,
        "recorded": tally.total,
        "compared": tally.compared,
        "equal": tally.equal,
        "tolerated": tally.tolerated,
        "differences": tally.differences,
        "skipped": tally.skipped,
        "notes": tally.notes,
        "first_difference": None
        if first is None
        else {
            "where": first.where,
            "seq": first.seq,
            "field": first.path,
            "recorded": first.recorded,
            "derived": first.derived,
        },
    }
