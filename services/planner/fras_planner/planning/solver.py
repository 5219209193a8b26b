"""The planner: one long-lived clingo Control a scene, its state set anew for each plan."""

from collections.abc import Callable, Generator, Iterable
from contextlib import contextmanager
from typing import Any

import clingo

from fras_planner.planning.errors import (
    ContradictoryFluents,
    SceneChanged,
    SceneOutOfBounds,
    UnknownBlock,
)
from fras_planner.planning.measures import NAME
from fras_planner.planning.narrator import (
    tell_no_plan,
    tell_plan,
    tell_why_not_action,
    tell_why_not_block,
)
from fras_planner.planning.no_plan import minimal_core
from fras_planner.planning.occasion import Evidence, occasion
from fras_planner.planning.parsed import CONFLICT_BUDGET, SEED, Parsed, parse
from fras_planner.planning.plan import NoPlan, Plan, WhyNot
from fras_planner.planning.program import Knowledge, Program
from fras_planner.planning.scene import PlanningScene
from fras_planner.planning.scene_facts import SceneFacts
from fras_planner.planning.search import Best, OutOfTime, Search
from fras_planner.planning.signature import STATIC, exclusion, normalised

# Both arms let go, then reach, grasp and pull: no plan of these rules needs more.
HORIZON = 5
MAX_HORIZON = 50
# A thousand times what a plan takes.
TIME_LIMIT_S = 5.0
# Actions of the block chosen for the next grasp (`actions.lp`).
NEEDS_TARGET = ("reach", "grasp")

