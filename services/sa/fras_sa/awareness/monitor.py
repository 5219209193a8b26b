"""Plan monitoring: whether what an action should have brought holds, and the numbers behind it.

Which atoms those are is the planner's knowledge; here each one asked about is looked up among the
fluents that hold, and where it is missing the numbers are told that kept it from holding.
"""

import re
from collections.abc import Iterable
from dataclasses import dataclass

from . import fluents as fl
from .blocks import Blocks
from .errors import UnknownAtom
from .parameters import AwarenessParameters
from .views import ARMS, Evidence, RobotView, TissueModel, TissueView

FORMS: dict[str, tuple[str, ...]] = {
    "at": ("arm", "block"),
    "in_hand": ("arm", "block"),
    "closed_gripper": ("arm",),
    "max_height": ("arm",),
    "visible_roi": (),
    "reachable": ("arm", "block"),
    "fixed": ("block",),
    "above_roi": ("block",),
}
"""The fluents and the sorts of their arguments."""

_ATOM = re.compile(r"(?P<name>\w+)(?:\((?P<arguments>.+)\))?")
_ARGUMENTS = re.compile(r",(?![^(]*\))")


@dataclass(frozen=True, slots=True)
class Monitored:
    """What became of one expectation.

    Parameters
    ----------
    atom : str
        As asked; a leading `-` reads: must not hold.
    holds : bool
        Whether it is as expected.
    evidence : dict of str to float
        The numbers behind that, whether true or false.
    """

    atom: str
    holds: bool
    evidence: Evidence


@dataclass(frozen=True, slots=True)
class Situation:
    """What one context was made from, and what was found to hold."""

    parameters: AwarenessParameters
    blocks: Blocks
    model: TissueModel
    tissue: TissueView
    robot: RobotView
    holding: fl.Fluents
    visibility: Evidence
    force: Evidence


def monitor(expected: Iterable[str], situation: Situation) -> tuple[Monitored, ...]:
    """Hold expectations against a situation.

    Parameters
    ----------
    expected : iterable of str
        Fluents, each with a leading `-` where it must not hold.
    situation : Situation

    Returns
    -------
    tuple of Monitored
        In the order asked.

    Raises
    ------
    UnknownAtom
        If a fluent, arm or block does not exist.
    """
    return tuple(_monitored(atom, situation) for atom in expected)


def _monitored(atom: str, situation: Situation) -> Monitored:
    fluent = atom.removeprefix("-")
    name, arguments = _parsed(atom, fluent, situation.blocks)
    found = situation.holding.get(fluent)
    evidence = dict(found) if found is not None else _missing(name, arguments, situation)
    return Monitored(atom, (found is not None) != atom.startswith("-"), evidence)


def _parsed(atom: str, fluent: str, blocks: Blocks) -> tuple[str, dict[str, str]]:
    """Return a fluent's name and its arguments by sort."""
    match = _ATOM.fullmatch(fluent)
    name, text = (match["name"], match["arguments"]) if match else ("", "")
    given = _ARGUMENTS.split(text) if text else []
    if name not in FORMS or len(FORMS[name]) != len(given):
        forms = [f"{form}({','.join(sorts)})" if sorts else form for form, sorts in FORMS.items()]
        raise UnknownAtom(atom, "fluent", fluent, forms)
    arguments = dict(zip(FORMS[name], given, strict=True))
    for sort, known in (("arm", ARMS), ("block", blocks.names)):
        if sort in arguments and arguments[sort] not in known:
            raise UnknownAtom(atom, sort, arguments[sort], known)
    return name, arguments


def _missing(name: str, arguments: dict[str, str], situation: Situation) -> Evidence:
    """Return the numbers that kept a fluent from holding."""
    parameters, blocks = situation.parameters, situation.blocks
    if name == "visible_roi":
        return dict(situation.visibility)
    if name == "max_height":
        return fl.max_height_evidence(situation.visibility, situation.force)
    if name == "closed_gripper":
        return fl.jaw_evidence(parameters, situation.robot.arms[arguments["arm"]])
    row = blocks.row(arguments["block"])
    if name == "fixed":
        return fl.fixed_evidence(0)
    if name == "reachable":
        return fl.reachable_evidence(blocks, row)
    if name == "above_roi":
        return fl.above_roi_evidence(blocks, row, situation.model.roi_m)
    arm = situation.robot.arms[arguments["arm"]]
    place = fl.distances(blocks.current(situation.tissue.nodes_m)[row : row + 1], arm.tip_m)
    evidence = fl.distance_evidence(parameters, place[0])
    return evidence if name == "at" else evidence | fl.jaw_evidence(parameters, arm)
