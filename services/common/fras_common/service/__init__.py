"""What every service process is made of: arguments, inbox, loop, trial gate, logs, health."""

from fras_common.lean import without

with without("rich"):
    # It draws tracebacks with it where there is one; ours are JSON.
    import structlog as _structlog  # noqa: F401  # pyright: ignore[reportUnusedImport]

from fras_common.service.host import INBOX, Deferred, ServiceHost
from fras_common.service.runner import Service, run_service, run_shell

__all__ = ["INBOX", "Deferred", "Service", "ServiceHost", "run_service", "run_shell"]
