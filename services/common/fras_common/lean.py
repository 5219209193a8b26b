"""Libraries that others bring along without our using them: each process would load them."""

import sys
from collections.abc import Generator
from contextlib import contextmanager


@contextmanager
def without(*names: str) -> Generator[None]:
    """Keep libraries from being imported within the block, unless they were before.

    Parameters
    ----------
    names : str
        Libraries that those imported within the block can do without.
    """
    hidden = [name for name in names if name not in sys.modules]
    # Python's own way to say that there is none.
    sys.modules.update(dict.fromkeys(hidden))  # pyright: ignore[reportArgumentType, reportCallIssue]
    try:
        yield
    finally:
        for name in hidden:
            sys.modules.pop(name, None)
