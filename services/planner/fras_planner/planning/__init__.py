"""The planning core: contexts in, plans with their reasons out; no bus, no clock, no file."""

from fras_planner.planning.errors import (
    ContradictoryFluents,
    EmptyContext,
    KnowledgeFault,
    PlanningError,
    SceneChanged,
    SceneOutOfBounds,
    UnknownAction,
    UnknownArm,
    UnknownBlock,
    UnknownCriterion,
    UnknownFluent,
    UnknownGoal,
)
from fras_planner.planning.parsed import Parsed, parse
from fras_planner.planning.plan import NoPlan, Plan, PlannedAction, WhyNot
from fras_planner.planning.program import Knowledge
from fras_planner.planning.scene import Context, PlanningScene
from fras_planner.planning.solver import Planner
from fras_planner.planning.verifier import Violation, verify

__all__ = [
    "Context",
    "ContradictoryFluents",
    "EmptyContext",
    "Knowledge",
    "KnowledgeFault",
    "NoPlan",
    "Parsed",
    "Plan",
    "PlannedAction",
    "Planner",
    "PlanningError",
    "PlanningScene",
    "SceneChanged",
    "SceneOutOfBounds",
    "UnknownAction",
    "UnknownArm",
    "UnknownBlock",
    "UnknownCriterion",
    "UnknownFluent",
    "UnknownGoal",
    "Violation",
    "WhyNot",
    "parse",
    "verify",
]
