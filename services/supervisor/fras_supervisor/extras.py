"""Whether the libraries of a service are installed, by what the distribution says of itself."""

import re
from collections.abc import Callable, Iterable, Sequence
from importlib.metadata import PackageNotFoundError, requires, version
from typing import Final

from fras_common.extras import MissingExtra
from fras_supervisor.producers import service_of

DISTRIBUTION: Final = "fras"
EXTRA_OF: Final = {"arms": "motion"}
"""Services whose extra bears another name."""
# Those with a further condition (a platform) can be done without.
_REQUIREMENT = re.compile(r"([A-Za-z0-9._-]+)[^;]*; extra == ['\"]([^'\"]+)['\"]")


def require_installed(name: str, command: Sequence[str]) -> None:
    """Raise unless what the service of a command needs is installed beside this program.

    Raises
    ------
    MissingExtra
        Naming the process, the library and the extra.
    """
    service = service_of(command)
    extra = EXTRA_OF.get(service, service)
    for library in missing(extra, requires(DISTRIBUTION) or (), is_installed):
        raise MissingExtra(
            f"process {name} runs {service}, which needs the library {library!r}: install it "
            f"with `pip install '{DISTRIBUTION}[{extra}]'`",
            service=service,
            library=library,
        )


def missing(
    extra: str, requirements: Iterable[str], installed: Callable[[str], bool]
) -> tuple[str, ...]:
    """Name the libraries of an extra that are not installed.

    Parameters
    ----------
    extra : str
        One that the distribution does not have needs nothing.
    requirements : iterable of str
        Of the distribution, as `Requires-Dist` of its metadata has them: extras that take others
        in are written out there.
    installed : callable
        Tells it of a library.
    """
    matches = (_REQUIREMENT.fullmatch(line) for line in requirements)
    libraries = (match[1] for match in matches if match is not None and match[2] == extra)
    return tuple(one for one in libraries if not installed(one))


def is_installed(library: str) -> bool:
    """Whether a distribution of that name is installed."""
    try:
        version(library)
    except PackageNotFoundError:
        return False
    return True
