"""The audit log as a file: written by the recorder, read by whoever looks into it."""

from fras_log.errors import ForeignLog, LogExists, NoSuchLog, NotAnMcap
from fras_log.reader import LogReader, RawMessage
from fras_log.writer import LogFile

__all__ = [
    "ForeignLog",
    "LogExists",
    "LogFile",
    "LogReader",
    "NoSuchLog",
    "NotAnMcap",
    "RawMessage",
]
