"""From a log to a summary and a report: what a trial was, for people and for programs."""

from fras_cli.report.reading import read_trial
from fras_cli.report.summary import PatientSummary, Percentiles, Summary, summarise, to_json
from fras_cli.report.trial import Trial
from fras_cli.report.wording import patient_in_words, specifications_in_words
from fras_cli.report.writing import write_picture, write_report
from fras_log.errors import ForeignLog, NoSuchLog, NotAnMcap

__all__ = [
    "ForeignLog",
    "NoSuchLog",
    "NotAnMcap",
    "PatientSummary",
    "Percentiles",
    "Summary",
    "Trial",
    "patient_in_words",
    "read_trial",
    "specifications_in_words",
    "summarise",
    "to_json",
    "write_picture",
    "write_report",
]
