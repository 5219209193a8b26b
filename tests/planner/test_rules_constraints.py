"""The rules of constraints.lp, one by one: facts in, what is forbidden out, and not done."""

import pytest

from fras_planner.planning import Knowledge
from planner.mutants import models

GIVEN = (
    "#defined target/2. #defined occurs/3. #defined reachable/2. #defined avoided/1."
    "#defined tried/1. #defined rejected/1. #defined barred/1. #defined wanted/1."
    "#defined in_hand/2. #defined closed_gripper/1. #defined untried/1."
    "#defined clean/2. #defined in_hand/3. #defined closed_gripper/2. #defined max_height/2."
    "arm(psm1;psm2). "
)
STEP = [("step", (1,))]
NAMES = (
    "see_roi",
    "end_below_limit",
    "keep_off_attachments",
    "try_once",
    "heed_rejection",
    "respect_limit",
    "pull_before_moving",
    "open_gripper_first",
    "one_grasp_at_a_time",
)
HELD = "in_hand(start,psm1,1). "
TWO = "reachable(psm1,b(1,1)). reachable(psm1,b(1,2)). "


def lifting(knowledge: Knowledge, facts: str) -> list[set[str]]:
    """Rules that are not enforced, in each model."""
    found = models(knowledge, ["constraints.lp"], GIVEN + facts, STEP)
    return [{name for name in NAMES if f"enforced({name})" not in atoms} for atoms in found]


def test_rule_and_enforced(knowledge: Knowledge) -> None:
    (atoms,) = models(
        knowledge, ["constraints.lp"], GIVEN + ":- rule(Rule), not enforced(Rule).", STEP
    )
    assert {atom for atom in atoms if atom.startswith("rule(")} == {f"rule({n})" for n in NAMES}
    assert len(lifting(knowledge, "")) == 2 ** len(NAMES)


