"""The audit: what a log records is derived again from what it records, by the cores themselves."""

from fras_audit.auditing import SERVICES, Progress, audit_log
from fras_audit.comparison import Difference, Tally
from fras_audit.reading import read_recorded
from fras_audit.report import Report

__all__ = [
    "SERVICES",
    "Difference",
    "Progress",
    "Report",
    "Tally",
    "audit_log",
    "read_recorded",
]
