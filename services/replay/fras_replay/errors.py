"""Why there is nothing to replay, or no place to replay it into."""

from collections.abc import Collection

from fras_common.errors import FrasError


class NothingToReplay(FrasError):
    """No message is left of the log, or of the part that was asked for."""


class BadKey(FrasError):
    """A pattern that fits no key of the log, or a new name that can't be one."""


class BadPlace(FrasError):
    """A place in the log that can't be understood. Attributes: ``place``."""

    def __init__(self, text: str) -> None:
        super().__init__(
            f"{text!r} is no place in a log: give a tick, as 120, or seconds from its start, as "
            "2.5s",
            place=text,
        )


class BadRate(FrasError):
    """A rate that can't be kept. Attributes: ``rate``."""

    def __init__(self, rate: float, least: float, most: float) -> None:
        super().__init__(
            f"rate {rate:g}: from {least:g} to {most:g} seconds of the log a second, or 0 for as "
            "fast as possible",
            rate=rate,
        )


class NoSuchMark(FrasError):
    """A mark that the log does not have. Attributes: ``number``."""


class LiveCell(FrasError):
    """Somebody in the cell acts on messages, or replays already. Attributes: ``services``."""

    def __init__(self, cell: str, services: Collection[str]) -> None:
        names = ", ".join(sorted(services))
        super().__init__(
            f"cell {cell!r} is live, with {names}: recorded commands must not reach arms, nor "
            "recorded states those who watch them; replay into another --cell",
            cell=cell,
            services=sorted(services),
        )
