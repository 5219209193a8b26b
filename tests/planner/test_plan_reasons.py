"""Why this plan, in words; why none: a minimal core and the facts behind it."""

import re
from collections.abc import Callable

import pytest

from fras_planner.planning import Knowledge, Planner, PlanningScene

SceneMaker = Callable[..., PlanningScene]


def bare(scene: PlanningScene, *statics: str) -> PlanningScene:
    return PlanningScene.make(scene.names, scene.blocks_m, scene.roi_m, statics)


def test_the_choice_is_told_with_its_numbers(planner: Planner) -> None:
    assert planner.plan([]).explanation == (
        "psm2 goes for b(2,2): no other arm reaches it.",
        "psm2 grasps b(2,2): 57 mm from the nearest attachment, 30 mm from the region of interest; "
        "best of 3 candidate blocks under the criterion 'weighted'.",
        "psm2 pulls b(2,2) up to expose the region of interest: only where it may pull no higher "
        "is tissue moved sideways.",
    )


def test_a_choice_that_ignores_attachments_says_so(planner: Planner) -> None:
    assert planner.plan([], ignore_ap=True).explanation[1] == (
        "psm2 grasps b(1,2): 10 mm from the region of interest, the nearest of 4 candidate blocks; "
        "attachment points are ignored as asked."
    )


def test_a_choice_without_attachments_says_so(knowledge: Knowledge, scene: PlanningScene) -> None:
    free = bare(scene, *(atom for atom in scene.statics if not atom.startswith("fixed")))
    assert Planner(knowledge, free, "weighted").plan([], tried=["b(1,1)"]).explanation[1] == (
        "psm2 grasps b(1,2): no attachment is known, 10 mm from the region of interest; "
        "best of 3 candidate blocks under the criterion 'weighted'."
    )


def test_of_two_arms_the_choice_is_told(knowledge: Knowledge, scene: PlanningScene) -> None:
    both = Planner(knowledge, bare(scene, *scene.statics, "reachable(psm1,b(2,2))"), "weighted")
    assert both.plan([]).explanation[0] == (
        "psm1 goes for b(2,2): both arms reach it, and psm1 comes first."
    )
    assert both.plan(["closed_gripper(psm1)"]).explanation[0] == (
        "psm2 goes for b(2,2): both arms reach it, and psm2 needs fewer actions."
    )


@pytest.mark.parametrize(
    ("state", "tried", "first"),
    [
        (
            ["in_hand(psm1,b(2,1))", "closed_gripper(psm1)", "max_height(psm1)"],
            [],
            "The tissue is moved sideways to b(1,2) because psm1 may not pull higher.",
        ),
        (
            ["in_hand(psm1,b(2,1))", "closed_gripper(psm1)"],
            [],
            "psm1 still holds b(2,1) and may pull higher: it pulls on.",
        ),
        (
            ["in_hand(psm1,b(2,1))", "closed_gripper(psm1)"],
            ["b(2,1)"],
            "psm1 lets go of b(2,1): it was tried in vain.",
        ),
        (
            ["in_hand(psm1,b(1,1))", "closed_gripper(psm1)"],
            [],
            "psm1 lets go of b(1,1): it lies over an attachment point.",
        ),
        (
            ["closed_gripper(psm2)"],
            [],
            "psm2 opens its gripper: it holds nothing.",
        ),
    ],
)
def test_what_follows_from_the_state_is_told(
    planner: Planner, state: list[str], tried: list[str], first: str
) -> None:
    assert planner.plan(state, tried=tried).explanation[0] == first


def test_tissue_that_cannot_be_moved_is_let_go(knowledge: Knowledge, scene: PlanningScene) -> None:
    lost = bare(scene, *(atom for atom in scene.statics if not atom.startswith("above_roi")))
    state = ["in_hand(psm1,b(2,1))", "closed_gripper(psm1)", "max_height(psm1)"]
    plan = Planner(knowledge, lost, "weighted").plan(state)
    assert plan.actions[0].text == "release(psm1)"
    assert plan.explanation[0] == ("psm1 lets go of b(2,1) so that the tissue can be grasped anew.")


