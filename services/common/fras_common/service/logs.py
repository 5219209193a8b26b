"""Structured logs: one JSON line each on stderr, and from WARNING up a message on the bus."""

import contextlib
import io
import logging
import sys
from collections.abc import Callable, Mapping, MutableMapping
from typing import Any, TextIO, cast

import structlog

from fras_common.messages import LogRecord

Emit = Callable[[LogRecord], None]


class Stderr(io.TextIOBase):
    """Standard error that outlives its reader: a supervisor's death must not stop a safe stop."""

    def write(self, text: str, /) -> int:
        """Write, unless nobody can read it any more."""
        with contextlib.suppress(BrokenPipeError):
            sys.stderr.write(text)
        return len(text)

    def flush(self) -> None:
        """Flush, unless nobody can read it any more."""
        with contextlib.suppress(BrokenPipeError):
            sys.stderr.flush()


def in_reading_order(
    _logger: Any, _method: str, event: MutableMapping[str, Any]
) -> Mapping[str, Any]:
    """When, how grave, who, what; then the rest."""
    first = ("timestamp", "level", "service", "event")
    return {**{key: event[key] for key in first if key in event}, **event}


def configure_logging(service: str, level: str, emit: Emit) -> structlog.stdlib.BoundLogger:
    """Set structlog up for this process and return the service's logger.

    Parameters
    ----------
    service : str
    level : str
        Name of the lowest level that is printed.
    emit : callable
        Gets each record from WARNING up, to be published on `log/<service>`.
    """
    structlog.configure(
        processors=_processors(emit),
        wrapper_class=structlog.make_filtering_bound_logger(logging.getLevelNamesMapping()[level]),
        logger_factory=structlog.PrintLoggerFactory(file=cast(TextIO, Stderr())),
        cache_logger_on_first_use=False,
    )
    return structlog.get_logger(service=service)


def logger_to(service: str, file: TextIO, emit: Emit) -> structlog.stdlib.BoundLogger:
    """Return a logger of a part of this process, which leaves the set-up of the rest alone.

    Parameters
    ----------
    service : str
    file : TextIO
        Gets the lines.
    emit : callable
        Gets each record from WARNING up, to be published on `log/<service>`.
    """
    return structlog.wrap_logger(
        structlog.PrintLogger(file),
        processors=_processors(emit),
        wrapper_class=structlog.make_filtering_bound_logger(logging.INFO),
        cache_logger_on_first_use=False,
        service=service,
    )


def _processors(emit: Emit) -> list[Any]:
    def publish(_logger: Any, method: str, event: MutableMapping[str, Any]) -> Mapping[str, Any]:
        if method in {"warning", "error", "critical"}:
            fields = {key: str(value) for key, value in event.items() if key != "event"}
            emit(LogRecord(level=method, event=str(event["event"]), fields=fields))
        return event

    return [
        structlog.processors.add_log_level,
        structlog.processors.format_exc_info,
        publish,
        structlog.processors.TimeStamper(fmt="iso", utc=True),
        in_reading_order,
        structlog.processors.JSONRenderer(sort_keys=False, default=str),
    ]
