"""Which benchmarks `fras bench all` runs, how small, and what of their figures it tells."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Final

from benchmarks.fe import RATIOS, TARGETS
from benchmarks.fe_mesh import TO_REACH
from benchmarks.log import EXPORT_S

Figures = Any


@dataclass(frozen=True)
class Row:
    """One line of the table; `met`: whether the figure is good enough, if that is set."""

    what: str
    figure: str
    goal: str = ""
    met: bool | None = None


@dataclass(frozen=True)
class Job:
    """One benchmark.

    Attributes
    ----------
    arguments : tuple of str
        `{out}` stands for the folder, in which `<name>.json` is looked for.
    rows : callable
        Makes the table's lines of what stands in that file.
    """

    name: str
    module: str
    arguments: tuple[str, ...]
    rows: Callable[[Figures], list[Row]]


def at_most(what: str, value: float, most: float, unit: str) -> Row:
    """Hold a figure against the most that it may be."""
    return Row(f"{what} [{unit}]" if unit else what, f"{value:.3g}", f"{most:g}", value <= most)


def at_least(what: str, value: float, least: float) -> Row:
    """Hold a figure against the least that it has to be."""
    return Row(what, f"{value:.3g}", f"at least {least:g}", value >= least)


def judged(figures: Figures) -> list[Row]:
    """Take over what a benchmark has held against its targets itself."""
    return [Row(one["what"], str(one["value"]), "", bool(one["met"])) for one in figures["targets"]]


def _motion(figures: Figures) -> list[Row]:
    # How many are drawn is no figure: few, to be brief.
    return [row for row in judged(figures) if "random motions" not in row.what]


def _awareness(figures: Figures) -> list[Row]:
    return [
        Row(one["what"], f"{one['value']:.3g} {one['unit']}", f"{one['at_most']:g}", one["met"])
        for one in figures["targets"]
    ]


def _loop(figures: Figures) -> list[Row]:
    overhead = figures["overhead_ms"]
    return [
        at_most("a tick above its finite elements, p50", overhead["p50"], 1.5, "ms"),
        at_most("... p99", overhead["p99"], 4.0, "ms"),
        at_most("... p50 over that of three raw Zenoh hops", figures["ratio_p50"], 2.0, ""),
        at_most("start-up, command to first tick", figures["startup_s"], 3.0, "s"),
        at_least("simulated time over wall time", figures["simulated_over_wall"], 2.0),
    ]


def _fe(figures: Figures) -> list[Row]:
    rows: list[Row] = []
    for mesh, methods in figures["meshes"].items():
        ours = methods["auto"]
        rows.append(at_least(f"{mesh}: times real time", ours["real_time_factor"], TARGETS[mesh]))
        for peer, least in RATIOS.items():
            if "times_fras" in methods.get(peer, {}):
                text = f"{mesh}: {peer}, times the time of FRAS"
                rows.append(at_least(text, methods[peer]["times_fras"], least))
    return rows


def _mesh(figures: Figures) -> list[Row]:
    worst = max(abs(one["off"]) for scene in figures.values() for one in scene["21x25x3"].values())
    return [
        at_most("force on 21x25x3 against 41x49x3, worst", 100.0 * worst, 100.0 * TO_REACH, "%")
    ]


def _criteria(figures: Figures) -> list[Row]:
    return [
        Row(
            f"`{name}`: grasps beside an attachment, from the region of interest",
            f"{one['beside_an_attachment']:.0%}, {one['to_the_roi_mm']:.0f} mm",
        )
        for name, one in figures.items()
    ]


def _recorder(figures: Figures) -> list[Row]:
    return [
        *(Row(what, "", "", met) for what, met in figures["targets"].items()),
        Row("memory to verify a log [MiB]", f"{figures['verify_peak_mib']:.3g}"),
    ]


def _log(figures: Figures) -> list[Row]:
    rows: list[Row] = []
    for name, one in figures["scenarios"].items():
        rows += [
            at_most(f"{name}: audit over the trial's time", one["audit"] / one["trial"], 1.0, ""),
            at_most(f"{name}: export to Foxglove", one["foxglove"], EXPORT_S, "s"),
            at_most(f"{name}: export to Rerun", one["rerun"], EXPORT_S, "s"),
        ]
    return rows


def _replay(figures: Figures) -> list[Row]:
    fastest = max(row["fast_messages_s"] for row in figures["runs"])
    late_ms, most_ms = figures["median_p99_ms"], figures["target_p99_ms"]
    return [
        at_most("a message late at rate 1, median of the p99", late_ms, most_ms, "ms"),
        Row("messages a second as fast as possible", f"{fastest:,}"),
    ]


def _secure(figures: Figures) -> list[Row]:
    return [at_most("a tick over one without", figures["tick_ratio_p50"], figures["target"], "")]


def _page(figures: Figures) -> list[Row]:
    return [
        at_most("press of STOP to arms at rest, p99", figures["at_rest_ms"]["p99"], 100.0, "ms"),
        at_most("page opened to tissue drawn, p50", figures["first_picture_s"]["p50"], 2.0, "s"),
        # Fewer than 20 pairs tell nothing of a few per cent, and take ten minutes.
    ]


def _start(figures: Figures) -> list[Row]:
    ready_s = sorted(figures["ready_s"])
    return [
        at_most("all processes ready, median", ready_s[len(ready_s) // 2], 3.0, "s"),
        Row("processor time until then [s]", f"{figures['processor_s']:.3g}"),
    ]


def _soak(figures: Figures) -> list[Row]:
    # So few trials do not fill the caches: what memory does is told, and judged over 200.
    memory = [one for one in figures["judged"] if one["quantity"] == "memory_mib"]
    others = [one for one in figures["judged"] if one["quantity"] != "memory_mib"]
    uneven = [f"{one['process']} {one['quantity']}" for one in others if not one["flat"]]
    what = f"descriptors, threads and files over {figures['trials']} trials"
    most = max(memory, key=lambda one: one["slope"])
    return [
        Row(what, ", ".join(uneven) or "flat", "flat", not uneven),
        Row("memory, the largest rise a trial [MiB]", f"{most['slope']:.2f}, of {most['process']}"),
    ]


def _hosts(figures: Figures) -> list[Row]:
    return [
        Row(
            f"a tick over two hosts, {one['rtt_ms']:g} ms apart, p50 [ms]",
            f"{one['tick_p50_ms']:.3g}",
        )
        for one in figures["rows"]
    ]


_JSON: Final = ("--json", "{out}/{name}.json")
_OUT: Final = ("--out", "{out}")

JOBS: Final[tuple[Job, ...]] = (
    Job("loop", "benchmarks.loop", ("--trials", "4", *_JSON), _loop),
    Job("start", "benchmarks.start", ("--runs", "3", *_JSON), _start),
    Job(
        "fe",
        "benchmarks.fe",
        ("--meshes", "11x13x2", "21x25x2", "--budget", "8", *_OUT),
        _fe,
    ),
    Job("mesh", "benchmarks.fe_mesh", _JSON, _mesh),
    Job(
        "planner",
        "benchmarks.planner",
        ("--sizes", "7", "10", "--repeats", "1", "--replans", "1000", *_OUT),
        judged,
    ),
    Job("criteria", "benchmarks.criteria", ("--scenes", "100", *_OUT), _criteria),
    Job(
        "awareness", "benchmarks.awareness", ("--pulls", "12", "--calls", "300", *_OUT), _awareness
    ),
    Job(
        "motion",
        "benchmarks.motion",
        ("--motions", "100", "--ticks", "1500", "--stops", "50", *_OUT),
        _motion,
    ),
    Job(
        "recorder",
        "benchmarks.recorder",
        ("--rounds", "2", "--small", "20000", "--states", "1500", "--seconds", "2", *_JSON),
        _recorder,
    ),
    Job("log", "benchmarks.log", ("--runs", "1", "--scenarios", "default", *_JSON), _log),
    Job("replay", "benchmarks.replay", ("--runs", "2", *_JSON), _replay),
    Job("secure", "benchmarks.secure", ("--trials", "4", *_JSON), _secure),
    Job(
        "page",
        "benchmarks.page",
        ("--pairs", "0", "--paced-pairs", "0", "--stops", "25", "--opens", "10", *_JSON),
        _page,
    ),
    Job("soak", "benchmarks.soak", ("--trials", "24", "--mesh", "11,13,2", *_JSON), _soak),
    Job("hosts", "benchmarks.hosts", ("--rtt", "0", "10", *_JSON), _hosts),
)
