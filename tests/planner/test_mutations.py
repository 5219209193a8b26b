"""No rule is idle: without any one of them some plan, reason or refusal is another.

What the whole knowledge gives is pinned by the golden plans, the reasons and the tests of each
rule; here it only has to change.
"""

from collections.abc import Callable, Iterable, Iterator
from functools import cache
from itertools import count

import pytest

from fras_common.errors import FrasError
from fras_planner.knowledge import load_knowledge
from fras_planner.planning import Knowledge, Planner, PlanningScene, verify
from fras_planner.planning.program import PLAN_FILES
from planner.mutants import Mutant, models, mutants, reprinted, statements

Fingerprint = Callable[[Knowledge], Iterator[object]]

KNOWLEDGE = load_knowledge()
# These word what the other files decide, or judge it.
WORDING = (
    "explain.lp", "because.lp", "no_plan.lp", "words.lp", "why_not_block.lp", "why_not_action.lp"
)  # fmt: skip
JUDGING = ("verify.lp",)
# Rules whose absence nothing shows, with the reason why they stay.
EQUIVALENT: dict[str, str] = {}

ROWS = (1, 2, 3)
NAMES = tuple(f"b({i},{j})" for i in ROWS for j in ROWS)
CENTRES = tuple((0.02 * i, 0.02 * j, 0.0) for i in ROWS for j in ROWS)
ROI = (0.04, 0.04, 0.0)
# psm1 reaches the first two columns, psm2 the last two.
REACH = tuple(f"reachable(psm{a},b({i},{j}))" for a in (1, 2) for i in ROWS for j in (a, a + 1))


def scene(*statics: str) -> PlanningScene:
    return PlanningScene.make(NAMES, CENTRES, ROI, statics)


TISSUE = scene(*REACH, "fixed(b(1,1))", "above_roi(b(2,2))")
TWO_FIXED = scene(*REACH, "fixed(b(1,1))", "fixed(b(1,3))")
FREE = scene(*REACH, "above_roi(b(2,2))")
ATTACHED = scene(*REACH, *(f"fixed({name})" for name in NAMES))
OUT_OF_REACH = scene("fixed(b(1,1))")

LIMIT = "max_height(psm1)"
HELD = "at(psm1,b(2,2)) in_hand(psm1,b(2,2)) closed_gripper(psm1)"
HELD_FIXED = "at(psm1,b(1,1)) in_hand(psm1,b(1,1)) closed_gripper(psm1)"
HELD_2 = "at(psm2,b(1,2)) in_hand(psm2,b(1,2)) closed_gripper(psm2)"
SPANNED = "in_hand(psm1,b(1,1)) in_hand(psm1,b(2,1)) in_hand(psm1,b(2,2)) closed_gripper(psm1)"
ALL_REJECTED = " ".join(f"rejected({name})" for name in NAMES)
ALL = " ".join(f"tried({name})" for name in NAMES)

# Scene, criterion, goal, most actions; and the states to plan for.
PLANS: tuple[tuple[PlanningScene, str, str, int, tuple[str, ...]], ...] = (
    (
        TISSUE,
        "weighted",
        "visible",
        5,
        (
            "",
            "tried(b(3,3))",
            f"{HELD} {LIMIT}",
            f"{HELD} tried(b(2,2)) at(psm2,b(1,3))",
            HELD_FIXED,
            f"{HELD_2} ignore_ap",
            f"{HELD_2} {HELD_FIXED}",
            f"{SPANNED} tried(b(2,1))",
            f"{SPANNED} tried(b(2,1)) tried(b(2,2))",
            "rejected(b(3,3)) barred(psm2)",
            f"{HELD} rejected(b(2,2))",
            f"{HELD} barred(psm1)",
            f"{SPANNED} rejected(b(2,2))",
            "visible_roi max_height(psm2)",
            "at(psm2,b(3,3))",
            "in_hand(psm1,b(1,2))",
            "ignore_ap tried(b(2,2)) max_height(psm2) closed_gripper(psm2)",
            ALL,
            "barred(psm1) barred(psm2)",
            ALL_REJECTED,
        ),
    ),
    (
        TISSUE,
        "weighted",
        "clear",
        5,
        (
            f"{LIMIT} visible_roi",
            f"{HELD} {LIMIT} visible_roi",
            f"{HELD} {LIMIT} visible_roi {ALL}",
        ),
    ),
    (TWO_FIXED, "weighted", "visible", 4, (f"{HELD} {LIMIT}",)),
    (TWO_FIXED, "sum", "visible", 3, ("",)),
    (TWO_FIXED, "literal", "visible", 3, ("",)),
    (TWO_FIXED, "lex", "visible", 3, ("",)),
    (TWO_FIXED, "nearest", "visible", 3, ("",)),
    (TWO_FIXED, "capped", "visible", 3, ("",)),
    (TISSUE, "capped", "visible", 3, ("", "tried(b(3,3))")),
    (TISSUE, "nearest", "visible", 3, ("tried(b(3,3))",)),
    (FREE, "lex", "visible", 3, ("",)),
    (ATTACHED, "weighted", "visible", 5, ("", f"{HELD} {LIMIT}")),
    (OUT_OF_REACH, "weighted", "visible", 5, ("", f"{HELD} {LIMIT}")),
    (TISSUE, "weighted", "visible", 2, ("",)),
    (TISSUE, "weighted", "visible", 3, ("closed_gripper(psm1) closed_gripper(psm2)", HELD_FIXED)),
)