LIMITED = {
    "visible_roi": {"visible_fraction": 0.412, "threshold_fraction": 0.7},
    "max_height(psm1)": {"force_n": 0.4612, "limit_n": 0.5},
    "reachable(psm1,b(2,1))": {"rest_y_m": 0.01},
    "force": {"force_n": 0.4612},
}


def test_a_plan_made_anew_says_why_with_what_was_measured(planner: Planner) -> None:
    state = ["in_hand(psm1,b(2,1))", "closed_gripper(psm1)", "max_height(psm1)"]
    assert planner.plan(state, reason="force", evidence=LIMITED).explanation == (
        "Planned anew: the force limit was crossed.",
        "41.2 % of the tissue over the region of interest is lifted clear of it; more than 70.0 % "
        "is needed.",
        "psm1 may not pull higher: the limit of 0.50 N was crossed; now the tissue bears 0.46 N.",
        "The tissue is moved sideways to b(1,2) because psm1 may not pull higher.",
    )


def test_a_first_plan_says_nothing_of_that(planner: Planner) -> None:
    assert planner.plan([], evidence=LIMITED).explanation == planner.plan([]).explanation


def test_that_there_is_no_plan_is_told_after_why_one_was_sought(
    planner: Planner, scene: PlanningScene
) -> None:
    none = planner.plan([], tried=scene.names, reason="force", evidence=LIMITED).no_plan
    assert none is not None
    assert none.sentences[:3] == (
        "Planned anew: the force limit was crossed.",
        "41.2 % of the tissue over the region of interest is lifted clear of it; more than 70.0 % "
        "is needed.",
        "No plan of at most 5 actions reaches the goal.",
    )


def test_evidence_of_what_was_not_sensed_is_not_told(planner: Planner) -> None:
    odd = {
        "max_height(psm2": {"limit_n": 0.5, "force_n": 0.4},
        "visible_roi. occurs(release,psm1,1)": {"visible_fraction": 1.0},
        "max_height(psm2)": {"limit_n": 0.5, "force_n": 0.4},
        "visible_roi": {"visible_fraction": float("nan"), "threshold_fraction": 1e308},
    }
    plain = planner.plan([], reason="exposure")
    assert planner.plan([], reason="exposure", evidence=odd).explanation == plain.explanation


@pytest.mark.parametrize(
    ("reason", "sentence"),
    [
        ("exposure", "Planned anew: all actions of the plan before are done."),
        ("hold", "Planned anew: the arms were stopped and let go again."),
        ("nothing_in_reach", "Planned anew: the jaw closed on nothing."),
        (
            "hold: at the door",
            "Planned anew: the arms were stopped and let go again, at the door.",
        ),
        ("slipped", "Planned anew: slipped."),
        (
            "deviation: in_hand(psm1,b(1,1)) expected after grasp(psm1,b(1,1)); distance 7.2 mm",
            "Planned anew: deviation, in_hand(psm1,b(1,1)) expected after grasp(psm1,b(1,1)); "
            "distance 7.2 mm.",
        ),
        # Whatever a service says stands there as it was said, and is no rule.
        (
            'refused: "}). goal. a(\\"\n\0{} %',
            'Planned anew: refused, "}). goal. a(\\"  {} %.',
        ),
    ],
)
def test_why_anew(planner: Planner, reason: str, sentence: str) -> None:
    assert planner.plan([], reason=reason).explanation[0] == sentence


# --- no plan ----------------------------------------------------------------------------------


def test_everything_tried(planner: Planner, scene: PlanningScene) -> None:
    none = planner.plan([], tried=scene.names).no_plan
    assert none is not None
    assert none.core == ("see_roi", "try_once")
    assert none.sentences == (
        "No plan of at most 5 actions reaches the goal.",
        "Rule: A block that was tried in vain is not tried again.",
        "Rule: The region of interest must be visible at the end.",
        "4 of the 4 blocks that an arm reaches have been tried in vain.",
    )


def test_everything_attached(knowledge: Knowledge, scene: PlanningScene) -> None:
    attached = bare(scene, *scene.statics, *(f"fixed({name})" for name in scene.names))
    planner = Planner(knowledge, attached, "weighted")
    plan = planner.plan([])
    assert plan.actions == ()
    assert plan.no_plan is not None
    assert plan.no_plan.core == ("keep_off_attachments", "see_roi")
    assert plan.explanation == plan.no_plan.sentences
    assert plan.no_plan.sentences[-1] == (
        "Attachment points lie under 4 of the 4 blocks that an arm reaches."
    )
    assert planner.plan([], ignore_ap=True).no_plan is None


