"""What the services would refuse later, told before any of them starts.

Each rule names a field, its value and what is allowed, where one field alone can't tell.
"""

from collections.abc import Iterator
from math import prod
from typing import Final

from fras_common.scenario.model import Scenario

Breach = tuple[str, object, str]

MAX_NODES: Final = 100_000
# The box that the arms' placement and their workspace gate cover, seen from above.
REACH_M: Final = (0.11, 0.13)
JAW_STOP_RAD_S2: Final = 50.0
ROUNDING: Final = 1 + 1e-9


def breaches(scenario: Scenario) -> Iterator[Breach]:
    """Yield each field that goes beyond what its neighbours allow."""
    yield from _tissue(scenario)
    yield from _motion(scenario)
    yield from _awareness(scenario)


def _tissue(scenario: Scenario) -> Iterator[Breach]:
    tissue = scenario.tissue
    if prod(tissue.node_counts) > MAX_NODES:
        yield "tissue.node_counts", list(tissue.node_counts), f"at most {MAX_NODES} nodes in all"
    for axis, reach in enumerate(REACH_M):
        if tissue.size_m[axis] > reach:
            yield (
                f"tissue.size_m[{axis}]",
                tissue.size_m[axis],
                f"at most {reach} m, what the arms reach",
            )
    attached = (
        bool(scenario.scene.discs) if scenario.scene else scenario.generator.attached_fraction > 0
    )
    if not tissue.bed and not attached:
        yield "tissue.bed", False, "tissue that is attached nowhere needs the bed"


def _motion(scenario: Scenario) -> Iterator[Breach]:
    motion, dt_s = scenario.motion, scenario.tissue.dt_s
    fastest = 2 * motion.stop_deceleration_m_s2 * dt_s
    for name in ("free_speed_m_s", "holding_speed_m_s"):
        speed: float = getattr(motion, name)
        if speed > fastest * ROUNDING:
            yield (
                f"motion.{name}",
                speed,
                f"a stop must end within two ticks: at most {fastest:.4g}, or raise "
                "motion.stop_deceleration_m_s2",
            )
    fastest = 2 * JAW_STOP_RAD_S2 * dt_s
    if motion.jaw_speed_rad_s > fastest * ROUNDING:
        yield (
            "motion.jaw_speed_rad_s",
            motion.jaw_speed_rad_s,
            f"a stop must end within two ticks: at most {fastest:.4g}",
        )
    for index, box in enumerate(motion.forbidden_boxes):
        if not all(a < b for a, b in zip(box.lower_m, box.upper_m, strict=True)):
            yield (
                f"motion.forbidden_boxes[{index}].upper_m",
                list(box.upper_m),
                f"above lower_m = {list(box.lower_m)} on each axis",
            )


def _awareness(scenario: Scenario) -> Iterator[Breach]:
    awareness = scenario.awareness
    depth_m = -scenario.scene.roi_m[2] if scenario.scene else scenario.generator.roi_depth_m
    if depth_m >= awareness.visible_distance_m:
        yield (
            "awareness.visible_distance_m",
            awareness.visible_distance_m,
            f"more than the depth of the region of interest, {depth_m} m: no tissue hides it else",
        )
    if awareness.hard_limit_n is not None and awareness.hard_limit_n < awareness.force_limit_n:
        yield (
            "awareness.hard_limit_n",
            awareness.hard_limit_n,
            f"must be at least force_limit_n = {awareness.force_limit_n}",
        )
