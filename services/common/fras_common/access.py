"""Who may do what: the topic table as access-control rules of a Zenoh router.

What is not allowed is refused. Whoever shows a certificate of the CA may read everything; what else
it may, its certificate's name says. Zenoh carries caches, heartbeats and recovery of a key below
that key, behind a chunk `@adv`, which `**` does not match.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType
from typing import Any

from fras_common.provenance import ARM_DRIVERS
from fras_common.topics import GUESTS, QUERIES, SERVICES, TOOLS, TOPICS, Qos, Query, Topic

PARTICIPANTS: tuple[str, ...] = (
    *SERVICES,
    *GUESTS,
    *TOOLS,
    "cli",
    "client",
)
"""Names of certificates that may take part; `client` leads arms, as `motion` does."""

LEADERS = frozenset({"motion", "client"})
"""Who may tell an arm to move."""

REPLAY = "replay"
LINK = "router-"
"""How the certificate's name of a router begins that links to others, or is linked to."""
_ADVANCED = frozenset({Qos.STATE, Qos.EVENT})
_READS = ("declare_subscriber", "declare_liveliness_subscriber", "liveliness_query")
_SERVES = ("declare_queryable", "reply")
_WRITES = ("put", "delete", *_SERVES, "query", "liveliness_token")

Rule = dict[str, object]


@dataclass(frozen=True)
class Rights:
    """What a participant may do besides reading; key expressions within the cell.

    Attributes
    ----------
    publishes : tuple of str
        Keys or families.
    kept : tuple of str
        Those of them that are kept for whoever comes later, and recovered.
    serves, asks : tuple of str
        Queries that it answers, and that it may ask.
    """

    publishes: tuple[str, ...]
    kept: tuple[str, ...]
    serves: tuple[str, ...]
    asks: tuple[str, ...]


def rights_of(name: str) -> Rights:
    """Read a participant's rights from the topic table."""
    topics = [topic for topic in TOPICS if _may_publish(name, topic)]
    return Rights(
        publishes=tuple(_own(name, topic) for topic in topics),
        kept=tuple(_own(name, topic) for topic in topics if topic.qos in _ADVANCED),
        serves=tuple(query.key for query in QUERIES if query.server == name),
        asks=tuple(query.key for query in QUERIES if _may_ask(name, query)),
    )


def access_control(
    cell: str,
    participants: Sequence[str] = PARTICIPANTS,
    *,
    replays: bool = False,
    names: Mapping[str, str] = MappingProxyType({}),
    links: Mapping[str, Sequence[str]] = MappingProxyType({}),
) -> Mapping[str, object]:
    """Make Zenoh's `access_control` for the router of a cell.

    Parameters
    ----------
    cell : str
    participants : sequence of str
    replays : bool
        The cell is for looking at logs: `replay` speaks in everybody's place.
    names : mapping of str to str
        What a participant's certificate must say where that is not the participant's own name.
    links : mapping of str to sequence of str
        Other routers, and the participants behind each: together it may what they may.
    """
    rules = _everybodys_rules(cell)
    subjects = {name: names.get(name, name) for name in (*participants, *links)}
    policies: list[Rule] = [{"rules": [one["id"] for one in rules], "subjects": [*subjects]}]
    for name in participants:
        own = _own_rules(cell, name)
        if replays and name == REPLAY:
            messages = ("put", *_SERVES, "liveliness_token")
            own.append(_rule("replay-all", "ingress", messages, _everything(cell)))
        rules += own
        policies.append({"rules": [one["id"] for one in own], "subjects": [name]})
    for router, behind in links.items():
        behind_it = [one["id"] for name in behind for one in _own_rules(cell, name)]
        policies.append({"rules": behind_it, "subjects": [router]})
    return {
        "enabled": True,
        "default_permission": "deny",
        "rules": rules,
        "subjects": [{"id": name, "cert_common_names": [cn]} for name, cn in subjects.items()],
        "policies": policies,
    }


def _everybodys_rules(cell: str) -> list[Rule]:
    """Whoever is let in hears all, and may ask the caches for what it missed."""
    everything = _everything(cell)
    return [
        _rule("hear", "egress", (*_READS, *_WRITES), everything),
        _rule("read", "ingress", _READS, everything),
        _rule("recover", "ingress", ("query",), everything[1:]),
    ]


def _everything(cell: str) -> tuple[str, str]:
    return f"fras/{cell}/**", f"fras/{cell}/**/@adv/**"


def _own_rules(cell: str, name: str) -> list[Rule]:
    rights = rights_of(name)
    wanted = (
        ("publish", ("put", "reply"), rights.publishes),
        ("keep", ("put", *_SERVES), [f"{key}/@adv/**" for key in rights.kept]),
        ("serve", _SERVES, rights.serves),
        ("ask", ("query",), rights.asks),
        ("be", ("liveliness_token",), (f"alive/{name}/*", f"ready/{name}/*")),
    )
    return [
        _rule(f"{name}-{verb}", "ingress", messages, [f"fras/{cell}/{key}" for key in keys])
        for verb, messages, keys in wanted
        if keys
    ]


def _rule(name: str, flow: str, messages: Sequence[str], keys: Sequence[str]) -> Rule:
    return {
        "id": name,
        "permission": "allow",
        "flows": [flow],
        "messages": [*messages],
        "key_exprs": [*keys],
    }


def _may_publish(name: str, topic: Topic[Any]) -> bool:
    if topic.producer == "*":
        return True
    if topic.producer == "client":
        return name in LEADERS
    return name in ARM_DRIVERS if topic.producer == "arms" else name == topic.producer


def _own(name: str, topic: Topic[Any]) -> str:
    """Key, or of a family the part that is the participant's own."""
    head, brace, rest = topic.key.partition("{")
    if not brace:
        return topic.key
    return f"{head}{name}/**" if "{" in rest else f"{head}{name}"


def _may_ask(name: str, query: Query[Any, Any]) -> bool:
    return "*" in query.askers or name in query.askers