# Few blocks, for all that may be done and all that is best.
SMALL = "block(b(1,1)). block(b(1,2)). reachable((psm1;psm2),b(1,1)). reachable(psm1,b(1,2))."
EVEN = "roi_distance((b(1,1);b(1,2)),5). nearest_attachment((b(1,1);b(1,2)),5)."
SMALL_STATES = (
    "",
    "closed_gripper(psm1). closed_gripper(psm2).",
    "max_height(psm2). ignore_ap.",
    "in_hand(psm1,b(1,2)). closed_gripper(psm1). above_roi(b(1,1)). visible_roi.",
)


def outcome(ask: Callable[..., object], *about: object) -> object:
    """What comes back, or the refusal."""
    try:
        return ask(*about)
    except FrasError as error:
        return type(error).__name__, str(error)


def planned(planner: Planner, state: str) -> object:
    plan = planner.plan(state.split())
    end = plan.no_plan.core if plan.no_plan else plan.history
    return plan.actions, plan.target, plan.arm, plan.cost, end, plan.explanation


def courses(knowledge: Knowledge, state: str, *, best: bool) -> list[list[str]]:
    """All that may be done in three steps, or what is best of it."""
    last = 4 if best else 3
    parts = [("signature", ()), *(("step", (t,)) for t in range(1, last + 1)), ("check", (last,))]
    facts = f"{SMALL} {EVEN} {state} :- rule(R), not enforced(R). "
    facts += f"query({last})." if best else f"{{ query({last}) }}."
    found = models(knowledge, [*PLAN_FILES, "preferences/weighted.lp"], facts, parts, best=best)
    told = ("occurs(", "target(", "query(")
    return sorted(sorted(atom for atom in atoms if atom.startswith(told)) for atoms in found)


def fingerprint(knowledge: Knowledge) -> Iterator[object]:
    """What the knowledge makes of a few states: plans with their costs, or refusals."""
    yield knowledge.alphabet
    for tissue, criterion, goal, horizon, states in PLANS:
        planner = Planner(knowledge, tissue, criterion, goal, horizon)
        for state in states:
            yield outcome(planned, planner, state)
    yield Planner(knowledge, TISSUE, "weighted", conflict_budget=0).plan([]).explanation
    late = Planner(knowledge, TISSUE, "weighted", clock=count(step=60.0).__next__)
    yield late.plan([]).explanation
    for state in SMALL_STATES:
        yield courses(knowledge, state, best=False)
        yield courses(knowledge, state, best=True)


