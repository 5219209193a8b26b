"""A verdict of situation awareness, as tests that play it need one."""

from typing import Any

import msgspec

from fras_common.messages import Verdict


def verdict(tick: int, trial: str = "t-1", level: Any = "ok", **changes: Any) -> Verdict:
    """Nothing is seen, nothing is held, no force is borne, but for the changes."""
    quiet = Verdict(
        tick=tick,
        trial=trial,
        level=level,
        ok=level == "ok",
        reason="",
        max_force_n=0.0,
        limit_n=0.5,
        hard_limit_n=1.0,
        visibility=0.0,
        visible=False,
        max_height=[],
        force_rate_n_s=0.0,
        crossing_tick=-1,
        max_node_speed_m_s=0.0,
        grasped={},
    )
    return msgspec.structs.replace(quiet, **changes)
