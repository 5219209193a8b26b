"""What situation awareness (SA) publishes and answers."""

from typing import Literal

from fras_common.messages.base import Header, Vec3, Wire

Level = Literal["ok", "soft", "hard", "invalid"]
Evidence = dict[str, float]


class Verdict(Header, frozen=True, kw_only=True):
    """Whether the arm may go on: one a tick, motion moves on nothing else.

    Attributes
    ----------
    level : {"ok", "soft", "hard", "invalid"}
        What motion may do next, docs/tick-protocol.md.
    max_force_n : float
        Force by the scenario's metric.
    visibility : float
        Share of the tissue around the region of interest that has been lifted clear of it.
    max_height : list of arms
        Arms that may not pull higher.
    force_rate_n_s : float
        How fast that force changes, smoothed over two ticks or so; an invalid tick leaves it.
    crossing_tick : int
        First tick at which the force is expected above the limit that binds the action (soft in
        a pull, else hard); -1 if none is in sight.
    grasped : dict of arm to number of nodes held
    """

    level: Level
    ok: bool
    reason: str
    max_force_n: float
    limit_n: float
    hard_limit_n: float
    visibility: float
    visible: bool
    max_height: list[str]
    force_rate_n_s: float
    crossing_tick: int
    max_node_speed_m_s: float
    grasped: dict[str, int]


class ContextRequest(Wire, frozen=True, kw_only=True):
    """Ask for the context as soon as SA has seen `min_tick`.

    Attributes
    ----------
    expected : list of atoms
        What must hold after the action just done (a leading - means: must not), for `monitored`.
    """

    trial: str
    request_id: str
    min_tick: int
    expected: list[str]


class Monitored(Wire, frozen=True, kw_only=True):
    """Whether one expected `atom` (as asked) is as expected, and the numbers behind it."""

    atom: str
    holds: bool
    evidence: Evidence


class Context(Header, frozen=True, kw_only=True):
    """The situation in logical terms, with the numbers behind each fluent."""

    request_id: str
    fluents: list[str]
    evidence: dict[str, Evidence]
    names: list[str]
    blocks_m: list[Vec3]
    roi_m: Vec3
    fixed_points_m: list[Vec3]
    monitored: list[Monitored]


class TargetRequest(Wire, frozen=True, kw_only=True):
    """Ask where `arm` must go for an action."""

    trial: str
    action: str
    arm: str
    block: str


class TargetReply(Wire, frozen=True, kw_only=True):
    """Target in the world frame; nothing for actions that need none."""

    position_m: Vec3 | None
