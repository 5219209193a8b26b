"""Goals for motion, made by hand."""

from fras_common.messages import ExecuteRequest, Vec3

TARGET = (0.03, 0.03, 0.005)


def reach_goal(target_m: Vec3 = TARGET) -> ExecuteRequest:
    """The first goal of trial `t`: psm1 is to reach a block."""
    return ExecuteRequest(
        trial="t", goal_id="g1", name="reach", arm="psm1", block="b(2,2)", target_m=target_m
    )
