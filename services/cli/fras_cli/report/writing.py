"""The files that come from a log: `summary.json`, `report.html`, and a picture."""

import os
from pathlib import Path

from fras_cli.report.reading import read_trial
from fras_cli.report.story import tell
from fras_cli.report.summary import Summary, summarise, to_json


def write_report(log: Path, out_dir: Path) -> Summary:
    """Write `summary.json` and `report.html` on a log into `out_dir`, which is made.

    Raises
    ------
    NoSuchLog, NotAnMcap, ForeignLog, ScenarioError
        Nothing is written.
    """
    # Not at the top: every command that leads a stack comes by here, and `fras stop` has no time
    # to load what draws.
    from fras_cli.report.page import render_page

    trial = read_trial(log)
    summary = summarise(trial)
    page = render_page(trial, summary)
    out_dir.mkdir(parents=True, exist_ok=True)
    _write(out_dir / "summary.json", to_json(summary))
    _write(out_dir / "report.html", page.encode())
    return summary


def write_picture(log: Path, path: Path) -> None:
    """Write the wide PNG of a trial: the tissue before and after, force and visibility.

    Raises
    ------
    NoSuchLog, NotAnMcap, ForeignLog, ScenarioError
        Nothing is written.
    """
    from fras_cli.report.figures import PICTURE_DPI, picture_figure, to_png

    trial = read_trial(log)
    figure = picture_figure(trial, tell(trial))
    path.parent.mkdir(parents=True, exist_ok=True)
    _write(path, to_png(figure, PICTURE_DPI))


def _write(path: Path, data: bytes) -> None:
    """Write at once: readers see the old file or the whole new one."""
    part = path.with_name(f".{path.name}.{os.getpid()}")
    try:
        part.write_bytes(data)
        part.replace(path)
    finally:
        part.unlink(missing_ok=True)
