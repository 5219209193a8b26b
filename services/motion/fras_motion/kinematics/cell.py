"""Where the arms stand by default: psm1 at the low-y side of the tissue, psm2 at the other."""

from __future__ import annotations

from math import sqrt

from .pose import Pose, Vector3

__all__ = ["BASES_IN_WORLD", "HOME_TIPS_M"]

_HALF = sqrt(0.5)
# Chosen by a search over height and distance: each arm reaches x -0.01 .. 0.11, y -0.01 .. 0.13,
# z -0.005 .. 0.09 with its tool down and every joint at least 8 % of its range from a limit. The
# bases are turned so that the wide joint (yaw, +-91 degrees) swings across the long side of the
# tissue and the narrow one (pitch, +-53 degrees) across the short side.
BASES_IN_WORLD: dict[str, Pose] = {
    "psm1": Pose((0.05, 0.0, 0.16), (0.0, 0.0, _HALF, _HALF)),
    "psm2": Pose((0.05, 0.12, 0.16), (0.0, 0.0, -_HALF, _HALF)),
}
HOME_TIPS_M: dict[str, Vector3] = {"psm1": (0.05, 0.03, 0.06), "psm2": (0.05, 0.09, 0.06)}
