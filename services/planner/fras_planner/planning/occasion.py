"""What a plan is made for, as facts: the reason, and the numbers behind what was sensed."""

from collections.abc import Mapping

from fras_planner.planning.signature import functor

# Fluents whose numbers `because.lp` tells.
TOLD = ("visible_roi", "max_height")


def occasion(reason: str, evidence: Mapping[str, Mapping[str, float]]) -> list[str]:
    """Return ``reason(Kind,Detail)`` and ``evidence(Atom,Name,Text)``; texts are strings."""
    kind, _, detail = reason.partition(":")
    facts = [f"reason({_quoted(kind.strip())},{_quoted(detail.strip())})"]
    for atom, numbers in evidence.items():
        if functor(atom) in TOLD:
            facts += [
                f"evidence({atom},{_quoted(name)},{_quoted(spoken(name, value))})"
                for name, value in numbers.items()
            ]
    return facts


def spoken(name: str, value: float) -> str:
    """Write a number with the unit that its name ends in."""
    if name.endswith("_fraction"):
        return f"{100 * value:.1f} %"
    if name.endswith("_n"):
        return f"{value:.2f} N"
    if name.endswith("_m"):
        return f"{1e3 * value:.0f} mm"
    return f"{value:.3g}"


def _quoted(text: str) -> str:
    escaped = text.replace("\\", "\\\\").replace('"', '\\"').replace("\n", "\\n")
    return f'"{escaped}"'
