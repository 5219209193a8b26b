"""`fras bench`: run one of the benchmarks of the checkout, in a process of its own."""

import os
import subprocess
import sys
from pathlib import Path

from rich.console import Console
from rich.table import Table

from fras_common.errors import FrasError

# Name, module, what it measures. Modules of `benchmarks/` need the checkout.
BENCHMARKS: dict[str, tuple[str, str]] = {
    "all": ("benchmarks.brief", "All of them briefly, in a quarter of an hour; one table."),
    "fe": ("benchmarks.fe", "The finite elements against MuJoCo flex and felupe, by mesh."),
    "mesh": ("benchmarks.fe_mesh", "How much a finer mesh changes the force of a pull."),
    "stress": ("fras_sim.stress", "10,000 steps that try to break the tissue."),
    "planner": ("benchmarks.planner", "The planner against the paper's way with clingo, by grid."),
    "criteria": ("benchmarks.criteria", "Where each criterion grasps, over 400 scenes."),
    "awareness": (
        "benchmarks.awareness",
        "What a verdict and a context cost, how well a crossing is foretold.",
    ),
    "motion": ("benchmarks.motion", "The arms against their limits, their stops and their reach."),
    "recorder": (
        "benchmarks.recorder",
        "Writing and verifying a log against the bare library; loss at 50 times a trial's rate.",
    ),
    "log": (
        "benchmarks.log",
        "Verifying, auditing and exporting a trial against the trial's own time.",
    ),
    "replay": ("benchmarks.replay", "How late a replay's messages go out, and how fast at most."),
    "secure": ("benchmarks.secure", "What certificates and access control cost a tick."),
    "fuzz": (
        "benchmarks.fuzz",
        "Hostile input against decoders, services, a trial and readers of files.",
    ),
    "soak": (
        "benchmarks.soak",
        "Memory, descriptors, threads and files over many trials of one stack.",
    ),
    "page": ("benchmarks.page", "The surgeon's page: stops, what it costs a tick, first picture."),
    "loop": ("benchmarks.loop", "A tick of all services against three raw Zenoh hops."),
    "start": ("benchmarks.start", "How long a stack takes to be ready, and what its processes do."),
    "hosts": (
        "benchmarks.hosts",
        "A tick over two hosts, by the round trip between them.",
    ),
}


class UnknownBenchmark(FrasError):
    """A benchmark that does not exist. Attributes: ``name``."""


class NoCheckout(FrasError):
    """Benchmarks are part of the checkout, not of an installed wheel."""


def list_benchmarks(console: Console) -> None:
    """Print what there is to measure."""
    table = Table(box=None, show_header=False)
    for name, (_, what) in BENCHMARKS.items():
        table.add_row(f"fras bench {name}", what)
    console.print(table)
    console.print("`fras bench NAME --help` lists the options of one.")


def run_benchmark(name: str, arguments: list[str]) -> int:
    """Run a benchmark with its own arguments and return its exit status.

    Raises
    ------
    UnknownBenchmark, NoCheckout
    """
    if name not in BENCHMARKS:
        known = ", ".join(BENCHMARKS)
        raise UnknownBenchmark(f"there is no benchmark {name!r}: one of {known}", name=name)
    module, _ = BENCHMARKS[name]
    environment = dict(os.environ)
    if module.startswith("benchmarks."):
        root = str(_checkout())
        before = environment.get("PYTHONPATH")
        environment["PYTHONPATH"] = f"{root}{os.pathsep}{before}" if before else root
    command = [sys.executable, "-m", module, *arguments]
    return subprocess.run(command, env=environment, check=False).returncode


def _checkout() -> Path:
    for folder in (*Path(__file__).resolve().parents, Path.cwd(), *Path.cwd().parents):
        if (folder / "benchmarks" / "fe.py").is_file():
            return folder
    raise NoCheckout(
        "the benchmarks are not here: run this in a checkout of FRAS, installed with `make install`"
    )
