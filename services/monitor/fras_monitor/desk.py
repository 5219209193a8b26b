"""What the buttons do: each a message on the bus, and so in the recording."""

from collections.abc import Callable
from typing import Final, Protocol

from fras_common.bus import Bus
from fras_common.errors import FrasError
from fras_common.messages import (
    ApproveRequest,
    DecisionReply,
    HoldState,
    RejectRequest,
    ReplayStatus,
    ResumeRequest,
    WhyNotReply,
    WhyNotRequest,
)
from fras_common.topics import APPROVE, REJECT, REPLAY_CONTROL, RESUME, WHY_NOT
from fras_monitor.commands import (
    AnyCommand,
    Approve,
    Colour,
    Colouring,
    Here,
    Look,
    Reject,
    Replay,
    Resume,
    Stop,
    WhyNot,
)
from fras_monitor.stop import HOLDER, Stopper
from fras_monitor.words import hold_in_words, plain, sentence

ANSWER_S: Final = 5.0
NO_REASON: Final = "no reason given"


class Tell(Protocol):
    """Tells every page something once."""

    def __call__(self, words: str, *, good: bool = True) -> None:
        """Tell it."""
        ...


class Desk:
    """Carries out what a surgeon asks for; waits for nothing, answers come when they come.

    Parameters
    ----------
    bus : Bus
    stopper : Stopper
    tell : Tell
    trial : callable
        Which trial the page shows now.
    holds : callable
        Who holds the arms now, holder to reason.
    note : callable
        Takes in a message that is an answer, on any thread.
    colour : callable
        Colours the tissue by something else.
    """

    def __init__(
        self,
        bus: Bus,
        stopper: Stopper,
        tell: Tell,
        trial: Callable[[], str],
        holds: Callable[[], dict[str, str]],
        note: Callable[[object], None],
        colour: Callable[[Colouring], None],
    ) -> None:
        self._bus = bus
        self._stopper = stopper
        self._tell = tell
        self._trial = trial
        self._holds = holds
        self._note = note
        self._colour = colour

    def do(self, command: AnyCommand) -> None:
        """Carry out a command."""
        match command:
            case Stop():
                self._stopper.press()
            case Resume():
                self._resume(command)
            case WhyNot():
                self.why_not(command.block)
            case Approve():
                approval = ApproveRequest(trial=self._trial(), plan=command.plan, by=HOLDER)
                self._bus.ask(APPROVE, approval, self._on_decision("approved"), ANSWER_S)
            case Reject():
                reason = command.reason.strip() or NO_REASON
                rejection = RejectRequest(
                    trial=self._trial(), plan=command.plan, by=HOLDER, reason=reason
                )
                self._bus.ask(REJECT, rejection, self._on_decision("rejected"), ANSWER_S)
            case Colour():
                self._colour(command.by)
            case Replay():
                self._bus.ask(REPLAY_CONTROL, command.control(), self._on_replay, ANSWER_S)
            case Here() | Look():
                pass  # the hub has counted it, the scene has shown it

    def why_not(self, block: str) -> None:
        """Ask the planner why its plan does not grasp a block."""
        self._bus.ask(WHY_NOT, WhyNotRequest(question=block), self._on_why_not, ANSWER_S)

    def _resume(self, command: Resume) -> None:
        now = self._holds()
        if command.holds != now:
            self._tell("What holds the arms has changed meanwhile: look again.", good=False)
            return
        if not now:
            self._tell("Nothing holds the arms.", good=False)
        for holder in now:
            request = ResumeRequest(holder=holder, by=HOLDER)
            self._bus.ask(RESUME, request, self._resumed(holder), ANSWER_S)

    def _resumed(self, holder: str) -> Callable[[HoldState | FrasError], None]:
        def on_done(answer: HoldState | FrasError) -> None:
            what = hold_in_words(holder)
            if isinstance(answer, FrasError):
                self._tell(sentence(f"Not ended: {what}: {plain(str(answer))}"), good=False)
                return
            if holder == HOLDER:
                self._stopper.clear()
            self._tell(sentence(f"Ended: {what}"))

        return on_done

    def _on_decision(self, what: str) -> Callable[[DecisionReply | FrasError], None]:
        def on_done(answer: DecisionReply | FrasError) -> None:
            if isinstance(answer, FrasError):
                self._tell(sentence(f"Not {what}: {plain(str(answer))}"), good=False)
            elif not answer.accepted:
                self._tell(sentence(f"Not {what}: {plain(answer.text)}"), good=False)
            else:
                left_out = ", ".join(plain(one) for one in answer.excluded)
                without = f"; from now on without {left_out}" if left_out else ""
                self._tell(f"The plan is {what}{without}.")

        return on_done

    def _on_why_not(self, answer: WhyNotReply | FrasError) -> None:
        if isinstance(answer, FrasError):
            self._tell(sentence(f"The planner has no answer: {plain(str(answer))}"), good=False)
        else:
            self._note(answer)

    def _on_replay(self, answer: ReplayStatus | FrasError) -> None:
        if isinstance(answer, FrasError):
            self._tell(sentence(f"The replay can't do that: {plain(str(answer))}"), good=False)
        else:
            self._note(answer)
