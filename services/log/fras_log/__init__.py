"""The audit log as a file: written by the recorder, read by whoever looks into it."""

from fras_log.audit_log import AuditLog, LogHeading, take_up
from fras_log.errors import ForeignLog, LogExists, NoSuchLog, NotAnMcap
from fras_log.findings import Finding, Verification
from fras_log.keys import BadKey, PublicKey, Signer
from fras_log.pieces import scan_log
from fras_log.reader import LogReader, RawMessage
from fras_log.recover import Recovery, recover_file
from fras_log.verify import verify_file
from fras_log.writer import LogFile

__all__ = [
    "AuditLog",
    "BadKey",
    "Finding",
    "ForeignLog",
    "LogExists",
    "LogFile",
    "LogHeading",
    "LogReader",
    "NoSuchLog",
    "NotAnMcap",
    "PublicKey",
    "RawMessage",
    "Recovery",
    "Signer",
    "Verification",
    "recover_file",
    "scan_log",
    "take_up",
    "verify_file",
]
