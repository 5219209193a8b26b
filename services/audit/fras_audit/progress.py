"""Who wants to know how far an audit is."""

from collections.abc import Callable

# Gets the service, what has been done and how much there is.
Progress = Callable[[str, int, int], None]
