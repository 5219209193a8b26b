"""Who else is in the cell: nobody who acts on messages, before a replay and while it runs."""

from fras_common.service import ServiceHost
from fras_replay.cell import NAME, live
from fras_replay.errors import LiveCell

__all__ = ["CellWatch"]

TOKENS_S = 5.0


class CellWatch:
    """Stops a replay before the next message once somebody comes who acts on them.

    Parameters
    ----------
    host : ServiceHost
    cell, instance : str
        Where it is, and the name of this participant there.

    Attributes
    ----------
    intruder : LiveCell or None
        Why it was stopped.
    """

    def __init__(self, host: ServiceHost, cell: str, instance: str) -> None:
        self._host = host
        self._cell = cell
        self._instance = instance
        self.intruder: LiveCell | None = None

    def require_dead(self) -> None:
        """Ask who is there.

        Raises
        ------
        LiveCell
            Somebody acts on messages there, or replays already.
        NoAnswer
            The router can't tell who is there.
        """
        if others := live(self._host.bus.tokens(TOKENS_S), self._instance):
            raise LiveCell(self._cell, others)

    def begin(self) -> None:
        """Watch from now on who comes."""
        self._host.bus.watch_tokens(self._on_token)

    def _on_token(self, token: str, present: bool) -> None:
        # Another replay looks again once it is seen, and finds this one: it is the one that goes.
        if present and token.split("/")[1] != NAME and live({token}, self._instance):
            self._host.post(lambda: self._flee({token}))

    def _flee(self, tokens: set[str]) -> None:
        """Stop before the next message: somebody who acts on them has come."""
        self.intruder = LiveCell(self._cell, live(tokens, self._instance))
        self._host.stop()
