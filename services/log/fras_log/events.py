"""What stands in a log, piece by piece."""

from dataclasses import dataclass
from typing import NamedTuple

from fras_log.channels import Definition


class Recorded(NamedTuple):
    """A message.

    Parameters
    ----------
    offset : int
        Of its chunk in the file.
    channel : Definition
        Key, encodings and schema.
    log_time, publish_time, sequence : int
        As the file has them.
    payload : bytes
        As it travelled.
    """

    offset: int
    channel: Definition
    log_time: int
    publish_time: int
    sequence: int
    payload: bytes

    @property
    def topic(self) -> str:
        """Key without the cell."""
        return self.channel.topic


@dataclass(frozen=True, slots=True)
class Began:
    """The header: whose conventions the file follows."""

    offset: int
    profile: str


@dataclass(frozen=True, slots=True)
class Told:
    """A metadata record."""

    offset: int
    name: str
    content: dict[str, str]


@dataclass(frozen=True, slots=True)
class Attached:
    """An attachment."""

    offset: int
    name: str
    content: bytes


@dataclass(frozen=True, slots=True)
class Broken:
    """Damage.

    Parameters
    ----------
    offset : int
        Where it was noticed.
    text : str
        What is wrong.
    loses : bool
        Whether messages may be missing for it.
    """

    offset: int
    text: str
    loses: bool = True


@dataclass(frozen=True, slots=True)
class Cut:
    """The file ends before its footer: it was cut, never closed, or is still written."""

    offset: int
    text: str


@dataclass(frozen=True, slots=True)
class Ended:
    """The file's end as it should be: footer, checksums, index and all."""

    offset: int


Event = Began | Recorded | Told | Attached | Broken | Cut | Ended
