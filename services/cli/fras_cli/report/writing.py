"""The files that come from a log: `summary.json`, `report.html`, and a picture."""

from pathlib import Path

from fras_cli.report.reading import read_trial
from fras_cli.report.story import tell
from fras_cli.report.summary import Summary, summarise, to_json
from fras_common.files import write_whole


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
    write_whole(out_dir / "summary.json", to_json(summary))
    write_whole(out_dir / "report.html", page.encode())
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
    write_whole(path, to_png(figure, PICTURE_DPI))
