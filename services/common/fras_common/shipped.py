"""Folders that come with FRAS: a wheel carries them inside a package, a checkout at its root."""

from importlib.util import find_spec
from pathlib import Path
from typing import Final

IN_PACKAGE: Final = {"asp": "fras_planner", "compose": "fras_supervisor"}
"""Which package of a wheel carries which folder."""


def shipped_places(name: str) -> tuple[Path, ...]:
    """Where a folder that comes with FRAS can be: in its package, then in the checkout.

    The package is looked for, not imported.

    Parameters
    ----------
    name : {"asp", "compose"}
        Its name in a checkout.
    """
    spec = find_spec(IN_PACKAGE[name])
    packages = [Path(place) for place in (spec.submodule_search_locations or [])] if spec else []
    return tuple(
        place for package in packages for place in (package / name, package.parents[2] / name)
    )


def shipped(name: str) -> Path:
    """Return the folder itself; if it is nowhere, the first place where it could be."""
    places = shipped_places(name)
    return next((place for place in places if place.is_dir()), places[0])
