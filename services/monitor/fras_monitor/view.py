"""The page as plain values: everything that stands on it, in words, for one moment."""

import msgspec

from fras_common.messages import Context, TaskStatus, Verdict
from fras_monitor.liveness import Freshness, freshness, life_of, lives
from fras_monitor.picture import Picture
from fras_monitor.stop import HOLDER, REASON, StopRecord
from fras_monitor.timetable import latest_changes, timetable, why
from fras_monitor.words import (
    OUTCOMES,
    evidence_in_words,
    fluent_in_words,
    hold_in_words,
    percent,
    phase_in_words,
    plain,
    point,
    reason_in_words,
    sentence,
    service_in_words,
)


class Force(msgspec.Struct, frozen=True, kw_only=True):
    """The gauge of the force [N]; `level`: ok, soft, hard or invalid."""

    value_n: float
    limit_n: float
    hard_limit_n: float
    level: str
    words: str


class Visibility(msgspec.Struct, frozen=True, kw_only=True):
    """The gauge of what is exposed; `threshold` is known once the situation has been told."""

    share: float
    threshold: float | None
    visible: bool
    words: str


class Course(msgspec.Struct, frozen=True, kw_only=True):
    """What the plots show, against simulated seconds."""

    at_s: list[float]
    force_n: list[float]
    visibility: list[float]


class Fact(msgspec.Struct, frozen=True, kw_only=True):
    """One fact of the situation, and the numbers behind it."""

    text: str
    evidence: list[str]


class Light(msgspec.Struct, frozen=True, kw_only=True):
    """How one service is."""

    name: str
    life: str
    words: str


class PlanSection(msgspec.Struct, frozen=True, kw_only=True):
    """One plan of the timetable; a row is text, state and note."""

    title: str
    reason: str
    rows: list[tuple[str, str, str]]


class StopView(msgspec.Struct, frozen=True, kw_only=True):
    """The last press of STOP."""

    state: str
    words: str


class ReplayView(msgspec.Struct, frozen=True, kw_only=True):
    """The time line of a replay; a mark is position, kind and words."""

    phase: str
    position_s: float
    begin_s: float
    end_s: float
    rate: float
    log: str
    damage: list[str]
    marks: list[tuple[float, str, str]]


class View(msgspec.Struct, frozen=True, kw_only=True):
    """All that stands on the page, but for the scene."""

    live: bool
    live_words: str
    trial: str
    headline: str
    outcome: str
    force: Force | None
    visibility: Visibility | None
    holds: dict[str, str]
    hold_words: list[str]
    held_here: bool
    stop: StopView
    waiting_plan: str
    decisions: list[str]
    plans: list[PlanSection]
    why: list[str]
    changes: list[str]
    situation: list[Fact]
    services: list[Light]
    log: str
    log_fine: bool
    question: str
    answer: list[str]
    replay: ReplayView | None


def view_of(picture: Picture, stop: StopRecord, now_s: float) -> View:
    """Lay out what is known at a moment.

    Parameters
    ----------
    picture : Picture
    stop : StopRecord
    now_s : float
        By the clock of the arrival times.
    """
    task = picture.of_trial(picture.task)
    verdict = picture.of_trial(picture.verdict)
    plan = picture.plan
    holds = holds_of(picture)
    fresh = freshness(picture, now_s)
    log_words, log_fine = _log(picture)
    return View(
        live=fresh.live,
        live_words=fresh.words,
        trial=picture.trial,
        headline=_headline(picture, fresh),
        outcome=_outcome(task.outcome, task.reason) if task is not None else "",
        force=_force(verdict, held=bool(holds)) if verdict is not None else None,
        visibility=_visibility(picture, verdict) if verdict is not None else None,
        holds=holds,
        hold_words=[_hold(holder, reason) for holder, reason in holds.items()],
        held_here=HOLDER in holds,
        stop=StopView(state=stop.state, words=stop.in_words(now_s)),
        # What waits in a recording was decided on long ago.
        waiting_plan="" if picture.is_replay else _waiting_plan(task),
        decisions=_decisions(task),
        plans=[
            PlanSection(
                title=one.title,
                reason=one.reason,
                rows=[(row.text, row.state, row.note) for row in one.rows],
            )
            for one in timetable(picture)
        ],
        why=why(plan) if plan is not None else [],
        changes=latest_changes(picture),
        situation=_situation(picture),
        services=_lights(picture, now_s),
        log=log_words,
        log_fine=log_fine,
        question=_question(picture),
        answer=[sentence(plain(one)) for one in picture.answer.sentences] if picture.answer else [],
        replay=_replay(picture),
    )


def holds_of(picture: Picture) -> dict[str, str]:
    """Return who holds the arms, and why, by what motion last said of it."""
    robot, holds = picture.robot, picture.holds
    if holds is not None and (robot is None or holds.at_s >= robot.at_s):
        return dict(holds.message.holds)
    return dict(robot.message.holds) if robot is not None else {}


def _hold(holder: str, reason: str) -> str:
    return sentence(hold_in_words(holder, "" if reason == REASON else reason))


def _headline(picture: Picture, fresh: Freshness) -> str:
    task = picture.of_trial(picture.task)
    if task is None:
        return "No procedure is under way" if fresh.live else "Waiting"
    if holds_of(picture) and task.phase not in ("idle", "ended"):
        return "The arms are held"
    return phase_in_words(task.phase, task.action)


