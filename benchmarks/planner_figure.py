"""The tables, targets and figure of `benchmarks.planner`, beside the paper's numbers."""

# matplotlib ships no complete types.
# pyright: reportUnknownMemberType=false

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

CELLS = ("A 10%", "A 30%", "A 50%", "A 70%", "B 50%", "C 50%")
# Table I of the paper, mean and standard deviation in seconds, by N and in the order of CELLS
# (clingo on a 2.6 GHz Intel i7 with 16 GB; 25 scenes a cell, 100 for B and C).
PAPER_S: dict[int, tuple[tuple[float, float], ...]] = {
    5: ((0.25, 0.02), (0.24, 0.02), (0.23, 0.01), (0.24, 0.01), (0.12, 0.04), (0.32, 0.02)),
    6: ((0.68, 0.02), (0.65, 0.02), (0.63, 0.01), (0.62, 0.01), (0.32, 0.09), (1.01, 0.10)),
    7: ((1.50, 0.02), (1.48, 0.03), (1.41, 0.02), (1.42, 0.01), (0.72, 0.19), (1.95, 0.04)),
    8: ((3.06, 0.04), (2.97, 0.06), (2.90, 0.04), (2.88, 0.02), (1.52, 0.49), (4.03, 0.08)),
    9: ((5.88, 0.08), (5.70, 0.15), (5.51, 0.03), (5.51, 0.05), (2.77, 0.60), (7.74, 0.16)),
    10: ((10.75, 0.20), (10.21, 0.28), (9.92, 0.09), (9.87, 0.08), (4.95, 1.05), (16.00, 1.43)),
}
# Fewer sizes than this say nothing about growth.
LEAST_SIZES = 2
MEMORY_TARGET_MIB = 50e6 / 2**20
# Of what is resident; clingo keeps the names that it has seen.
FLAT_SHARE = 0.05
Rows = dict[str, Any]
Points = dict[int, float]


def _number(value: float | str | None) -> str:
    if value is None:
        return "not tried"
    if isinstance(value, str):
        return value
    return f"{value:,.0f}" if value >= 100 else f"{value:.3g}"


def _line(n: int | str, name: str, values: list[float | str | None], mib: float | None) -> str:
    memory = "" if mib is None else f"{mib:.0f}"
    return f"{n:<4}{name:21}" + "".join(f"{_number(v):>10}" for v in values) + f"{memory:>8}"


def _ratios(theirs: Rows, ours: dict[str, float]) -> list[float | str | None]:
    times = [theirs["ms"].get(cell) for cell in CELLS]
    return [
        ms / ours[cell] if isinstance(ms, float) else ""
        for ms, cell in zip(times, CELLS, strict=True)
    ]


def main_table(result: dict[int, Rows], variants: tuple[str, ...], criterion: str) -> str:
    """Table I: the paper, the baseline and FRAS, and how many times FRAS is faster."""
    head = f"{'N':4}{'ms a plan':21}" + "".join(f"{cell:>10}" for cell in CELLS) + f"{'MiB':>8}"
    lines = [head]
    for n, rows in result.items():
        ours = rows[criterion]
        if n in PAPER_S:
            lines.append(_line(n, "paper", [mean * 1e3 for mean, _ in PAPER_S[n]], None))
        for variant in variants:
            theirs: Rows = rows["baseline"].get(variant, {"ms": {}, "mib": None})
            times = [theirs["ms"].get(cell) for cell in CELLS]
            lines.append(_line(n, f"baseline, {variant}", times, theirs["mib"]))
        lines.append(_line(n, "FRAS, cold", [ours["cold_ms"][c] for c in CELLS], ours["mib"]))
        lines.append(_line(n, "FRAS, warm p50", [ours["warm_ms"][c] for c in CELLS], None))
        for variant, theirs in rows["baseline"].items():
            if any(isinstance(ms, float) for ms in theirs["ms"].values()):
                for state in ("cold", "warm"):
                    ratios = _ratios(theirs, ours[f"{state}_ms"])
                    lines.append(_line("", f"  {variant} / {state}, x", ratios, None))
    return "\n".join(lines)


