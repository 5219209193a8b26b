"""How far the suite's campaigns go: a part each time, the whole of it with `make test-full`."""

import os
from typing import TypeVar

Part = TypeVar("Part")


def length(whole: Part, usual: Part) -> Part:
    """Choose a number of random cases, or the cases themselves."""
    return whole if os.environ.get("FRAS_TESTS") == "full" else usual
