"""The planner again: each plan from its context, each answer to why not, each step of the loop."""

import time
from collections.abc import Mapping
from pathlib import Path

import msgspec

from fras_audit.builds import rounding
from fras_audit.comparison import Tally
from fras_audit.executive import audit_executive
from fras_audit.progress import Progress
from fras_audit.recorded import Recorded, reply_of, request_of
from fras_common.errors import FrasError
from fras_common.messages import Context, Plan, RpcRecord
from fras_common.topics import CONTEXT, PLAN, WHY_NOT
from fras_log.attachments import rules_in
from fras_planner.adapter import PlanMaker
from fras_planner.knowledge import attached_knowledge, load_knowledge
from fras_planner.memory import PlanRequest
from fras_planner.planning import Knowledge

# A search that the clock ended, or the number of conflicts allowed, says so in its core.
BY_THE_CLOCK = "search_time"
# Time decides whether there is an answer, never which: a slower machine may take longer.
PATIENCE_S = 600.0


def audit(recorded: Recorded, progress: Progress) -> list[Tally]:
    """Derive plans, answers, and what the executive asked and said.

    Returns
    -------
    list of Tally
        Rules where the log names them, plans, answers, questions, statuses.

    Raises
    ------
    BadAttachment, AttachedRulesUnusable
    """
    knowledge, attached = rules_of(recorded)
    named = recorded.metadata.get("asp_digest", "")
    tallies: list[Tally] = []
    if attached or named:
        rules = Tally("planner", "rules", 1)
        rules.compare("the opening record", named, knowledge.digest)
        if not attached:
            rules.notes.append("the log names them and does not hold them: this machine's serve")
        tallies.append(rules)
    sent: Mapping[str, str] = knowledge.files if tallies else {}
    return [
        *tallies,
        *audit_plans(recorded, knowledge, progress, attached=attached),
        *audit_executive(recorded, knowledge, sent),
    ]


def rules_of(recorded: Recorded) -> tuple[Knowledge, bool]:
    """Return the rules attached to a log and True, else those of this machine.

    Raises
    ------
    BadAttachment, AttachedRulesUnusable
    """
    rules = rules_in(recorded.attachments, Path(recorded.path))
    if rules:
        return attached_knowledge(rules, recorded.path), True
    return load_knowledge(), False


def maker_of(recorded: Recorded, knowledge: Knowledge) -> PlanMaker:
    """Make a planner for the trial's scenario that is given all the time it needs."""
    section = msgspec.structs.replace(recorded.scenario.planner, time_limit_s=PATIENCE_S)
    scenario = msgspec.structs.replace(recorded.scenario, planner=section)
    return PlanMaker(knowledge, scenario, time.perf_counter)


def context_of(recorded: Recorded, plan: Plan) -> Context | None:
    """Return the context that a plan was made from; None if the log does not hold it."""
    for context in recorded.of(CONTEXT):
        if (context.request_id, context.tick) == (plan.request_id, plan.tick):
            return context
    return None


def audit_plans(
    recorded: Recorded, knowledge: Knowledge, progress: Progress, *, attached: bool
) -> list[Tally]:
    """Derive plans and answers, in the order in which one solver gave them.

    That order counts: what the solver learnt from one question stays for the next.
    """
    tolerance = rounding(recorded, "planner")
    questions = [one for one in recorded.mirrors(WHY_NOT) if one.fault is None]
    plans = Tally("planner", "plans", len(recorded.of(PLAN)), tolerance)
    answers = Tally("planner", "answers to why not", len(questions), tolerance)
    _note_other_rules(recorded, knowledge, plans, attached=attached)
    maker = maker_of(recorded, knowledge)
    said = sorted([*recorded.of(PLAN), *questions], key=lambda one: one.stamp_ns)
    before: Plan | None = None
    for number, one in enumerate(said, start=1):
        if number > 1 and one.source != said[number - 2].source:
            plans.notes.append(f"another planner took over: {one.source}")
            maker = _successor(recorded, knowledge, before)
        if isinstance(one, Plan):
            before = one
            _audit_plan(one, maker, recorded, plans)
        else:
            _audit_answer(one, maker, answers)
        progress("planner", number, len(said))
    return [plans, answers]


def _successor(recorded: Recorded, knowledge: Knowledge, before: Plan | None) -> PlanMaker:
    """Make the planner of a process that took over: it knows the last plan, and nothing else."""
    maker = maker_of(recorded, knowledge)
    context = context_of(recorded, before) if before is not None else None
    if before is not None and context is not None:
        maker.recall(before, context)
    return maker


def _note_other_rules(
    recorded: Recorded, knowledge: Knowledge, plans: Tally, *, attached: bool
) -> None:
    others = sorted({one.asp_digest for one in recorded.of(PLAN)} - {knowledge.digest})
    if not others:
        return
    named = ", ".join(digest[:12] for digest in others)
    ours = (
        f"those attached to the log ({knowledge.digest[:12]})"
        if attached
        else f"this machine's ({knowledge.digest[:12]}), and the log attaches none: --asp-dir "
        "compares decisions"
    )
    plans.notes.append(f"planned by other rules (digest {named}) than {ours}")


def _audit_plan(plan: Plan, maker: PlanMaker, recorded: Recorded, plans: Tally) -> None:
    where = f"plan for {plan.request_id} at tick {plan.tick}"
    context = context_of(recorded, plan)
    if context is None:
        plans.notes.append(f"{where}: its context is not in the log")
        return
    if plan.no_plan is not None and BY_THE_CLOCK in plan.no_plan.core:
        plans.notes.append(f"{where}: the time allowed was over, which no audit can derive")
        return
    try:
        derived = maker(context, PlanRequest.of(plan))
    except FrasError as error:
        plans.surplus(where, f"a plan; refused again: {error}", plan.seq)
        return
    plans.compare_messages(where, _untimed(plan), _untimed(derived))


def _audit_answer(mirror: RpcRecord, maker: PlanMaker, answers: Tally) -> None:
    question = request_of(WHY_NOT, mirror).question
    where = f"why not {question}"
    try:
        derived = maker.why_not(question)
    except FrasError as error:
        answers.surplus(where, f"an answer; refused again: {error}", mirror.seq)
        return
    answers.compare(where, reply_of(WHY_NOT, mirror), derived, mirror.seq)


def _untimed(plan: Plan) -> Plan:
    """Return a plan without the wall-clock times that it took."""
    return msgspec.structs.replace(plan, ground_s=0.0, solve_s=0.0)