def criteria_table(result: dict[int, Rows], criteria: tuple[str, ...]) -> str:
    """FRAS by criterion: a cold plan and its parts, warm plans in mixed states, and numpy."""
    columns = {
        "cold": "whole_ms",
        "ground": "ground_ms",
        "search": "solve_ms",
        "warm p50": "warm_p50_ms",
        "p99": "warm_p99_ms",
        "untold p50": "warm_plan_p50_ms",
        "search p50": "warm_search_p50_ms",
        "told p50": "told_p50_ms",
        "numpy": "numpy_ms",
        "MiB": "mib",
    }
    lines = [f"{'N':4}{'FRAS, ms':21}" + "".join(f"{title:>11}" for title in columns)]
    for n, rows in result.items():
        for criterion in criteria:
            values = [rows[criterion][name] for name in columns.values()]
            lines.append(f"{n:<4}{criterion:21}" + "".join(f"{_number(v):>11}" for v in values))
    return "\n".join(lines)


def _mean_of_first_plans(times: dict[str, float | str]) -> float | None:
    values = [times.get(cell) for cell in CELLS if cell.startswith("A")]
    numbers = [value for value in values if isinstance(value, float)]
    return sum(numbers) / len(numbers) if len(numbers) == len(values) else None


def _first_plans(rows: Rows, variant: str, ranked_by: str, against: str) -> float | None:
    """How many times longer the baseline's first plans take, all shares of attachments pooled."""
    theirs = _mean_of_first_plans(rows["baseline"].get(variant, {"ms": {}})["ms"])
    ours = _mean_of_first_plans(rows[ranked_by][against])
    return theirs / ours if theirs is not None and ours is not None else None


def targets(
    result: dict[int, Rows],
    flat: Rows,
    reasons: Rows,
    variants: tuple[str, ...],
    criteria: tuple[str, ...],
) -> list[tuple[str, str, bool]]:
    """Return what was to reach, what was reached, and whether that is enough."""
    found: list[tuple[str, str, bool]] = []

    def hold(text: str, value: float | None, enough: Callable[[float], bool], unit: str) -> None:
        if value is None:
            found.append((text, "not measured", False))
        else:
            found.append((text, f"{value:.4g} {unit}", enough(value)))

    if 10 in result:
        for against, least in (("warm_ms", 500), ("cold_ms", 50)):
            for variant in variants:
                text = f"N = 10, {against[:4]}: >= {least} x the baseline's first plans ({variant})"
                ratio = _first_plans(result[10], variant, criteria[0], against)
                hold(text, ratio, lambda value, least=least: value >= least, "x")
    # The plan and, apart from it, the telling: history and reasons.
    limits = (
        (7, "warm_plan_p50_ms", "a warm plan, not told, p50", 2),
        (7, "warm_plan_p99_ms", "a warm plan, not told, p99", 10),
        (7, "warm_p99_ms", "a warm plan told, p99", 10),
        (10, "told_p50_ms", "history and reasons", 20),
        (40, "warm_p50_ms", "a warm plan told, p50", 20),
    )
    for n, name, what, most in limits:
        for criterion in criteria if n in result else ():
            text = f"N = {n}, {criterion}: {what} <= {most} ms"
            value = result[n][criterion][name]
            hold(text, value, lambda value, most=most: value <= most, "ms")
    for criterion in criteria:
        small = [rows[criterion]["mib"] for n, rows in result.items() if n <= 20]
        if small:
            largest = max(n for n in result if n <= 20)
            text = f"up to N = {largest}, {criterion}: <= 50 MB (here MiB, peak growth)"
            hold(text, max(small), lambda value: value <= MEMORY_TARGET_MIB, "MiB")
    # Each plan is told by a Control of its own, and clingo does not give all of one back.
    text = (
        f"N = {flat['n']}: {flat['replans']:,} warm plans grow by less than {FLAT_SHARE:.0%} "
        "more than as many empty Controls"
    )
    grown = flat["growth_mib"] - flat["floor_mib"]
    hold(text, grown, lambda value: value < FLAT_SHARE * flat["before_mib"], "MiB")
    for name, what, most in (
        ("why_not_p50_ms", "why not another", 15),
        ("core_p50_ms", "why no plan, with its minimal core", 10),
        ("verify_ms", f"verify {reasons['verified_steps']:,} steps", 1000),
    ):
        text = f"N = {reasons['n']}: {what} <= {most} ms"
        hold(text, reasons[name], lambda value, most=most: value <= most, "ms")
    return found


