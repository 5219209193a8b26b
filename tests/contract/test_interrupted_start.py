"""Ctrl-C while a process still loads its libraries: it ends at once, and says nothing."""

import os
import signal
import subprocess
import sys

import pytest

# Stops where a module is loaded, as a slow disk would.
LOADING = """
import importlib.abc, runpy, signal, sys

slow, process = sys.argv.pop(1), sys.argv.pop(1)

class Slow(importlib.abc.MetaPathFinder):
    def find_spec(self, name, path, target=None):
        if name == slow:
            print("loading", flush=True)
            signal.pause()

sys.meta_path.insert(0, Slow())
runpy.run_module(process, run_name="__main__")
"""

SERVICES = ("sim", "sa", "planner", "motion", "recorder")


@pytest.mark.parametrize(
    ("process", "module", "arguments"),
    [
        *((f"fras_{name}", f"fras_{name}.service", ()) for name in SERVICES),
        ("fras_sim", "fras_common.service", ()),
        ("fras_motion.arms_main", "fras_common.service", ()),
        ("fras_common.router", "zenoh", ()),
        ("fras_cli", "typer", ()),
        ("fras_cli", "fras_cli.keep", ("up",)),
        ("fras_cli", "fras_common.bus.zenoh_bus", ("run", "--pace", "0")),
    ],
)
def test_it_ends_of_the_signal_alone(process: str, module: str, arguments: tuple[str, ...]):
    with subprocess.Popen(
        [sys.executable, "-c", LOADING, module, process, *arguments],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        # A shell that starts the tests in the background has children ignore it.
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.default_int_handler),
        env={name: value for name, value in os.environ.items() if name != "FRAS_PARENT"},
    ) as started:
        try:
            assert started.stdout is not None
            assert started.stdout.readline() == "loading\n", started.communicate(timeout=60)
            started.send_signal(signal.SIGINT)
            said = started.communicate(timeout=60)
        finally:
            started.kill()
    assert said == ("", "")
    assert started.returncode == -signal.SIGINT
