"""The plans as rows of blocks on the time axis: what was meant, what was done, what was cut."""

# pyright: reportUnknownMemberType=false
# matplotlib does not type its **kwargs.

from collections.abc import Sequence

from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Patch, Rectangle

from fras_cli.report.figures.style import INK, LIMIT, colour_of, drawing
from fras_cli.report.story import ActionStory, PlanStory
from fras_cli.report.trial import Trial
from fras_cli.report.wording import plan_reason, plan_title

BLOCK = 0.58
# Widths as shares of the time axis: of an action that was never begun, and of a letter.
GHOST = 0.075
LETTER = 0.0088
ROOM_FOR_REASON = 0.5
BROKEN = {"interrupted", "failed", "aborted", "refused"}


def timeline_figure(trial: Trial, stories: Sequence[PlanStory]) -> Figure:
    """One row a plan, the first on top."""
    rows = max(len(stories), 1)
    with drawing():
        figure = Figure(figsize=(8.4, 0.85 + 0.42 * rows), layout="constrained")
        axes = figure.subplots()
        end_s = max((state.tick for state in trial.robot), default=0) * trial.dt_s or trial.dt_s
        reach_s = end_s
        for row, story in enumerate(stories):
            reach_s = max(reach_s, _draw_plan(axes, row, story, end_s))
        axes.set_xlim(-0.005 * end_s, 1.015 * reach_s)
        axes.set_ylim(rows - 0.5, -0.5)
        axes.set_yticks(range(len(stories)), [plan_title(story) for story in stories])
        axes.tick_params(axis="y", length=0)
        axes.spines[["top", "right", "left"]].set_visible(False)
        axes.set_xlabel("simulated time [s]")
        figure.legend(handles=_legend(stories), loc="outside upper right", ncols=8, fontsize=7.5)
    return figure


def _legend(stories: Sequence[PlanStory]) -> list[Patch]:
    names = dict.fromkeys(action.name for story in stories for action in story.actions)
    return [
        *(Patch(facecolor=colour_of(name), alpha=0.75, label=name) for name in names),
        Patch(facecolor="none", edgecolor=LIMIT, lw=1.6, hatch="////", label="cut short"),
        Patch(facecolor="none", edgecolor=INK, lw=0.8, ls=":", label="not begun"),
    ]


def _draw_plan(axes: Axes, row: int, story: PlanStory, end_s: float) -> float:
    """Draw one row and return how far it reaches [s]."""
    if story.kind in {"check", "no plan"}:
        text = "nothing left to do" if story.kind == "check" else "no action can help"
        axes.plot([story.at_s], [row], marker="D", ms=5, color=INK, clip_on=False)
        axes.annotate(
            text,
            (story.at_s, row),
            xytext=(-8, 0) if story.at_s > 0.3 * end_s else (8, 0),
            textcoords="offset points",
            ha="right" if story.at_s > 0.3 * end_s else "left",
            va="center",
        )
        return story.at_s
    at_s = story.at_s
    for action in story.actions:
        spent_s = action.end_s - action.begin_s
        begin_s = max(at_s, action.begin_s)
        width_s = spent_s if spent_s > 0.0 else GHOST * end_s
        _draw_block(axes, row, action, begin_s, width_s, end_s)
        at_s = begin_s + width_s
    if story.number > 1:
        # Beside the row, on the side where there is room.
        left = story.at_s > ROOM_FOR_REASON * end_s
        axes.annotate(
            plan_reason(story),
            (story.at_s if left else at_s, row),
            xytext=(-6 if left else 6, 0),
            textcoords="offset points",
            ha="right" if left else "left",
            va="center",
            style="italic",
            fontsize=7.5,
        )
    return at_s


def _draw_block(
    axes: Axes, row: int, action: ActionStory, begin_s: float, width_s: float, end_s: float
) -> None:
    begun, broken = action.end != "not begun", action.end in BROKEN
    axes.add_patch(
        Rectangle(
            (begin_s, row - BLOCK / 2),
            width_s,
            BLOCK,
            facecolor=colour_of(action.name) if begun else "none",
            alpha=0.75 if begun else None,
            lw=0,
        )
    )
    axes.add_patch(
        Rectangle(
            (begin_s, row - BLOCK / 2),
            width_s,
            BLOCK,
            fill=False,
            edgecolor=LIMIT if broken else INK,
            hatch="////" if broken else None,
            lw=1.6 if broken else 0.8,
            ls="-" if begun else ":",
            zorder=3 if broken else 2,
        )
    )
    room = width_s / end_s / LETTER
    label = next((text for text in _labels(action) if len(text) <= room), "")
    box = {"facecolor": "white", "alpha": 0.8, "lw": 0, "pad": 1.0} if broken else None
    axes.text(
        begin_s + width_s / 2,
        row,
        label,
        ha="center",
        va="center",
        fontsize=7.5,
        bbox=box,
        zorder=4,
    )


def _labels(action: ActionStory) -> list[str]:
    """Return what may stand on the block, the most telling first."""
    return [f"{action.name} {action.block}" if action.block else action.name, action.name]
