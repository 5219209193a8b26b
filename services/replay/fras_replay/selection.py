"""Which keys of a log are replayed, and under which names."""

import re
from collections.abc import Sequence
from dataclasses import dataclass

from fras_replay.errors import BadKey

OWN = re.compile(r"(?:health|log|fault)/replay|rpc/replay/.+")
"""What a replay says of itself; a log that holds it was recorded of a replay."""
_KEY = re.compile(r"[^/*$#?@{}\s]+(?:/[^/*$#?@{}\s]+)*")


@dataclass(frozen=True)
class Selection:
    """What was asked for.

    Attributes
    ----------
    include, exclude : sequence of str
        Keys, or families as `sim/**` (`*` is one chunk, `**` any number); nothing included: all.
    remap : sequence of (str, str)
        Old and new key, or old and new family: both with `/**`.
    """

    include: Sequence[str] = ()
    exclude: Sequence[str] = ()
    remap: Sequence[tuple[str, str]] = ()

    def choose(self, keys: Sequence[str]) -> dict[str, str]:
        """Return the new name of each key that is replayed.

        Parameters
        ----------
        keys : sequence of str
            Those of the log.

        Raises
        ------
        BadKey
            A pattern fits none of them, a new name can't be a key or is taken.
        """
        for pattern in (*self.include, *self.exclude, *(old for old, _ in self.remap)):
            if not any(fits(pattern, key) for key in keys):
                known = ", ".join(sorted(keys))
                raise BadKey(f"{pattern!r} fits no key of the log; there are: {known}", key=pattern)
        chosen: dict[str, str] = {}
        taken: dict[str, str] = {}
        for key in keys:
            if OWN.fullmatch(key) or not self._wanted(key):
                continue
            name = self._renamed(key)
            if name in taken:
                raise BadKey(f"both {taken[name]!r} and {key!r} would be {name!r}", key=name)
            chosen[key] = name
            taken[name] = key
        return chosen

    def _wanted(self, key: str) -> bool:
        included = not self.include or any(fits(one, key) for one in self.include)
        return included and not any(fits(one, key) for one in self.exclude)

    def _renamed(self, key: str) -> str:
        name = key
        for old, new in self.remap:
            if fits(old, key):
                head, family = old.removesuffix("**"), old.endswith("**")
                name = new.removesuffix("**") + key[len(head) :] if family else new
                break
        if not _KEY.fullmatch(name) or OWN.fullmatch(name):
            raise BadKey(f"{key!r} can't be sent as {name!r}: use --exclude or --remap", key=name)
        return name


def fits(pattern: str, key: str) -> bool:
    """Whether a pattern, with `*` for one chunk and `**` for any number, matches a key."""
    chunks = {"**": ".*", "*": "[^/]+"}
    parts = [chunks.get(chunk, re.escape(chunk)) for chunk in pattern.split("/")]
    # `a/**` matches `a`, too, as it does on the bus.
    text = "/".join(parts).replace("/.*", "(?:/.*)?").replace(".*/", "(?:.*/)?")
    return re.fullmatch(text, key) is not None


def parse_remap(text: str) -> tuple[str, str]:
    """Read `OLD=NEW`.

    Raises
    ------
    BadKey
        It is not that, or a family is to become a key or the other way round.
    """
    old, sign, new = text.partition("=")
    if not sign or not old or not new or old.endswith("/**") != new.endswith("/**"):
        raise BadKey(f"{text!r} renames nothing: give OLD=NEW, or OLD/**=NEW/**", key=text)
    if "*" in old.removesuffix("/**") + new.removesuffix("/**"):
        raise BadKey(f"{text!r}: a family is named with /** at its end alone", key=text)
    return old, new
