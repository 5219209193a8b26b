"""How a trial begins: its log is opened, and every service understands the same scenario."""

from collections.abc import Generator, Mapping
from typing import Any

from fras_common.codec import content_digest
from fras_common.messages import OpenRequest, ResetReply, ResetRequest, TaskRequest
from fras_common.scenario import Scenario
from fras_common.topics import MOTION_RESET, SA_RESET, SIM_RESET
from fras_planner.effects import Ask
from fras_planner.endings import DigestMismatch

RESET_TIMEOUT_S = 60.0


def log_request(request: TaskRequest, scenario: Scenario, rules: Mapping[str, str]) -> OpenRequest:
    """Return what opens the log; `rules` are the files that the planner goes by."""
    return OpenRequest(
        trial=request.trial,
        scenario=scenario,
        mesh=request.mesh,
        directory=request.out_dir,
        rules=dict(rules),
    )


def reset_all(request: TaskRequest, scenario: Scenario) -> Generator[Ask, Any, None]:
    """Reset motion, sim and SA, in this order; raises as `compare` does."""
    reset = ResetRequest(trial=request.trial, scenario=scenario, mesh=request.mesh)
    for query in (MOTION_RESET, SIM_RESET, SA_RESET):
        reply: ResetReply = yield Ask(query, reset, RESET_TIMEOUT_S)
        compare(request, scenario, reply, query.server)


def compare(request: TaskRequest, scenario: Scenario, reply: ResetReply, service: str) -> None:
    """Require that a service has understood what it was sent.

    Raises
    ------
    DigestMismatch
    """
    expected = content_digest(request.trial, scenario, request.mesh)
    if reply.digest != expected:
        raise DigestMismatch(
            f"{service} read another scenario (digest {reply.digest[:12]}, expected "
            f"{expected[:12]}): do all services run the same version?",
            service=service,
        )
