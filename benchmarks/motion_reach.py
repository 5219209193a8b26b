"""How far from their limits the joints are over the tissue, and the picture of it."""

# matplotlib ships no complete types.
# pyright: reportUnknownMemberType=false

from pathlib import Path
from typing import Any

import numpy as np
from benchmarks import psm_reference as psm
from matplotlib.axes import Axes
from matplotlib.colors import BoundaryNorm, ListedColormap, Normalize
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch, Rectangle
from numpy.typing import NDArray

from fras_cli.report.figures.style import INK, drawing
from fras_motion.kinematics import BASES_IN_WORLD, ArmKinematics, Pose

Floats = NDArray[np.float64]
Raw = dict[str, Any]

SIZE_M = (0.1, 0.12)
TOP_M = 0.065  # 5 mm of tissue and 60 mm of lift
STEP_M = 0.0025
SHOWN_M = (0.005, TOP_M)
HALF_M = SIZE_M[1] / 2
# Of the maps' colours and lines [% of a joint's range]; at the middle of its range a joint has 50.
LEVELS = (0, 5, 10, 15, 20, 25, 30, 35, 40, 45)
# Okabe and Ito's palette, one colour a joint that can be nearest.
JOINT_COLOURS = ("#d55e00", "#e69f00", "#009e73", "#999999", "#cc79a7", "#56b4e9")


def axes_m() -> tuple[Floats, Floats, Floats]:
    """Grid over the tissue and the heights to which it is lifted [m]."""
    x, y, z = (np.linspace(0.0, top, round(top / STEP_M) + 1) for top in (*SIZE_M, TOP_M))
    return x, y, z


def margins(arm: str, x: Floats, y: Floats, z: Floats) -> Floats:
    """Distance of each joint to its nearer limit, tool down, as a share of the joint's range.

    Returns
    -------
    ndarray, shape (nz, ny, nx, 6)
        Of joints by motion's inverse kinematics, which psm_reference holds to the points.

    Raises
    ------
    Unreachable
        A point is out of reach.
    """
    kinematics = ArmKinematics(BASES_IN_WORLD[arm])
    points = np.stack(np.meshgrid(z, y, x, indexing="ij")[::-1], axis=-1).reshape(-1, 3)
    joints = np.array(
        [
            kinematics.inverse(Pose((px, py, pz), kinematics.tool_down_xyzw))
            for px, py, pz in points.tolist()
        ]
    )
    tips, rotations = psm.forward(joints, psm.BASES[arm])
    off_m = float(np.linalg.norm(tips - points, axis=1).max())
    turned_rad = float(psm.turns_rad(rotations, psm.tool_down(arm)).max())
    if max(off_m, turned_rad) > 1e-9:
        raise SystemExit(f"{arm}: joints miss their points by {off_m} m, {turned_rad} rad")
    shares = np.minimum(joints - psm.LOWER, psm.UPPER - joints) / (psm.UPPER - psm.LOWER)
    return shares.reshape(len(z), len(y), len(x), 6)


def reachability() -> tuple[dict[str, Floats], Raw]:
    """Margins of both arms, and their worst, over the tissue and over the half that each serves."""
    x, y, z = axes_m()
    maps = {arm: margins(arm, x, y, z) for arm in psm.BASES}
    figures: Raw = {"points_an_arm": int(len(x) * len(y) * len(z))}
    for arm, shares in maps.items():
        served = y < HALF_M - 1e-9 if arm == "psm1" else y >= HALF_M - 1e-9
        figures[arm] = {
            "whole_tissue": _worst(shares, x, y, z),
            "half_it_serves": _worst(shares[:, served], x, y[served], z),
        }
    return maps, figures


def _worst(shares: Floats, x: Floats, y: Floats, z: Floats) -> Raw:
    k, j, i, joint = np.unravel_index(int(shares.argmin()), shares.shape)
    return {
        "margin": round(float(shares.min()), 4),
        "joint": psm.NAMES[int(joint)],
        "at_m": [round(float(v), 4) for v in (x[i], y[j], z[k])],
    }


