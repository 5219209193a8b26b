"""What a plan is made for, as facts: the reason, and the numbers behind what was sensed."""

import math
from collections.abc import Container, Mapping

from fras_planner.planning.signature import normalised

Evidence = Mapping[str, Mapping[str, float]]
# Its numbers are told whether it holds or not.
GOAL = "visible_roi"
# Larger is no measurement, and longer no reason.
MOST = 1e6
LONGEST = 500


def occasion(reason: str, evidence: Evidence, sensed: Container[str]) -> list[str]:
    """Return ``reason(Kind,Detail)`` and ``evidence(Atom,Name,Text)``; texts are strings.

    Parameters
    ----------
    reason : str
        ``kind`` or ``kind: detail``.
    evidence : mapping of str to mapping of str to float
        Of atoms that are not `sensed`, nothing is told.
    sensed : container of str
        Checked atoms: no other text becomes part of the program.
    """
    kind, _, detail = reason.partition(":")
    facts = [f"reason({_quoted(kind.strip())},{_quoted(detail.strip())})"]
    for text, numbers in evidence.items():
        atom = normalised(text)
        if atom == GOAL or atom in sensed:
            facts += [
                f"evidence({atom},{_quoted(name)},{_quoted(spoken(name, value))})"
                for name, value in numbers.items()
                if abs(value) < MOST
            ]
    return facts


def spoken(name: str, value: float) -> str:
    """Write a number with the unit that its name ends in."""
    if name.endswith("_fraction"):
        return f"{100 * value:.1f} %"
    if name.endswith("_n"):
        return f"{value:.2f} N"
    if name.endswith("_m"):
        return f"{1e3 * value:.1f} mm"
    if name.endswith("_rad"):
        return f"{math.degrees(value):.1f} degrees"
    return f"{value:.3g}"


def _quoted(text: str) -> str:
    printable = "".join(letter if letter.isprintable() else " " for letter in text[:LONGEST])
    escaped = printable.replace("\\", "\\\\").replace('"', '\\"')
    return f'"{escaped}"'
