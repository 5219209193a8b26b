"""What planning gives back."""

from dataclasses import dataclass


@dataclass(frozen=True)
class PlannedAction:
    """One action of a plan.

    Attributes
    ----------
    t : int
        Step, from 1; its effect shows at step t + 1.
    text : str
        The atom, `reach(psm1,b(3,2))`.
    name : str
        `reach`, `grasp`, `pull`, `move` or `release`.
    args : tuple of str
        Arm, and block where the action has one.
    expected : tuple of str
        Atoms that must be sensed after success; a leading `-` reads: must not be sensed.
    """

    t: int
    text: str
    name: str
    args: tuple[str, ...]
    expected: tuple[str, ...]


@dataclass(frozen=True)
class NoPlan:
    """Why there is no plan.

    Attributes
    ----------
    core : tuple of str
        Names of rules that together leave no plan; without any one of them there would be one.
        `search_budget` or `search_time` alone: the conflicts or the seconds allowed were spent
        before a plan was found or ruled out.
    sentences : tuple of str
        The rules and the facts behind them, in words.
    """

    core: tuple[str, ...]
    sentences: tuple[str, ...]


@dataclass(frozen=True)
class Plan:
    """A plan with its reasons.

    Attributes
    ----------
    actions : tuple of PlannedAction
        In order; empty if the goal is reached, or if there is no plan.
    target, arm : str
        The block chosen for a new grasp, empty if none; the arm that makes it, else the arm of
        the first action.
    cost : tuple of int
        What the plan pays on each level of preference, highest first (see `target.lp`).
    models : int
        Plans that the solver found on the way, each better than the one before.
    ground_s, solve_s, told_s : float
        By the planner's clock: grounding, paid by the first plan of a scene; the search; deriving
        the history and the reasons.
    history : dict of int to tuple of str
        Every atom that holds at each step, the action taken at it among them: first those that
        change, then those of the scene.
    explanation : tuple of str
        The reasons, in the order of the actions.
    no_plan : NoPlan or None
    optimal : bool
        False if the conflict budget ended the search; then this is the best plan found, if any.
    """

    actions: tuple[PlannedAction, ...]
    target: str
    arm: str
    cost: tuple[int, ...]
    models: int
    ground_s: float
    solve_s: float
    told_s: float
    history: dict[int, tuple[str, ...]]
    explanation: tuple[str, ...]
    no_plan: NoPlan | None = None
    optimal: bool = True


@dataclass(frozen=True)
class WhyNot:
    """Why a plan does not do something.

    Attributes
    ----------
    question : str
        A block, or an action.
    rules : tuple of str
        Names of the rules that together forbid it; empty if it is possible, or if what it needs
        is missing.
    sentences : tuple of str
        The answer in words.
    """

    question: str
    rules: tuple[str, ...]
    sentences: tuple[str, ...]
