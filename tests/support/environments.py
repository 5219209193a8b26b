"""A virtual environment that holds what this one does, but FRAS itself."""

import subprocess
import sys
import sysconfig
import venv
from pathlib import Path


def environment_without_fras(folder: Path) -> Path:
    """Make one in a second, with links to the libraries of this one; return its interpreter."""
    venv.create(folder, symlinks=True, with_pip=False)
    here = Path(sysconfig.get_path("purelib"))
    there = next((folder / "lib").glob("python*")) / "site-packages"
    for entry in here.iterdir():
        # An editable install of FRAS is a file of paths and its metadata.
        if "fras" not in entry.name:
            (there / entry.name).symlink_to(entry)
    return folder / "bin" / "python"


def install_wheel(python: Path, wheel: Path) -> None:
    """Install a wheel alone: what it needs is there."""
    pip = [sys.executable, "-m", "pip", "--python", str(python), "install", "--quiet"]
    subprocess.run([*pip, "--no-deps", "--no-index", str(wheel)], check=True)
