"""Force and visibility against simulated time, with the actions as bands behind them."""

# pyright: reportUnknownMemberType=false
# matplotlib does not type its **kwargs.

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from fras_cli.report.figures.style import (
    FAINT,
    FORCE,
    INK,
    LIMIT,
    PATIENT,
    VISIBILITY,
    colour_of,
    drawing,
    open_frame,
)
from fras_cli.report.story import PlanStory
from fras_cli.report.trial import Trial

# Of the axis: a narrower band has no room for a horizontal word.
NARROW = 0.07


def course_figure(trial: Trial, stories: Sequence[PlanStory]) -> Figure:
    """Force above, visibility below, on one time axis."""
    with drawing():
        figure = Figure(figsize=(8.4, 4.9), layout="constrained")
        force, visibility = figure.subplots(2, 1, sharex=True, height_ratios=[3, 2])
        draw_force(force, trial, stories)
        draw_visibility(visibility, trial, stories)
        visibility.set_xlabel("simulated time [s]")
    return figure


def draw_force(
    axes: Axes, trial: Trial, stories: Sequence[PlanStory], narrow: float = NARROW
) -> None:
    """Force by the scenario's metric, with its limits; actions named, re-plans marked."""
    awareness = trial.scenario.awareness
    soft_n = awareness.force_limit_n
    hard_n = 2.0 * soft_n if awareness.hard_limit_n is None else awareness.hard_limit_n
    time_s = np.array([verdict.tick * trial.dt_s for verdict in trial.verdicts])
    force_n = np.array([verdict.max_force_n for verdict in trial.verdicts])
    borne_n = np.array([force for _, force in trial.borne])
    peak_n = float(np.nanmax([*force_n, *borne_n, 0.0]))
    top_n = 1.12 * max(peak_n, hard_n)
    _frame(axes, trial, stories)
    _name_actions(axes, stories, narrow_s=narrow * _end_s(trial))
    off = ", switched off" if awareness.no_limit else ""
    axes.axhline(soft_n, color=LIMIT, lw=1.2, ls=(0, (5, 2)), zorder=3)
    _note(axes, soft_n, f"limit {soft_n:g} N{off}")
    axes.axhline(hard_n, color=LIMIT, lw=1.2, zorder=3)
    _note(axes, hard_n, f"hard limit {hard_n:g} N{off}")
    axes.fill_between(
        time_s, force_n, soft_n, where=force_n > soft_n, color=LIMIT, alpha=0.35, lw=0
    )
    axes.plot(time_s, force_n, color=FORCE, lw=1.4, zorder=4)
    if trial.patient:
        _draw_patient(axes, trial, soft_n)
    _mark_replans(axes, stories, named=True)
    axes.set_ylim(0.0, top_n)
    metric = "tool force" if awareness.force_metric == "tool" else "largest nodal force"
    axes.set_ylabel(f"{metric} [N]")


def _draw_patient(axes: Axes, trial: Trial, soft_n: float) -> None:
    """Draw what the patient bears in truth, filled where that is above the limit and missed."""
    believed_n = {verdict.tick: verdict.max_force_n for verdict in trial.verdicts}
    time_s = np.array([tick * trial.dt_s for tick, _ in trial.borne])
    borne_n = np.array([force for _, force in trial.borne])
    missed = np.array(
        [force > soft_n >= believed_n.get(tick, -1.0) >= 0.0 for tick, force in trial.borne]
    )
    axes.fill_between(time_s, borne_n, soft_n, where=missed, color=PATIENT, alpha=0.35, lw=0)
    axes.plot(time_s, borne_n, color=PATIENT, lw=1.4, zorder=5, label="patient, in truth")
    axes.plot([], [], color=FORCE, lw=1.4, label="model, believed")
    axes.legend(loc="upper left", bbox_to_anchor=(0.0, 1.0), fontsize=7.5)


def draw_visibility(axes: Axes, trial: Trial, stories: Sequence[PlanStory]) -> None:
    """Share of the tissue around the region of interest that is lifted clear of it."""
    needed = 100.0 * trial.scenario.awareness.visible_fraction
    time_s = np.array([verdict.tick * trial.dt_s for verdict in trial.verdicts])
    percent = np.array([100.0 * verdict.visibility for verdict in trial.verdicts])
    _frame(axes, trial, stories)
    axes.axhline(needed, color=FAINT, lw=1.2, ls=(0, (5, 2)), zorder=3)
    _note(axes, needed, f"visible above {needed:g} %", colour=INK)
    axes.plot(time_s, percent, color=VISIBILITY, lw=1.6, zorder=4)
    _mark_replans(axes, stories, named=False)
    axes.set_ylim(0.0, 105.0)
    axes.set_yticks([0, 25, 50, 75, 100])
    axes.set_ylabel("visibility of ROI [%]")


def _end_s(trial: Trial) -> float:
    last = max((verdict.tick for verdict in trial.verdicts), default=0)
    return max(last, 1) * trial.dt_s


def _frame(axes: Axes, trial: Trial, stories: Sequence[PlanStory]) -> None:
    open_frame(axes)
    # A little room, or a peak in the last tick would be cut by the frame.
    axes.set_xlim(0.0, 1.01 * _end_s(trial))
    for story in stories:
        for action in story.actions:
            if action.end_s > action.begin_s:
                colour = colour_of(action.name)
                axes.axvspan(action.begin_s, action.end_s, color=colour, alpha=0.20, lw=0)


def _name_actions(axes: Axes, stories: Sequence[PlanStory], narrow_s: float) -> None:
    place = axes.get_xaxis_transform()
    actions = [
        action for story in stories for action in story.actions if action.end_s > action.begin_s
    ]
    upright = any(action.end_s - action.begin_s < narrow_s for action in actions)
    for action in actions:
        axes.text(
            (action.begin_s + action.end_s) / 2,
            1.02,
            action.name,
            transform=place,
            ha="center",
            va="bottom",
            rotation=90 if upright else 0,
        )


def _mark_replans(axes: Axes, stories: Sequence[PlanStory], *, named: bool) -> None:
    for story in stories:
        if story.kind == "re-plan":
            axes.axvline(story.at_s, color=INK, lw=0.9, ls=":", zorder=2)
            if not named:
                continue
            axes.annotate(
                f"re-plan {story.replan}",
                (story.at_s, 0.86),
                xycoords=axes.get_xaxis_transform(),
                xytext=(-3, 0),
                textcoords="offset points",
                ha="right",
                va="top",
                rotation=90,
                fontsize=7.5,
                zorder=5,
            )


def _note(axes: Axes, height: float, text: str, colour: str = LIMIT) -> None:
    """Name a horizontal line at its left end, where curves are low."""
    axes.annotate(
        text,
        (0.0, height),
        xycoords=axes.get_yaxis_transform(),
        xytext=(4, 2.5),
        textcoords="offset points",
        color=colour,
        fontsize=7.5,
        zorder=5,
    )