@pytest.mark.parametrize(
    ("facts", "expected", "absent"),
    [
        pytest.param(
            TWO + "avoided(b(1,1)).",
            "forbidden(reach(psm1,b(1,1)),keep_off_attachments) candidate(b(1,2))",
            "forbidden(reach(psm1,b(1,2)),keep_off_attachments) candidate(b(1,1))",
            id="reach-keep_off_attachments",
        ),
        pytest.param(
            TWO + "tried(b(1,2)).",
            "forbidden(reach(psm1,b(1,2)),try_once) candidate(b(1,1))",
            "forbidden(reach(psm1,b(1,1)),try_once) candidate(b(1,2))",
            id="reach-try_once",
        ),
        pytest.param(
            TWO + "rejected(b(1,2)).",
            "forbidden(reach(psm1,b(1,2)),heed_rejection) candidate(b(1,1))",
            "forbidden(reach(psm1,b(1,1)),heed_rejection) candidate(b(1,2))",
            id="reach-rejected",
        ),
        pytest.param(
            TWO + "reachable(psm2,b(1,2)). barred(psm1).",
            "forbidden(reach(psm1,b(1,1)),heed_rejection)"
            " forbidden(reach(psm1,b(1,2)),heed_rejection) candidate(b(1,2))",
            "forbidden(reach(psm2,b(1,2)),heed_rejection) candidate(b(1,1))",
            id="reach-barred",
        ),
        pytest.param(
            TWO, "candidate(b(1,1)) candidate(b(1,2))", "candidate(b(2,2))", id="candidate"
        ),
        pytest.param(
            "in_hand(psm1,b(1,1)). in_hand(psm2,b(1,2)). closed_gripper(psm2).",
            "contradiction(psm1,open_gripper_holds)",
            "contradiction(psm2,open_gripper_holds)",
            id="contradiction-open_gripper_holds",
        ),
        pytest.param(
            HELD,
            "forbidden(pull,psm1,try_once,1) forbidden(move,psm1,try_once,1)",
            "forbidden(pull,psm2,try_once,1) forbidden(pull,psm1,keep_off_attachments,1)"
            " forbidden(pull,psm1,heed_rejection,1)",
            id="try_once",
        ),
        pytest.param(
            HELD + "untried(psm1).",
            "forbidden(pull,psm1,heed_rejection,1) forbidden(move,psm1,heed_rejection,1)",
            "forbidden(pull,psm1,try_once,1) forbidden(pull,psm2,heed_rejection,1)"
            " forbidden(pull,psm1,keep_off_attachments,1)",
            id="heed_rejection",
        ),
        pytest.param(
            HELD + "untried(psm1). wanted(psm1).",
            "forbidden(pull,psm1,keep_off_attachments,1)"
            " forbidden(move,psm1,keep_off_attachments,1)",
            "forbidden(pull,psm1,try_once,1) forbidden(pull,psm2,keep_off_attachments,1)"
            " forbidden(pull,psm1,heed_rejection,1)",
            id="keep_off_attachments",
        ),
        pytest.param(
            HELD + "untried(psm1). wanted(psm1). clean(psm1,b(1,1)).",
            "",
            "forbidden(pull,psm1,try_once,1) forbidden(pull,psm1,keep_off_attachments,1)",
            id="clean_tissue",
        ),
        pytest.param(
            "in_hand(target,psm1,1).",
            "",
            "forbidden(pull,psm1,try_once,1) forbidden(pull,psm1,keep_off_attachments,1)",
            id="fresh_grasp",
        ),
        pytest.param(
            "max_height(psm1,1).",
            "forbidden(pull,psm1,respect_limit,1)",
            "forbidden(pull,psm2,respect_limit,1) forbidden(move,psm1,respect_limit,1)",
            id="respect_limit",
        ),
        pytest.param(
            "max_height(psm1,1).",
            "forbidden(move,psm2,pull_before_moving,1)",
            "forbidden(move,psm1,pull_before_moving,1) forbidden(pull,psm2,pull_before_moving,1)",
            id="pull_before_moving",
        ),
        pytest.param(
            "closed_gripper(psm1,1).",
            "forbidden(reach,psm1,open_gripper_first,1) forbidden(grasp,psm1,open_gripper_first,1)",
            "forbidden(reach,psm2,open_gripper_first,1) forbidden(pull,psm1,open_gripper_first,1)",
            id="open_gripper_first",
        ),
        pytest.param(
            "in_hand(target,psm1,1).",
            "forbidden(reach,psm1,one_grasp_at_a_time,1)"
            " forbidden(reach,psm2,one_grasp_at_a_time,1)"
            " forbidden(grasp,psm2,one_grasp_at_a_time,1)",
            "forbidden(pull,psm1,one_grasp_at_a_time,1)",
            id="one_grasp_at_a_time",
        ),
        pytest.param(
            "",
            "forbidden(move,psm1,pull_before_moving,1)",
            "forbidden(reach,psm1,one_grasp_at_a_time,1) forbidden(pull,psm1,respect_limit,1)",
            id="nothing_held",
        ),
    ],
)
def test_forbidden(knowledge: Knowledge, facts: str, expected: str, absent: str) -> None:
    # That the forbidden is not done is for the tests below: here nothing is done.
    atoms = models(knowledge, ["constraints.lp"], GIVEN + facts, STEP)[0]
    assert set(expected.split()) <= atoms
    assert not set(absent.split()) & atoms


@pytest.mark.parametrize(
    ("facts", "done", "rule"),
    [
        (TWO + "avoided(b(1,1)). ", "target(psm1,b(1,1)).", "keep_off_attachments"),
        (TWO + "tried(b(1,1)). ", "target(psm1,b(1,1)).", "try_once"),
        (HELD, "occurs(pull,psm1,1).", "try_once"),
        (TWO + "rejected(b(1,1)). ", "target(psm1,b(1,1)).", "heed_rejection"),
        (HELD + "untried(psm1). ", "occurs(pull,psm1,1).", "heed_rejection"),
        (HELD + "untried(psm1). wanted(psm1). ", "occurs(pull,psm1,1).", "keep_off_attachments"),
        ("max_height(psm1,1). ", "occurs(pull,psm1,1).", "respect_limit"),
        ("", "occurs(move,psm1,1).", "pull_before_moving"),
        ("closed_gripper(psm1,1). ", "occurs(grasp,psm1,1).", "open_gripper_first"),
        ("in_hand(target,psm2,1). ", "occurs(reach,psm1,1).", "one_grasp_at_a_time"),
    ],
)
def test_enforced(knowledge: Knowledge, facts: str, done: str, rule: str) -> None:
    """What is forbidden is done only if its rule is lifted; the others may stand."""
    assert {rule} in lifting(knowledge, facts + done)
    assert all(rule in lifted for lifted in lifting(knowledge, facts + done))
    assert set() in lifting(knowledge, facts)
