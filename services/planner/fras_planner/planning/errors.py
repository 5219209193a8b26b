"""What can be wrong with what the planner is given; each error names the culprit."""

import re
from collections.abc import Iterable

from fras_common.errors import FrasError

SHOWN = 6


def _some(items: Iterable[str]) -> str:
    """Spell out the first few of many."""
    listed = list(items)
    rest = len(listed) - SHOWN
    return ", ".join(listed[:SHOWN]) + (f", ... ({rest} more)" if rest > 0 else "")


def _by_indices(block: str) -> list[int]:
    """b(2,10) after b(2,9)."""
    return [int(number) for number in re.findall("[0-9]+", block)]


class PlanningError(FrasError):
    """Base of all that the planner refuses."""


MEND_THE_RULE = "mend the rule, or leave out --asp-dir for the knowledge supplied"


class KnowledgeFault(PlanningError):
    """A rule file is missing, or clingo does not understand it.

    Parameters
    ----------
    remedy : str
        What to do; only told.
    """

    file: str
    line: int
    message: str

    def __init__(self, file: str, line: int, message: str, remedy: str = MEND_THE_RULE) -> None:
        place = f"{file}:{line}" if line else file
        super().__init__(
            f"{place}: {message}; {remedy}",
            file=file,
            line=line,
            message=message,
        )


class UnknownCriterion(PlanningError):
    """No file of that name in `preferences/`."""

    criterion: str
    known: tuple[str, ...]

    def __init__(self, criterion: str, known: Iterable[str]) -> None:
        names = tuple(known)
        super().__init__(
            f"no criterion '{criterion}'; known: {', '.join(names)}",
            criterion=criterion,
            known=names,
        )


class UnknownGoal(PlanningError):
    """A goal that `goal.lp` does not describe."""

    goal: str
    known: tuple[str, ...]

    def __init__(self, goal: str, known: Iterable[str]) -> None:
        names = tuple(known)
        super().__init__(f"no goal '{goal}'; known: {', '.join(names)}", goal=goal, known=names)


class EmptyContext(PlanningError):
    """A context without blocks or without a single fluent."""

    lacks: str

    def __init__(self, lacks: str) -> None:
        super().__init__(
            f"the context has no {lacks}: ask the situation awareness for a whole one", lacks=lacks
        )


class UnknownFluent(PlanningError):
    """An atom that the signature in `domain.lp` does not have."""

    atom: str
    known: tuple[str, ...]

    def __init__(self, atom: str, known: Iterable[str]) -> None:
        forms = tuple(known)
        super().__init__(
            f"'{atom}' is no fluent of the signature; known: {', '.join(forms)}",
            atom=atom,
            known=forms,
        )


class UnknownAction(PlanningError):
    """A question about something that is neither an action of `domain.lp` nor a block."""

    action: str
    known: tuple[str, ...]

    def __init__(self, action: str, known: Iterable[str]) -> None:
        forms = tuple(known)
        super().__init__(
            f"'{action}' is no action of the signature, nor a block b(i,j); "
            f"actions: {', '.join(forms)}",
            action=action,
            known=forms,
        )


class UnknownBlock(PlanningError):
    """An atom about a block that the context does not have."""

    atom: str
    block: str
    known: tuple[str, ...]

    def __init__(self, atom: str, block: str, known: Iterable[str]) -> None:
        names = tuple(sorted(known, key=_by_indices))
        super().__init__(
            f"'{atom}': no block '{block}'; known: {_some(names)}",
            atom=atom,
            block=block,
            known=names,
        )


class UnknownArm(PlanningError):
    """An atom about an arm that the knowledge does not have."""

    atom: str
    arm: str
    known: tuple[str, ...]

    def __init__(self, atom: str, arm: str, known: Iterable[str]) -> None:
        names = tuple(known)
        super().__init__(
            f"'{atom}': no arm '{arm}'; known: {', '.join(names)}", atom=atom, arm=arm, known=names
        )


class ContradictoryFluents(PlanningError):
    """Atoms that cannot hold together."""

    atoms: tuple[str, ...]
    rule: str
    known: tuple[str, ...]

    def __init__(self, rule: str, atoms: Iterable[str], known: Iterable[str]) -> None:
        named, sensed = tuple(atoms), tuple(known)
        super().__init__(
            f"contradictory context (rule {rule} in constraints.lp): {_some(named)}; "
            f"sensed in all: {_some(sensed)}; the sensing is at fault, the arm must hold",
            rule=rule,
            atoms=named,
            known=sensed,
        )


class SceneChanged(PlanningError):
    """A context whose reachable, fixed or above_roi atoms are not those of the planner's scene."""

    atoms: tuple[str, ...]

    def __init__(self, atoms: Iterable[str]) -> None:
        named = tuple(atoms)
        super().__init__(
            f"the scene has changed ({_some(named)}): make a new Planner for it", atoms=named
        )


class SceneOutOfBounds(PlanningError):
    """A scene malformed, or too large for clingo's 32-bit integers."""

    quantity: str
    value: object
    allowed: str

    def __init__(self, quantity: str, value: object, allowed: str) -> None:
        super().__init__(
            f"{quantity} = {value}: {allowed}", quantity=quantity, value=value, allowed=allowed
        )
