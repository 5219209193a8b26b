"""What situation awareness can't answer."""

from fras_common.errors import FrasError


class NothingKnown(FrasError):
    """No state of this trial has been seen yet."""


class TooFarAhead(FrasError):
    """A state of a tick that nobody can have come to yet."""

    def __init__(self, tick: int, next_tick: int) -> None:
        super().__init__(
            f"state of tick {tick}, and tick {next_tick} is the next to judge: dropped",
            tick=tick,
            next_tick=next_tick,
        )


class TooManyQuestions(FrasError):
    """More questions wait for a tick than can be kept."""

    def __init__(self, waiting: int, min_tick: int) -> None:
        super().__init__(
            f"{waiting} questions wait already, this one for tick {min_tick}: ask again later",
            waiting=waiting,
            min_tick=min_tick,
        )


class OtherTrial(FrasError):
    """A question about another trial than the one that is watched."""

    def __init__(self, asked: str, watched: str) -> None:
        super().__init__(
            f"asked about trial {asked!r}, watching {watched!r}: reset first",
            asked=asked,
            watched=watched,
        )


class LostMoment(FrasError):
    """The states of the last tick judged can't be recalled, and with them what SA remembers."""

    def __init__(self, tick: int) -> None:
        super().__init__(
            f"the recorder does not remember the states of tick {tick}, which was judged last: "
            "the trial can't go on",
            tick=tick,
        )
