"""The rules of goal.lp, one by one: a last step in, whether it is a goal out."""

import pytest

from fras_planner.planning import Knowledge
from planner.mutants import models

GIVEN = "#defined visible_roi/1. #defined max_height/2. #defined busy/1. #defined enforced/1."
LAST = [("check", (3,))]
BOTH = "enforced(see_roi). enforced(end_below_limit). "


@pytest.mark.parametrize(
    ("goal", "end", "reached"),
    [
        pytest.param("visible", BOTH, False, id="see_roi"),
        pytest.param("visible", BOTH + "visible_roi(2).", False, id="see_roi-too_early"),
        pytest.param("visible", BOTH + "visible_roi(3).", True, id="see_roi-seen"),
        pytest.param("visible", "enforced(end_below_limit).", True, id="see_roi-lifted"),
        pytest.param(
            "clear", BOTH + "visible_roi(3). max_height(psm2,3).", False, id="end_below_limit"
        ),
        pytest.param(
            "clear", BOTH + "visible_roi(3). max_height(psm2,2).", True, id="end_below_limit-before"
        ),
        pytest.param(
            "visible", BOTH + "visible_roi(3). max_height(psm2,3).", True, id="end_below_limit-goal"
        ),
        pytest.param(
            "clear",
            "enforced(see_roi). visible_roi(3). max_height(psm2,3).",
            True,
            id="end_below_limit-lifted",
        ),
        pytest.param("visible", BOTH + "visible_roi(3). busy(3).", False, id="idle_at_end"),
        pytest.param("visible", BOTH + "visible_roi(3). busy(2).", True, id="idle_at_end-before"),
    ],
)
def test_goal(knowledge: Knowledge, goal: str, end: str, reached: bool) -> None:
    facts = GIVEN + "query(3). " + end
    assert bool(models(knowledge, ["goal.lp"], facts, LAST, f"--const=goal={goal}")) == reached


def test_query_is_off_until_it_is_asked(knowledge: Knowledge) -> None:
    facts = GIVEN + BOTH + "busy(3)."
    (atoms,) = models(knowledge, ["goal.lp"], facts, LAST)
    assert "query(3)" not in atoms


def test_goal_is_visible_unless_told(knowledge: Knowledge) -> None:
    assert models(knowledge, ["goal.lp"], GIVEN + "query(3). visible_roi(3). max_height(psm1,3).")
