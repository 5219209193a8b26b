"""Services started by hand compute on one thread too: two give other bits than one."""

import os
import subprocess
import sys

import pytest

from fras_common.threads import ONE_THREAD

PROBE = """
import sys
from fras_{name}.__main__ import main
assert "numpy" not in sys.modules, "numpy came before the environment was set"
try:
    main(["--help"])
except SystemExit:
    import os
    print(*[os.environ.get(name, "-") for name in sys.argv[1:]])
"""


@pytest.mark.parametrize("name", ["sim", "sa", "planner", "motion", "recorder"])
def test_environment_is_set_before_numpy_comes(name: str) -> None:
    environment = {key: value for key, value in os.environ.items() if key not in ONE_THREAD}
    done = subprocess.run(
        [sys.executable, "-c", PROBE.format(name=name), *ONE_THREAD],
        env=environment,
        capture_output=True,
        text=True,
        check=True,
    )
    assert done.stdout.splitlines()[-1].split() == list(ONE_THREAD.values())
