"""How a trial begins: its log is opened, and every service understands the same scenario."""

from collections.abc import Generator, Mapping
from typing import Any

from fras_common.codec import content_digest
from fras_common.messages import OpenRequest, ResetReply, ResetRequest, TaskRequest
from fras_common.scenario import Scenario, patient_scenario
from fras_common.topics import MOTION_RESET, PATIENT, SA_RESET, SIM_RESET
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
    """Reset motion, sim, the patient where there is one, and SA, in this order.

    The patient's scenario is derived from the trial's; whoever else is reset gets the trial's own.

    Raises
    ------
    DigestMismatch
        See `compare`.
    ScenarioError
        No patient can be derived.
    """
    derived = patient_scenario(scenario)
    resets = [(MOTION_RESET, scenario), (SIM_RESET, scenario)]
    resets += [(PATIENT.reset, derived)] if derived is not None else []
    for query, own in (*resets, (SA_RESET, scenario)):
        reset = ResetRequest(trial=request.trial, scenario=own, mesh=request.mesh)
        reply: ResetReply = yield Ask(query, reset, RESET_TIMEOUT_S)
        compare(request, own, reply, query.server)


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
