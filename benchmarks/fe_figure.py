"""The figure of `benchmarks.fe`: cost over size, and where it goes."""

# matplotlib ships no complete types.
# pyright: reportUnknownMemberType=false

from math import prod
from pathlib import Path
from typing import Any

from matplotlib.figure import Figure

REAL_TIME_MS = 20.0


def draw(meshes: dict[str, dict[str, Any]], reference: str, path: Path) -> None:
    """Write the picture; its kind follows from the file's name."""
    figure = Figure(figsize=(11, 4.5), layout="constrained")
    left, right = figure.subplots(1, 2)
    sizes = {mesh: prod(map(int, mesh.split("x"))) for mesh in meshes}
    methods = list(dict.fromkeys(method for rows in meshes.values() for method in rows))
    for method in methods:
        rows = {m: rows[method] for m, rows in meshes.items() if "ms" in rows.get(method, {})}
        label = f"FRAS, {method}" if rows and "max_force_n" in next(iter(rows.values())) else method
        left.loglog(
            [sizes[mesh] for mesh in rows],
            [row["ms"] for row in rows.values()],
            "o-",
            label=label,
        )
    left.axhline(REAL_TIME_MS, color="0.5", linestyle="--", linewidth=1)
    left.text(
        max(sizes.values()),
        REAL_TIME_MS * 0.93,
        "real time",
        color="0.4",
        fontsize=8,
        ha="right",
        va="top",
    )
    left.set(xlabel="nodes along x, y, z", ylabel="ms a step, two cores", title="50 mm pull")
    left.set_xticks(list(sizes.values()), list(sizes), rotation=30)
    left.minorticks_off()
    left.legend(fontsize=8)
    base = [0.0] * len(meshes)
    rows = [methods[reference]["phase_ms"] for methods in meshes.values()]
    shares = [{name: ms / sum(row.values()) for name, ms in row.items()} for row in rows]
    for phase in shares[0]:
        heights = [100 * share.get(phase, 0.0) for share in shares]
        right.bar(list(meshes), heights, bottom=base, label=phase)
        base = [low + height for low, height in zip(base, heights, strict=True)]
    right.set(ylabel="% of a step", title=f"where FRAS spends it ({reference})")
    right.legend(fontsize=8, loc="center left", bbox_to_anchor=(1.0, 0.5))
    figure.savefig(path, dpi=150)
