"""`fras log` as its user meets it."""

from typing import Any

from typer.testing import CliRunner

from fras_cli.app import app
from fras_cli.failures import exit_status
from fras_common.errors import FrasError


def fras_log(*arguments: Any) -> tuple[int, str]:
    """Exit status and all that is said; a known error as the command's main does it."""
    result = CliRunner().invoke(
        app, ["log", *map(str, arguments)], env={"COLUMNS": "300", "TERM": "dumb"}
    )
    if isinstance(result.exception, FrasError):
        return exit_status(result.exception), f"{result.output}fras: {result.exception}"
    assert result.exception is None or isinstance(result.exception, SystemExit), result.exception
    return result.exit_code, result.output
