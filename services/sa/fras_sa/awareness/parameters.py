"""The thresholds of situation awareness; the defaults are the paper's."""

import math
from dataclasses import dataclass
from typing import Literal

from .errors import BadParameter


@dataclass(frozen=True, slots=True)
class AwarenessParameters:
    """Thresholds of Algorithms 1 and 2.

    Parameters
    ----------
    force_limit_n : float [N]
        The soft limit, the paper's epsilon: a pull is interrupted above it.
    hard_limit_n : float or None [N]
        Any action is interrupted above it; None means twice `force_limit_n`.
    no_limit : bool
        Watch the force but never interrupt for it.
    force_metric : {"nodal_max", "tool"}
        What is held against the limits: the largest nodal elastic force, or the largest force
        on a tool.
    visible_distance_m : float [m]
        Tissue nearer to the ROI than this at rest hides it; farther than this it does not.
    visible_fraction : float
        delta: the ROI is visible when more than this fraction of the hiding tissue is away.
    closed_jaw_rad : float [rad]
        A gripper is closed below it.
    at_distance_m : float [m]
        An arm is at a block nearer than this.
    blocks : int
        N: blocks along each side of the tissue.
    sample_edge_m : float [m]
        Longest edge of the triangles into which the surface near the ROI is resampled.

    Raises
    ------
    BadParameter
        If a value has no meaning.
    """

    force_limit_n: float = 0.5
    hard_limit_n: float | None = None
    no_limit: bool = False
    force_metric: Literal["nodal_max", "tool"] = "nodal_max"
    visible_distance_m: float = 0.01
    visible_fraction: float = 0.7
    closed_jaw_rad: float = math.radians(20.0)
    at_distance_m: float = 0.005
    blocks: int = 7
    sample_edge_m: float = 0.00125

    def __post_init__(self) -> None:
        for name in ("force_limit_n", "visible_distance_m", "at_distance_m", "sample_edge_m"):
            value: float = getattr(self, name)
            if not (math.isfinite(value) and value > 0.0):
                raise BadParameter(name, value, "finite and > 0")
        if not math.isfinite(self.closed_jaw_rad):
            raise BadParameter("closed_jaw_rad", self.closed_jaw_rad, "finite")
        if not 0.0 <= self.visible_fraction < 1.0:
            raise BadParameter("visible_fraction", self.visible_fraction, "in [0, 1)")
        if self.hard_limit_n is not None and not (
            math.isfinite(self.hard_limit_n) and self.hard_limit_n >= self.force_limit_n
        ):
            raise BadParameter("hard_limit_n", self.hard_limit_n, "finite and >= force_limit_n")
        if self.force_metric not in ("nodal_max", "tool"):
            raise BadParameter("force_metric", self.force_metric, "nodal_max or tool")
        if not 1 <= self.blocks <= 100:
            raise BadParameter("blocks", self.blocks, "between 1 and 100")

    @property
    def hard_n(self) -> float:
        """The hard limit in force [N]: `hard_limit_n`, or twice the soft one."""
        return 2.0 * self.force_limit_n if self.hard_limit_n is None else self.hard_limit_n
