"""What a shell completes of `fras`: the script it reads, and what that asks for."""

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

FRAS = str(Path(sys.executable).with_name("fras"))
# As a shell does behind `fras run <tab>`: words so far, and what it calls for what may follow.
ASK = """
source {script}
COMP_WORDS=({words}) COMP_CWORD={place}
_fras_completion {fras}
printf '%s\\n' "${{COMPREPLY[@]}}"
"""


def script_for(shell: str) -> str:
    environment = {**os.environ, "_FRAS_COMPLETE": f"source_{shell}"}
    done = subprocess.run([FRAS], check=True, capture_output=True, text=True, env=environment)
    return done.stdout


@pytest.mark.parametrize(
    ("shell", "registers"),
    [
        ("bash", "complete -o default -F _fras_completion fras"),
        ("zsh", "#compdef fras"),
        ("fish", "complete --command fras"),
    ],
)
def test_each_shell_gets_a_script_that_registers_with_it(shell: str, registers: str) -> None:
    assert registers in script_for(shell)


def completed_by_bash(folder: Path, *words: str) -> list[str]:
    script = folder / "fras.bash"
    script.write_text(script_for("bash"))
    quoted = " ".join(f"'{word}'" for word in ("fras", *words))
    text = ASK.format(script=script, words=quoted, place=len(words), fras=FRAS)
    done = subprocess.run(["bash", "-c", text], check=True, capture_output=True, text=True)
    return done.stdout.split()


@pytest.mark.skipif(shutil.which("bash") is None, reason="no bash here")
@pytest.mark.parametrize(
    ("words", "offered"),
    [
        (("re",), {"resume", "restart", "report", "replay"}),
        (("log", "ver"), {"verify"}),
        (("run", "--cri"), {"--criterion"}),
        (("run", ""), {"a", "b", "c", "default", "slab", "twin"}),
        (("run", "sl"), {"slab"}),
    ],
)
def test_bash_offers_commands_options_and_scenarios(
    words: tuple[str, ...], offered: set[str], tmp_path: Path
) -> None:
    assert offered <= set(completed_by_bash(tmp_path, *words))


def test_a_file_of_ones_own_is_left_to_the_shell(tmp_path: Path) -> None:
    assert completed_by_bash(tmp_path, "run", "./mine") == []


def test_zsh_asks_with_its_own_words() -> None:
    environment = {
        **os.environ,
        "_FRAS_COMPLETE": "complete_zsh",
        "_TYPER_COMPLETE_ARGS": "fras log ver",
    }
    done = subprocess.run([FRAS], check=True, capture_output=True, text=True, env=environment)
    assert '"verify":' in done.stdout
