"""Tells a finished plan: its actions by name, its history, its reasons in words.

The rules for that (`program.TELL_FILES` and those after it) run on one plan as facts, outside the
search.
"""

from collections import defaultdict
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import clingo

from fras_planner.planning.errors import KnowledgeFault
from fras_planner.planning.plan import PlannedAction
from fras_planner.planning.program import (
    NO_PLAN_FILES,
    TELL_FILES,
    WHY_NOT_ACTION_FILES,
    WHY_NOT_BLOCK_FILES,
    Knowledge,
    Program,
)


@dataclass(frozen=True)
class Story:
    """A plan told: the actions, the atoms that change at each step, the reasons."""

    actions: tuple[PlannedAction, ...]
    history: dict[int, tuple[str, ...]]
    explanation: tuple[str, ...]


def telling_program(knowledge: Knowledge) -> Program:
    """Parse what tells a plan."""
    return Program(knowledge, TELL_FILES, ())


def tell_plan(
    knowledge: Knowledge, facts: Iterable[str], steps: int, program: Program | None = None
) -> Story:
    """Tell a plan.

    Parameters
    ----------
    knowledge : Knowledge
    facts : iterable of str
        The model's shown atoms, its context, the scene's facts about the blocks involved.
    steps : int
        Steps of the plan, the last one included at which the goal holds.
    program : Program, optional
        A `telling_program` that nothing was told with yet.
    """
    told = program if program is not None else telling_program(knowledge)
    _ground(told, [*facts, f"step(1..{steps})"], ("history", "explain", "because"))
    expected: dict[int, list[str]] = defaultdict(list)
    for t, atom in told.rows("expected", 2):
        expected[t.number].append(str(atom))
    holds: dict[int, list[str]] = defaultdict(list)
    for atom, t in told.rows("holds", 2):
        holds[t.number].append(str(atom))
    actions = {
        t.number: PlannedAction(
            t=t.number,
            text=str(action),
            name=action.name,
            args=tuple(str(argument) for argument in action.arguments),
            expected=tuple(sorted(expected[t.number])),
        )
        for action, t in told.rows("does", 2)
    }
    history = {
        t: (*([actions[t].text] if t in actions else []), *sorted(holds[t]))
        for t in range(1, steps + 1)
    }
    return Story(tuple(actions[t] for t in sorted(actions)), history, _sentences(knowledge, told))


def tell_no_plan(
    knowledge: Knowledge, facts: Iterable[str], core: Sequence[str]
) -> tuple[str, ...]:
    """Tell why there is no plan, from the scene's facts, the context and the core of rules."""
    blamed = [f"core({rule})" for rule in core]
    told = _told(knowledge, [*facts, *blamed], ("no_plan", "because"), NO_PLAN_FILES)
    return _sentences(knowledge, told)


def tell_why_not_block(
    knowledge: Knowledge, preference: str, facts: Iterable[str]
) -> tuple[str, ...]:
    """Tell why a plan does not grasp the block asked about; `preference`: the criterion's file."""
    files = (*WHY_NOT_BLOCK_FILES, preference)
    return _sentences(knowledge, _told(knowledge, facts, ("why_not_block",), files))


def tell_why_not_action(knowledge: Knowledge, facts: Iterable[str]) -> tuple[str, ...]:
    """Tell why a plan does not begin with the action asked about."""
    return _sentences(knowledge, _told(knowledge, facts, ("why_not_action",), WHY_NOT_ACTION_FILES))


def _told(
    knowledge: Knowledge,
    facts: Iterable[str],
    parts: Sequence[str],
    files: Sequence[str],
) -> Program:
    program = Program(knowledge, files, ())
    _ground(program, facts, parts)
    # The program is handed on whole, because its atoms are gone with it.
    return program


def _ground(program: Program, facts: Iterable[str], parts: Sequence[str]) -> None:
    """Facts in, facts out: grounding does all the work, no search is needed."""
    program.ground(*((part, ()) for part in ("base", *parts)), facts=facts)


def _sentences(knowledge: Knowledge, told: Program) -> tuple[str, ...]:
    found: list[tuple[int, str]] = []
    for row in told.rows("sentence", 3):
        order, text, values = row
        try:
            words = [_spoken(value) for value in values.arguments]
            found.append((order.number, text.string.format(*words)))
        except (LookupError, RuntimeError, ValueError) as error:
            problem = (
                f"sentence({','.join(map(str, row))}) can't be said "
                f"({type(error).__name__}: {error})"
            )
            raise KnowledgeFault(knowledge.origin, 0, problem) from error
    return tuple(sentence for _, sentence in sorted(found))


def _spoken(value: clingo.Symbol) -> str:
    return value.string if value.type == clingo.SymbolType.String else str(value)
