"""The page of all commands, from the command line's own parser."""

import os
from collections.abc import Iterator
from contextlib import redirect_stdout, suppress
from io import StringIO
from typing import Any, Final
from unittest.mock import patch

import typer

from fras_cli.app import app
from fras_cli.bench import BENCHMARKS
from fras_cli.commands.services import SERVICES
from manual.markdown import block, code, page, prose, table

WIDTH: Final = {"COLUMNS": "90"}
# Typer carries no types for the parser below its commands.
Parser = Any


def commands() -> Iterator[tuple[str, Parser]]:
    """Yield each command by its full name, `fras log show`, with its parser."""
    yield from _below("fras", typer.main.get_command(app))


def commands_page() -> str:
    """Return the page: every command with its arguments and options."""
    said = dict(commands())
    return page(
        "Commands",
        prose(
            """`fras COMMAND --help` tells the same. Exit status: 0 success, 1 another named
            end, 2 bad input, 3 a stack that fails or is busy, 130 interrupted."""
        ),
        table(
            ("command", "what"),
            (
                (f"[`{name}`](#{name.replace(' ', '-')})", parser.help.partition("\n")[0])
                for name, parser in said.items()
                if not _group(parser)
            ),
        ),
        *(_command(name, parser) for name, parser in said.items() if not _group(parser)),
        "## What `fras bench` measures",
        table(("name", "what"), ((code(name), what) for name, (_, what) in BENCHMARKS.items())),
        "## What services take",
        prose(
            """Each service's command has options of its own; a table of processes
            (`compose/*.toml`) fills them in."""
        ),
        *(f"### Options of `fras {name}`\n\n{block(_help_of(name), 'text')}" for name in SERVICES),
    )


def _below(name: str, parser: Parser) -> Iterator[tuple[str, Parser]]:
    yield name, parser
    for inner in getattr(parser, "commands", {}).values():
        if not inner.hidden:
            yield from _below(f"{name} {inner.name}", inner)


def _group(parser: Parser) -> bool:
    return bool(getattr(parser, "commands", None)) and not parser.invoke_without_command


def _command(name: str, parser: Parser) -> str:
    context = typer.Context(parser, info_name=name)
    usage = " ".join((name, *parser.collect_usage_pieces(context)))
    parts = [f"## {name}", parser.help, block(usage, "text")]
    rows = [
        (code(record[0]), record[1].replace("<", "&lt;"))
        for parameter in parser.get_params(context)
        if (record := parameter.get_help_record(context)) and record[0] != "--help"
    ]
    if rows:
        parts.append(table(("argument or option", "what"), rows))
    return "\n\n".join(parts)


def _help_of(name: str) -> str:
    """Return a service's help without its usage, which Python's versions break differently."""
    said = StringIO()
    with patch.dict(os.environ, WIDTH), redirect_stdout(said), suppress(SystemExit):
        SERVICES[name].main()(["--help"])
    return said.getvalue().partition("\n\n")[2]
