"""The commands that pages show, and whether the command line would take them."""

import re
import shlex
from collections.abc import Iterator
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import typer

from fras_cli.app import app
from fras_cli.bench import BENCHMARKS
from fras_cli.commands.services import SERVICES
from support.pages import ROOT

HEREDOC = re.compile(r"<<'(\w+)'\n.*?\n\1\n", re.DOTALL)
ENDS = {";", "&&", "|", "||", "&"}
REDIRECTIONS = {">", ">>", "<", "2>"}
SHELLS = {"source", "export", "cp", "cat", "echo", "mkdir", "scp"}
OTHERS = {"dask", "docker", "rerun", "pip"}
"""Programs that are not ours."""


def commands(text: str) -> Iterator[list[str]]:
    """Words of each command of a shell text, without comments, redirections and variables."""
    for line in HEREDOC.sub("\n", text).replace("\\\n", " ").splitlines():
        reader = shlex.shlex(line, posix=True, punctuation_chars=True)
        reader.whitespace_split = True
        words: list[str] = []
        reading = list(reader)
        while reading:
            word = reading.pop(0)
            if word in ENDS:
                yield words
                words = []
            elif word in REDIRECTIONS:
                reading.pop(0)
            elif words or not re.match(r"\w+=", word):
                words.append(word)
        if words:
            yield words


def check(words: list[str], page: Path) -> None:
    """Refuse a command that does not exist, or has not these options; none is run."""
    # As an environment of another name has it: theatre/bin/fras.
    words = [Path(words[0]).name, *words[1:]]
    program, *rest = words
    if "fras" in words:
        check_fras(words[words.index("fras") + 1 :])
    elif program == "make":
        targets = re.findall(r"^([a-z-]+):", (ROOT / "Makefile").read_text(), re.MULTILINE)
        assert set(rest) <= set(targets), words
    elif program in {"python", "python3"}:
        check_python(rest, page)
    else:
        assert program in SHELLS | OTHERS, words


def check_python(rest: list[str], page: Path) -> None:
    if rest[0] == "-m":
        assert find_spec(rest[1]) is not None, rest
    else:
        shown = f"python {rest[0]} " in page.read_text().partition("```python")[2]
        assert shown or (ROOT / rest[0]).is_file(), rest


def check_fras(words: list[str]) -> None:
    """Parse a command as `fras` does, up to where it would be run."""
    parser: Any = typer.main.get_command(app)
    context: Any = None
    name = "fras"
    if not words or words[0] == "--install-completion":
        # It would do so; without anything it shows its help.
        assert not words or any(words[0] in option.opts for option in parser.params), words
        return
    try:
        while hasattr(parser, "commands"):
            context = parser.make_context(name, list(words), parent=context)
            # What a group takes for its command; the library has no other name for it.
            words = [*context._protected_args, *context.args]  # noqa: SLF001
            name, parser, words = parser.resolve_command(context, words)
        context = parser.make_context(name, list(words), parent=context)
    except typer.Exit:  # --version, --help
        return
    except Exception as error:
        raise AssertionError(f"{name} {' '.join(words)}: {error}") from error
    if name == "bench":
        assert context.params["name"] in {None, *BENCHMARKS}, context.params
    if context.args:
        module = BENCHMARKS[context.params["name"]][0] if name == "bench" else SERVICES[name].module
        check_passed_on(module, context.args)


def check_passed_on(module: str, words: list[str]) -> None:
    """Options that a service or a benchmark parses by itself stand in its source."""
    source = _source(module) + _source("fras_common.service.runner")
    for option in (word.partition("=")[0] for word in words if word.startswith("-")):
        destination = option.removeprefix("--").replace("-", "_")
        assert f'"{option}"' in source or f'"{destination}"' in source, (module, option)


def _source(module: str) -> str:
    spec = find_spec(module)
    assert spec is not None
    assert spec.origin is not None
    return Path(spec.origin).read_text()


def check_named(words: list[str]) -> None:
    """Refuse a command of a sentence: arguments may be missing there, options may not be made up.

    `run|up` stands for each of both.
    """
    for first in words[0].split("|"):
        parser: Any = typer.main.get_command(app)
        rest = [first, *words[1:]]
        while rest and rest[0] in getattr(parser, "commands", {}):
            parser, rest = parser.commands[rest[0]], rest[1:]
        if parser.name == "experiment" and rest:
            parser = parser.commands["run"]
        assert parser.name != "fras" or rest[0].startswith("-"), words
        if parser.name == "bench":
            assert set(rest[:1]) <= {*BENCHMARKS, "NAME"}, words
        elif parser.name in SERVICES:
            check_passed_on(SERVICES[parser.name].module, rest)
        else:
            known = {option for parameter in parser.params for option in parameter.opts}
            said = (word for several in rest for word in several.split("|"))
            options = {word.partition("=")[0] for word in said if word.startswith("--")}
            assert options <= known | {"--help"}, words
