"""The rules of history.lp, one by one: a plan as facts in, what it does and leads to out."""

import pytest

from fras_planner.planning import Knowledge
from planner.mutants import models

TELL = [("history", ())]
TARGET = "target(psm1,b(2,2)). "
# A gripper that spans two blocks.
TWO = "in_hand(psm1,b(10,1)). in_hand(psm1,b(2,1)). in_hand(start,psm1,1..2). "


@pytest.mark.parametrize(
    ("plan", "expected", "absent"),
    [
        pytest.param(
            TWO + "clean(psm1,b(10,1)).",
            "called(psm1,b(10,1))",
            "called(psm1,b(2,1))",
            id="called-clean",
        ),
        pytest.param(
            TWO + "clean(psm1,b(10,1)). clean(psm1,b(2,1)).",
            "called(psm1,b(2,1))",
            "called(psm1,b(10,1))",
            id="called-smallest_clean",
        ),
        pytest.param(
            TWO, "called(psm1,b(2,1))", "called(psm1,b(10,1))", id="called-smallest_of_none_clean"
        ),
        pytest.param(
            TWO, "grip(psm1,b(2,1),2)", "grip(psm1,b(2,1),3) grip(psm1,b(10,1),2)", id="grip-start"
        ),
        pytest.param(
            TARGET + "in_hand(target,psm1,3).",
            "grip(psm1,b(2,2),3)",
            "grip(psm1,b(2,2),2)",
            id="grip-target",
        ),
        pytest.param(
            TARGET + "occurs(reach,psm1,1).",
            "does(reach(psm1,b(2,2)),1) expected(1,at(psm1,b(2,2)))",
            "does(reach(psm1,b(2,2)),2) expected(1,in_hand(psm1,b(2,2)))",
            id="reach",
        ),
        pytest.param(
            TARGET + "occurs(grasp,psm1,2).",
            "does(grasp(psm1,b(2,2)),2)"
            " expected(2,in_hand(psm1,b(2,2))) expected(2,closed_gripper(psm1))",
            "expected(2,at(psm1,b(2,2)))",
            id="grasp",
        ),
        pytest.param(
            TWO + "occurs(pull,psm1,1).",
            "does(pull(psm1,b(2,1)),1)",
            "does(pull(psm1,b(10,1)),1) expected(1,visible_roi)",
            id="pull-start",
        ),
        pytest.param(
            TARGET + "in_hand(target,psm1,3). occurs(pull,psm1,3).",
            "does(pull(psm1,b(2,2)),3)",
            "",
            id="pull-target",
        ),
        pytest.param(
            TWO + "occurs(move,psm1,1). above_roi(b(10,3)). above_roi(b(3,4)).",
            "does(move(psm1,b(3,4)),1)",
            "does(move(psm1,b(10,3)),1) does(move(psm1,b(2,1)),1) expected(1,visible_roi)",
            id="move",
        ),
        pytest.param(
            TWO + "occurs(release,psm1,1).",
            "does(release(psm1),1) expected(1,-closed_gripper(psm1))",
            "expected(1,closed_gripper(psm1))",
            id="release",
        ),
        pytest.param(
            "at(psm2,b(1,1)). at(start,psm2,1..2).",
            "holds(at(psm2,b(1,1)),1) holds(at(psm2,b(1,1)),2)",
            "holds(at(psm2,b(1,1)),3)",
            id="holds-at_start",
        ),
        pytest.param(
            TARGET + "at(target,psm1,2). at(psm1,b(1,1)).",
            "holds(at(psm1,b(2,2)),2)",
            "holds(at(psm1,b(1,1)),2) holds(at(psm1,b(2,2)),1)",
            id="holds-at_target",
        ),
        pytest.param(
            TWO,
            "holds(in_hand(psm1,b(10,1)),1) holds(in_hand(psm1,b(2,1)),2)",
            "holds(in_hand(psm1,b(2,1)),3)",
            id="holds-in_hand_start",
        ),
        pytest.param(
            TARGET + "in_hand(target,psm1,3).",
            "holds(in_hand(psm1,b(2,2)),3)",
            "holds(in_hand(psm1,b(2,2)),2)",
            id="holds-in_hand_target",
        ),
        pytest.param(
            "closed_gripper(psm2,2).",
            "holds(closed_gripper(psm2),2)",
            "holds(closed_gripper(psm2),1)",
            id="holds-closed_gripper",
        ),
        pytest.param(
            "max_height(psm1,1).",
            "holds(max_height(psm1),1)",
            "holds(max_height(psm1),2)",
            id="holds-max_height",
        ),
        pytest.param(
            "visible_roi(4).", "holds(visible_roi,4)", "holds(visible_roi,3)", id="holds-visible"
        ),
        pytest.param(
            "tried(b(1,1)). step(1..2).",
            "holds(tried(b(1,1)),1) holds(tried(b(1,1)),2)",
            "holds(tried(b(1,1)),3) holds(ignore_ap,1)",
            id="holds-tried",
        ),
        pytest.param(
            "ignore_ap. step(1..2).",
            "holds(ignore_ap,1) holds(ignore_ap,2)",
            "holds(ignore_ap,3)",
            id="holds-ignore_ap",
        ),
    ],
)
def test_rule(knowledge: Knowledge, plan: str, expected: str, absent: str) -> None:
    (atoms,) = models(knowledge, ["history.lp"], plan, TELL)
    assert set(expected.split()) <= atoms
    assert not set(absent.split()) & atoms
