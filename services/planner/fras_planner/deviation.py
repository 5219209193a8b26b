"""An effect that did not come, in words, with the numbers that situation awareness measured."""

from collections.abc import Mapping

from fras_common.messages import Monitored, PlannedAction
from fras_planner.planning.occasion import spoken

# What was measured, its name, the number that it is held against, and what makes the fluent true.
_MEASURED = (
    ("distance_m", "distance", "at_distance_m", "below"),
    ("jaw_rad", "jaw", "closed_jaw_rad", "below"),
    ("visible_fraction", "visible", "threshold_fraction", "more than"),
)
_OPPOSITE = {"below": "at least", "more than": "at most"}


def first_deviation(action: PlannedAction, monitored: list[Monitored]) -> str:
    """Return the reason to plan anew after an action that succeeded; empty if all is as expected.

    Parameters
    ----------
    action : PlannedAction
        What was done, with what the rules expect of it.
    monitored : list of Monitored
        What became of that; what nobody looked at counts as missing.
    """
    told = {one.atom: one for one in monitored}
    for atom in action.expected:
        found = told.get(atom)
        if found is None or not found.holds:
            head = f"deviation: {atom} expected after {action.text}"
            numbers = _numbers(atom, found.evidence if found is not None else {})
            return "; ".join([head, *numbers])
    return ""


def _numbers(atom: str, evidence: Mapping[str, float]) -> list[str]:
    wanted = not atom.startswith("-")
    return [
        f"{word} {spoken(name, evidence[name])}, needed {needed if wanted else _OPPOSITE[needed]} "
        f"{spoken(limit, evidence[limit])}"
        for name, word, limit, needed in _MEASURED
        if name in evidence and limit in evidence
    ]