Sensed = dict[str, clingo.Symbol]


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
    time_limit_s : float
        Seconds after which an answer's searches end without a plan.
    clock : callable, optional
        Returns seconds, for `time_limit_s` and the times in a plan; without one these are 0, and
        the limit is that of each search.
    parsed : Parsed, optional
        Of the same knowledge, criterion, goal, seed and budget, and used by no other planner;
        without it the rules are parsed now.

    Raises
    ------
    KnowledgeFault, UnknownCriterion, UnknownGoal
    EmptyContext, SceneOutOfBounds, UnknownFluent, UnknownArm, UnknownBlock
    """

    def __init__(
        self,
        knowledge: Knowledge,
        scene: PlanningScene,
        criterion: str = "capped",
        goal: str = "visible",
        horizon: int = HORIZON,
        seed: int = SEED,
        conflict_budget: int = CONFLICT_BUDGET,
        time_limit_s: float = TIME_LIMIT_S,
        clock: Callable[[], float] = _no_clock,
        parsed: Parsed | None = None,
    ) -> None:
        began = clock()
        if not 1 <= horizon <= MAX_HORIZON:
            raise SceneOutOfBounds("horizon", horizon, f"1 to {MAX_HORIZON} actions")
        if parsed is None:
            parsed = parse(knowledge, criterion, goal, seed, conflict_budget)
        self._telling: Program | None = parsed.telling
        self._preference = knowledge.preference_file(criterion)
        self.scene = scene
        self.criterion = criterion
        self.goal = goal
        self._knowledge = knowledge
        self._horizon = horizon
        self._clock = clock
        self._sensed_now: Sensed = {}
        # The file itself tells whether it ranks by sums over all attachments, the costly measure.
        sums = "attachment_distance_" in knowledge.files[self._preference]
        self._facts = SceneFacts(knowledge.alphabet, scene, sums=sums)
        last = horizon + 1
        steps = [("step", (t,)) for t in range(1, last + 1)]
        parts = [("signature", ()), ("base", ()), *steps, ("check", (last,))]
        parsed.planning.ground(*parts, facts=self._facts.all)
        self._control = parsed.planning.control
        self._search = Search(self._control, time_limit_s, clock)
        self._control.assign_external(clingo.Function("query", [clingo.Number(last)]), True)
        self._rules = {
            str(atom.symbol.arguments[0]): atom.literal
            for atom in self._control.symbolic_atoms.by_signature("enforced", 1)
        }
        self._assumptions = list(self._rules.values())
        self._ground_s = clock() - began

    @property
    def rules(self) -> frozenset[str]:
        """Names of the rules that it enforces."""
        return frozenset(self._rules)

    def plan(
        self,
        fluents: Iterable[str],
        ignore_ap: bool = False,
        tried: Iterable[str] = (),
        rejected: Iterable[str] = (),
        *,
        reason: str = "initial",
        evidence: Evidence | None = None,
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
        rejected : iterable of str
            Blocks, and arms, that a person has excluded from grasping.
        reason : str
            Why a plan is made now, ``kind`` or ``kind: detail``; only told.
        evidence : mapping of str to mapping of str to float, optional
            The numbers behind each atom, their names ending in their unit (``_n``, ``_m``,
            ``_fraction``); only told.

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
        sensed = self._read(fluents, ignore_ap, tried, rejected)
        self._assign(sensed)
        best = Best()
        began = self._clock()
        self._search.begin()
        try:
            result, _ = self._search(self._assumptions, best.take)
        except OutOfTime:
            best, result = Best(), None
        solve_s = self._clock() - began
        ground_s, self._ground_s = self._ground_s, 0.0
        if not best.models:
            proved = result is not None and bool(result.unsatisfiable)
            unproved = "search_time" if result is None else "search_budget"
            why_now = occasion(reason, evidence or {}, sensed)
            none = self._why_none(sensed, why_now, "" if proved else unproved)
            told_s = self._clock() - began - solve_s
            return Plan(
                (), "", "", (), 0, ground_s, solve_s, told_s, {}, none.sentences, none, proved
            )
        self._check_contradictions(best, sensed)
        steps = 1 + len(best.named("occurs"))
        about = [*self._facts_about(best, sensed, steps), *occasion(reason, evidence or {}, sensed)]
        began = self._clock()
        story = tell_plan(self._knowledge, about, steps, self._telling)
        self._telling = None
        told_s = self._clock() - began
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
            told_s=told_s,
            history={t: (*atoms, *self._facts.statics) for t, atoms in story.history.items()},
            explanation=story.explanation,
            optimal=result is not None and bool(result.exhausted),
        )

    def why_not(
        self,
        question: str,
        fluents: Iterable[str],
        ignore_ap: bool = False,
        tried: Iterable[str] = (),
        rejected: Iterable[str] = (),
    ) -> WhyNot:
        """Say why the plan for a context does not grasp a block, or does not begin with an action.

        Parameters
        ----------
        question : str
            A block `b(i,j)`, or an action as `domain.lp` declares it, `pull(psm1,b(3,2))`.
        fluents, ignore_ap, tried, rejected
            As for `plan`.

        Returns
        -------
        WhyNot
            What is missing for it; or the rules that forbid it; or by how much it is worse.

        Raises
        ------
        UnknownAction, UnknownArm, UnknownBlock
            If the question is about something that there is not.
        UnknownFluent, ContradictoryFluents, SceneChanged
            As for `plan`.
        """
        asked = normalised(question)
        is_block = NAME.fullmatch(asked) is not None
        if is_block and asked not in self._facts.blocks:
            raise UnknownBlock(asked, asked, self._facts.blocks)
        action = None if is_block else self._knowledge.alphabet.action(asked, self._facts.blocks)
        plan = self.plan(fluents, ignore_ap, tried, rejected)
        block = asked if action is None else str(action.arguments[-1])
        facts = [
            f"asked({asked})",
            *self._facts.about([block, plan.target]),
            *self._facts.reachable(block),
            *self._facts.above_roi,
            *self._sensed_now,
            *(f"planned({done.text},{done.t})" for done in plan.actions),
            *([f"target({plan.arm},{plan.target})"] if plan.target else []),
            f"criterion({self.criterion})",
            f"count(actions,{self._horizon})",
        ]
        if action is None:
            facts += self._keeping(asked)
            told = tell_why_not_block(self._knowledge, self._preference, facts)
            return WhyNot(asked, (), told)
        rules, contrast = self._contrast(action, plan)
        facts += [*contrast, *(f"core({rule})" for rule in rules)]
        return WhyNot(asked, tuple(rules), tell_why_not_action(self._knowledge, facts))

    def _keeping(self, block: str) -> list[str]:
        """Return `keeps(Rule,Arm)` for each rule that alone keeps an arm from grasping a block."""
        targets = self._control.symbolic_atoms.by_signature("target", 2)
        aims = [atom for atom in targets if str(atom.symbol.arguments[1]) == block]
        try:
            with self._any_model():
                return [
                    f"keeps({rule},{aim.symbol.arguments[0]})"
                    for aim in aims
                    if not self._search([aim.literal])[0].unsatisfiable
                    for rule, enforced in self._rules.items()
                    if self._search([aim.literal, enforced])[0].unsatisfiable
                ]
        except OutOfTime:
            return []

    def _contrast(self, action: clingo.Symbol, plan: Plan) -> tuple[list[str], list[str]]:
        """Make the best plan that begins with an action.

        Returns
        -------
        rules : list of str
            That forbid it, together; empty if none does.
        facts : list of str
            `possible` if there is such a plan, and `worse(Level,By)` for the first level of
            preference on which it falls short of the plan that was made.
        """
        arm, *blocks = action.arguments
        wanted = [clingo.Function("occurs", [clingo.Function(action.name), arm, clingo.Number(1)])]
        if action.name in NEEDS_TARGET:
            wanted.append(clingo.Function("target", [arm, *blocks]))
        atoms = [self._control.symbolic_atoms[symbol] for symbol in wanted]
        given = [atom.literal for atom in atoms if atom is not None]
        if len(given) < len(wanted):
            return [], []
        best = Best()
        try:
            result, _ = self._search([*given, *self._assumptions], best.take)
            if not best.models and not result.unsatisfiable:
                return [], ["undecided"]
            if best.models:
                prices = zip(best.levels, best.cost, plan.cost or best.cost, strict=True)
                worse = next(((level, by - of) for level, by, of in prices if by != of), None)
                return [], ["possible", *([f"worse({worse[0]},{worse[1]})"] if worse else [])]
            with self._any_model():
                if self._search(given)[0].unsatisfiable:
                    return [], []
                return minimal_core(self._search, self._rules, given), []
        except OutOfTime:
            return [], ["undecided"]

    @contextmanager
    def _any_model(self) -> Generator[None]:
        """Look for any plan, not for the best."""
        # The options' names are known at run time only.
        solving: Any = self._control.configuration.solve
        solving.opt_mode = "ignore"
        try:
            yield
        finally:
            solving.opt_mode = "opt"

    def _read(
        self,
        fluents: Iterable[str],
        ignore_ap: bool,
        tried: Iterable[str],
        rejected: Iterable[str],
    ) -> Sensed:
        """Check the atoms; those that may change, in alphabetical order."""
        alphabet = self._knowledge.alphabet
        atoms = {normalised(atom) for atom in fluents}
        statics = frozenset(atom for atom in atoms if alphabet.kind(atom) == STATIC)
        if statics and statics != self.scene.statics:
            self._facts.check(statics)
            raise SceneChanged(sorted(statics ^ self.scene.statics))
        atoms -= statics
        atoms |= {f"tried({normalised(block)})" for block in tried}
        atoms |= {exclusion(name, alphabet.arms) for name in rejected}
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
    def _check_contradictions(best: Best, sensed: Sensed) -> None:
        for arm, rule in best.named("contradiction"):
            about = [atom for atom, symbol in sensed.items() if arm in symbol.arguments]
            raise ContradictoryFluents(str(rule), about, sensed)

    def _facts_about(self, best: Best, sensed: Sensed, steps: int) -> list[str]:
        """Facts for telling a plan; only the blocks that it involves are described."""
        involved = [str(symbol.arguments[-1]) for symbol in sensed.values() if symbol.arguments]
        involved += [str(block) for _, block in best.named("target")]
        shown = [str(atom) for atom in best.atoms]
        about = self._facts.about(involved)
        for _, block in best.named("target"):
            about += self._facts.reachable(str(block))
        return [*shown, *sensed, *about, *self._facts.above_roi, *self._counts(best, steps - 1)]

    def _counts(self, best: Best, actions: int) -> list[str]:
        return [
            f"criterion({self.criterion})",
            f"count(candidates,{best.candidates})",
            f"count(fixed,{self._facts.fixed_count})",
            f"count(actions,{actions})",
        ]

    def _why_none(self, sensed: Sensed, why_now: list[str], unproved: str) -> NoPlan:
        """Say why there is no plan; `unproved`: what ended the search before that was proved."""
        core = [unproved]
        best = Best()
        try:
            with self._any_model():
                # Without any rule there is always a model; it tells contradictions and candidates.
                self._search(on_model=best.take)
                self._check_contradictions(best, sensed)
                if not unproved:
                    core = minimal_core(self._search, self._rules)
        except OutOfTime:
            core = ["search_time"]
        facts = [*self._facts.all, *sensed, *why_now, *self._counts(best, self._horizon)]
        return NoPlan(tuple(core), tell_no_plan(self._knowledge, facts, core))
