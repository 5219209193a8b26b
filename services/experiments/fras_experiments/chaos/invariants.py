"""What must hold in every trial, whatever happened to it: pure, from the messages of its log.

Each invariant takes evidence and yields what breaks it. The recorder's chain and signature are
`fras_log.verify_file`'s, and whether decisions follow is `fras_audit.audit_log`'s.
"""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import groupby
from typing import Final

from fras_common.messages import RecorderEvent, RobotState
from fras_experiments.chaos.evidence import Evidence

STOP_FORCE_N: Final = 0.05
"""What the way to rest may add: 3 mm at the stiffness of the tissue, and how it settles."""
TICKS_TO_REST: Final = 3
"""The one under way, and two to stop."""
TICKS_UNDER_WAY: Final = 2
"""What may still be on its way when somebody has gone: a state, and the one that it led to."""
LOOP: Final = ("sim", "sa", "motion")
OVER: Final = ("done", "interrupted")


@dataclass(frozen=True)
class Breach:
    """Something that must not be.

    Attributes
    ----------
    invariant : str
        Its name in `INVARIANTS`, or `intact`, `derived`.
    text : str
    tick : int
        -1 where it has none.
    """

    invariant: str
    text: str
    tick: int = -1


@dataclass(frozen=True)
class Undisturbed:
    """What the same trial did when nothing happened to it.

    Attributes
    ----------
    outcome : str
    max_force_n : float [N]
    """

    outcome: str
    max_force_n: float


Invariant = Callable[[Evidence, Undisturbed], Iterator[Breach]]


def ends(evidence: Evidence, undisturbed: Undisturbed) -> Iterator[Breach]:
    """See that it ends as the undisturbed one did, or in a hold that has a name."""
    ending = evidence.ending
    if ending is None:
        yield Breach("ends", "the log does not say how the trial ended")
        return
    held = ending.outcome == "aborted" and ending.reason.startswith("hold:")
    if not held and ending.outcome not in ("success", undisturbed.outcome):
        yield Breach("ends", f"{ending.outcome}: {ending.reason}")


def complete(evidence: Evidence, undisturbed: Undisturbed) -> Iterator[Breach]:
    """See that nothing is missing that a living process had published."""
    del undisturbed
    reborn = _born_within(evidence)
    for (key, source), numbers in evidence.numbers.items():
        first = 0 if source in reborn else min(numbers)
        missing = set(range(first, max(numbers) + 1)) - set(numbers)
        if missing:
            yield Breach("complete", f"{len(missing)} messages of {source} on {key} are missing")
    for event in evidence.order:
        if isinstance(event, RecorderEvent) and event.kind == "gap":
            text = f"the recorder missed {event.count} messages of {event.subject}"
            yield Breach("complete", text)
    if not evidence.states:
        yield Breach("complete", "there is no state of the arms")
        return
    last = max(state.tick for state in evidence.states)
    ticks = {
        "robot/state": {one.tick for one in evidence.states},
        "sim/tissue_state": {one.tick for one in evidence.tissues},
        "sa/verdict": {one.tick for one in evidence.verdicts},
    }
    for key, those in ticks.items():
        # Nobody may have been there to answer the last one.
        if missing := sorted(set(range(last if key != "robot/state" else last + 1)) - those):
            text = f"{len(missing)} ticks without {key}"
            yield Breach("complete", text, missing[0])


def _born_within(evidence: Evidence) -> set[str]:
    """Find who began to speak within the trial: all that they ever said belongs into its log.

    Whom the first recorder lists as it begins, itself among them, was there already: it may be the
    second one, if nothing that the first had heard was written yet.
    """
    began = listed = listing = False
    seen, born = set[str](), set[str]()
    for message in evidence.order:
        if isinstance(message, RobotState):
            began, listing = True, False
            continue
        found = _alive(message)
        if found is None or message.kind != "present":
            listing = False
            continue
        if began and not listing and found[1] not in seen:
            born.add(found[1])
        seen.add(found[1])
        if found[1] == message.source and not listed:
            listed = listing = True
            born.clear()
    return born


def _alive(event: RecorderEvent) -> tuple[str, str] | None:
    """Tell service and publisher of a token that came or went; None of anything else."""
    if event.kind == "gap" or not event.subject.startswith("alive/"):
        return None
    source = event.subject.removeprefix("alive/")
    return source.partition("/")[0], source


def interlocked(evidence: Evidence, undisturbed: Undisturbed) -> Iterator[Breach]:
    """See that each tick rests on the verdict before it, and none is left out or taken back."""
    del undisturbed
    judged = {one.tick for one in evidence.verdicts} & {one.tick for one in evidence.tissues}
    unjudged = list[int]()
    last = evidence.states[0].tick if evidence.states else 0
    for state in evidence.states:
        if not last <= state.tick <= last + 1:
            yield Breach("interlocked", f"tick {state.tick} follows tick {last}", state.tick)
        last = max(last, state.tick)
        if state.tick <= 0:
            continue
        if state.verdict_tick != state.tick - 1:
            text = f"the arms moved on verdict {state.verdict_tick}"
            yield Breach("interlocked", text, state.tick)
        if state.tick - 1 not in judged:
            unjudged.append(state.tick)
    if unjudged:
        text = f"{len(set(unjudged))} ticks after one whose tissue or verdict the log does not hold"
        yield Breach("interlocked", text, unjudged[0])