# Questions to a planner of each scene, criterion and goal: what is asked about, in which state.
QUESTIONS: tuple[tuple[PlanningScene, str, str, int, tuple[tuple[str, str], ...]], ...] = (
    (
        TISSUE,
        "weighted",
        "visible",
        5,
        (
            ("b(3,3)", ""),
            ("b(2,2)", ""),
            ("b(1,1)", ""),
            ("b(2,2)", "tried(b(2,2))"),
            ("b(3,2)", "tried(b(3,3))"),
            ("b(2,2)", "rejected(b(2,2))"),
            ("b(2,1)", "barred(psm1)"),
            ("b(2,2)", "barred(psm1)"),
            ("b(2,2)", "visible_roi"),
            ("b(3,3)", f"{HELD} {LIMIT}"),
            ("b(2,1)", "ignore_ap"),
            ("reach(psm2,b(3,3))", ""),
            ("grasp(psm2,b(3,3))", ""),
            ("reach(psm1,b(1,3))", ""),
            ("pull(psm1,b(1,2))", ""),
            ("move(psm1,b(2,2))", ""),
            ("pull(psm1,b(1,2))", HELD),
            ("move(psm1,b(1,2))", HELD),
            ("move(psm1,b(2,2))", HELD),
            ("release(psm1)", ""),
            ("release(psm1)", HELD),
            ("release(psm1)", f"{HELD} visible_roi"),
            ("reach(psm1,b(2,1))", ""),
            ("reach(psm2,b(2,2))", "ignore_ap tried(b(1,2)) at(psm1,b(2,2))"),
            ("reach(psm1,b(2,1))", "ignore_ap"),
            ("reach(psm1,b(3,2))", "tried(b(3,3))"),
            ("reach(psm2,b(3,2))", "tried(b(3,3)) tried(b(2,3))"),
            ("release(psm1)", LIMIT),
            ("pull(psm1,b(2,2))", SPANNED),
            ("grasp(psm1,b(1,3))", "at(psm1,b(1,3))"),
            ("grasp(psm1,b(2,2))", "at(psm1,b(1,1))"),
        ),
    ),
    (TISSUE, "nearest", "visible", 5, (("b(2,2)", "tried(b(3,3))"),)),
    (TISSUE, "weighted", "visible", 2, (("b(2,2)", ""), ("reach(psm2,b(3,3))", ""))),
    (TISSUE, "weighted", "clear", 1, (("pull(psm1,b(2,2))", f"{HELD} max_height(psm2)"),)),
    (
        TISSUE,
        "weighted",
        "clear",
        5,
        (("pull(psm1,b(2,2))", f"{SPANNED} max_height(psm2)"),),
    ),
    (OUT_OF_REACH, "weighted", "visible", 5, (("b(1,2)", ""), ("move(psm1,b(2,2))", HELD))),
)


# Rules of one's own that keep the best block from being grasped: with words, without, without a
# name.
OWN_RULES = (
    "\n#program base. forbidden(reach(A,B),open_gripper_first) :- reachable(A,B), B = b(3,3).",
    "\n#program base. rule(mine). forbidden(reach(A,B),mine) :- reachable(A,B), B = b(3,3).",
    "\n#program base. :- target(_,b(3,3)).",
)

NOTHING_GRASPED = "\n#program base. rule(mine). forbidden(reach(A,B),mine) :- reachable(A,B)."


def answers(knowledge: Knowledge) -> Iterator[object]:
    """Why not another block or action, for a few of them."""
    for tissue, criterion, goal, horizon, asked in QUESTIONS:
        planner = Planner(knowledge, tissue, criterion, goal, horizon)
        for question, state in asked:
            yield outcome(planner.why_not, question, state.split())
    for rule in OWN_RULES:
        files = dict(knowledge.files)
        files["constraints.lp"] += rule
        planner = Planner(Knowledge(files, ""), TISSUE, "weighted")
        for question in ("b(3,3)", "reach(psm2,b(3,3))"):
            yield outcome(planner.why_not, question, [])
    spent = Planner(knowledge, TISSUE, "weighted", conflict_budget=0)
    yield outcome(spent.why_not, "reach(psm2,b(3,3))", [])


MANY = " ".join(f"rejected({name})" for name in NAMES[:6])
# Why a plan is made, as the executive says it.
REASONS = (
    "initial",
    "exposure",
    "force",
    "hold",
    "restart",
    "nothing_in_reach",
    "deviation: x",
    "rejected: x",
    "late",
)
MEASURED = {
    "visible_roi": {"visible_fraction": 0.5, "threshold_fraction": 0.7},
    "max_height(psm1)": {"force_n": 0.4, "limit_n": 0.5},
}


def occasions(knowledge: Knowledge) -> Iterator[object]:
    """What is said of a plan because of when and upon what numbers it is made."""
    planner = Planner(knowledge, TISSUE, "weighted")
    for reason in REASONS:
        for state in ("", f"{HELD} {LIMIT}", "rejected(b(3,3)) barred(psm2)", MANY):
            plan = planner.plan(state.split(), reason=reason, evidence=MEASURED)
            yield plan.explanation


def explained(knowledge: Knowledge) -> Iterator[object]:
    """All that is worded: plans, their absence, and the names of rules."""
    yield from fingerprint(knowledge)
    yield from answers(knowledge)
    files = dict(knowledge.files)
    files["constraints.lp"] += NOTHING_GRASPED
    yield outcome(planned, Planner(Knowledge(files, ""), TISSUE), "")
    # Blocks that both arms reach, one of them with its gripper closed.
    for arm in ("psm1", "psm2"):
        tried = [f"tried(b({i},{j}))" for i in ROWS for j in (1, 3)]
        yield outcome(
            planned,
            Planner(knowledge, TISSUE, "weighted"),
            " ".join([*tried, f"closed_gripper({arm})"]),
        )


