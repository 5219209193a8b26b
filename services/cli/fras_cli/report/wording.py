"""Names and reasons of the messages in plain words, for people who did not write them."""

from msgspec import UnsetType

from fras_cli.report.story import ActionStory, PlanStory
from fras_cli.report.summary import CUT_SHORT, Summary

_OUTCOMES = {
    "success": "Success: the region of interest is exposed.",
    "no_plan": "No plan: the planner found no way to expose the region of interest.",
    "aborted": "Aborted: the trial was stopped before its end.",
    "failed": "Failed: the region of interest could not be exposed.",
}
_REASONS = {
    "initial": "the trial begins",
    "exposure": "all actions of the plan are done",
    "force": "the force limit was crossed",
    "force_soft": "the force limit was crossed",
    "force_hard": "the hard force limit was crossed",
    "hold": "a person held the arms and let them go again",
    "rejected": "a person rejected the plan before",
    "restart": "a service had to start again",
    "nothing_in_reach": "the jaw closed on nothing",
    "replans": "the number of re-plans allowed is used up",
    "hold:solver": "the tissue simulation had no valid solution",
    "hold:robot": "the state of the robot was unusable",
    "hold:stale": "the states of tissue and robot did not belong together",
}


def outcome_in_words(summary: Summary) -> str:
    """One sentence that says how the trial ended."""
    if summary.outcome == "aborted" and summary.reason == CUT_SHORT:
        return "Unfinished: the log ends before the trial did."
    return _OUTCOMES[summary.outcome]


def details_in_words(summary: Summary, needed_fraction: float) -> list[str]:
    """Sentences that put the numbers of the summary beside their limits."""
    sentences: list[str] = []
    if summary.outcome in {"failed", "aborted", "no_plan"} and summary.reason != CUT_SHORT:
        sentences.append(sentence(reason_in_words(summary.reason)))
    if summary.visibility is not None:
        sentences.append(
            f"{summary.visibility:.0%} of the tissue over the region of interest is lifted clear "
            f"of it; more than {needed_fraction:.0%} is needed."
        )
    if summary.max_force_n is not None:
        above = summary.ticks_above_limit
        crossed = f", above it for {_count(above, 'tick')}" if above else ""
        sentences.append(
            f"The largest force was {summary.max_force_n:.2f} N, the limit is "
            f"{summary.limit_n:.2f} N{crossed}."
        )
    sentences += patient_in_words(summary)
    done = _count(len(summary.actions), "action")
    sentences.append(f"{done} in {summary.sim_s:.1f} s, {_count(summary.replans, 're-plan')}.")
    return sentences


def patient_in_words(summary: Summary) -> list[str]:
    """Say what the patient bore in truth; nothing where there is none besides its model."""
    patient = summary.patient
    if isinstance(patient, UnsetType):
        return []
    believed_n = patient.believed_max_force_n
    said = f", where its model said {believed_n:.2f} N" if believed_n is not None else ""
    sentences = [f"The patient bore {patient.max_force_n:.2f} N at most{said}."]
    if patient.ticks_above_limit:
        missed = (
            f"the model missed {patient.missed} of them"
            if patient.missed
            else "the model missed none"
        )
        above = _count(patient.ticks_above_limit, "tick")
        sentences.append(f"It bore more than the limit for {above}; {missed}.")
    if patient.needless:
        sentences.append(
            f"For {_count(patient.needless, 'tick')} the model said so, and it did not."
        )
    return sentences


def specifications_in_words(summary: Summary) -> str:
    """Whether what was done kept to the safety specifications."""
    if summary.violations is None:
        return "not checked: the trial has no end"
    return "; ".join(summary.violations) or "all kept"


def reason_in_words(reason: str) -> str:
    """Turn a reason of a plan, a result or an outcome into a clause; keep an unknown one."""
    if reason in _REASONS:
        return _REASONS[reason]
    head, colon, rest = reason.partition(":")
    rest = rest.strip()
    match head if colon else "":
        case "deviation":
            fluent, _, rest = rest.partition(" expected after ")
            action, _, numbers = rest.partition("; ")
            negative = fluent.startswith("-")
            found = "still holds" if negative else "does not hold"
            measured = f" ({numbers})" if numbers else ""
            return (
                f"after {action}, {fluent.removeprefix('-')} {found}, against expectation{measured}"
            )
        case "refused":
            return f"the motion service refused: {rest}"
        case "hold":
            return f"held by {rest} and not let go"
        case "rejected":
            return f"a person rejected the plan before: {rest}"
        case "gate":
            return f"the safety gate {rest} stopped the arm"
        case _:
            return reason


def plan_title(story: PlanStory) -> str:
    """Heading of a plan."""
    match story.kind:
        case "plan":
            return "First plan"
        case "re-plan":
            return f"Re-plan {story.replan}"
        case "resumed":
            kind = story.plan.reason.partition(":")[0]
            why = {"restart": "a restart", "rejected": "a rejection"}.get(kind, "a hold")
            return f"Plan after {why}"
        case "check":
            return "Goal check"
        case "no plan":
            return "No plan"


def plan_reason(story: PlanStory) -> str:
    """Why a plan was made."""
    if story.plan.reason == "exposure" and story.kind != "check":
        return "the plan is done, the goal not yet reached"
    return reason_in_words(story.plan.reason)


def end_in_words(action: ActionStory) -> str:
    """How an action ended, with its reason."""
    if action.end == "succeeded":
        return "done"
    if action.end == "unfinished":
        return "under way when the log ends"
    return f"{action.end}: {reason_in_words(action.reason)}" if action.reason else action.end


def changes(before: PlanStory, after: PlanStory) -> list[str]:
    """Sentences on what a later plan does otherwise than the one before it."""
    old, new = before.plan, after.plan
    sentences = [
        f"{block} is no candidate any more." for block in new.tried if block not in old.tried
    ]
    sentences += [
        f"{name} is excluded by a person." for name in new.rejected if name not in old.rejected
    ]
    if old.ignore_ap and not new.ignore_ap:
        sentences.append("Attachment points, ignored before, count from now on.")
    if old.target and new.target and new.actions and old.target != new.target:
        sentences.append(f"The block to hold changes from {old.target} to {new.target}.")
    if old.arm and new.arm and new.actions and old.arm != new.arm:
        sentences.append(f"The arm changes from {old.arm} to {new.arm}.")
    dropped = [action.text for action in before.actions if action.end == "not begun"]
    if dropped:
        sentences.append(f"No longer carried out: {', '.join(dropped)}.")
    return sentences


def sentence(clause: str) -> str:
    """Begin with a capital, end with a full stop."""
    text = clause[:1].upper() + clause[1:]
    return text if text.endswith((".", "?", "!")) else f"{text}."


def _count(number: int, noun: str) -> str:
    return f"{number} {noun}" if number == 1 else f"{number} {noun}s"
