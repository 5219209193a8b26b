"""`fras log extract`: the files that belong to a log, listed or written out."""

from pathlib import Path

from rich.console import Console
from rich.markup import escape
from rich.table import Table

from fras_cli.run import EXIT_NOT_SUCCESS
from fras_log.attachments import read_attachments, write_attachments


def extract(path: Path, out: Path | None, console: Console) -> int:
    """List the attachments of a log, or write them below a folder.

    Returns
    -------
    int
        0 if there are any, else 1.

    Raises
    ------
    NoSuchLog, NotAnMcap
    BadAttachment, InTheWay
        Nothing was written.
    """
    attachments = read_attachments(path)
    if not attachments:
        console.print(f"{path} attaches no files.", markup=False)
        return EXIT_NOT_SUCCESS
    if out is None:
        table = Table("attachment", "bytes")
        for name, content in attachments.items():
            table.add_row(escape(repr(name)[1:-1]), str(len(content)))
        console.print(table)
        console.print("--out DIR writes them there.")
        return 0
    for written in write_attachments(attachments, path, out):
        console.print(str(written), markup=False, highlight=False, soft_wrap=True)
    return 0
