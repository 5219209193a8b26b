"""From a log to files that viewers open: Foxglove and Lichtblick, and Rerun."""

from fras_log.export.exporting import Exported, export
from fras_log.export.outputs import (
    Format,
    NothingToExport,
    OutputExists,
    OutputIsLog,
    OutputUnwritable,
)

__all__ = [
    "Exported",
    "Format",
    "NothingToExport",
    "OutputExists",
    "OutputIsLog",
    "OutputUnwritable",
    "export",
]
