"""What situation awareness can't answer."""

from fras_common.errors import FrasError


class NothingKnown(FrasError):
    """No state of this trial has been seen yet."""


class OtherTrial(FrasError):
    """A question about another trial than the one that is watched."""

    def __init__(self, asked: str, watched: str) -> None:
        super().__init__(f"asked about trial {asked!r}, watching {watched!r}: reset first")
