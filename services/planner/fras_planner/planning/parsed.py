"""What of the rules can be parsed before a scene is known, so that a first plan need not wait."""

from dataclasses import dataclass

from fras_planner.planning.errors import UnknownGoal
from fras_planner.planning.narrator import telling_program
from fras_planner.planning.program import PLAN_FILES, Knowledge, Program

GOALS = ("visible", "clear")
SEED = 1
CONFLICT_BUDGET = 200_000


@dataclass(frozen=True)
class Parsed:
    """Programs that wait for the facts of a scene; each can be grounded once.

    Attributes
    ----------
    planning : Program
    telling : Program
        For the reasons of the first plan.
    """

    planning: Program
    telling: Program


def parse(
    knowledge: Knowledge,
    criterion: str,
    goal: str,
    seed: int = SEED,
    conflict_budget: int = CONFLICT_BUDGET,
) -> Parsed:
    """Parse the rules of a planner; the parameters are those of `Planner`.

    Raises
    ------
    KnowledgeFault, UnknownCriterion, UnknownGoal
    """
    if goal not in GOALS:
        raise UnknownGoal(goal, GOALS)
    options = [
        f"--const=goal={goal}",
        f"--seed={seed}",
        f"--solve-limit={conflict_budget}",
        "--parallel-mode=1",
        "--heuristic=Domain",
        "--opt-strategy=bb,lin",
    ]
    files = [*PLAN_FILES, knowledge.preference_file(criterion)]
    return Parsed(Program(knowledge, files, options), telling_program(knowledge))
