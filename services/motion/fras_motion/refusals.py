"""A goal that is refused: said in the log, counted by name, answered with the numbers."""

from fras_common.messages import ExecuteReply
from fras_common.service import ServiceHost
from fras_motion.adapter import in_words
from fras_motion.errors import Refused


def refusal(host: ServiceHost, goal_id: str, error: Refused) -> ExecuteReply:
    """Count a refusal, and make the reply that the mirror of the query puts on the bus."""
    about = f"goal {error.reason}"
    host.tell(about, "warning", "goal refused", goal=goal_id, problem=str(error))
    host.refusals[error.reason] += 1
    return ExecuteReply(
        accepted=False, reason=error.reason, text=str(error), values=in_words(error.values)
    )
