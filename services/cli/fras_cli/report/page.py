"""`report.html`: one self-contained page on one trial."""

from dataclasses import dataclass
from datetime import UTC, datetime
from typing import Any

from jinja2 import Environment, PackageLoader, StrictUndefined
from markupsafe import Markup
from msgspec import UnsetType

from fras_cli.report.figures import (
    course_figure,
    make_stage,
    timeline_figure,
    tissue_figure,
    to_svg,
)
from fras_cli.report.story import PlanStory, tell
from fras_cli.report.summary import Summary, to_json
from fras_cli.report.trial import Trial
from fras_cli.report.wording import (
    changes,
    details_in_words,
    end_in_words,
    outcome_in_words,
    plan_reason,
    plan_title,
    reason_in_words,
    specifications_in_words,
)
from fras_log import PublicKey

TEMPLATE = "template.html.j2"


@dataclass(frozen=True)
class FigureBlock:
    """A figure with what it shows in words, for those who can't see it."""

    svg: Markup
    caption: str


def render_page(trial: Trial, summary: Summary) -> str:
    """Render the page.

    Parameters
    ----------
    trial : Trial
    summary : Summary
        Of the same trial.

    Returns
    -------
    str
        HTML that asks no other host for anything.
    """
    stories = tell(trial)
    environment = Environment(
        loader=PackageLoader("fras_cli.report", "."),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    return environment.get_template(TEMPLATE).render(
        trial=trial,
        summary=summary,
        headline=outcome_in_words(summary),
        details=details_in_words(summary, trial.scenario.awareness.visible_fraction),
        began=_began(trial),
        figures=_figures(trial, stories),
        numbers=_numbers(trial, summary),
        plans=[
            _plan(story, stories[index - 1] if index else None)
            for index, story in enumerate(stories)
        ],
        summary_json=to_json(summary).decode(),
    )


def _began(trial: Trial) -> str:
    if not trial.first_ns:
        return "at an unknown time"
    return datetime.fromtimestamp(trial.first_ns / 1e9, tz=UTC).strftime("%Y-%m-%d %H:%M:%S UTC")


def _figures(trial: Trial, stories: tuple[PlanStory, ...]) -> list[FigureBlock]:
    blocks: list[FigureBlock] = []
    stage = make_stage(trial)
    if stage is not None:
        caption = (
            "The tissue, coloured by the elastic force of its nodes (the line in the scale is the "
            "limit). Dots: attachment points under the tissue. Ring: the region of interest (ROI) "
            "under the tissue, drawn through it; tissue inside the ring hides it."
        )
        blocks.append(FigureBlock(Markup(to_svg(tissue_figure(stage), "tissue")), caption))
    if trial.verdicts:
        caption = (
            "Force against its limits, and visibility of the region of interest against what is "
            "needed. Bands: actions. Dotted: re-plans; simulated time stands still meanwhile."
        )
        if trial.patient:
            caption += (
                " Dark: the force that the model says, by which the trial goes. Violet: what the "
                "patient bears in truth, filled where that is above the limit and the model says "
                "that it is not. The pictures of the tissue show the model."
            )
        blocks.append(FigureBlock(Markup(to_svg(course_figure(trial, stories), "course")), caption))
    if stories:
        caption = "The plans, one a row, with what became of their actions."
        blocks.append(
            FigureBlock(Markup(to_svg(timeline_figure(trial, stories), "timeline")), caption)
        )
    return blocks


def _numbers(trial: Trial, summary: Summary) -> list[tuple[str, str]]:
    """Rows of the table of the first screen: what, and how much."""
    needed = trial.scenario.awareness.visible_fraction
    tick, fe = summary.tick_ms, summary.fe_ms
    rows = [
        ("Outcome", f"{summary.outcome}: {reason_in_words(summary.reason)}"),
        (
            "Scenario",
            f"{trial.scenario.name}, seed {summary.seed}, kind {_or(summary.scenario_kind)}",
        ),
        ("Visibility", f"{_or(summary.visibility, '.1%')} (needed: more than {needed:.0%})"),
        ("Largest force", f"{_or(summary.max_force_n, '.3f', ' N')} (limit {summary.limit_n:g} N)"),
        ("Ticks above the limit", f"{summary.ticks_above_limit} of {summary.ticks}"),
        *_patient_rows(summary),
        ("Safety specifications", specifications_in_words(summary)),
        ("Plans", f"{summary.plans}, of them {summary.replans} re-plans"),
        ("Simulated time", f"{summary.sim_s:.2f} s"),
        ("Wall time", f"{summary.wall_s:.2f} s"),
        ("Command to first tick", _or(summary.startup_s, ".2f", " s")),
        ("A tick, p50 / p99", f"{tick.p50:.2f} / {tick.p99:.2f} ms" if tick else "unknown"),
        ("Its FE step, p50 / p99", f"{fe.p50:.2f} / {fe.p99:.2f} ms" if fe else "unknown"),
        ("Messages", f"{summary.messages} recorded, {summary.lost} lost"),
    ]
    rows += [
        ("Head of the log", summary.head or "none: it was never closed"),
        ("Signed with key", _signed_by(trial)),
    ]
    if trial.malformed:
        rows.append(("Malformed messages", str(trial.malformed)))
    return rows


def _patient_rows(summary: Summary) -> list[tuple[str, str]]:
    patient = summary.patient
    if isinstance(patient, UnsetType):
        return []
    return [
        ("Largest force that the patient bore", f"{patient.max_force_n:.3f} N"),
        (
            "Its ticks above the limit",
            f"{patient.ticks_above_limit}, missed by the model {patient.missed}, "
            f"needless alarms {patient.needless}",
        ),
    ]


def _signed_by(trial: Trial) -> str:
    """Name the key that the log says it is signed with; only verification tells whether it is."""
    try:
        raw = bytes.fromhex(trial.metadata.get("public_key", ""))
    except ValueError:
        return "unknown"
    return f"{PublicKey(raw).fingerprint} (see fras log verify)" if raw else "none"


def _or(value: float | str | None, spec: str = "", unit: str = "") -> str:
    return "unknown" if value is None else f"{value:{spec}}{unit}"


def _plan(story: PlanStory, before: PlanStory | None) -> dict[str, Any]:
    """Collect what the template needs to know of one plan."""
    plan = story.plan
    return {
        "title": plan_title(story),
        "at_s": story.at_s,
        "kind": story.kind,
        "reason": plan_reason(story),
        "changes": changes(before, story) if before else [],
        "sentences": plan.no_plan.sentences if plan.no_plan else plan.explanation,
        "core": plan.no_plan.core if plan.no_plan else [],
        "criterion": plan.criterion,
        "solved_ms": 1e3 * (plan.ground_s + plan.solve_s),
        "actions": [
            {
                "text": action.text,
                "end": action.end,
                "words": end_in_words(action),
                "begin_s": action.begin_s if action.goal_id else None,
                "spent_s": action.end_s - action.begin_s,
            }
            for action in story.actions
        ],
    }
