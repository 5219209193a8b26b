"""The rules of effects.lp, one by one: what was and what was done in, what is out."""

import pytest

from fras_planner.planning import Knowledge
from planner.mutants import models

GIVEN = "#defined occurs/3. "
TO_2 = [("step", (1,)), ("step", (2,))]
HELD = "in_hand(start,psm1,1). closed_gripper(psm1,1). at(start,psm1,1). "


@pytest.mark.parametrize(
    ("before", "expected", "absent"),
    [
        pytest.param(
            HELD + "occurs(release,psm1,1).", "dropped(psm1,1)", "dropped(psm2,1)", id="dropped"
        ),
        pytest.param(
            "closed_gripper(psm1,1). occurs(release,psm1,1).",
            "",
            "dropped(psm1,1)",
            id="dropped-nothing_held",
        ),
        pytest.param(
            "at(start,psm1,1). occurs(reach,psm1,1).",
            "at(target,psm1,2)",
            "at(start,psm1,2) at(target,psm2,2)",
            id="at_target-reach",
        ),
        pytest.param(
            "at(target,psm1,1). occurs(grasp,psm1,1).",
            "at(target,psm1,2)",
            "at(start,psm1,2)",
            id="at_target-stays",
        ),
        pytest.param(
            "at(target,psm1,1). in_hand(target,psm1,1). occurs(release,psm1,1).",
            "",
            "at(target,psm1,2)",
            id="at_target-dropped",
        ),
        pytest.param(
            "at(start,psm1,1). occurs(reach,psm2,1).", "at(start,psm1,2)", "", id="at_start-stays"
        ),
        pytest.param(
            HELD + "occurs(release,psm1,1).", "", "at(start,psm1,2)", id="at_start-dropped"
        ),
        pytest.param(
            "at(start,psm1,1). closed_gripper(psm1,1). occurs(release,psm1,1).",
            "at(start,psm1,2)",
            "",
            id="at_start-empty_gripper",
        ),
        pytest.param(
            "occurs(grasp,psm1,1).",
            "in_hand(target,psm1,2) closed_gripper(psm1,2)",
            "in_hand(start,psm1,2) in_hand(target,psm2,2) closed_gripper(psm2,2)",
            id="grasp",
        ),
        pytest.param(
            HELD + "occurs(pull,psm1,1).",
            "in_hand(start,psm1,2) closed_gripper(psm1,2)",
            "in_hand(target,psm1,2)",
            id="in_hand-stays",
        ),
        pytest.param(
            HELD + "occurs(release,psm1,1).",
            "",
            "in_hand(start,psm1,2) closed_gripper(psm1,2)",
            id="release",
        ),
        pytest.param(
            HELD + "occurs(release,psm2,1).",
            "in_hand(start,psm1,2) closed_gripper(psm1,2)",
            "",
            id="release-other_arm",
        ),
        pytest.param(
            "max_height(psm1,1). occurs(pull,psm1,1).",
            "max_height(psm1,2)",
            "max_height(psm2,2)",
            id="max_height-stays",
        ),
        pytest.param(
            "max_height(psm1,1). max_height(psm2,1). occurs(move,psm1,1).",
            "max_height(psm2,2)",
            "max_height(psm1,2)",
            id="max_height-move",
        ),
        pytest.param(
            "max_height(psm1,1). occurs(release,psm1,1).",
            "",
            "max_height(psm1,2)",
            id="max_height-release",
        ),
        pytest.param("occurs(pull,psm1,1).", "visible_roi(2)", "visible_roi(1)", id="visible-pull"),
        pytest.param("occurs(move,psm2,1).", "visible_roi(2)", "", id="visible-move"),
        pytest.param("occurs(grasp,psm2,1).", "", "visible_roi(2)", id="visible-not_by_grasp"),
        pytest.param(
            "visible_roi(1). occurs(reach,psm1,1).", "visible_roi(2)", "", id="visible-stays"
        ),
        pytest.param(
            "visible_roi(1). occurs(release,psm1,1). closed_gripper(psm1,1).",
            "visible_roi(2)",
            "",
            id="visible-empty_gripper",
        ),
        pytest.param(
            "visible_roi(1). occurs(release,psm1,1)." + HELD,
            "",
            "visible_roi(2)",
            id="visible-dropped",
        ),
    ],
)
def test_rule(knowledge: Knowledge, before: str, expected: str, absent: str) -> None:
    (atoms,) = models(knowledge, ["effects.lp"], GIVEN + before, TO_2)
    assert set(expected.split()) <= atoms
    assert not set(absent.split()) & atoms