def test_attached_or_tried_between_them(planner: Planner) -> None:
    none = planner.plan([], tried=["b(1,2)", "b(2,1)", "b(2,2)"]).no_plan
    assert none is not None
    # Either rule alone, lifted, would leave a block: both are to blame.
    assert none.core == ("keep_off_attachments", "see_roi", "try_once")


def test_nothing_in_reach(knowledge: Knowledge, scene: PlanningScene) -> None:
    none = Planner(knowledge, bare(scene, "fixed(b(1,1))"), "weighted").plan([]).no_plan
    assert none is not None
    assert none.core == ("see_roi",)
    assert "No arm reaches any block." in none.sentences


def test_nowhere_to_move(knowledge: Knowledge, scene: PlanningScene) -> None:
    stuck = Planner(knowledge, bare(scene, "reachable(psm1,b(2,1))"), "weighted")
    state = ["in_hand(psm1,b(2,1))", "closed_gripper(psm1)", "max_height(psm1)"]
    none = stuck.plan(state, tried=["b(2,1)"]).no_plan
    assert none is not None
    assert (
        "No block is known to lie above the region of interest, so tissue cannot be moved there."
        in none.sentences
    )


def test_a_horizon_too_short(knowledge: Knowledge, scene: PlanningScene) -> None:
    none = Planner(knowledge, scene, "weighted", horizon=2).plan([]).no_plan
    assert none is not None
    assert none.sentences[0] == "No plan of at most 2 actions reaches the goal."
    assert none.sentences[-1] == (
        "3 candidate blocks are left, but 2 actions are too few, or a rule without a name forbids "
        "what it would take."
    )


def test_each_core_is_needed_whole(knowledge: Knowledge, make_scene: SceneMaker) -> None:
    """With any rule of a core struck from the knowledge there is a plan."""
    scene = make_scene(3, 1, fixed=["b(1,1)", "b(2,2)"])
    tried = [name for name in scene.names if name not in {"b(1,1)", "b(2,2)"}]
    none = Planner(knowledge, scene, "weighted").plan([], tried=tried).no_plan
    assert none is not None
    assert len(none.core) == 3
    for rule in none.core:
        files = dict(knowledge.files)
        assert f"{rule};" in files["constraints.lp"]
        files["constraints.lp"] = files["constraints.lp"].replace(f"{rule};", "", 1)
        lifted = Planner(Knowledge(files, ""), scene, "weighted").plan([], tried=tried)
        assert lifted.no_plan is None, rule


def test_every_rule_can_be_worded(knowledge: Knowledge) -> None:
    pool = re.search(r"^rule\(([^)]*)\)\.", knowledge.files["constraints.lp"], re.MULTILINE)
    assert pool is not None
    names = {name.strip() for name in pool.group(1).split(";")}
    worded = re.findall(r"^text\((\w+),", knowledge.files["words.lp"], re.MULTILINE)
    assert sorted(names) == sorted(worded)


def test_an_arm_stuck_at_its_limit_with_the_roi_seen(
    knowledge: Knowledge, scene: PlanningScene
) -> None:
    state = ["in_hand(psm1,b(2,1))", "closed_gripper(psm1)", "max_height(psm1)", "visible_roi"]
    none = (
        Planner(knowledge, scene, "weighted", goal="clear").plan(state, tried=scene.names).no_plan
    )
    assert none is not None
    assert none.core == ("end_below_limit", "see_roi", "try_once")
    assert "Rule: No arm may end at its limit." in none.sentences


def test_a_spent_budget_is_said_without_blaming_a_rule(
    knowledge: Knowledge, scene: PlanningScene
) -> None:
    plan = Planner(knowledge, scene, "weighted", conflict_budget=0).plan([])
    assert plan.no_plan is not None
    assert not plan.optimal
    assert plan.no_plan.core == ("search_budget",)
    assert plan.explanation == (
        "The search ended before a plan was found: allow it more conflicts.",
    )


