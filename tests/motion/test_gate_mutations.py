"""Mutation check: with any one safeguard switched off, the tests that shall prove it fail.

That they pass otherwise is what the suite shows anyhow.
"""

from collections.abc import Callable
from typing import Any

import pytest

from fras_common.service.gate import TrialGate
from fras_motion import course
from fras_motion.controller import MotionController
from fras_motion.patience import Patience
from fras_motion.safety import CHECKS, GATES, SAFEGUARDS, Reaction
from fras_motion.trial import MotionTrial
from support.safety_page import ROOT, rows

PROOFS = {row.name: row.proofs for row in rows()}
NOWHERE = (0.05, 0.03, 0.05)


def nothing(*arguments: Any, **named: Any) -> None:
    del arguments, named


def no_trial_check(patch: pytest.MonkeyPatch) -> None:
    accept = MotionTrial.execute

    def execute(self: MotionTrial, trial: str, goal: Any) -> None:
        del trial
        self._open = True
        accept(self, self.name, goal)

    patch.setattr(MotionTrial, "execute", execute)
    patch.setattr(TrialGate, "admit", lambda self, route, message: True)


def deaf_to(level: str) -> Callable[[pytest.MonkeyPatch], None]:
    def switch_off(patch: pytest.MonkeyPatch) -> None:
        react = course.required_reaction
        patch.setattr(
            course,
            "required_reaction",
            lambda said, action: Reaction.GO_ON if said == level else react(said, action),
        )

    return switch_off


def no_watchdog(patch: pytest.MonkeyPatch) -> None:
    wait = Patience.exhausted
    patch.setattr(
        Patience, "exhausted", lambda self, now, missing, holds: wait(self, now, "", holds)
    )
    patch.setattr(MotionTrial, "may_tick", lambda self, verdict: self.controller.wants_tick)


def no_hold_timeout(patch: pytest.MonkeyPatch) -> None:
    make = Patience.__init__
    patch.setattr(
        Patience,
        "__init__",
        lambda self, peer_timeout_s, hold_timeout_s: make(self, peer_timeout_s, 0),
    )


def replaced(target: str, by: Callable[..., Any]) -> Callable[[pytest.MonkeyPatch], None]:
    return lambda patch: patch.setattr(target, by)


class Never(Exception):
    """What is never raised."""


#: How to switch off what is no gate and no check, or not only that.
SWITCHES: dict[str, Callable[[pytest.MonkeyPatch], None]] = {
    "another_trial": no_trial_check,
    "restart": replaced("fras_motion.trial.RESTART", "nobody"),  # type: ignore[arg-type]
    "goal_used": lambda patch: patch.setattr(MotionTrial, "require_new", nothing),
    "target_missing": replaced("fras_motion.primitives._target", lambda g: g.target_m or NOWHERE),
    "jaw_open": replaced("fras_motion.primitives._needs_closed_jaw", lambda goal, posture: 0.0),
    "jaw_closed": replaced("fras_motion.primitives._needs_open_jaw", nothing),
    "unreachable": replaced("fras_motion.kinematics.inverse._into_limits", lambda joints: joints),
    "profile": replaced("fras_motion.controller.ProfileImpossible", Never),  # type: ignore[arg-type]
    # Corners of a path are held against the box before the path is laid out, too.
    "workspace": replaced("fras_motion.primitives.check_workspace", nothing),
    "joint_acceleration": replaced("fras_motion.rehearsal.joint_accelerations", nothing),
    "verdict_tick": lambda patch: patch.setattr(MotionController, "expect", nothing),
    "verdict_invalid": deaf_to("invalid"),
    "force_soft": deaf_to("soft"),
    "force_hard": deaf_to("hard"),
    "hold": lambda patch: patch.setattr(MotionController, "hold", nothing),
    "supervision": replaced("fras_motion.page_watch.PageWatch._problem", lambda self, **_: ""),
    "cancel": lambda patch: patch.setattr(MotionTrial, "cancel", nothing),
    "watchdog": no_watchdog,
    "hold_timeout": no_hold_timeout,
}


def switch_off(name: str, patch: pytest.MonkeyPatch) -> None:
    for table in (GATES, CHECKS):
        if name in table:
            patch.setitem(table, name, nothing)  # type: ignore[arg-type]
    if name in SWITCHES or name not in {**GATES, **CHECKS}:
        SWITCHES[name](patch)


def run(proof: str) -> pytest.ExitCode:
    """Run one test in this process, with whatever is patched in it."""
    quiet = ("-q", "--no-header", "--timeout=0", "-p", "no:cacheprovider", "-p", "no:faulthandler")
    return pytest.ExitCode(pytest.main([*quiet, f"{ROOT}/{proof}"]))


CASES = [(name, proof) for name in SAFEGUARDS for proof in PROOFS.get(name, ("none",))]


@pytest.mark.parametrize(("name", "proof"), CASES)
def test_proof_fails_without_its_safeguard(
    name: str, proof: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    with monkeypatch.context() as patch:
        switch_off(name, patch)
        assert run(proof) is pytest.ExitCode.TESTS_FAILED
