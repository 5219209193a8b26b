"""Names, actions and reasons of the messages in words that a surgeon uses."""

import math
import re
from collections.abc import Callable, Mapping
from functools import lru_cache
from typing import Final

# The same few texts stand on the page for seconds, and are told anew ten times a second.
TOLD: Final = 2_000

ARMS: Final = {"psm1": "right instrument", "psm2": "left instrument"}

SERVICES: Final = {
    "sim": "tissue model",
    "patient": "patient",
    "sa": "force and visibility watch",
    "planner": "planner",
    "motion": "arm control",
    "recorder": "recorder",
    "monitor": "surgeon's page",
    "supervisor": "supervisor",
    "replay": "replay",
    "solver": "tissue model",
}

HOLDERS: Final = {
    "monitor": "stopped on this page",
    "cli": "stopped at a terminal",
    "restart": "arm control started again",
    "recorder": "nothing is being recorded",
    "supervisor": "a part of the system failed",
    "unreadable": "earlier stops could not be read",
    "cancel": "the procedure is being ended",
    "others": "further stops",
}

_ACTIONS: Final = {
    "reach": ("reach for {block}", "reaching for {block}"),
    "grasp": ("grasp the tissue at {block}", "grasping the tissue at {block}"),
    "pull": ("lift the tissue at {block}", "lifting the tissue at {block}"),
    "move": (
        "carry the tissue sideways to {block}",
        "carrying the tissue sideways to {block}",
    ),
    "release": ("let go of the tissue", "letting go of the tissue"),
}

_PHASES: Final = {
    "resetting": "Preparing the procedure",
    "planning": "Planning",
    "awaiting_approval": "The plan waits for your approval",
    "ended": "Ended; the recording is being closed",
    "idle": "Ended",
}

OUTCOMES: Final = {
    "success": "The target region is exposed.",
    "no_plan": "There is no plan for this situation.",
    "aborted": "The procedure was stopped before its end.",
    "failed": "The target region could not be exposed.",
}

_REASONS: Final = {
    "initial": "the procedure begins",
    "exposure": "the previous plan was carried out",
    "force": "the force limit was crossed",
    "force_soft": "the force limit was crossed",
    "force_hard": "the hard force limit was crossed",
    "hold": "the arms were stopped, then allowed to go on",
    "restart": "a part of the system had to start again",
    "rejected": "the previous plan was rejected",
    "nothing_in_reach": "the jaws closed on nothing",
    "replans": "as many new plans were made as are allowed",
    "hold:solver": "the tissue model had no valid solution",
    "hold:robot": "the state of the arms was unusable",
    "hold:stale": "the states of tissue and arms did not belong together",
}

_FLUENTS: Final[tuple[tuple[str, str], ...]] = (
    (r"reachable\((\w+),(b\(\d+,\d+\))\)", r"{0} can reach {1}"),
    (r"at\((\w+),(b\(\d+,\d+\))\)", r"{0} is at {1}"),
    (r"in_hand\((\w+),(b\(\d+,\d+\))\)", r"{0} holds the tissue at {1}"),
    (r"closed_gripper\((\w+)\)", r"the jaws of the {0} are closed"),
    (r"max_height\((\w+)\)", r"{0} may not lift higher"),
    (r"fixed\((b\(\d+,\d+\))\)", r"{0} lies over an attachment"),
    (r"above_roi\((b\(\d+,\d+\))\)", r"{0} lies above the target region"),
    (r"visible_roi", r"the target region is exposed"),
)

_EVIDENCE: Final[Mapping[str, tuple[str, float]]] = {
    "_rad": ("°", 57.29577951308232),
    "_m": ("mm", 1e3),
    "_n": ("N", 1.0),
    "_s": ("s", 1.0),
}

# What a number is, without the unit at the end of its name. As the scene is seen at first, x leads
# away from whoever looks and y from right to left.
_MEASURES: Final[Mapping[str, str]] = {
    "visible": "lifted clear",
    "threshold": "needed: more than",
    "margin": "beyond what is needed",
    "at_distance": "counts as there up to",
    "jaw": "jaws at",
    "closed_jaw": "count as closed up to",
    "roi_offset_x": "the target region lies behind it by",
    "roi_offset_y": "and to the left by",
    "half_cell_x": "counts as above it up to, behind or in front",
    "half_cell_y": "left or right",
    "fixed_points": "attachments under it",
    "rest_y": "from the right edge, at rest",
    "middle_y": "middle of the tissue",
}

_BLOCK: Final = re.compile(r"b\((\d+),\s*(\d+)\)")
_ACTION: Final = re.compile(r"\b(reach|grasp|pull|move|release)\((psm\d)(?:,(b\(\d+,\d+\)))?\)")
_ATOM: Final = re.compile(
    r"-?\b(?:(?:reachable|at|in_hand)\(\w+,b\(\d+,\d+\)\)|(?:closed_gripper|max_height)\(\w+\)"
    r"|(?:fixed|above_roi)\(b\(\d+,\d+\)\)|visible_roi\b)"
)
_PHRASES: Final[tuple[tuple[re.Pattern[str], str], ...]] = (
    (re.compile(r"\bregion of interest\b"), "target region"),
    (re.compile(r"\bROI\b"), "target region"),
    (re.compile(r"\battachment point(s?)\b"), r"attachment\1"),
    (re.compile(r"\bcandidate blocks?\b"), "possible points"),
    (re.compile(r"\bblocks\b"), "points"),
    (re.compile(r"\bblock\b"), "point"),
    (re.compile(r" under the criterion '\w+'"), " by the chosen preference"),
    (re.compile(r"\bgripper\b"), "jaws"),
    (re.compile(r"\barm(s?)\b(?! control)"), r"instrument\1"),
    (re.compile(r"\b[Rr]e-plan"), "new plan"),
)


