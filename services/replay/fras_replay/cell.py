"""Into which cells a log may be replayed."""

from collections.abc import Iterable

NAME = "replay"
# They hear everything and move nothing: a replay may be watched, and recorded again.
LISTENERS = frozenset({"recorder", "monitor"})


def live(tokens: Iterable[str], instance: str) -> set[str]:
    """Return what makes a cell live: all but listeners and this very replay.

    Parameters
    ----------
    tokens : iterable of str
        Liveliness tokens, as `alive/sim/3f2a`.
    instance : str
        Of this replay.
    """
    own = f"{NAME}/{instance}"
    others = {token.partition("/")[2] for token in tokens} - {own}
    return {other for other in others if other.partition("/")[0] not in LISTENERS}
