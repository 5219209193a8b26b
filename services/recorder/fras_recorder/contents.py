"""The log of a trial, opened, with what it says about itself: versions, scenario, rules, table."""

import os
import time
from collections.abc import Sequence
from importlib.metadata import version
from pathlib import Path
from platform import node, python_version

from fras_common.bus import RawSample
from fras_common.codec import HeaderFields, read_header
from fras_common.digests import own_table_digest, rules_digest
from fras_common.errors import FrasError
from fras_common.messages import OpenRequest
from fras_common.scenario import to_toml
from fras_common.service.build import build_of_this_process
from fras_log import AuditLog, LogHeading, Signer, take_up
from fras_log.attachments import RULES
from fras_recorder.completeness import PER_TICK, WITH_PATIENT, Completeness
from fras_recorder.writing import Opened, Trial

LOG_NAME = "audit.mcap"
DIRECTORY_LENGTH = 1000


class LogUnwritable(FrasError):
    """The folder named for a log can't take it."""


def log_path(request: OpenRequest, below: Path | None = None) -> Path:
    """Return where the log of a trial is to stand.

    Parameters
    ----------
    request : OpenRequest
    below : Path, optional
        The only folder below which logs may stand; links are followed before it is asked.

    Raises
    ------
    LogUnwritable
        The directory is no absolute path, leads upwards, or out of that folder.
    """
    text, folder = request.directory, Path(request.directory)
    if len(text) > DIRECTORY_LENGTH or not text.isprintable():
        problem = f"the directory's name is not printable or longer than {DIRECTORY_LENGTH}"
        raise LogUnwritable(f"can't write a log: {problem}", path=text[:DIRECTORY_LENGTH])
    if not folder.is_absolute() or ".." in folder.parts:
        raise LogUnwritable(
            f"can't write into {text!r}: give an absolute path without '..'", path=text
        )
    try:
        outside = below is not None and not folder.resolve().is_relative_to(below.resolve())
    except (OSError, RuntimeError) as error:
        raise LogUnwritable(f"can't write into {text}: {error}", path=text) from error
    if outside:
        raise LogUnwritable(f"can't write into {text}: logs stand below {below} here", path=text)
    return folder / LOG_NAME


def exists(path: Path) -> bool:
    """Whether there is a log that may have to be gone on with.

    Raises
    ------
    LogUnwritable
        It can't be told.
    """
    try:
        return path.exists()
    except OSError as error:
        raise LogUnwritable(f"can't write {path}: {error}", path=path) from error


def is_written(path: Path, other: str) -> bool:
    """Whether a log is the file at `other`, by whatever name."""
    try:
        return os.path.samefile(path, other)
    except (OSError, ValueError):
        return False


def in_order(cached: Sequence[RawSample]) -> list[RawSample]:
    """Sort samples of many keys by when they were sent; those of one publisher stay as they are.

    Its clock may have been set back meanwhile.
    """
    latest_ns: dict[tuple[str, str], int] = {}
    stamps_ns: list[int] = []
    for sample in cached:
        header = read_header(sample.payload)
        stream = (sample.key, header.source if header is not None else "")
        stamp_ns = max(header.stamp_ns if header is not None else 0, latest_ns.get(stream, 0))
        latest_ns[stream] = stamp_ns
        stamps_ns.append(stamp_ns)
    by_stamp = sorted(range(len(cached)), key=stamps_ns.__getitem__)
    return [cached[number] for number in by_stamp]


def without_trials_before(cached: Sequence[RawSample], trial: str) -> list[RawSample]:
    """Leave out what a publisher said in other trials before its first word in this one.

    By its numbers: its clock may have been ahead then.
    """
    headers = [read_header(sample.payload) for sample in cached]
    first: dict[tuple[str, str], int] = {}
    for sample, header in zip(cached, headers, strict=True):
        if header is not None and header.trial == trial:
            stream = (sample.key, header.source)
            first[stream] = min(first.get(stream, header.seq), header.seq)
    return [
        sample
        for sample, header in zip(cached, headers, strict=True)
        if header is None
        or header.trial == trial
        or header.seq >= first.get((sample.key, header.source), 0)
    ]


def open_log(
    path: Path, request: OpenRequest, signer: Signer | None, cached: Sequence[RawSample] = ()
) -> Opened:
    """Begin the log of a trial, or go on with the one that another recorder left unfinished.

    Parameters
    ----------
    path : Path
        See `log_path`.
    request : OpenRequest
    signer : Signer or None
    cached : sequence of RawSample
        What publishers still cache: a log that is gone on with gets what it lacks of it.

    Raises
    ------
    LogExists
        There is a log in the folder already, of another trial or a finished one.
    LogUnwritable
        The folder or the file can't be made.
    NoSuchLog, NotAnMcap, ForeignLog
        What is there of the log can't be read.
    """
    per_tick = WITH_PATIENT if request.scenario.has_patient else PER_TICK
    seen = Completeness(request.trial, per_tick=per_tick)

    def note(key: str, header: HeaderFields) -> None:
        seen.note(key, header.trial, header.tick, header.seq)

    heading = _heading(request, signer)
    try:
        if path.exists():
            log = take_up(path, heading, time.time_ns(), note)
            genuine = without_trials_before(cached, request.trial)
            return Opened(log, Trial(request.trial, log.began_ns), seen, genuine)
        return Opened(AuditLog(path, heading, time.time_ns()), Trial(request.trial), seen)
    except OSError as error:
        raise LogUnwritable(f"can't write {path}: {error}", path=path) from error


def _heading(request: OpenRequest, signer: Signer | None) -> LogHeading:
    metadata, attachments = _describe(request)
    options = request.scenario.recorder
    return LogHeading(
        metadata,
        attachments,
        signer,
        rotate_bytes=options.rotate_bytes,
        rotate_s=options.rotate_s,
        fsync=options.fsync,
    )


def _describe(request: OpenRequest) -> tuple[dict[str, str], dict[str, bytes]]:
    scenario_toml = to_toml(request.scenario)
    metadata = {
        "trial": request.trial,
        "fras_version": version("fras"),
        "python_version": python_version(),
        "build": build_of_this_process(),
        "host": node(),
        "topics_digest": own_table_digest(),
        "scenario": scenario_toml,
    }
    attachments = {"scenario.toml": scenario_toml.encode()}
    if request.mesh:
        attachments["mesh"] = request.mesh
    if request.rules:
        metadata["asp_digest"] = rules_digest(request.rules)
        attachments |= {RULES + name: text.encode() for name, text in request.rules.items()}
    return metadata, attachments
