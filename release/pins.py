"""The pinned distributions, who needs them, and what they say of themselves."""

import tomllib
from collections.abc import Iterator
from dataclasses import dataclass
from importlib.metadata import Distribution, PackageNotFoundError, distribution
from pathlib import Path
from typing import Final

from packaging.requirements import Requirement
from packaging.utils import NormalizedName, canonicalize_name

from fras_common.errors import FrasError

ROOT: Final = Path(__file__).resolve().parents[1]
FRAS: Final = "fras"
NOT_RUNTIME: Final = frozenset({"bench", "dev"})
"""Extras of the tests, the checks and the measurements: nothing of them is needed to run FRAS."""


class PinMissing(FrasError):
    """A pin that is not installed here, or in another version. Attributes: ``name``."""

    def __init__(self, name: str, pinned: str, found: str | None) -> None:
        super().__init__(
            f"{name} is pinned at {pinned}, and {found or 'nothing'} is installed: run "
            "`make install test` (its licence is read from what is installed)",
            name=name,
        )


@dataclass(frozen=True)
class Pin:
    """One line of constraints.txt.

    Parameters
    ----------
    name : str
        As it stands there.
    version : str
    extras : tuple of str
        Extras of FRAS that need it, directly or not; the empty one stands for FRAS itself.
    """

    name: str
    version: str
    extras: tuple[str, ...]

    @property
    def is_runtime(self) -> bool:
        """Whether an extra needs it that is not only for tests and measurements."""
        return not NOT_RUNTIME.issuperset(self.extras)


def read_pins(root: Path = ROOT) -> dict[NormalizedName, tuple[str, str]]:
    """Read constraints.txt: name and version by normalised name."""
    lines = (root / "constraints.txt").read_text(encoding="utf-8").splitlines()
    pairs = (line.split("==") for line in lines if line and not line.startswith("#"))
    return {canonicalize_name(name): (name, version) for name, version in pairs}


def extras_of_fras(root: Path = ROOT) -> tuple[str, ...]:
    """Name the extras, as pyproject.toml has them; the empty one, FRAS itself, comes first."""
    project = tomllib.loads((root / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    return ("", *project["optional-dependencies"])


def all_pins(root: Path = ROOT) -> list[Pin]:
    """Return all pins with who needs them, as far as it is installed here."""
    needs = {extra: set(closure(FRAS, extra)) for extra in extras_of_fras(root)}
    return [
        Pin(name, version, tuple(extra for extra in needs if key in needs[extra]))
        for key, (name, version) in read_pins(root).items()
    ]


def installed(pin: Pin) -> Distribution:
    """Return what is installed of a pin.

    Raises
    ------
    PinMissing
    """
    try:
        found = distribution(pin.name)
    except PackageNotFoundError:
        raise PinMissing(pin.name, pin.version, None) from None
    if found.version != pin.version:
        raise PinMissing(pin.name, pin.version, found.version)
    return found


def requirements_of(name: str, extra: str = "") -> Iterator[Requirement]:
    """Give what a distribution requires on this machine; nothing if it is not installed."""
    try:
        lines = distribution(name).requires or []
    except PackageNotFoundError:
        return
    for line in lines:
        requirement = Requirement(line)
        if requirement.marker is None or requirement.marker.evaluate({"extra": extra}):
            yield requirement


def closure(name: str, extra: str = "") -> set[NormalizedName]:
    """Everything that a distribution needs with an extra, directly or not."""
    seen: set[tuple[NormalizedName, str]] = set()
    waiting: list[tuple[str, str]] = [(name, extra)]
    while waiting:
        for requirement in requirements_of(*waiting.pop()):
            key = canonicalize_name(requirement.name)
            for asked in ("", *requirement.extras):
                if (key, asked) not in seen:
                    seen.add((key, asked))
                    waiting.append((key, asked))
    return {key for key, _ in seen} - {canonicalize_name(name)}
