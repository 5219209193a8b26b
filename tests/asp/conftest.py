"""Asks the rules directly: a state and a course of action in, the atoms of the model out."""

from collections.abc import Callable, Sequence
from pathlib import Path

import clingo
import pytest

ASP = Path(__file__).resolve().parents[2] / "asp"
PLAN_FILES = ("domain", "target", "actions", "effects", "constraints", "goal")
SCENE = """
block(b(1,1)). block(b(1,2)). block(b(2,1)). block(b(2,2)).
reachable(psm1,b(1,1)). reachable(psm1,b(2,1)). reachable(psm2,b(1,2)). reachable(psm2,b(2,2)).
fixed(b(1,1)). above_roi(b(2,2)).
roi_distance(b(1,1),78). roi_distance(b(1,2),50). roi_distance(b(2,1),60). roi_distance(b(2,2),0).
nearest_attachment(b(1,1),0). nearest_attachment(b(1,2),60).
nearest_attachment(b(2,1),50). nearest_attachment(b(2,2),78).
"""

Ask = Callable[..., frozenset[str] | None]


@pytest.fixture
def ask() -> Ask:
    """Force a course of action on the rules.

    The returned function takes `state` (facts about what is sensed), `course` ("reach psm1", one
    a step, "" for none), `target` ("psm1,b(2,1)"), `lifted` (names of rules not enforced), `goal`
    (None: any end will do) and `idle_at_end` (False: the goal is asked for at the step of the last
    action). It returns all atoms of the model, or None if the rules do not allow it.
    """

    def run(
        state: str = "",
        course: Sequence[str] = (),
        target: str | None = None,
        lifted: Sequence[str] = (),
        goal: str | None = None,
        scene: str = SCENE,
        idle_at_end: bool = True,
    ) -> frozenset[str] | None:
        last = len(course) + idle_at_end
        control = clingo.Control([f"--const=goal={goal or 'visible'}", "--opt-mode=ignore"])
        for name in PLAN_FILES:
            control.add("base", [], "#program base.\n" + (ASP / f"{name}.lp").read_text())
        control.add("base", [], "#defined preference/3.")
        control.add("given", [], scene + state)
        planned = [
            f"planned({action.split()[0]},{action.split()[1]},{t})."
            for t, action in enumerate(course, start=1)
            if action
        ]
        aim = f":- not target({target})." if target else ":- target(_,_)."
        forced = f"""
            #defined planned/3.
            :- planned(X,A,T), not occurs(X,A,T).
            :- occurs(X,A,T), not planned(X,A,T).
            {" ".join(planned)} {aim}
        """
        control.add("forced", [], forced)
        parts: list[tuple[str, list[clingo.Symbol]]] = [
            ("signature", []),
            ("given", []),
            ("base", []),
        ]
        parts += [("step", [clingo.Number(t)]) for t in range(1, last + 1)]
        control.ground([*parts, ("check", [clingo.Number(last)])])
        control.ground([("forced", [])])
        if goal:
            control.assign_external(clingo.Function("query", [clingo.Number(last)]), True)
        enforced = control.symbolic_atoms.by_signature("enforced", 1)
        assumed = [(a.symbol, str(a.symbol.arguments[0]) not in lifted) for a in enforced]
        models: list[frozenset[str]] = []
        control.solve(
            assumed,
            on_model=lambda model: models.append(
                frozenset(str(atom) for atom in model.symbols(atoms=True))
            ),
        )
        return models[0] if models else None

    return run