class Watch:
    """A clock that goes on by some seconds each time it is looked at."""

    def __init__(self, step_s: float) -> None:
        self.step_s = step_s
        self.now_s = 0.0

    def __call__(self) -> float:
        self.now_s += self.step_s
        return self.now_s


def test_time_may_end_a_search_only_without_a_plan(
    knowledge: Knowledge, scene: PlanningScene
) -> None:
    watch = Watch(6.0)
    planner = Planner(knowledge, scene, "weighted", clock=watch)
    late = planner.plan([])
    assert late.no_plan is not None
    assert late.actions == ()
    assert not late.optimal
    assert late.no_plan.core == ("search_time",)
    assert late.explanation == ("The time for planning was over before an answer was found.",)
    watch.step_s = 0.0
    assert planner.plan([]).actions == Planner(knowledge, scene, "weighted").plan([]).actions


def test_time_may_end_the_search_for_a_minimal_core(
    knowledge: Knowledge, scene: PlanningScene
) -> None:
    watch = Watch(0.0)
    planner = Planner(knowledge, scene, "weighted", clock=watch)
    proved = planner.plan([], tried=scene.names).no_plan
    assert proved is not None
    assert "try_once" in proved.core
    watch.step_s = 2.0
    late = planner.plan([], tried=scene.names).no_plan
    assert late is not None
    assert late.core == ("search_time",)


def test_a_search_under_way_is_ended_in_time(knowledge: Knowledge, make_scene: SceneMaker) -> None:
    # Without a clock each search may take the whole limit, here less than any search of this size.
    planner = Planner(knowledge, make_scene(40, 1), "weighted", time_limit_s=1e-5)
    late = planner.plan([])
    assert late.no_plan is not None
    assert late.no_plan.core == ("search_time",)


def test_a_small_budget_gives_the_best_plan_so_far(
    knowledge: Knowledge, make_scene: SceneMaker
) -> None:
    unproved = 0
    for seed in range(10):
        scene = make_scene(7, seed)
        tried = scene.names[:9]
        best = Planner(knowledge, scene, "weighted").plan([], tried=tried)
        hasty = Planner(knowledge, scene, "weighted", conflict_budget=1).plan([], tried=tried)
        if hasty.no_plan is None:
            assert hasty.actions[-1].name == "pull"
            assert hasty.cost >= best.cost
            unproved += not hasty.optimal
    assert unproved


def test_what_a_person_rejected_is_told_and_not_grasped(planner: Planner) -> None:
    first = planner.plan([])
    again = planner.plan([], rejected=[first.target], reason="rejected: too near the vessel")
    assert again.target
    assert again.target != first.target
    assert again.explanation[:2] == (
        "Planned anew: a person rejected the plan before, too near the vessel.",
        f"{first.target} is excluded: a person rejected it.",
    )


def test_a_barred_arm_grasps_nothing(planner: Planner) -> None:
    first = planner.plan([])
    again = planner.plan([], rejected=[first.arm], reason="rejected")
    assert again.target
    assert again.arm != first.arm
    assert again.explanation[1] == f"{first.arm} is excluded: a person rejected it."


def test_rejected_tissue_in_hand_is_let_go(planner: Planner) -> None:
    state = ["in_hand(psm2,b(2,2))", "at(psm2,b(2,2))", "closed_gripper(psm2)"]
    assert [action.name for action in planner.plan(state).actions] == ["pull"]
    plan = planner.plan(state, rejected=["b(2,2)"])
    assert [action.name for action in plan.actions] == ["release", "reach", "grasp", "pull"]
    assert plan.target != "b(2,2)"
    assert "psm2 lets go of b(2,2): a person has excluded it." in plan.explanation


def test_everything_rejected_leaves_no_plan_and_says_so(
    planner: Planner, scene: PlanningScene
) -> None:
    none = planner.plan([], rejected=scene.names, reason="rejected: no").no_plan
    assert none is not None
    assert "heed_rejection" in none.core
    assert "Rule: What a person has excluded is not grasped." in none.sentences
    assert "A person has excluded 4 of the 4 blocks that an arm reaches." in none.sentences


def test_why_not_a_rejected_block(planner: Planner) -> None:
    answer = planner.why_not("b(2,2)", [], rejected=["b(2,2)"])
    assert answer.sentences == ("b(2,2) is excluded: a person rejected it.",)
