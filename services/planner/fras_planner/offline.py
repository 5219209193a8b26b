"""Planning from a file of contexts, without any service: what `fras plan` does."""

import time
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import msgspec

from fras_common.errors import FrasError
from fras_planner.knowledge import AttachedRulesUnusable, attached_knowledge, load_knowledge
from fras_planner.planning import (
    Context,
    Knowledge,
    KnowledgeFault,
    Plan,
    Planner,
    PlanningScene,
    WhyNot,
    verify,
)

Vector = tuple[float, float, float]


class BadContext(FrasError):
    """A context that can't be read. Attributes: ``place``, ``problem``."""


class ContextFile(msgspec.Struct, frozen=True, kw_only=True):
    """A context as JSON; a recorded `sa/context` message fits, its other fields are not read."""

    blocks_m: list[Vector]
    names: list[str]
    roi_m: Vector
    fluents: list[str]
    fixed_points_m: list[Vector] = []
    ignore_ap: bool = False
    tried: list[str] = []
    rejected: list[str] = []
    reason: str = "initial"
    evidence: dict[str, dict[str, float]] = {}


def read_contexts(text: bytes | str, place: str) -> tuple[list[Context], bool]:
    """Read one context, or a list of them.

    Parameters
    ----------
    text : bytes or str
        JSON.
    place : str
        What to call it in errors.

    Returns
    -------
    list of Context
    bool
        Whether it was a list.

    Raises
    ------
    BadContext
        If it is no JSON, or says something else than a context does.
    """
    try:
        raw: Any = msgspec.json.decode(text)
        is_list = isinstance(raw, list)
        files = msgspec.convert(raw if is_list else [raw], list[ContextFile])
    except (msgspec.MsgspecError, UnicodeDecodeError, RecursionError) as error:
        raise BadContext(
            f"{place}: {error}; a context has names, blocks_m, roi_m [m] and fluents, and may have "
            "fixed_points_m, tried, rejected, ignore_ap, evidence and reason",
            place=place,
            problem=str(error),
        ) from error
    contexts = [
        Context(
            names=tuple(file.names),
            blocks_m=tuple(file.blocks_m),
            roi_m=file.roi_m,
            fluents=tuple(file.fluents),
            fixed_points_m=tuple(file.fixed_points_m),
            ignore_ap=file.ignore_ap,
            tried=tuple(file.tried),
            rejected=tuple(file.rejected),
            reason=file.reason,
            evidence=file.evidence,
        )
        for file in files
    ]
    return contexts, is_list


class OfflinePlanner:
    """Plans contexts one after the other; contexts of one scene share a planner.

    Parameters
    ----------
    knowledge : Knowledge
    criterion, goal : str
        As for `Planner`.
    """

    def __init__(self, knowledge: Knowledge, criterion: str, goal: str) -> None:
        self._knowledge = knowledge
        self._criterion = criterion
        self._goal = goal
        self._planner: Planner | None = None

    def plan(self, context: Context, questions: Iterable[str] = ()) -> dict[str, Any]:
        """Return a plan, and answers to why it is not another one, as plain data.

        Raises
        ------
        PlanningError
        """
        planner = self._planner_for(context)
        given = (context.fluents, context.ignore_ap, context.tried, context.rejected)
        row = plain(planner.plan(*given, reason=context.reason, evidence=context.evidence))
        row["why_not"] = [plain(planner.why_not(question, *given)) for question in questions]
        return row

    def _planner_for(self, context: Context) -> Planner:
        scene = PlanningScene.from_context(context, self._knowledge)
        if self._planner is None or self._planner.scene != scene:
            self._planner = Planner(
                self._knowledge,
                scene,
                criterion=self._criterion,
                goal=self._goal,
                clock=time.perf_counter,
            )
        return self._planner


def plan_file(
    text: bytes | str,
    place: str,
    *,
    criterion: str,
    goal: str,
    asp_dir: Path | None,
    questions: Sequence[str],
) -> tuple[list[dict[str, Any]], bool]:
    """Plan all contexts of a file.

    Returns
    -------
    list of dict
        A plan for each context; where a context is refused, ``error`` instead, with ``type``,
        ``text`` and the values.
    bool
        Whether the file was a list.

    Raises
    ------
    BadContext, KnowledgeFault, UnknownCriterion, UnknownGoal
    """
    knowledge = load_knowledge(asp_dir)
    knowledge.preference_file(criterion)
    contexts, is_list = read_contexts(text, place)
    planner = OfflinePlanner(knowledge, criterion, goal)
    rows: list[dict[str, Any]] = []
    for context in contexts:
        try:
            rows.append(planner.plan(context, questions))
        except FrasError as error:
            if not is_list:
                raise
            rows.append({"error": {"type": error.kind, "text": str(error), **error.values}})
    return rows, is_list


def plain(result: Plan | WhyNot) -> dict[str, Any]:
    """Return a result as JSON has it."""
    row: dict[str, Any] = msgspec.json.decode(msgspec.json.encode(result))
    return row


@dataclass(frozen=True)
class Judgement:
    """What became of holding a history against safety specifications.

    Attributes
    ----------
    broken : tuple of str
        Those that it breaks, in words.
    asp_digest : str
        Of the rules with the specifications.
    ours : bool
        Whether their `verify.lp` is the one that came with this FRAS.
    our_digest : str
        Of the rules that came with it.
    """

    broken: tuple[str, ...]
    asp_digest: str
    ours: bool
    our_digest: str


def verify_history(
    history: Mapping[int, Iterable[str]],
    asp_dir: Path | None = None,
    attached: Mapping[str, str] | None = None,
    log: str = "",
) -> Judgement:
    """Hold a history against the safety specifications.

    Parameters
    ----------
    history : mapping of int to iterable of str
    asp_dir : Path, optional
        Whose specifications; they go before all others.
    attached : mapping of str to str, optional
        Rules that came with a log; without any, those that came with FRAS.
    log : str
        Where the attached ones come from, for messages.

    Raises
    ------
    KnowledgeFault, AttachedRulesUnusable, UnknownFluent
    """
    own = load_knowledge()
    is_attached = asp_dir is None and bool(attached)
    if is_attached:
        knowledge = attached_knowledge(attached or {}, log)
    else:
        knowledge = own if asp_dir is None else load_knowledge(asp_dir)
    try:
        found = verify(knowledge, history)
    except KnowledgeFault as error:
        if is_attached:
            raise AttachedRulesUnusable(log, error) from error
        raise
    return Judgement(
        broken=tuple(violation.sentence for violation in found),
        asp_digest=knowledge.digest,
        ours=knowledge.files.get("verify.lp") == own.files["verify.lp"],
        our_digest=own.digest,
    )
