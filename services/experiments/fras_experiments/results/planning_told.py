"""Planning times in words and tables, beside the paper's Table I."""

from collections.abc import Callable, Iterator, Sequence
from typing import Final

import numpy as np
from numpy.typing import NDArray

from fras_experiments.results import paper, words
from fras_experiments.results.paper import Stated
from fras_experiments.results.planning import Cell, Planning, paper_growth
from fras_experiments.results.statistics import Growth, bootstrap_interval, describe

OURS: Final = ("median [95 %]", "mean ± sd", "highest")
HOW: Final = {
    True: "from the stamp of SA's context to that of the plan, both as they lie in the log: the "
    "context's way through the stack, grounding and solving, and making the message",
    False: "grounding and solving alone, as this campaign's timing.csv has no other",
}
SOLVER: Final = "grounding and solving: median"
REPLAN_F: Final = 0.5


def planning_lines(planning: Planning) -> Iterator[str]:
    """Write the tables of planning times by N and by f, and of re-planning."""
    yield "## Planning time"
    yield ""
    yield from _first_by_size(planning)
    yield (
        f"Ours is {HOW[planning.through_service]}. The paper's is clingo's time, on a 2.6 GHz "
        "Core i7. The machines differ, so that the ratio is an order of magnitude."
    )
    yield ""
    theirs = paper_growth()
    if planning.growth is None:
        yield "Fewer than 3 sizes N: no growth can be told."
    else:
        yield (
            f"Growth with N: {growth_words(planning.growth)}. The paper's Table I: "
            f"{growth_words(theirs)}."
        )
        if planning.through_service and planning.solver_growth is not None:
            yield f"Of grounding and solving alone: {growth_words(planning.solver_growth)}."
    yield ""
    if len(planning.by_fraction) > 1:
        yield from _first_by_fraction(planning.by_fraction)
    if planning.move or planning.release:
        yield from _anew(planning)


def _first_by_size(planning: Planning) -> Iterator[str]:
    rows = list[tuple[str, ...]]()
    for n, times in planning.first_s.items():
        ours, theirs = describe(1e3 * times, seed=0), paper.plan_s(n)
        rows.append(
            (
                *(str(n), str(ours.n), *_ours(times)),
                *((_solver(planning, n),) if planning.through_service else ()),
                words.NONE if theirs is None else words.number(1e3 * theirs, 0),
                words.NONE if theirs is None else words.number(1e3 * theirs / ours.median, 0),
            )
        )
    head = ("N", "n", f"first plan [ms]: {OURS[0]}", *OURS[1:])
    head += (SOLVER,) if planning.through_service else ()
    yield from words.table((*head, "paper's mean [ms]", "paper / our median"), rows)


def _solver(planning: Planning, n: int) -> str:
    times = planning.solver_s.get(n)
    return words.NONE if times is None else words.number(1e3 * float(np.median(times)))


def _first_by_fraction(cells: Sequence[Cell]) -> Iterator[str]:
    yield "### First plans by N and f"
    yield ""
    yield "f is the share of the tissue that is attached; the paper's are of Table I, 25 a cell."
    yield ""

    def stated(n: int, fraction: float) -> Stated | None:
        return paper.plan_at(n, fraction)

    yield from _beside(cells, stated, "first plan")
    yield from _growths("f = {f:.0f} %", cells, lambda f: lambda n: _mean(paper.plan_at(n, f)))


def _anew(planning: Planning) -> Iterator[str]:
    yield "### Re-planning"
    yield ""
    yield (
        "B: the first later plan of a trial that keeps the grasp. C: the first that releases it. "
        "A trial that did both is in both, and all are told alike whether their first plan heeded "
        "attachments or not: later plans always do. The paper's are of "
        f"f = {100 * REPLAN_F:.0f} %, 100 a cell."
    )
    yield ""
    for kind, cells, table in (
        ("B", planning.move, paper.REPLAN_B_S),
        ("C", planning.release, paper.REPLAN_C_S),
    ):
        if not cells:
            yield f"No trial has re-planned as in scenario {kind}."
            yield ""
            continue

        def stated(n: int, fraction: float, table: dict[int, Stated] = table) -> Stated | None:
            return table.get(n) if abs(fraction - REPLAN_F) < 1e-6 else None

        yield from _beside(cells, stated, f"re-planning {kind}")
        yield from _growths(
            f"{kind}, f = {{f:.0f}} %",
            cells,
            lambda f, stated=stated: lambda n: _mean(stated(n, f)),
        )


def _beside(
    cells: Sequence[Cell], stated: Callable[[int, float], Stated | None], what: str
) -> Iterator[str]:
    """Write one row a size and fraction."""
    rows = list[tuple[str, ...]]()
    for n in sorted({n for cell in cells for n in cell.times_s}):
        for cell in cells:
            times = cell.times_s.get(n)
            if times is None:
                continue
            theirs = stated(n, cell.fraction)
            ratio = None if theirs is None else theirs.mean / float(np.median(times))
            rows.append(
                (
                    *(str(n), f"{100 * cell.fraction:g}", str(times.size), *_ours(times)),
                    words.NONE if theirs is None else _stated(theirs),
                    words.NONE if ratio is None else words.number(ratio, 0),
                )
            )
    head = ("N", "f [%]", "n", f"{what} [ms]: {OURS[0]}", *OURS[1:])
    yield from words.table((*head, "paper [ms]: mean ± sd", "paper / our median"), rows)


def _growths(
    label: str,
    cells: Sequence[Cell],
    theirs: Callable[[float], Callable[[int], float | None]],
) -> Iterator[str]:
    for cell in cells:
        if cell.growth is None:
            continue
        mean_s = theirs(cell.fraction)
        text = f"- {label.format(f=100 * cell.fraction)}: {growth_words(cell.growth)}"
        known = all(mean_s(n) is not None for n in paper.PLAN_S)
        yield f"{text}; the paper's {growth_words(paper_growth(mean_s))}" if known else text
    yield ""


def _ours(times_s: NDArray[np.float64]) -> tuple[str, str, str]:
    ours = describe(1e3 * times_s, seed=0)
    of_median = bootstrap_interval(1e3 * times_s, np.median, seed=0)
    return (
        f"{words.number(ours.median)} {words.interval(of_median)}",
        f"{words.number(ours.mean)} ± {words.number(ours.sd)}",
        words.number(ours.highest),
    )


def _mean(stated: Stated | None) -> float | None:
    return None if stated is None else stated.mean


def _stated(stated: Stated) -> str:
    sd = words.NONE if stated.sd is None else words.number(1e3 * stated.sd, 0)
    return f"{words.number(1e3 * stated.mean, 0)} ± {sd}"


def growth_words(fit: Growth) -> str:
    """Tell a power law in words."""
    ci = words.interval(fit.ci)
    return f"t ∝ N^{fit.exponent:.2f}{' ' + ci if ci else ''}, R² = {fit.r_squared:.3f}"
