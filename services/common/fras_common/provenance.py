"""Whose message it may be: the source in the header against the producer in the topic table."""

from fras_common.codec import MalformedMessage, read_header
from fras_common.topics import topic_of

ARM_DRIVERS = frozenset({"arms", "motion"})
"""Who may be the producer `arms`: a process of their own, or motion that simulates them."""


class WrongSource(MalformedMessage):
    """A message that says to be of another service than the one that speaks on its key."""

    counted_as = "wrong_source"

    def __init__(self, key: str, source: str, producers: frozenset[str]) -> None:
        expected = " or ".join(sorted(producers))
        super().__init__(key, "$.source", f"says {source!r}, and only {expected} speaks here")
        self.source = source
        self.values["source"] = source


def producers_of(key: str) -> frozenset[str] | None:
    """Name the services that may speak on a concrete key; None where anybody may.

    Anybody may on a command's key, whose receiver decides by its own state, and on a key that is
    not in the table.
    """
    topic = topic_of(key)
    if topic is None or topic.producer == "client":
        return None
    if topic.producer == "arms":
        return ARM_DRIVERS
    return frozenset({key.split("/")[1] if topic.producer == "*" else topic.producer})


def require_source(key: str, source: str) -> None:
    """Refuse a message whose source, `sim/3f2a`, is none of its key's producers.

    Raises
    ------
    WrongSource
    """
    producers = producers_of(key)
    if producers is not None and source.partition("/")[0] not in producers:
        raise WrongSource(key, source, producers)


def require_speaker(key: str, payload: bytes) -> None:
    """Do the same for a message as bytes; one without a header says nothing of itself.

    Raises
    ------
    WrongSource
    """
    header = read_header(payload) if producers_of(key) is not None else None
    if header is not None:
        require_source(key, header.source)