# Histories, each of which breaks one specification; atoms stand at the steps given.
HISTORIES: tuple[dict[int, str], ...] = (
    {1: "reach(psm1,b(1,1)) reach(psm2,b(1,1)) reachable(psm1,b(1,1)) reachable(psm2,b(1,1))"},
    {1: "reach(psm1,b(1,1))"},
    {1: "reach(psm1,b(1,1)) reachable(psm1,b(1,1)) closed_gripper(psm1)"},
    {1: "grasp(psm1,b(1,1)) at(psm1,b(1,1)) closed_gripper(psm1)"},
    {1: "grasp(psm1,b(1,1))"},
    {1: "grasp(psm1,b(1,1)) at(psm1,b(1,1)) in_hand(psm2,b(1,2))"},
    {1: "in_hand(psm1,b(1,1)) in_hand(psm2,b(1,2))"},
    dict.fromkeys((1, 2), "grasp(psm1,b(1,1)) at(psm1,b(1,1))"),
    {
        1: "grasp(psm1,b(1,1)) at(psm1,b(1,1))",
        2: "pull(psm1,b(1,1)) in_hand(psm1,b(1,1))",
        3: "grasp(psm1,b(1,1)) at(psm1,b(1,1))",
    },
    {1: "grasp(psm1,b(1,1)) at(psm1,b(1,1)) fixed(b(1,1))"},
    {1: "pull(psm1,b(1,1)) in_hand(psm1,b(1,1)) fixed(b(1,1))"},
    {1: "grasp(psm1,b(1,1)) at(psm1,b(1,1)) tried(b(1,1))"},
    {1: "grasp(psm1,b(1,1)) at(psm1,b(1,1)) rejected(b(1,1))"},
    {1: "grasp(psm1,b(1,1)) at(psm1,b(1,1)) barred(psm1)"},
    {1: "pull(psm1,b(1,1)) in_hand(psm1,b(1,1)) max_height(psm1)"},
    {1: "pull(psm1,b(1,1))"},
    {1: "move(psm1,b(1,1)) above_roi(b(1,1)) max_height(psm1)"},
    {1: "move(psm1,b(1,1)) in_hand(psm1,b(1,1)) max_height(psm1)"},
    {1: "move(psm1,b(1,1)) in_hand(psm1,b(1,1)) above_roi(b(1,1))"},
)


def judged(knowledge: Knowledge) -> Iterator[object]:
    """What is said of a few histories."""
    for history in HISTORIES:
        yield verify(knowledge, {t: atoms.split() for t, atoms in history.items()})


def differs(take: Fingerprint, knowledge: Knowledge) -> bool:
    """Whether the outcomes are not those of the whole knowledge; looks no farther than it must."""
    pairs = zip(whole(take), take(knowledge), strict=True)
    try:
        return any(one != other for one, other in pairs)
    except (FrasError, KeyError):
        # Refused outright, or a name without its words.
        return True


@cache
def whole(take: Fingerprint) -> list[object]:
    return list(take(KNOWLEDGE))


def expect_death(take: Fingerprint, mutant: Mutant) -> None:
    assert differs(take, mutant.knowledge) != (mutant.text in EQUIVALENT), mutant.text


def every(files: Iterable[str]) -> pytest.MarkDecorator:
    return pytest.mark.parametrize("mutant", mutants(KNOWLEDGE, files), ids=str)


@every(file for file in KNOWLEDGE.files if file not in {*WORDING, *JUDGING})
def test_rule_of_planning(mutant: Mutant) -> None:
    expect_death(fingerprint, mutant)


@every(file for file in WORDING if file in KNOWLEDGE.files)
def test_rule_of_wording(mutant: Mutant) -> None:
    takes = {"because.lp": occasions, "why_not_block.lp": answers, "why_not_action.lp": answers}
    expect_death(takes.get(mutant.file, explained), mutant)


@every(file for file in JUDGING if file in KNOWLEDGE.files)
def test_rule_of_judging(mutant: Mutant) -> None:
    expect_death(judged, mutant)


@pytest.mark.parametrize("take", [explained, judged])
def test_reprinting_alone_changes_nothing(take: Fingerprint) -> None:
    files = {name: reprinted(statements(text)) for name, text in KNOWLEDGE.files.items()}
    assert not differs(take, Knowledge(files, ""))


def test_what_is_equivalent_is_still_there() -> None:
    texts = {mutant.text for mutant in mutants(KNOWLEDGE, KNOWLEDGE.files)}
    assert set(EQUIVALENT) <= texts
