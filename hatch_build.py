"""What a build of the distribution adds to the files: of which commit they are."""

import runpy
import tempfile
from pathlib import Path
from typing import Any

from hatchling.builders.config import BuilderConfig
from hatchling.builders.hooks.plugin.interface import BuildHookInterface

MODULE = "services/common/fras_common/commit.py"


class CommitHook(BuildHookInterface[BuilderConfig]):
    """Writes the commit into sdist and wheel; a wheel made from an sdist finds it there."""

    def initialize(self, version: str, build_data: dict[str, Any]) -> None:
        """Add the file, unless the code stays in its checkout, or the commit is not known."""
        if version == "editable":
            return
        # By its path: what is built is not installed.
        module = runpy.run_path(str(Path(self.root) / MODULE))
        if not (commit := module["commit"]()):
            return
        # Kept until this process ends, which is after the file was taken in.
        self._folder = tempfile.TemporaryDirectory(prefix="fras-build-")
        written = Path(self._folder.name) / module["FILE"]
        written.write_text(f"{commit}\n", encoding="utf-8")
        place = Path(MODULE).with_name(module["FILE"])
        inside = place.relative_to("services/common") if self.target_name == "wheel" else place
        build_data["force_include"][str(written)] = str(inside)
