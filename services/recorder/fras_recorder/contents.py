"""The log of a trial, opened, with what it says about itself: versions, host, scenario."""

from importlib.metadata import version
from pathlib import Path
from platform import node, python_version

from fras_common.errors import FrasError
from fras_common.messages import OpenRequest
from fras_common.scenario import to_toml
from fras_log import LogFile, Signer

LOG_NAME = "audit.mcap"


class LogUnwritable(FrasError):
    """The folder named for a log can't take it."""


def open_log(request: OpenRequest, now_ns: int, signer: Signer | None) -> LogFile:
    """Begin the log of a trial.

    Raises
    ------
    LogExists
        There is a log in the folder already.
    LogUnwritable
        The folder or the file can't be made.
    """
    path = Path(request.directory) / LOG_NAME
    metadata, attachments = _describe(request)
    try:
        return LogFile(path, metadata, attachments, now_ns, signer)
    except OSError as error:
        raise LogUnwritable(f"cannot write {path}: {error}", path=path) from error


def _describe(request: OpenRequest) -> tuple[dict[str, str], dict[str, bytes]]:
    scenario_toml = to_toml(request.scenario)
    metadata = {
        "trial": request.trial,
        "fras_version": version("fras"),
        "python_version": python_version(),
        "host": node(),
        "scenario": scenario_toml,
    }
    attachments = {"scenario.toml": scenario_toml.encode()}
    if request.mesh:
        attachments["mesh"] = request.mesh
    return metadata, attachments
