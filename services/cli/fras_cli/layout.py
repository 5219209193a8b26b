"""What a stack consists of: its process table, rules, keys, hosts."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from types import MappingProxyType

from fras_cli.own_keys import require_keys
from fras_cli.own_rules import read_rules
from fras_cli.patient import require_process
from fras_common.errors import FrasError
from fras_common.identity import default_keys_dir
from fras_supervisor import Endpoint, Table, UnknownHost, find_table, load_table, place
from fras_supervisor.hosts import placeholder
from fras_supervisor.supervision import NAME as SUPERVISOR
from fras_supervisor.table import PLACEHOLDERS

USUAL_TABLE = "local"


class OtherRules(FrasError):
    """Rules or processes were asked for of a stack that has its own. Attributes: ``cell``."""


@dataclass(frozen=True)
class Layout:
    """What an own stack consists of.

    Attributes
    ----------
    compose : str
        Process table: `compose/<name>.toml`, or a file.
    asp_dir : Path or None
        Rules for the planner other than those that came with FRAS.
    keys : Path or None
        Folder of the certificates by which its processes know each other; None: by none.
    host : str
        Which host of the table this machine is; empty: all of it runs here.
    addresses : mapping of str to str
        Where the routers of hosts are.
    patient : bool
        A patient has to be among its processes: the usual table is then `twin`, no other layout.
    """

    compose: str = USUAL_TABLE
    asp_dir: Path | None = None
    keys: Path | None = None
    host: str = ""
    addresses: Mapping[str, str] = field(default_factory=dict[str, str])
    patient: bool = field(default=False, compare=False)

    def table(self) -> Table:
        """Read the process table.

        Raises
        ------
        TableError
        NoPatient
        """
        path = Path(self.compose)
        path = path if path.suffix == ".toml" else find_table(self._shipped())
        table = load_table(path, (*PLACEHOLDERS, "keys"))
        if self.patient:
            require_process(table)
        if self.keys is not None:
            require_keys(table)
        return table

    def placed(self, port: int) -> tuple[Table, dict[str, str]]:
        """Take out what runs on this host; give what to fill in for the routers' endpoints, too.

        Raises
        ------
        TableError
        UnknownHost, NothingOnHost, NoAddress, BadAddress
            See `fras_supervisor.place`.
        OtherRules
            The rules are for a planner that is not here.
        UnusableRules
        """
        table, routers = self.table(), {}
        if self.host or self.addresses:
            table, routers = place(table, self.host, port, self.addresses, self.protocol)
        if self.asp_dir is None:
            return table, routers
        if "planner" not in table.processes:
            raise OtherRules(
                f"there is no planner on host {self.host or 'of this table'}: leave out "
                f"--asp-dir {self.asp_dir}, or give it where the planner is",
                cell="",
            )
        read_rules(self.asp_dir)
        rules = str(self.asp_dir.resolve())
        return table.with_arguments("planner", "--asp-dir", rules), routers

    def certificates_of(self, host: str) -> list[str]:
        """List whose certificates a host of the table needs.

        Raises
        ------
        TableError, UnknownHost
        """
        table = self.table()
        if host not in table.hosts:
            raise UnknownHost(table.source, host, tuple(table.hosts))
        return [*(one.name for one in table.processes.values() if one.host == host), SUPERVISOR]

    def own_addresses(self, routers: Mapping[str, str]) -> list[str]:
        """List where others reach a router of this host; empty if none asks for it."""
        mine = routers.get(placeholder(self.host), "") if self.host else ""
        return [Endpoint.parse(mine).host] if mine else []

    def far_routers(self, port: int) -> dict[str, str]:
        """Return hosts whose routers this one links to, each with its endpoint."""
        table, routers = self.placed(port)
        others = {host: placeholder(host) for host in table.hosts if host != self.host}
        return {host: routers[name] for host, name in others.items() if name in routers}

    def _shipped(self) -> str:
        compose = "twin" if self.patient and self.compose == USUAL_TABLE else self.compose
        if self.keys is None:
            return compose
        return "secure" if compose == USUAL_TABLE else f"secure-{compose}"

    @property
    def protocol(self) -> str:
        """Of its router's endpoint."""
        return "tcp" if self.keys is None else "tls"

    @property
    def values(self) -> dict[str, str]:
        """What its table may ask for in braces, besides what the supervisor knows."""
        return {} if self.keys is None else {"keys": str(self.keys.resolve())}

    def in_words(self) -> str:
        """Options that ask for it; empty for the usual one."""
        asked = [] if self.compose == USUAL_TABLE else [f"--compose {self.compose}"]
        asked += ["--secure"] if self.keys is not None else []
        asked += [f"--host {self.host}"] if self.host else []
        return " ".join([*asked, *([f"--asp-dir {self.asp_dir}"] if self.asp_dir else [])])


USUAL = Layout()


def layout_of(
    compose: str,
    asp_dir: Path | None,
    *,
    secure: bool,
    host: str = "",
    addresses: Mapping[str, str] = MappingProxyType({}),
) -> Layout:
    """Make a layout of what the command line asks for.

    Raises
    ------
    BadIdentity
        Nobody knows where this user's keys are.
    """
    keys = default_keys_dir() if secure else None
    return Layout(compose, asp_dir, keys, host, addresses)
