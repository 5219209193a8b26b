"""What situation awareness refuses, each with the values that made it refuse."""

from collections.abc import Sequence

from fras_common.errors import FrasError


class AwarenessError(FrasError):
    """Base of the errors of situation awareness."""


class BadParameter(AwarenessError):
    """A threshold outside what has a meaning."""

    def __init__(self, name: str, value: object, allowed: str) -> None:
        super().__init__(
            f"situation awareness parameter {name} = {value!r}: must be {allowed}; "
            "correct it in the scenario",
            name=name,
            value=value,
            allowed=allowed,
        )


class MalformedModel(AwarenessError):
    """A tissue model whose arrays do not fit together."""

    def __init__(self, field: str, problem: str) -> None:
        super().__init__(
            f"tissue model, {field}: {problem}; reset the simulator with a sound mesh",
            field=field,
            problem=problem,
        )


class NoTissueNearRoi(AwarenessError):
    """No tissue lies within the visibility distance of the ROI, so nothing hides it."""

    def __init__(self, roi_m: Sequence[float], distance_m: float) -> None:
        place = ", ".join(f"{value:.4f}" for value in roi_m)
        super().__init__(
            f"no tissue surface within {distance_m} m of the ROI ({place}) at rest, so its "
            "visibility is undefined; move the ROI under the tissue or raise visible_distance_m",
            roi_m=tuple(roi_m),
            distance_m=distance_m,
        )


class NoBlocks(AwarenessError):
    """No cell of the grid has tissue at its centre."""

    def __init__(self, blocks: int) -> None:
        super().__init__(
            f"none of the {blocks} x {blocks} cells over the tissue has surface at its centre; "
            "raise the number of blocks or check the mesh's surface",
            blocks=blocks,
        )


class UnusableState(AwarenessError):
    """A state with values that are not finite or do not fit the model."""

    def __init__(self, quantity: str, problem: str) -> None:
        super().__init__(
            f"{quantity}: {problem}; no fluent can be told from it: reset the trial",
            quantity=quantity,
            problem=problem,
        )


class TwoTicks(AwarenessError):
    """Where the tissue is at one tick, and what it bears at another."""

    def __init__(self, believed: int, seen: int) -> None:
        super().__init__(
            f"a force of tick {believed} with positions of tick {seen}: join them by tick first",
            believed=believed,
            seen=seen,
        )


class UnknownAtom(AwarenessError):
    """An expectation about a fluent, arm or block that the scene does not have."""

    def __init__(self, atom: str, sort: str, name: str, known: Sequence[str]) -> None:
        super().__init__(
            f"{atom!r} can't be monitored: unknown {sort} {name!r}; known: {_some(known)}",
            atom=atom,
            sort=sort,
            name=name,
            known=tuple(known),
        )


class UnknownName(AwarenessError):
    """An action, arm or block that the scene does not have."""

    def __init__(self, sort: str, name: str, known: Sequence[str]) -> None:
        super().__init__(
            f"unknown {sort} {name!r}; known: {_some(known)}",
            sort=sort,
            name=name,
            known=tuple(known),
        )


def _some(names: Sequence[str]) -> str:
    return ", ".join(names[:8]) + (", ..." if len(names) > 8 else "")