def _lines(result: dict[int, Rows], variants: tuple[str, ...], ranked_by: str) -> dict[str, Points]:
    """Mean of the first plans [ms] by size."""
    lines: dict[str, Points] = {
        "paper, 2.6 GHz i7": {
            n: 1e3 * sum(mean for mean, _ in PAPER_S[n][:4]) / 4 for n in result if n in PAPER_S
        }
    }
    for variant in variants:
        lines[f"baseline, {variant}"] = {
            n: ms
            for n, rows in result.items()
            if variant in rows["baseline"]
            and (ms := _mean_of_first_plans(rows["baseline"][variant]["ms"])) is not None
        }
    for state in ("cold", "warm"):
        lines[f"FRAS, {state}"] = {
            n: ms
            for n, rows in result.items()
            if (ms := _mean_of_first_plans(rows[ranked_by][f"{state}_ms"])) is not None
        }
    lines["numpy, block only"] = {n: rows[ranked_by]["numpy_ms"] for n, rows in result.items()}
    return lines


def draw(
    result: dict[int, Rows], variants: tuple[str, ...], criteria: tuple[str, ...], path: Path
) -> dict[str, float]:
    """Write the picture and return the fitted exponents p of time ~ N^p."""
    # Only here: every measuring process imports this file.
    from matplotlib.figure import Figure

    figure = Figure(figsize=(11, 4.8), layout="constrained")
    left, right = figure.subplots(1, 2)
    exponents: dict[str, float] = {}
    for name, points in _lines(result, variants, criteria[0]).items():
        label = name
        if len(points) >= LEAST_SIZES:
            times = np.log(list(points.values()))
            exponents[name] = round(float(np.polyfit(np.log(list(points)), times, 1)[0]), 2)
            label = f"{name}: N^{exponents[name]:.1f}"
        if points:
            left.loglog(list(points), list(points.values()), "o-", label=label, markersize=4)
    left.set_ylim(top=10 * left.get_ylim()[1])  # room for the legend
    left.set(xlabel="N", ylabel="ms a first plan", title=f"time, criterion {criteria[0]}")
    for variant in variants:
        rows = {n: rows["baseline"].get(variant, {}).get("mib") for n, rows in result.items()}
        known = {n: mib for n, mib in rows.items() if mib is not None}
        if known:
            right.loglog(list(known), list(known.values()), "o-", label=f"baseline, {variant}")
    for criterion in criteria:
        memory = [rows[criterion]["mib"] for rows in result.values()]
        right.loglog(list(result), memory, "o-", label=f"FRAS, {criterion}")
    right.axhline(MEMORY_TARGET_MIB, color="0.5", linestyle="--", linewidth=1)
    right.text(min(result), MEMORY_TARGET_MIB * 1.05, "50 MB", color="0.4", fontsize=8)
    right.set(xlabel="N", ylabel="MiB, growth of the peak", title="memory")
    for axes in (left, right):
        axes.set_xticks(list(result), [str(n) for n in result])
        axes.minorticks_off()
        axes.legend(fontsize=8)
    figure.savefig(path, dpi=150)
    return exponents
