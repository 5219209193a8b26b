"""What the page's buttons send: typed, bounded, refused if it is anything else."""

from typing import Annotated, Literal

import msgspec
from msgspec import Meta

from fras_common.errors import FrasError
from fras_common.messages import ReplayControl
from fras_common.messages.replay import ReplayCommand

MAX_COMMAND_BYTES = 16 * 2**10

Name = Annotated[str, Meta(max_length=100)]
Text = Annotated[str, Meta(max_length=500)]
Colouring = Literal["force", "lift", "plain"]
Place = Literal["overview", "above", "side"]


class BadCommand(FrasError):
    """Something that no button of the page sends."""


class Command(
    msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True, tag_field="do"
):
    """Base of what a page may ask for."""


class Stop(Command, frozen=True, kw_only=True, tag="stop"):
    """Hold the arms."""


class Resume(Command, frozen=True, kw_only=True, tag="resume"):
    """Lift the holds that the surgeon was shown, holder to reason, and agreed to lift."""

    holds: dict[Name, Text]


class WhyNot(Command, frozen=True, kw_only=True, tag="why_not"):
    """Ask why the plan does not grasp a block."""

    block: Annotated[str, Meta(pattern=r"^b\([0-9]{1,2},[0-9]{1,2}\)$")]


class Approve(Command, frozen=True, kw_only=True, tag="approve"):
    """Let the plan be done that waits; `plan` is the one that the surgeon was shown."""

    plan: Name


class Reject(Command, frozen=True, kw_only=True, tag="reject"):
    """Have another plan made than the one that waits."""

    plan: Name
    reason: Annotated[str, Meta(max_length=400)] = ""


class Here(Command, frozen=True, kw_only=True, tag="here"):
    """Say that the page is open, in sight, and can be used."""


class Colour(Command, frozen=True, kw_only=True, tag="colour"):
    """Colour the tissue by something else."""

    by: Colouring


class Look(Command, frozen=True, kw_only=True, tag="look"):
    """Look at the scene from another place; `page` is whose scene, as in its address."""

    page: Name
    place: Place


class Replay(Command, frozen=True, kw_only=True, tag="replay"):
    """Tell the replay what to do."""

    command: ReplayCommand
    value: float = 0.0

    def control(self) -> ReplayControl:
        """Return it as the message."""
        return ReplayControl(command=self.command, value=self.value)


AnyCommand = Stop | Resume | WhyNot | Approve | Reject | Here | Colour | Look | Replay
_DECODER = msgspec.json.Decoder(AnyCommand)


def parse(text: str | bytes) -> AnyCommand:
    """Read what a page sent.

    Raises
    ------
    BadCommand
    """
    if len(text) > MAX_COMMAND_BYTES:
        raise BadCommand(f"{len(text)} bytes are more than a button sends")
    try:
        return _DECODER.decode(text)
    except (msgspec.DecodeError, UnicodeError) as error:
        raise BadCommand(f"not what a button sends: {error}") from error
