"""What the surgeon's page says of itself."""

from typing import Annotated

from msgspec import Meta

from fras_common.messages.base import Header


class Presence(Header, frozen=True, kw_only=True):
    """Who looks at a page now; said again and again, so that its end shows.

    Attributes
    ----------
    viewers : int
        Open pages that have answered lately and can stop the arms.
    read_only : int
        Those that can only look.
    """

    viewers: Annotated[int, Meta(ge=0)]
    read_only: Annotated[int, Meta(ge=0)] = 0
