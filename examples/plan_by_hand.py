"""Plan from a context written by hand: `python examples/plan_by_hand.py`.

No service and no tissue: a grid of 3 x 3 blocks, two of them attached, the target region under a
third. One sees the plan, why it is this one, what is expected after each action, and why it does
not grasp an attached block. The reasons come from the rules in `asp/`, not from this file.
"""

# %% What is true: atoms as `asp/domain.lp` declares them.
from fras_planner.knowledge import load_knowledge
from fras_planner.planning import Context, Planner, PlanningScene

columns = rows = range(1, 4)
names = tuple(f"b({i},{j})" for i in columns for j in rows)
context = Context(
    names=names,
    blocks_m=tuple((0.03 * i, 0.03 * j, 0.005) for i in columns for j in rows),
    roi_m=(0.06, 0.06, 0.0),
    fluents=(
        "fixed(b(1,1))",
        "fixed(b(1,2))",
        "above_roi(b(2,2))",
        *(f"reachable({'psm1' if j < 2 else 'psm2'},b({i},{j}))" for i in columns for j in rows),
    ),
)

# %% One planner serves one scene: it stays warm, and plans again in milliseconds.
knowledge = load_knowledge()  # or load_knowledge(Path("my-rules"))
scene = PlanningScene.from_context(context, knowledge)
planner = Planner(knowledge, scene, criterion="capped")
plan = planner.plan(context.fluents)
for action in plan.actions:
    print(
        f"{action.t}. {action.text:20} then {', '.join(action.expected) or 'nothing is promised'}"
    )
print(*plan.explanation, sep="\n")

# %% Ask back, about a block or an action.
for question in ("b(1,1)", "pull(psm1,b(3,1))"):
    print(f"\nWhy not {question}?")
    print(*planner.why_not(question, context.fluents).sentences, sep="\n")

# %% The same scene in another situation: the block is in hand, and the arm may not pull on.
held = (*context.fluents, "at(psm2,b(3,3))", "in_hand(psm2,b(3,3))", "closed_gripper(psm2)")
again = planner.plan((*held, "max_height(psm2)"), reason="force")
print("\nAt the limit:", " → ".join(action.text for action in again.actions))
