"""What a log says of motion, decoded with the stock MCAP reader and msgpack alone."""

import tomllib
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import msgpack
import numpy as np
from mcap.reader import make_reader
from numpy.typing import NDArray

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class MotionLog:
    """What the checks read of a log, as decoded.

    Parameters
    ----------
    states : list of dict
        `robot/state`, as recorded.
    verdicts : list of dict
        `sa/verdict`, as recorded.
    limits : dict
        The scenario's table `motion`.
    dt_s : float
        A tick [s].
    """

    states: list[dict[str, Any]]
    verdicts: list[dict[str, Any]]
    limits: dict[str, float]
    dt_s: float

    @property
    def ticks(self) -> list[dict[str, Any]]:
        """One state a tick: a change of holds is told in a further one of the same tick."""
        first: dict[int, dict[str, Any]] = {}
        for state in self.states:
            first.setdefault(state["tick"], state)
        return list(first.values())


def read_motion(log: Path) -> MotionLog:
    """Decode what the checks need."""
    found: dict[str, list[dict[str, Any]]] = {"robot/state": [], "sa/verdict": []}
    with log.open("rb") as stream:
        reader = make_reader(stream, validate_crcs=True)
        about = next(one for one in reader.iter_metadata() if one.name == "fras")
        for _, channel, message in reader.iter_messages(topics=list(found)):
            found[channel.topic].append(msgpack.unpackb(message.data))
    scenario = tomllib.loads(about.metadata["scenario"])
    return MotionLog(
        found["robot/state"],
        found["sa/verdict"],
        scenario["motion"],
        scenario["tissue"]["dt_s"],
    )


def series(log: MotionLog, arm: str, field: str) -> Floats:
    """Return a field of an arm over the ticks; one row a tick."""
    return np.array([state["arms"][arm][field] for state in log.ticks], dtype=np.float64)


def phases(log: MotionLog) -> list[str]:
    """Return what was done in the tick that led to each state."""
    return [state["action"]["phase"] if state["action"] else "" for state in log.ticks]
