"""An empty environment outside the checkout, with the wheel and an extra in it."""

import os
import subprocess
import sys
import venv
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path

from packaging.utils import canonicalize_name

from fras_common.errors import FrasError
from release.pins import FRAS, ROOT


class ExtraFails(FrasError):
    """An extra that does not do alone what it is for. Attributes: ``extra``."""

    def __init__(self, extra: str, problem: str) -> None:
        super().__init__(f"{FRAS}[{extra}]: {problem}", extra=extra)


@dataclass
class Environment:
    """An empty environment, outside the checkout, that knows nothing of this one."""

    folder: Path
    extra: str
    python: Path = field(init=False)

    def __post_init__(self) -> None:
        venv.create(self.folder / "venv", symlinks=True, with_pip=False)
        self.python = self.folder / "venv" / "bin" / "python"

    @property
    def variables(self) -> dict[str, str]:
        """What its processes know: no path, no home and no cache of ours."""
        return {"HOME": str(self.folder), "PATH": os.defpath, "COLUMNS": "200"}

    def install(self, wheel: Path, extras: Sequence[str]) -> None:
        """Install the wheel with its extras, in the pinned versions."""
        named = f"{wheel}[{','.join(extras)}]" if any(extras) else str(wheel)
        pip = [sys.executable, "-m", "pip", "--python", str(self.python), "install", "--quiet"]
        done = subprocess.run(
            [*pip, "--constraint", str(ROOT / "constraints.txt"), named],
            capture_output=True,
            text=True,
            check=False,
        )
        if done.returncode:
            raise ExtraFails(self.extra, f"pip ended with {done.returncode}\n{done.stderr}")

    def installed(self) -> set[str]:
        """Name the distributions that are there, by normalised name."""
        code = "import importlib.metadata as m; print(*(one.name for one in m.distributions()))"
        return {canonicalize_name(name) for name in self.run("python", "-c", code).split()}

    def command(self, *words: str) -> list[str]:
        """Return the command with its program found in the environment."""
        return [str(self.python.with_name(words[0])), *words[1:]]

    def run(self, *words: str) -> str:
        """Run a command to its end and return what it said.

        Raises
        ------
        ExtraFails
            It did not end with status 0.
        """
        done = subprocess.run(
            self.command(*words),
            cwd=self.folder,
            env=self.variables,
            capture_output=True,
            text=True,
            check=False,
        )
        if done.returncode:
            said = f"{done.stdout}{done.stderr}"
            raise ExtraFails(
                self.extra, f"{' '.join(words)[:80]} ended with {done.returncode}\n{said}"
            )
        return done.stdout

    def start(self, *words: str) -> subprocess.Popen[str]:
        """Start a process."""
        return subprocess.Popen(
            self.command(*words),
            cwd=self.folder,
            env=self.variables,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
        )
