"""What a recorder hears: verdicts, small, and states of a tissue that is pulled."""

import msgspec
import numpy as np

from fras_common.bus import RawSample
from fras_common.codec import encode
from fras_common.messages import Array, Header, RobotState, SolverReport, TissueState, Verdict

TRIAL = "bench"
NODES = (21, 25, 2)
SIZE_M = (0.1, 0.12, 0.005)
# Distinct states; their messages still differ in number and stamp.
SHAPES = 50


def verdict(tick: int) -> Verdict:
    """Return a verdict as SA tells it at each tick."""
    return Verdict(
        trial=TRIAL, tick=tick, level="ok", ok=True, reason="", max_force_n=0.123 + 1e-6 * tick,
        limit_n=0.5, hard_limit_n=1.0, visibility=0.3, visible=False, max_height=[],
        force_rate_n_s=0.01, crossing_tick=-1, max_node_speed_m_s=0.002, grasped={"psm1": 1},
    )  # fmt: skip


def robot(tick: int) -> RobotState:
    """Return a state of the arms on the verdict before."""
    return RobotState(trial=TRIAL, tick=tick, arms={}, action=None, holds={}, verdict_tick=tick - 1)


def tissue(tick: int) -> TissueState:
    """Return the tissue lifted in its middle, the higher the later; forces fall off around."""
    grid = np.meshgrid(*(np.linspace(0.0, s, n) for s, n in zip(SIZE_M, NODES, strict=True)))
    nodes = np.stack(grid, axis=-1).reshape(-1, 3)
    away = np.linalg.norm(nodes[:, :2] - [0.05, 0.06], axis=1)
    bump = np.exp(-((away / 0.024) ** 2)) * (1 + tick % SHAPES) / SHAPES
    lifted = nodes + bump[:, None] * [0.002, -0.001, 0.05]
    force = np.outer(bump**2, [0.01, 0.02, 0.4])
    return TissueState(
        trial=TRIAL,
        tick=tick,
        nodes_m=Array.of(lifted, "<f4"),
        nodal_force_n=Array.of(force, "<f4"),
        max_force_n=float(force.max()),
        max_node_speed_m_s=0.01,
        tool_force_n={},
        grasped={"psm1": [1]},
        grasped_force_n={},
        patch_force_n=Array.of(np.zeros((7, 3)), "<f4"),
        balance_residual_n=1e-9,
        solver=SolverReport(
            iterations=2, residual=1e-9, refactored=False, wall_s=0.002, converged=True,
            inverted_elements=0,
        ),
    )  # fmt: skip


def samples(key: str, messages: list[Header], count: int) -> list[RawSample]:
    """Return `count` samples of these messages in turn, each with a number and stamp of its own."""
    return [
        RawSample(
            key,
            encode(
                msgspec.structs.replace(
                    messages[number % len(messages)],
                    seq=number,
                    stamp_ns=1_000 + number,
                    source="bench/1",
                )
            ),
            "application/msgpack",
        )
        for number in range(count)
    ]
