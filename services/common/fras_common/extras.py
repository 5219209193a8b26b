"""Which extra of the distribution a missing library belongs to."""

from collections.abc import Generator
from contextlib import contextmanager

from fras_common.errors import FrasError


class MissingExtra(FrasError):
    """A service's libraries are not installed."""


@contextmanager
def require_extra(service: str) -> Generator[None]:
    """Turn a failed import within the block into the command that mends it.

    Raises
    ------
    MissingExtra
        Naming the library and the extra.
    """
    try:
        yield
    except ModuleNotFoundError as error:
        raise MissingExtra(
            f"{service} needs the library {error.name!r}: install it with "
            f"`pip install 'fras[{service}]'`",
            service=service,
            library=error.name,
        ) from error
