"""What a process loads before it is ready: each library costs every start."""

import subprocess
import sys

import pytest

LOADED = """
import importlib, sys
importlib.import_module(sys.argv[1])
print(*(name for name in sys.argv[2:] if sys.modules.get(name) is not None))
"""


@pytest.mark.parametrize(
    ("module", "unused"),
    [
        # Everybody waits for the router.
        ("fras_common.router", ("numpy", "structlog", "rich", "psutil", "fras_common.access")),
        ("fras_common.bus.zenoh_bus", ("numpy", "structlog", "rich")),
        ("fras_recorder.service", ("numpy", "rich")),
        ("fras_planner.service", ("rich", "scipy")),
        ("fras_sa.service", ("rich", "scipy", "numba")),
        ("fras_motion.service", ("rich", "scipy", "numba")),
        ("fras_sim.service", ("rich", "scipy.spatial", "meshio")),
        (
            "fras_cli.app",
            ("numpy", "scipy", "matplotlib", "zenoh", "structlog", "fras_cli.failures"),
        ),
        # `fras stop`: a person waits for it.
        ("fras_cli.keep", ("matplotlib", "jinja2")),
    ],
)
def test_it_loads_nothing_that_it_does_not_use(module: str, unused: tuple[str, ...]):
    done = subprocess.run(
        [sys.executable, "-c", LOADED, module, *unused], check=True, capture_output=True, text=True
    )
    assert done.stdout.split() == []


def test_what_was_loaded_before_stays():
    code = "import rich, sys, fras_common.service; assert sys.modules['rich'] is rich"
    subprocess.run([sys.executable, "-c", code], check=True)


def test_what_was_kept_away_can_be_loaded_later():
    code = "import fras_common.service, sys; assert 'rich' not in sys.modules; import rich.console"
    subprocess.run([sys.executable, "-c", code], check=True)
