"""Why a host's router is not reached from here: what a plain connection to it says."""

import socket
import threading
from collections.abc import Mapping

from fras_supervisor import Endpoint

AFTER_S = 5.0
"""A router that is only just starting is not spoken of."""
HEARD_AFTER_S = 60.0
"""Nor are services that load their libraries, behind a router that answers."""
EVERY_S = 5.0
TIMEOUT_S = 3.0


def obstacle(endpoint: str, timeout_s: float = TIMEOUT_S) -> str:
    """Connect to an endpoint and leave; say what hindered it, or nothing."""
    place = Endpoint.parse(endpoint)
    try:
        socket.create_connection((place.host, place.port), timeout_s).close()
    except socket.gaierror:
        return f"no such host name: {place.host}"
    except ConnectionRefusedError:
        return f"nothing listens there: is `fras up` running on it, and {place.port} its port?"
    except TimeoutError:
        return f"no answer: another address, or a firewall that drops {place.port}/tcp?"
    except OSError as error:
        return str(error)
    return ""


class FarRouters:
    """Looks, while services of other hosts are waited for, whether those hosts' routers answer.

    Parameters
    ----------
    endpoints : mapping of str to str
        Of hosts whose routers this one links to; empty: nobody is looked for.
    """

    def __init__(self, endpoints: Mapping[str, str]) -> None:
        self._endpoints = endpoints
        self._since_s: float | None = None
        self._looked_s = 0.0
        self._found: dict[str, str] = {}
        self._told: dict[str, str] = {}
        self._looker: threading.Thread | None = None

    def look(self, *, waiting: bool, now_s: float) -> list[str]:
        """Say what is new about routers that are not reached.

        Parameters
        ----------
        waiting : bool
            Whether services of other hosts are missing.
        now_s : float
            By a clock that never goes back.
        """
        if not waiting or not self._endpoints:
            self._since_s = None
            self._told.clear()
            self._found.clear()
            return []
        if self._since_s is None:
            self._since_s = self._looked_s = now_s
        waited_s = now_s - self._since_s
        if now_s - self._looked_s >= EVERY_S and not self._is_looking():
            self._looked_s = now_s
            # A name server may take long to say that it knows no such name.
            self._looker = threading.Thread(target=self._look, name="far routers", daemon=True)
            self._looker.start()
        said: list[str] = []
        for host, problem in dict(self._found).items():
            words = problem or (_SILENT if waited_s >= HEARD_AFTER_S else "")
            if waited_s >= AFTER_S and words and self._told.get(host) != words:
                self._told[host] = words
                said.append(f"the router of host {host} at {self._endpoints[host]}: {words}")
        return said

    def _is_looking(self) -> bool:
        return self._looker is not None and self._looker.is_alive()

    def _look(self) -> None:
        for host, endpoint in self._endpoints.items():
            self._found[host] = obstacle(endpoint)


_SILENT = (
    "something answers, but no service behind it is heard: the same cell on both hosts? "
    "With --secure: keys of one CA (`fras keys export`)? The logs of both routers say more"
)
