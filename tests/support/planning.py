"""Situations for the planner's tests."""

import numpy as np


def random_state(rng: np.random.Generator, names: tuple[str, ...]) -> list[str]:
    """Draw what may be sensed of two arms over some blocks."""
    state: list[str] = []
    for arm in ("psm1", "psm2"):
        where = [str(name) for name in rng.choice(names, size=int(rng.integers(0, 3)))]
        closed = rng.random() < 0.5
        state += [f"at({arm},{name})" for name in where]
        if closed:
            state.append(f"closed_gripper({arm})")
            state += [f"in_hand({arm},{name})" for name in where]
        if rng.random() < 0.3:
            state.append(f"max_height({arm})")
    if rng.random() < 0.15:
        state.append("visible_roi")
    return state
