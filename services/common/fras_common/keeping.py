"""How much is kept of each key, by its publisher and the recorder, and how often that is told."""

from typing import Final

from fras_common.rows import KEPT
from fras_common.topics import (
    FAULT,
    GUESTS,
    HEALTH,
    LOG,
    QUERIES,
    SERVICES,
    TOOLS,
    TOPICS,
    topic_of,
)

__all__ = ["beat_s_of", "is_of_ours", "kept_of"]

BEAT_S: Final = 0.1
UNHURRIED_BEAT_S: Final = 0.3

_BY_MIRROR: Final = {query.mirror: query.kept for query in QUERIES}
_MEMBERS: Final = tuple(
    topic.of(service=service).key
    for topic in (HEALTH, LOG, FAULT)
    for service in (*SERVICES, *GUESTS, *TOOLS)
)
_OURS: Final = frozenset([*(one.key for one in TOPICS), *_BY_MIRROR, *_MEMBERS])


def kept_of(key: str) -> int:
    """Tell how many messages of a concrete key are kept at the most."""
    if (kept := _BY_MIRROR.get(key)) is not None:
        return kept
    topic = topic_of(key)
    return topic.kept if topic is not None else KEPT


def beat_s_of(key: str) -> float:
    """Tell how often a publisher repeats its latest number, so that who lost that one asks for it.

    Half of a stack's idle work were these numbers; for most keys nobody waits.
    """
    topic = topic_of(key)
    return BEAT_S if topic is None or topic.awaited else UNHURRIED_BEAT_S


def is_of_ours(key: str) -> bool:
    """Whether one of our services has a concrete key: of others there is no end."""
    return key in _OURS