def still_while_missing(evidence: Evidence, undisturbed: Undisturbed) -> Iterator[Breach]:
    """See that no tick follows, but what was under way, while somebody of the loop is away."""
    del undisturbed
    away = set[str]()
    since = last = -1
    for message in evidence.order:
        if isinstance(message, RobotState):
            if away and message.tick > since + TICKS_UNDER_WAY:
                text = f"the arms moved while {', '.join(sorted(away))} was away"
                yield Breach("still_while_missing", text, message.tick)
                away.clear()
            last = max(last, message.tick)
        elif (found := _alive(message)) and found[0] in LOOP:
            if message.kind == "present":
                away.discard(found[0])
            else:
                since = last if not away else since
                away.add(found[0])


def held_still(evidence: Evidence, undisturbed: Undisturbed) -> Iterator[Breach]:
    """See that held arms come to rest within two ticks and stay there until resumed."""
    del undisturbed
    for run in _held(evidence):
        ticks = sorted({state.tick for state in run if not _opens(state)})
        if len(ticks) > TICKS_TO_REST + 1:
            text = f"{len(ticks) - 1} ticks under the hold of {', '.join(run[-1].holds)}"
            yield Breach("held_still", text, ticks[0])


def force_kept(evidence: Evidence, undisturbed: Undisturbed) -> Iterator[Breach]:
    """See that held arms bear at most what they bore, and the stop's travel."""
    del undisturbed
    force_n = {one.tick: one.max_force_n for one in evidence.verdicts}
    for run in _held(evidence):
        bore_n = force_n.get(run[0].tick, -1.0)
        if bore_n < 0.0:
            continue
        for tick in sorted({state.tick for state in run}):
            if force_n.get(tick, -1.0) > bore_n + STOP_FORCE_N:
                text = f"{force_n[tick]:.3f} N while held, {bore_n:.3f} N when it began"
                yield Breach("force_kept", text, tick)
                break


def _held(evidence: Evidence) -> Iterator[Sequence[RobotState]]:
    for held, run in groupby(evidence.states, key=lambda state: bool(state.holds)):
        if held:
            yield list(run)


def _opens(state: RobotState) -> bool:
    return state.action is not None and state.action.name == "release"


def fresh_commands(evidence: Evidence, undisturbed: Undisturbed) -> Iterator[Breach]:
    """See that a motion carries out what it took itself, never what was told to one before."""
    del undisturbed
    taken: dict[str, set[str]] = {}
    for goal in evidence.accepted:
        taken.setdefault(goal.goal_id, set()).add(goal.source)
    for goal_id, sources in taken.items():
        if len(sources) > 1:
            text = f"goal {goal_id} was taken by {len(sources)} lives of motion"
            yield Breach("fresh_commands", text)
    told = set[tuple[str, str]]()
    for state in evidence.states:
        action = state.action
        if action is None or action.phase in OVER:
            continue
        if state.source in taken.get(action.goal_id, ()) or (action.goal_id, state.source) in told:
            continue
        told.add((action.goal_id, state.source))
        text = f"{state.source} moved for goal {action.goal_id}, which it had not taken"
        yield Breach("fresh_commands", text, state.tick)


def said_twice_equal(evidence: Evidence, undisturbed: Undisturbed) -> Iterator[Breach]:
    """See that what is said of a tick again is the same."""
    del undisturbed
    arms = (
        (
            state.tick,
            {name: (a.joints, a.tip_in_world, a.jaw_rad) for name, a in state.arms.items()},
        )
        for state in evidence.states
    )
    tissue = ((one.tick, one.digest) for one in evidence.tissues)
    force = ((one.tick, (one.level, one.max_force_n, one.visibility)) for one in evidence.verdicts)
    for what, said in (("arms", arms), ("tissue", tissue), ("verdict", force)):
        first: dict[int, object] = {}
        contradicted = set[int]()
        for tick, content in said:
            if first.setdefault(tick, content) != content and tick not in contradicted:
                contradicted.add(tick)
                yield Breach("said_twice_equal", f"two different {what} of one tick", tick)


INVARIANTS: Final[Mapping[str, Invariant]] = {
    one.__name__: one
    for one in (
        ends,
        complete,
        interlocked,
        still_while_missing,
        held_still,
        force_kept,
        fresh_commands,
        said_twice_equal,
    )
}


def look(evidence: Evidence, undisturbed: Undisturbed) -> tuple[Breach, ...]:
    """Hold evidence against all of them."""
    return tuple(
        breach for invariant in INVARIANTS.values() for breach in invariant(evidence, undisturbed)
    )
