"""Colours, type and frames that all figures share; safe for colour-blind readers and for print."""

# pyright: reportUnknownMemberType=false
# matplotlib does not type its **kwargs.

from __future__ import annotations

import io
import re
from collections.abc import Generator
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any, Final

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import LinearSegmentedColormap, Normalize
from matplotlib.figure import Figure
from numpy.typing import NDArray

from fras_log import colours as palette

if TYPE_CHECKING:
    from matplotlib.typing import RcKeyType

INK: Final = "#1f2328"
FAINT: Final = "#8b949e"
LIMIT: Final = palette.LIMIT
FORCE: Final = "#1f2328"
VISIBILITY: Final = "#0072b2"
PATIENT: Final = "#7b3294"
FORCE_MAP: Final = LinearSegmentedColormap.from_list("force", list(palette.FORCE_STOPS))
# Of the pixels inside vector figures: sharp on screens that double theirs, and in print.
RASTER_DPI: Final = 180

# Okabe and Ito's palette: distinct under every common colour vision.
ACTION_COLOURS: Final = {
    "reach": "#56b4e9",
    "grasp": "#e69f00",
    "pull": "#009e73",
    "move": "#cc79a7",
    "release": "#999999",
}

_SETTINGS: Final[dict[RcKeyType, Any]] = {
    "font.family": "DejaVu Sans",
    "font.size": 8.5,
    "axes.edgecolor": INK,
    "axes.labelcolor": INK,
    "axes.linewidth": 0.7,
    "axes.titlesize": 9.5,
    "axes.titleweight": "bold",
    "axes.titlelocation": "left",
    "text.color": INK,
    "xtick.color": INK,
    "ytick.color": INK,
    "xtick.major.width": 0.7,
    "ytick.major.width": 0.7,
    "legend.frameon": False,
    "hatch.linewidth": 0.6,
    # The same log gives the same file, byte for byte.
    "svg.hashsalt": "fras",
}


@contextmanager
def drawing() -> Generator[None]:
    """Draw in our style; matplotlib's own settings are as before afterwards."""
    with mpl.rc_context(_SETTINGS):
        yield


def colour_of(action: str) -> str:
    """Colour of an action by its name; grey for one that is not known."""
    return ACTION_COLOURS.get(action, "#bbbbbb")


def force_colours(force_norm: Normalize, force_n: NDArray[np.float64]) -> NDArray[np.float64]:
    """RGB of each force, shape (n, 3)."""
    return np.asarray(FORCE_MAP(np.asarray(force_norm(force_n))), dtype=np.float64)[:, :3]


def open_frame(axes: Axes) -> None:
    """Leave only the two spines that carry a scale."""
    axes.spines[["top", "right"]].set_visible(False)


def to_svg(figure: Figure, name: str) -> str:
    """Render as an SVG element that can stand inside a page.

    Parameters
    ----------
    figure : Figure
    name : str
        Put before every id: several figures in one page must not share any.
    """
    with drawing():
        data = io.StringIO()
        about = {"Date": None, "Creator": "FRAS"}
        figure.savefig(data, format="svg", dpi=RASTER_DPI, metadata=about)
    text = data.getvalue()
    # The XML prologue belongs to a file of its own, not to an element in HTML.
    element = text[text.index("<svg") :]
    return re.sub(r'( id="|href="#|url\(#)', rf"\g<1>{name}-", element)


def to_png(figure: Figure, dpi: float) -> bytes:
    """Render as PNG."""
    with drawing():
        data = io.BytesIO()
        figure.savefig(data, format="png", dpi=dpi)
    return data.getvalue()
