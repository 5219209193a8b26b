"""Colours that stand for the same thing in every picture of a trial, whoever draws it.

Safe for colour-blind readers and for print; as text and numbers, without a drawing library.
"""

from typing import Final

import numpy as np
from numpy.typing import NDArray

ColourArray = NDArray[np.uint8]

# Lightness falls evenly from pale tissue to violet, so it reads in grey and under every vision.
FORCE_STOPS: Final = ("#f8e5d9", "#fdcaa4", "#fb8a63", "#d2426f", "#802582", "#2b115e")
LIMIT: Final = "#d55e00"
ROI: Final = "#0072b2"
TOOL: Final = "#6e7781"
ATTACHMENT: Final = "#3b4252"
WORDS: Final = "#8b949e"


def rgb(colour: str) -> tuple[int, int, int]:
    """Return red, green and blue, 0 to 255, of `#rrggbb`."""
    red, green, blue = bytes.fromhex(colour.removeprefix("#"))
    return red, green, blue


def force_rgb(force_n: NDArray[np.floating], top_n: float) -> ColourArray:
    """Colour forces from pale, at 0, to violet, at `top_n` and above.

    Parameters
    ----------
    force_n : ndarray, shape (n,) [N]
        One that is not a number is coloured as none.
    top_n : float

    Returns
    -------
    ndarray, shape (n, 3), uint8

    Notes
    -----
    Along the square root, because few nodes bear much: the root keeps what the many bear apart
    from nothing.
    """
    share = np.sqrt(np.clip(np.nan_to_num(force_n) / top_n, 0.0, 1.0))
    stops = np.array([rgb(colour) for colour in FORCE_STOPS], dtype=np.float64)
    places = np.linspace(0.0, 1.0, len(stops))
    channels = [np.interp(share, places, stops[:, channel]) for channel in range(3)]
    return np.rint(np.stack(channels, axis=-1)).astype(np.uint8)