def _outcome(outcome: str, reason: str) -> str:
    if not outcome:
        return ""
    told = OUTCOMES[outcome]
    return (
        told
        if outcome == "success" or not reason
        else (f"{told} {sentence(reason_in_words(reason))}")
    )


def _waiting_plan(task: TaskStatus | None) -> str:
    """Return the plan that nothing is done of before somebody has approved it."""
    return task.plan if task is not None and task.phase == "awaiting_approval" else ""


def _decisions(task: TaskStatus | None) -> list[str]:
    told: list[str] = []
    for number, one in enumerate(task.decisions if task is not None else (), start=1):
        if one.approved:
            told.append(f"Decision {number}: approved.")
        else:
            without = ", ".join(plain(name) for name in one.excluded)
            rest = f" Not used any more: {without}." if without else ""
            told.append(f"Decision {number}: rejected. {sentence(plain(one.reason))}{rest}")
    return told


def _force(verdict: Verdict, *, held: bool) -> Force:
    words = {
        "ok": f"{verdict.max_force_n:.2f} N, limit {verdict.limit_n:.2f} N",
        "soft": f"{verdict.max_force_n:.2f} N, above the limit of {verdict.limit_n:.2f} N",
        "hard": (
            f"{verdict.max_force_n:.2f} N, above the hard limit of {verdict.hard_limit_n:.2f} N"
        ),
        "invalid": "the tissue model has no valid solution",
    }[verdict.level]
    # What stands still crosses nothing.
    if verdict.level == "ok" and verdict.crossing_tick > verdict.tick and not held:
        words += ", expected to cross it soon"
    return Force(
        value_n=verdict.max_force_n,
        limit_n=verdict.limit_n,
        hard_limit_n=verdict.hard_limit_n,
        level=verdict.level,
        words=words,
    )


def _visibility(picture: Picture, verdict: Verdict) -> Visibility:
    context = picture.of_trial(picture.context)
    evidence = context.evidence.get("visible_roi", {}) if context is not None else {}
    threshold = evidence.get("threshold_fraction")
    needed = f", more than {percent(threshold)} is needed" if threshold is not None else ""
    state = "exposed" if verdict.visible else "not exposed"
    return Visibility(
        share=verdict.visibility,
        threshold=threshold,
        visible=verdict.visible,
        words=f"{state}: {percent(verdict.visibility)} lifted clear{needed}",
    )


def course_of(picture: Picture) -> Course:
    """Lay out the plots."""
    samples = picture.trace.samples if picture.trace.trial == picture.trial else ()
    dt_s = picture.dt_s
    return Course(
        at_s=[round(one.tick * dt_s, 3) for one in samples],
        force_n=[round(one.force_n, 4) for one in samples],
        visibility=[round(one.visibility, 4) for one in samples],
    )


def _situation(picture: Picture) -> list[Fact]:
    context = picture.of_trial(picture.context)
    if context is None:
        return []
    # What an instrument can reach is drawn, and what lies over an attachment is much.
    told = [one for one in context.fluents if not one.startswith(("reachable(", "fixed("))]
    fixed = [one for one in context.fluents if one.startswith("fixed(")]
    facts = [Fact(text=fluent_in_words(one), evidence=_evidence(context, one)) for one in told]
    if fixed:
        points = [point(one[len("fixed(") : -1]) for one in fixed]
        text = f"{len(fixed)} of {len(context.names)} points lie over an attachment"
        facts.append(Fact(text=text, evidence=[", ".join(points)]))
    return facts


def _evidence(context: Context, atom: str) -> list[str]:
    known = context.evidence.get(atom, {})
    return [evidence_in_words(name, value) for name, value in known.items() if name != "holds"]


def _lights(picture: Picture, now_s: float) -> list[Light]:
    # What a recording says of its services is how they were.
    judged = [life_of(picture, "replay", now_s)] if picture.is_replay else lives(picture, now_s)
    return [
        Light(name=service_in_words(one.name), life=one.life, words=one.words) for one in judged
    ]


def _log(picture: Picture) -> tuple[str, bool]:
    if picture.is_replay:
        return "This is a recording.", True
    heard = picture.log
    if heard is None:
        return "Nothing is known of a recording.", False
    status = heard.message
    lost = f" Parts of it are missing ({status.lost})." if status.lost else ""
    match status.state:
        case "recording":
            return f"Recording.{lost}", status.lost == 0
        case "behind":
            return f"The recording is behind; the arms wait.{lost}", False
        case "closed":
            closed = "The recording is closed"
            return f"{closed}.{lost}" if lost else f"{closed} and complete.", status.lost == 0
        case "error":
            return f"Not recording: {plain(status.reason)}.", False
        case "idle":
            return "Nothing is being recorded.", True


def _question(picture: Picture) -> str:
    answer = picture.answer
    return f"Why not {point(answer.question)}?" if answer is not None else ""


def _replay(picture: Picture) -> ReplayView | None:
    heard = picture.replay
    if heard is None:
        return None
    status = heard.message
    return ReplayView(
        phase=status.phase,
        position_s=round(status.position_s, 2),
        begin_s=status.begin_s,
        end_s=status.end_s,
        rate=status.rate,
        log=status.log,
        damage=status.damage,
        marks=[(one.position_s, one.kind, plain(one.text)) for one in status.marks],
    )
