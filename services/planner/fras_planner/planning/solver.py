"""The planner: one long-lived clingo Control a scene, its state set anew for each plan."""

from collections.abc import Callable, Iterable
from typing import Any

import clingo

from fras_planner.planning.errors import (
    ContradictoryFluents,
    SceneChanged,
    SceneOutOfBounds,
    UnknownGoal,
)
from fras_planner.planning.narrator import tell_no_plan, tell_plan
from fras_planner.planning.no_plan import minimal_core
from fras_planner.planning.plan import NoPlan, Plan
from fras_planner.planning.program import PLAN_FILES, Knowledge, Program
from fras_planner.planning.scene import PlanningScene
from fras_planner.planning.scene_facts import SceneFacts
from fras_planner.planning.signature import STATIC, normalised

GOALS = ("visible", "clear")
# Both arms let go, then reach, grasp and pull: no plan of these rules needs more.
HORIZON = 5
MAX_HORIZON = 50
CONFLICT_BUDGET = 200_000

Sensed = dict[str, clingo.Symbol]


class _Best:
    """The best model so far."""

    def __init__(self) -> None:
        self.atoms: list[clingo.Symbol] = []
        self.candidates = 0
        self.cost: tuple[int, ...] = ()
        self.models = 0

    def take(self, model: clingo.Model) -> None:
        shown = model.symbols(shown=True)
        # There may be thousands of candidates; only their number is told.
        self.atoms = [atom for atom in shown if atom.name != "candidate"]
        self.candidates = len(shown) - len(self.atoms)
        self.cost = tuple(model.cost)
        self.models += 1

    def named(self, name: str) -> list[list[clingo.Symbol]]:
        """Arguments of the atoms of that name."""
        return sorted(atom.arguments for atom in self.atoms if atom.name == name)


def _no_clock() -> float:
    return 0.0


