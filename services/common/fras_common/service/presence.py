"""Who is there, as the liveliness tokens tell, and whether a service is ready for it."""

from collections import defaultdict


class Presence:
    """Tokens by name and instance, and what one service waits for.

    Parameters
    ----------
    name : str
        The service.

    Attributes
    ----------
    inputs : set of str
        Services that it listens to or asks.
    unmet : set of str
        What has to be done before it is ready.
    is_alive, is_ready : bool
        What it has announced, or is about to.
    """

    def __init__(self, name: str) -> None:
        self.inputs: set[str] = set()
        self.unmet: set[str] = set()
        self.is_alive = False
        self.is_ready = False
        self._name = name
        self._tokens: dict[str, set[str]] = defaultdict(set)

    def note(self, token: str, present: bool) -> None:
        """Take in that a token has come or gone, `alive/sim/3f2a`."""
        name, _, instance = token.rpartition("/")
        if present:
            self._tokens[name].add(instance)
        elif name in self._tokens:
            self._tokens[name].discard(instance)
            if not self._tokens[name]:
                del self._tokens[name]

    def of(self, token: str) -> bool:
        """Whether some instance shows a token, `alive/sim`."""
        return token in self._tokens

    def becomes_ready(self) -> bool:
        """Whether it is ready now and was not before: itself alive, and all that it needs."""
        if self.is_ready or self.unmet:
            return False
        self.is_ready = all(self.of(f"alive/{one}") for one in (self._name, *self.inputs))
        return self.is_ready
