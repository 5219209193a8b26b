"""Whom of other hosts `fras up` waits for: pure, from names to words."""

from collections.abc import Collection, Mapping


class OtherHosts:
    """Tells of every change in who of the other hosts is there.

    Parameters
    ----------
    elsewhere : mapping of str to str
        Processes of other hosts, and whose they are; empty: there is nothing to tell.
    """

    def __init__(self, elsewhere: Mapping[str, str]) -> None:
        self._elsewhere = elsewhere
        self._told: str | None = None

    def look(self, missing: Collection[str]) -> str:
        """Say it in words if it has changed; else nothing.

        Parameters
        ----------
        missing : collection of str
            Services, of this host or others, that are not ready.
        """
        if not self._elsewhere:
            return ""
        waits: dict[str, list[str]] = {}
        for name in missing:
            if (host := self._elsewhere.get(name)) is not None:
                waits.setdefault(host, []).append(name)
        if waits:
            now = "waiting for " + "; ".join(
                f"{', '.join(names)} of host {host}" for host, names in waits.items()
            )
        elif missing:
            # Ours, which are not ready because theirs have only just come.
            return ""
        else:
            now = "the services of all hosts are ready"
        if now == self._told:
            return ""
        self._told = now
        return now