class Planner:
    """Plans in one scene.

    Parameters
    ----------
    knowledge : Knowledge
    scene : PlanningScene
    criterion : str
        Which block is best to grasp: a file in `asp/preferences/`.
    goal : str
        `visible`: the region of interest is seen; `clear`: and no arm is at its limit.
    horizon : int
        Most actions in a plan.
    seed : int
        Of the solver's random choices.
    conflict_budget : int
        Conflicts after which the search ends with the best plan so far.
    clock : callable, optional
        Returns seconds; only for `ground_s` and `solve_s`, which are 0 without one.

    Raises
    ------
    KnowledgeFault, UnknownCriterion, UnknownGoal
    EmptyContext, SceneOutOfBounds, UnknownFluent, UnknownArm, UnknownBlock
    """

    def __init__(
        self,
        knowledge: Knowledge,
        scene: PlanningScene,
        criterion: str = "weighted",
        goal: str = "visible",
        horizon: int = HORIZON,
        seed: int = 1,
        conflict_budget: int = CONFLICT_BUDGET,
        clock: Callable[[], float] = _no_clock,
    ) -> None:
        began = clock()
        if goal not in GOALS:
            raise UnknownGoal(goal, GOALS)
        if not 1 <= horizon <= MAX_HORIZON:
            raise SceneOutOfBounds("horizon", horizon, f"1 to {MAX_HORIZON} actions")
        preference = knowledge.preference_file(criterion)
        self.scene = scene
        self.criterion = criterion
        self.goal = goal
        self._knowledge = knowledge
        self._horizon = horizon
        self._clock = clock
        self._sensed_now: Sensed = {}
        # The file itself tells whether it ranks by sums over all attachments, the costly measure.
        sums = "attachment_distance_" in knowledge.files[preference]
        self._facts = SceneFacts(knowledge.alphabet, scene, sums=sums)
        options = [
            f"--const=goal={goal}",
            f"--seed={seed}",
            f"--solve-limit={conflict_budget}",
            "--parallel-mode=1",
            "--heuristic=Domain",
            "--opt-strategy=bb,lin",
        ]
        program = Program(knowledge, [*PLAN_FILES, preference], options)
        last = horizon + 1
        steps = [("step", (t,)) for t in range(1, last + 1)]
        parts = [("signature", ()), ("base", ()), *steps, ("check", (last,))]
        program.ground(*parts, facts=self._facts.all)
        self._control = program.control
        self._control.assign_external(clingo.Function("query", [clingo.Number(last)]), True)
        self._rules = {
            str(atom.symbol.arguments[0]): atom.literal
            for atom in self._control.symbolic_atoms.by_signature("enforced", 1)
        }
        self._assumptions = list(self._rules.values())
        self._ground_s = clock() - began

    def plan(
        self, fluents: Iterable[str], ignore_ap: bool = False, tried: Iterable[str] = ()
    ) -> Plan:
        """Make a plan.

        Parameters
        ----------
        fluents : iterable of str
            Atoms that hold. Static ones may be among them, then all of them must be and must be
            those of the scene. `tried(B)` and `ignore_ap` may be among them too.
        ignore_ap : bool
            Plan as if there were no attachments.
        tried : iterable of str
            Blocks that are no candidates any more.

        Returns
        -------
        Plan
            The best one; without actions if the goal is reached; with `no_plan` if there is none.

        Raises
        ------
        UnknownFluent, UnknownArm, UnknownBlock
            If an atom is not one of the signature over this scene.
        ContradictoryFluents
            If atoms cannot hold together.
        SceneChanged
            If there are static atoms and they are not those of the scene.
        """
        sensed = self._read(fluents, ignore_ap, tried)
        self._assign(sensed)
        best = _Best()
        began = self._clock()
        result = self._control.solve(self._assumptions, on_model=best.take)
        solve_s = self._clock() - began
        ground_s, self._ground_s = self._ground_s, 0.0
        if not best.models:
            proved = bool(result.unsatisfiable)
            none = self._why_none(sensed, proved=proved)
            return Plan((), "", "", (), 0, ground_s, solve_s, {}, none.sentences, none, proved)
        self._check_contradictions(best, sensed)
        steps = 1 + len(best.named("occurs"))
        story = tell_plan(self._knowledge, self._facts_about(best, sensed, steps), steps)
        arm, target = story.actions[0].args[0] if story.actions else "", ""
        for row in best.named("target"):
            arm, target = str(row[0]), str(row[1])
        return Plan(
            actions=story.actions,
            target=target,
            arm=arm,
            cost=best.cost,
            models=best.models,
            ground_s=ground_s,
            solve_s=solve_s,
            history={t: (*atoms, *self._facts.statics) for t, atoms in story.history.items()},
            explanation=story.explanation,
            optimal=bool(result.exhausted),
        )

    def _read(self, fluents: Iterable[str], ignore_ap: bool, tried: Iterable[str]) -> Sensed:
        """Check the atoms; those that may change, in alphabetical order."""
        alphabet = self._knowledge.alphabet
        atoms = {normalised(atom) for atom in fluents}
        statics = frozenset(atom for atom in atoms if alphabet.kind(atom) == STATIC)
        if statics and statics != self.scene.statics:
            self._facts.check(statics)
            raise SceneChanged(sorted(statics ^ self.scene.statics))
        atoms -= statics
        atoms |= {f"tried({normalised(block)})" for block in tried}
        if ignore_ap:
            atoms.add("ignore_ap")
        return {atom: alphabet.symbol(atom, self._facts.blocks) for atom in sorted(atoms)}

    def _assign(self, sensed: Sensed) -> None:
        for atom, symbol in self._sensed_now.items():
            if atom not in sensed:
                self._control.assign_external(symbol, False)
        for atom, symbol in sensed.items():
            if atom not in self._sensed_now:
                self._control.assign_external(symbol, True)
        self._sensed_now = sensed

    @staticmethod
    def _check_contradictions(best: _Best, sensed: Sensed) -> None:
        for arm, rule in best.named("contradiction"):
            about = [atom for atom, symbol in sensed.items() if arm in symbol.arguments]
            raise ContradictoryFluents(str(rule), about, sensed)

    def _facts_about(self, best: _Best, sensed: Sensed, steps: int) -> list[str]:
        """Facts for telling a plan; only the blocks that it involves are described."""
        involved = [str(symbol.arguments[-1]) for symbol in sensed.values() if symbol.arguments]
        involved += [str(block) for _, block in best.named("target")]
        shown = [str(atom) for atom in best.atoms]
        about = self._facts.about(involved)
        return [*shown, *sensed, *about, *self._facts.above_roi, *self._counts(best, steps - 1)]

    def _counts(self, best: _Best, actions: int) -> list[str]:
        return [
            f"criterion({self.criterion})",
            f"count(candidates,{best.candidates})",
            f"count(fixed,{self._facts.fixed_count})",
            f"count(actions,{actions})",
        ]

    def _why_none(self, sensed: Sensed, *, proved: bool) -> NoPlan:
        core = ["search_budget"]
        best = _Best()
        # The options' names are known at run time only.
        solving: Any = self._control.configuration.solve
        solving.opt_mode = "ignore"
        try:
            # Without any rule there is always a model; it tells contradictions and candidates.
            self._control.solve(on_model=best.take)
            self._check_contradictions(best, sensed)
            if proved:
                core = minimal_core(self._control, self._rules)
        finally:
            solving.opt_mode = "opt"
        facts = [*self._facts.all, *sensed, *self._counts(best, self._horizon)]
        return NoPlan(tuple(core), tell_no_plan(self._knowledge, facts, core))
