"""Nothing of a plan is done before a person has approved it; a rejection leads to another one."""

from collections.abc import Callable
from typing import Any

import pytest

from fras_common.messages import ApproveRequest, Plan, RejectRequest, TaskRequest, TaskStatus
from fras_common.scenario import PlannerSection
from fras_planner.approval import DecisionRequest, Proposal, judge
from fras_planner.endings import TaskAborted
from fras_planner.memory import Resumption, first_status
from support.world import BLOCK, EXPOSED, MOVING, OTHER, THIRD, World, held, hidden_pull, pulling

CONFIRM = PlannerSection(confirm=True)


def approve(plan: str, **fields: Any) -> ApproveRequest:
    return ApproveRequest(**{"trial": "t", "plan": plan, "by": "monitor", **fields})


def reject(*exclude: str, **fields: Any) -> Callable[[str], RejectRequest]:
    def request(plan: str) -> RejectRequest:
        usual: dict[str, Any] = {"trial": "t", "plan": plan, "by": "cli", "reason": "too near"}
        usual["exclude"] = list(exclude)
        return RejectRequest(**{**usual, **fields})

    return request


def confirming(plans: list[Any], *words: Any, **fields: Any) -> World:
    return World(plans, fields.pop("fluents", EXPOSED), planner=CONFIRM, decide=[*words], **fields)


def phases(world: World) -> list[str]:
    return [one.phase for one in world.said if isinstance(one, TaskStatus)]


def test_a_plan_is_done_once_it_is_approved() -> None:
    world = confirming([pulling(), []], approve)
    end = world.run()
    assert (end.outcome, end.scenario_kind) == ("success", "A")
    assert [(one.plan, one.approved, one.by) for one in end.decisions] == [("c1", True, "monitor")]
    told = phases(world)
    assert told.index("awaiting_approval") < told.index("acting")
    assert told.count("awaiting_approval") == 1  # not of what says that nothing is left to do


def test_nothing_is_asked_of_motion_while_a_plan_waits() -> None:
    asked: list[str] = []

    class Watching(World):
        def decision(self, executive: Any, plan: str) -> Any:
            asked.extend(self.asked)
            return super().decision(executive, plan)

    Watching([pulling(), []], EXPOSED, planner=CONFIRM, decide=[approve]).run()
    assert "sa/context" in asked
    assert "motion/execute" not in asked
    assert "sa/target" not in asked


def test_without_the_scenarios_word_nobody_is_asked() -> None:
    world = World([pulling(), []], EXPOSED)
    world.run()
    assert "awaiting_approval" not in phases(world)


def test_a_rejected_block_is_excluded_from_the_next_plan_which_waits_too() -> None:
    world = confirming([pulling(), pulling(OTHER), []], reject(), approve, fluents=held)
    end = world.run()
    first, second, third = world.requests
    assert (first.rejected, second.rejected, third.rejected) == ((), (BLOCK,), (BLOCK,))
    assert second.reason == "rejected: too near"
    assert second.request_id != first.request_id
    assert world.replies[0].excluded == [BLOCK]
    assert end.actions[0] == f"reach(psm1,{OTHER})"
    assert (end.replans, end.tried, end.scenario_kind) == (0, [], "A")
    assert [one.approved for one in end.decisions] == [False, True]


def test_a_rejection_may_name_blocks_and_arms() -> None:
    world = confirming([pulling(), []], reject("b(2, 2)", "psm1"))
    world.run()
    assert world.requests[1].rejected == (OTHER, "psm1")


def test_rejections_are_no_failures_of_plans() -> None:
    section = PlannerSection(confirm=True, max_replans=0)
    world = World(
        [pulling(), pulling(OTHER), pulling(THIRD), []],
        EXPOSED,
        planner=section,
        decide=[reject(), reject(), reject()],
    )
    end = world.run()
    assert (end.outcome, end.replans) == ("success", 0)


def test_a_rejected_move_excludes_the_tissue_in_hand() -> None:
    world = confirming(
        [pulling(), MOVING, []],
        approve,
        reject(),
        fluents=hidden_pull("max_height(psm1)", f"in_hand(psm1,{THIRD})"),
        ends={f"pull(psm1,{BLOCK})": ("interrupted", "force_soft")},
    )
    end = world.run()
    assert world.requests[2].rejected == (BLOCK, THIRD)
    assert end.scenario_kind == "A"  # the move was never made


def test_an_approved_move_makes_it_kind_b() -> None:
    world = confirming(
        [pulling(), MOVING, []],
        approve,
        approve,
        fluents=hidden_pull("max_height(psm1)"),
        ends={f"pull(psm1,{BLOCK})": ("interrupted", "force_soft")},
    )
    end = world.run()
    assert (end.scenario_kind, end.replans) == ("B", 1)