def draw(maps: dict[str, Floats], figures: Raw, path: Path) -> None:
    """Write the picture: a row an arm; margins at two heights, the worst of all, whose it is."""
    with drawing():
        figure = Figure(figsize=(11, 7.6), layout="constrained")
        panels = figure.subplots(2, 4, sharex=True, sharey=True)
        _, _, z = axes_m()
        image = None
        for row, (arm, shares) in zip(panels, maps.items(), strict=True):
            nearest = shares.min(axis=-1)
            levels = [int(np.abs(z - height).argmin()) for height in SHOWN_M]
            views = [(f"z = {1e3 * z[level]:.0f} mm", nearest[level]) for level in levels]
            views.append(("worst of z = 0 .. 65 mm", nearest.min(axis=0)))
            for axes, (title, view) in zip(row, views, strict=False):
                image = _margin_map(axes, view)
                axes.set_title(f"{arm}, {title}")
                _mark_half(axes, arm)
            _mark_worst(row[2], figures[arm])
            _joint_map(row[3], shares)
            row[3].set_title(f"{arm}, the joint nearest its limit")
            _mark_half(row[3], arm)
            row[0].set_ylabel("y [mm]")
        for axes in panels[-1]:
            axes.set_xlabel("x [mm]")
        if image is not None:
            bar = figure.colorbar(image, ax=panels[:, :3], location="bottom", aspect=50, pad=0.02)
            bar.set_label("distance of the nearest joint from its limit [% of the joint's range]")
        _legend(figure, maps)
        figure.savefig(path, dpi=120)


def _extent() -> tuple[float, float, float, float]:
    half = 1e3 * STEP_M / 2
    return (-half, 1e3 * SIZE_M[0] + half, -half, 1e3 * SIZE_M[1] + half)


def _margin_map(axes: Axes, view: Floats) -> Any:
    x, y, _ = axes_m()
    scale = Normalize(LEVELS[0], LEVELS[-1])
    image = axes.imshow(100 * view, origin="lower", extent=_extent(), cmap="cividis", norm=scale)
    lines = axes.contour(
        1e3 * x, 1e3 * y, 100 * view, levels=LEVELS, colors="white", linewidths=0.8
    )
    axes.clabel(lines, fmt="%g %%", fontsize=7.5)
    return image


def _joint_map(axes: Axes, shares: Floats) -> None:
    """Colour each place by the joint that is nearest to a limit at any of its heights."""
    nearest = shares.min(axis=0).argmin(axis=-1)
    norm = BoundaryNorm(np.arange(-0.5, 6.5), 6)
    axes.imshow(
        nearest, origin="lower", extent=_extent(), cmap=ListedColormap(JOINT_COLOURS), norm=norm
    )


def _mark_half(axes: Axes, arm: str) -> None:
    """Dim the half that the other arm serves."""
    low = HALF_M if arm == "psm1" else 0.0
    axes.add_patch(
        Rectangle(
            (0.0, 1e3 * low),
            1e3 * SIZE_M[0],
            1e3 * HALF_M,
            facecolor="none",
            edgecolor=INK,
            hatch="///",
            linewidth=0.0,
            alpha=0.45,
        )
    )
    axes.axhline(1e3 * HALF_M, color=INK, linewidth=1.2, linestyle="--")


def _mark_worst(axes: Axes, figures: Raw) -> None:
    worst = figures["whole_tissue"]
    x, y, _ = worst["at_m"]
    axes.plot(
        [1e3 * x], [1e3 * y], "o", color="white", markeredgecolor=INK, markersize=8, clip_on=False
    )
    axes.annotate(
        f"{100 * worst['margin']:.1f} %, {worst['joint'].replace('_', ' ')}",
        (1e3 * x, 1e3 * y),
        xytext=(8, -12 if y > HALF_M else 7),
        textcoords="offset points",
        bbox={"boxstyle": "round,pad=0.25", "facecolor": "white", "edgecolor": "none"},
        fontsize=8,
    )


def _legend(figure: Figure, maps: dict[str, Floats]) -> None:
    seen = sorted({int(joint) for s in maps.values() for joint in s.min(axis=0).argmin(-1).flat})
    handles: list[Any] = [
        Patch(facecolor=JOINT_COLOURS[joint], label=psm.NAMES[joint].replace("_", " "))
        for joint in seen
    ]
    handles.append(
        Patch(facecolor="white", edgecolor=INK, hatch="///", label="half that the other arm serves")
    )
    handles.append(
        Line2D([], [], color="white", marker="o", markeredgecolor=INK, label="worst place")
    )
    figure.legend(handles=handles, loc="outside lower center", ncols=len(handles))
