"""The tables and targets of `benchmarks.motion`."""

from typing import Any

Raw = dict[str, Any]

DT_MS = 20.0
EXACT = 1e-6
MOTIONS = 1000
# Of limits that a motion uses fully: differences of numbers near 0.1 over 20 ms, three times.
ROUNDING = 1e-9


def tables(report: Raw) -> str:
    """All that was measured, as text."""
    ik, anywhere, ticks, paced = (report[k] for k in ("ik", "anywhere", "ticks", "paced"))
    lines = [f"{'both arms, us':34}{'p50':>10}{'p99':>10}{'max':>10}{'off, m':>12}{'rad':>10}"]
    for name, row in (
        ("inverse kinematics", ik["ours"]),
        (f"damped least squares, {ik['peer']['iterations']:g} steps", ik["peer"]),
    ):
        lines.append(_durations(name, row) + f"{row['off_m']:12.1e}{row['turned_rad']:10.1e}")
    lines.append(f"{'  times ours':34}{ik['ratio_p50']:10.1f}{ik['ratio_p99']:10.1f}")
    lines.append(_durations("a tick of the controller", ticks["advance"]))
    lines.append(_durations("an action accepted", ticks["accept"]))
    lines.append(_durations(f"paced {paced['pace']:g} x: done after due", paced))
    lines.append(_durations("  of the processor's time", paced["worked"]))
    lines.append(
        f"{'  late':34}{paced['late']} of {paced['ticks']:,}, {paced['woken_late']} of them woken "
        "late by the machine"
    )
    lines.append(
        f"{anywhere['poses']:,} poses from anywhere: off {anywhere['off_m']:.1e} m, "
        f"{anywhere['turned_rad']:.1e} rad, none refused; damped least squares finds joints "
        f"within limits for {anywhere['peer_within_limits']:.0%}"
    )
    lines.append(f"\n{'largest share of a limit':34}" + "of all motions")
    lines += [f"{name:34}{share:14.6f}" for name, share in report["motions"]["used"].items()]
    return "\n".join([*lines, *_stops(report["stops"])])


def _durations(name: str, row: Raw) -> str:
    return f"{name:34}{row['p50_us']:10.1f}{row['p99_us']:10.1f}{row['max_us']:10.0f}"


def _stops(stops: Raw) -> list[str]:
    lines = [f"\n{'stops':10}{'':>6}{'furthest':>12}{'of v^2 / 2a':>13}{'at steady speed':>24}"]
    for name, scale, unit in (("tip", 1e3, "mm"), ("jaw", 1.0, "rad")):
        row = stops[name]
        low, high = row["steady_share"]
        lines.append(
            f"{name:10}{row['stops']:6}{row['furthest'] * scale:8.4f} {unit:3}"
            f"{row['largest_share']:13.6f}{low:12.6f} .. {high:.6f}"
        )
    return lines


def targets(report: Raw) -> list[tuple[str, str, bool]]:
    """What was to be reached: in words, as measured, and whether it was."""
    ik, ticks, paced = report["ik"], report["ticks"], report["paced"]
    motions, stops = report["motions"], report["stops"]
    used = max(motions["used"].items(), key=lambda item: item[1])
    reach = min(report["reachability"][arm]["whole_tissue"]["margin"] for arm in ("psm1", "psm2"))
    late = ticks["longer_than_dt"] * 1e4 / ticks["ticks"]
    share = max(stops[kind]["largest_share"] for kind in ("tip", "jaw"))
    off = max(ik["ours"]["off_m"], report["anywhere"]["off_m"])
    turned = max(ik["ours"]["turned_rad"], report["anywhere"]["turned_rad"])
    rows = [
        ("inverse kinematics of both arms, p99 <= 0.2 ms", ik["ours"]["p99_us"] / 1e3, 0.2, "ms"),
        ("inverse kinematics: off <= 1e-6 m", off, EXACT, "m"),
        ("inverse kinematics: turned <= 1e-6 rad", turned, EXACT, "rad"),
        (f"ticks longer than 20 ms in 10,000 (of {ticks['ticks']:,}) <= 1", late, 1.0, ""),
        (
            f"late ticks in 10,000 (of {paced['ticks']:,} paced {paced['pace']:g} x) <= 1",
            paced["late_in_10000"],
            1.0,
            "",
        ),
        (
            "  of them by the controller itself <= 1",
            (paced["late"] - paced["woken_late"]) * 1e4 / paced["ticks"],
            1.0,
            "",
        ),
        ("tip off its line <= 1e-6 m", motions["off_line_m"], EXACT, "m"),
        ("tip off its target <= 1e-6 m", motions["off_target_m"], EXACT, "m"),
        ("tool turned <= 1e-6 rad", motions["turned_rad"], EXACT, "rad"),
        (f"largest share of any limit <= 1 ({used[0]})", used[1], 1.0 + ROUNDING, ""),
        ("ticks from a hold to rest <= 2", float(stops["most_ticks"]), 2.0, ""),
        ("way of a stop over v^2 / 2a <= 1", share, 1.0 + ROUNDING, ""),
    ]
    found = [(text, f"{value:.3g} {unit}", value <= most) for text, value, most, unit in rows]
    found.append(
        ("whole tissue and 60 mm of lift inside joint limits", f"{100 * reach:.1f} %", reach > 0)
    )
    count = motions["motions"]
    found.append((f"at least {MOTIONS:,} random motions", f"{count:,}", count >= MOTIONS))
    return found