def test_attachments_are_not_ignored_again_after_a_rejection() -> None:
    section = PlannerSection(confirm=True, ignore_ap=True)
    world = World([pulling(), []], EXPOSED, planner=section, decide=[reject()])
    world.run()
    assert [one.ignore_ap for one in world.requests] == [True, False]


def test_an_abort_ends_the_waiting() -> None:
    world = confirming([pulling()], TaskAborted("enough"))
    end = world.run()
    assert (end.outcome, end.reason) == ("aborted", "enough")
    assert "motion/execute" not in world.asked


WAITING = first_status("t")


def proposal() -> Proposal:
    """What waits in a trial of its own."""
    caught: list[Any] = []

    class Catching(World):
        def decision(self, executive: Any, plan: str) -> Any:
            caught.append(executive.proposal)
            return TaskAborted("seen")

    Catching([pulling()], EXPOSED, planner=CONFIRM).run()
    return caught[0]


@pytest.mark.parametrize(
    ("request_", "reason"),
    [
        (approve("c1", by="planner"), "wrong_client"),
        (reject(by="rogue")("c1"), "wrong_client"),
        (approve("c1", trial="yesterday"), "another_trial"),
        (approve("c0"), "another_plan"),
        (reject()("c2"), "another_plan"),
        (reject("b(9,9)")("c1"), "unknown_name"),
        (reject("psm3")("c1"), "unknown_name"),
    ],
)
def test_a_decision_that_does_not_fit_is_refused_by_name(
    request_: DecisionRequest, reason: str
) -> None:
    reply = judge(request_, WAITING, proposal())
    assert (reply.accepted, reply.reason) == (False, reason)
    assert reply.text


def test_a_decision_while_nothing_waits_is_refused() -> None:
    assert judge(approve("c1"), WAITING, None).reason == "not_waiting"
    assert judge(approve("c1"), None, None).reason == "no_trial"


def test_a_decision_asked_again_is_answered_again() -> None:
    world = confirming([pulling(), pulling(OTHER), []], reject(), approve, fluents=held)
    end = world.run()
    again = judge(reject()("c1"), end, None)
    assert (again.accepted, again.excluded) == (True, [BLOCK])
    assert judge(approve("c2"), end, None).accepted
    # The other decision on the same plan is another matter.
    assert judge(approve("c1"), end, None).reason == "not_waiting"


def test_each_rejection_excludes_something_new() -> None:
    world = confirming([pulling(), pulling(OTHER), []], reject(), reject(BLOCK), reject(THIRD))
    world.run()
    assert [one.reason for one in world.replies] == ["", "nothing_to_exclude", ""]


def killed_while_waiting() -> tuple[World, TaskStatus]:
    """A world whose executive was killed while its plan waited, and the last that it said."""
    world = confirming([pulling()], TaskAborted("killed"))
    world.run()
    statuses = [one for one in world.said if isinstance(one, TaskStatus)]
    return world, next(one for one in statuses if one.phase == "awaiting_approval")


def start(world: World) -> TaskRequest:
    return TaskRequest(command="start", trial="t", scenario=world.scenario)


def test_a_restarted_executive_waits_for_the_same_plan() -> None:
    world, waiting = killed_while_waiting()
    plans = {one.request_id: one for one in world.said if isinstance(one, Plan)}
    left = Resumption(waiting, contexts=world.told, plans=plans, request=start(world))
    after = confirming([[]], approve)
    end = after.run(after.new_executive(left))
    assert (end.outcome, end.actions) == ("success", [one.text for one in pulling()])
    assert [one.plan for one in end.decisions] == ["c1"]
    # Nothing was planned anew, and situation awareness was asked nothing before.
    assert [one.reason for one in after.requests] == ["exposure"]
    assert after.asked[0] == "sa/target"


def test_a_restarted_executive_that_forgot_the_plan_makes_another_one() -> None:
    world, waiting = killed_while_waiting()
    after = confirming([pulling(), []], approve)
    end = after.run(after.new_executive(Resumption(waiting, request=start(world))))
    assert after.requests[0].reason == "restart"
    assert [one.plan for one in end.decisions] == ["c2"]


def test_what_was_rejected_before_a_restart_stays_excluded() -> None:
    world = confirming([pulling(), pulling(OTHER)], reject(), TaskAborted("killed"))
    world.run()
    statuses = [one for one in world.said if isinstance(one, TaskStatus)]
    waiting = [one for one in statuses if one.phase == "awaiting_approval"][-1]
    after = confirming([pulling(OTHER), []], approve)
    after.run(after.new_executive(Resumption(waiting, request=start(world))))
    assert after.requests[0].rejected == (BLOCK,)