def point(block: str) -> str:
    """Name a block, `b(3,4)`, as it stands on the page: `point 3-4`."""
    found = _BLOCK.fullmatch(block)
    return f"point {found[1]}-{found[2]}" if found else block


def instrument(arm: str) -> str:
    """Name an arm."""
    return ARMS.get(arm, arm)


def service_in_words(name: str) -> str:
    """Name a service; several of them one by one."""
    names = [one.strip() for one in name.split(",")]
    return ", ".join(SERVICES.get(one, one) for one in names)


@lru_cache(TOLD)
def action_in_words(text: str, *, under_way: bool = False) -> str:
    """Tell an action, `pull(psm1,b(3,4))`, as something to do or something that is being done."""
    found = _ACTION.fullmatch(text)
    if found is None:
        return plain(text)
    name, arm, block = found.groups()
    words = _ACTIONS[name][under_way].format(block=point(block or ""))
    return f"{instrument(arm).capitalize()}: {words}"


def phase_in_words(phase: str, action: str) -> str:
    """Tell what is going on now, in one line."""
    if phase == "acting":
        return action_in_words(action, under_way=True) if action else "Between two actions"
    return _PHASES.get(phase, phase)


@lru_cache(TOLD)
def fluent_in_words(atom: str) -> str:
    """Tell an atom of the situation; a leading minus says that it does not hold."""
    negated = atom.startswith("-")
    bare = atom.removeprefix("-")
    for pattern, words in _FLUENTS:
        if (found := re.fullmatch(pattern, bare)) is not None:
            told = words.format(*(_named(one) for one in found.groups()))
            return f"not: {told}" if negated else told
    return atom


@lru_cache(TOLD)
def evidence_in_words(name: str, value: float) -> str:
    """Tell a number behind an atom with its unit, as its name says: `distance_m` in mm."""
    for ending, (unit, factor) in _EVIDENCE.items():
        if name.endswith(ending):
            return f"{_measure(name.removesuffix(ending))} {_number(value * factor)} {unit}"
    if name.endswith("_fraction"):
        return f"{_measure(name.removesuffix('_fraction'))} {percent(value)}"
    return f"{_measure(name)} {_number(value)}"


def percent(share: float) -> str:
    """Tell a share so that one just below a tenth of a percent does not read as that."""
    return f"{math.floor(round(1000.0 * share, 6)) / 10.0:.1f}%"


def reason_in_words(reason: str) -> str:
    """Tell a reason of a plan, a result or an outcome as a clause."""
    if reason in _REASONS:
        return _REASONS[reason]
    head, colon, rest = reason.partition(":")
    rest = rest.strip()
    tellers: Mapping[str, Callable[[str], str]] = {
        "refused": lambda text: f"arm control refused: {plain(text)}",
        "hold": lambda text: f"the arms were held and not allowed to go on: {hold_in_words(text)}",
        "gate": lambda text: f"the safeguard '{text.replace('_', ' ')}' stopped the arm",
        "rejected": lambda text: f"the previous plan was rejected: {plain(text)}",
        "deviation": lambda text: f"not as expected: {plain(text)}",
    }
    return tellers[head](rest) if colon and head in tellers else plain(reason)


def hold_in_words(holder: str, reason: str = "") -> str:
    """Tell who holds the arms, and why."""
    name, _, rest = holder.partition(":")
    if name == "client":
        told, rest = f"stopped by {plain(rest)}", ""
    elif name in HOLDERS:
        told = HOLDERS[name]
    elif name in SERVICES:
        told = f"waiting for the {service_in_words(name)}"
    else:
        told = f"stopped by {plain(name)}"
    why = reason or rest.strip()
    return f"{told} ({plain(why)})" if why else told


@lru_cache(TOLD)
def plain(text: str) -> str:
    """Put everything in a sentence that is shorthand into words."""
    text = _ACTION.sub(lambda found: _quoted_action(found[0]), text)
    text = _ATOM.sub(lambda found: f"“{fluent_in_words(found[0])}”", text)
    text = _BLOCK.sub(lambda found: point(found[0]), text)
    for arm, words in ARMS.items():
        text = re.sub(rf"\b{arm}\b", f"the {words}", text)
    for pattern, words in _PHRASES:
        text = pattern.sub(words, text)
    return text


def sentence(clause: str) -> str:
    """Begin with a capital, end with a full stop."""
    text = clause[:1].upper() + clause[1:]
    return text if text.endswith((".", "?", "!")) else f"{text}."


def _quoted_action(text: str) -> str:
    told = action_in_words(text)
    return f"“{told[:1].lower()}{told[1:]}”"


def _named(term: str) -> str:
    return point(term) if _BLOCK.fullmatch(term) else instrument(term)


def _measure(name: str) -> str:
    return _MEASURES.get(name, name.replace("_", " "))


def _number(value: float) -> str:
    """Tell a number with as many places as a person reads; one that is almost none as none."""
    return f"{value:.0f}" if abs(value) >= 100.0 else f"{round(value, 2) + 0.0:g}"
