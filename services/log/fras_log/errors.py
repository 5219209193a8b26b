"""What can be wrong with a log before there is anything to read or write."""

from pathlib import Path

from fras_common.errors import FrasError


class NoSuchLog(FrasError):
    """There is no file, or it can't be opened."""

    def __init__(self, path: Path, problem: str) -> None:
        super().__init__(
            f"{path}: can't be read: {problem}; give the audit.mcap of a run",
            path=path,
            problem=problem,
        )


class NotAnMcap(FrasError):
    """The file is no MCAP file at all."""

    def __init__(self, path: Path, problem: str) -> None:
        super().__init__(
            f"{path}: is no MCAP file ({problem}); give the audit.mcap of a run",
            path=path,
            problem=problem,
        )


class ForeignLog(FrasError):
    """An MCAP file, but not one that a FRAS recorder wrote."""

    def __init__(self, path: Path, problem: str) -> None:
        super().__init__(
            f"{path}: is no log of FRAS: {problem}; give a file that the recorder wrote",
            path=path,
            problem=problem,
        )


class NewerLog(FrasError):
    """A log of a FRAS that came after this one; its messages may mean something else."""

    def __init__(self, path: Path, version: str, ours: str) -> None:
        super().__init__(
            f"{path}: was written by FRAS {version}, this is {ours}: install {version} or newer",
            path=path,
            version=version,
            ours=ours,
        )


class LogExists(FrasError):
    """A log is never written over."""


class NotAManifest(FrasError):
    """A file that should tell of a log's parts does not."""
