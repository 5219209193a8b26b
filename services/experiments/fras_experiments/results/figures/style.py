"""What the figures of a campaign share; built on the report's style."""

# pyright: reportUnknownMemberType=false
# matplotlib does not type its **kwargs.

import io
from pathlib import Path
from typing import Final

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray
from PIL import Image

from fras_cli.report.figures.style import drawing
from fras_common.files import write_whole

WIDTH_IN: Final = 7.2
"""Two columns of a paper."""
DPI: Final = 150
RASTER_DPI: Final = 80
"""Of the pixels inside vector formats."""
COLOURS: Final = 128
"""Of a PNG."""
# Okabe and Ito's palette; the marks differ as well, for print without colour.
KIND_COLOURS: Final = {"A": "#0072b2", "B": "#e69f00", "C": "#009e73", "": "#999999"}
KIND_MARKS: Final = {"A": "o", "B": "s", "C": "^", "": "x"}
PAPER: Final = "#cc79a7"
MANY: Final = 1_000
"""Marks in a vector format; more are pixels."""
FORMATS: Final = ("png", "svg", "pdf")


def kind_name(kind: str) -> str:
    """Name of a scenario kind on an axis."""
    return kind or "no plan"


def spread(n: int, width: float, seed: int) -> NDArray[np.float64]:
    """Sideways offsets of points that would hide each other, shape (n,)."""
    return np.random.default_rng(seed).uniform(-width, width, n)


def save(figure: Figure, path: Path) -> None:
    """Write a figure whole or not at all, in the format that its path ends with.

    The same figure gives the same bytes.

    Raises
    ------
    OSError
        It can't be written.
    """
    kind = path.suffix.removeprefix(".")
    dates = {"svg": {"Date": None}, "pdf": {"CreationDate": None, "ModDate": None}}
    dpi, data = DPI if kind == "png" else RASTER_DPI, io.BytesIO()
    with drawing():
        figure.savefig(data, format=kind, dpi=dpi, metadata=dates.get(kind))
    write_whole(path, _fewer_colours(data) if kind == "png" else data.getvalue())


def _fewer_colours(png: io.BytesIO) -> bytes:
    """Return a picture with a palette: a quarter of the size, and no difference to the eye."""
    data = io.BytesIO()
    with Image.open(png) as image:
        plain = image.convert("RGB").quantize(COLOURS, dither=Image.Dither.NONE)
    plain.save(data, format="png", optimize=True)
    return data.getvalue()
