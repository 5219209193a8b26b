"""Try each extra of the wheel alone: `python -m release.extras [EXTRA ...]`; `make extras`: all.

Each gets an empty environment outside the checkout. There it must install what its metadata says
and no more, import every module of its package, and do what it is for: a service comes alive on a
router of the same environment, and ends with status 0 when it is interrupted.
"""

import argparse
import signal
import sys
import tempfile
import time
import uuid
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from fras_common.bus.zenoh_bus import ZenohBus
from fras_supervisor import free_port
from release.environment import Environment, ExtraFails
from release.pins import FRAS, ROOT, closure, extras_of_fras

PATIENCE_S: Final = 300.0
"""For what compiles its kernels first."""
LAZY: Final = {
    "fras_log.export.blueprint": "rerun",
    "fras_log.export.rerun": "rerun",
    "fras_log.export.foxglove": "export",
    "fras_log.export.gauges": "export",
    "fras_log.export.packing": "export",
}
"""Modules that one which names the extra loads when it is asked for, and the extra they need."""
IMPORT_ALL: Final = """
import importlib, pkgutil, sys
package, *lazy = sys.argv[1:]
found = pkgutil.walk_packages(importlib.import_module(package).__path__, f"{package}.")
for name in [one.name for one in found]:
    if name not in lazy and not name.endswith("__main__"):
        importlib.import_module(name)
"""
TABLES: Final = (
    "from fras_supervisor import find_table, load_table; load_table(find_table('local'))"
)
SOLVE: Final = """
from fras_sim.fem import TissueParameters, TissueSimulator, box_mesh
mesh = box_mesh((0.01, 0.01, 0.01), (3, 3, 2))
tissue = TissueSimulator(mesh, TissueParameters(), mesh.bottom_nodes, solver='mkl')
tissue.step({})
assert tissue.solver_name == 'mkl', tissue.solver_name
"""
RULES: Final = "from fras_planner.knowledge import load_knowledge; assert load_knowledge().criteria"


@dataclass(frozen=True)
class Trial:
    """What an extra must do alone.

    Parameters
    ----------
    package : str
        Whose modules must all be importable; empty: none.
    services : tuple of str
        Modules with a main that come alive, with the name of the service they run.
    commands : tuple of tuple of str
        That must end with status 0; `fras` and `python` are those of the environment.
    beside : tuple of str
        Extras that it adds to: it is of no use without them.
    """

    package: str = ""
    services: tuple[tuple[str, str], ...] = ()
    commands: tuple[tuple[str, ...], ...] = ()
    beside: tuple[str, ...] = ()


def _service(name: str, *more: tuple[str, str]) -> Trial:
    return Trial(f"fras_{name}", ((f"fras_{name}", name), *more))


A_TRIAL: Final = ("fras", "run", "a", "--mesh", "11,13,2", "--pace", "0", "--out", "out")
TRIALS: Final = {
    "": Trial("fras_common"),
    "sim": _service("sim", ("fras_sim.patient_main", "patient")),
    "sa": _service("sa"),
    "planner": Trial("fras_planner", (("fras_planner", "planner"),), (("python", "-c", RULES),)),
    "motion": _service("motion", ("fras_motion.arms_main", "arms")),
    "recorder": _service("recorder"),
    "monitor": _service("monitor"),
    "log": Trial("fras_log", commands=(("python", "-m", "fras_log.keys"),)),
    "replay": Trial("fras_replay"),
    "supervisor": Trial("fras_supervisor", commands=(("python", "-c", TABLES),)),
    "audit": Trial("fras_audit"),
    "experiments": Trial("fras_experiments", commands=(("fras", "experiment", "--list"),)),
    "cli": Trial("fras_cli", commands=(("fras", "--version"), ("fras", "scenario", "new"))),
    "export": Trial(commands=(("python", "-c", "import fras_log.export.foxglove"),)),
    "rerun": Trial(commands=(("python", "-c", "import fras_log.export.rerun"),)),
    "mkl": Trial(commands=(("python", "-c", SOLVE),), beside=("sim",)),
    "bench": Trial(commands=(("python", "-c", "import felupe, mujoco, pypardiso"),)),
    "all": Trial(commands=(A_TRIAL, ("fras", "audit", "out"))),
}
WITHOUT: Final = {"dev": "it is where this runs", "docs": "`make docs` builds the site with it"}


def check_installed(environment: Environment, extras: Sequence[str]) -> int:
    """Hold what is installed against the metadata; return how many distributions that are.

    Raises
    ------
    ExtraFails
    """
    expected = {str(name) for extra in extras for name in closure(FRAS, extra)} | {FRAS}
    found = environment.installed()
    if found != expected:
        more, less = sorted(found - expected), sorted(expected - found)
        raise ExtraFails(environment.extra, f"installed without need: {more}, missing: {less}")
    return len(found)


def come_alive(environment: Environment, services: Iterable[tuple[str, str]]) -> None:
    """Start services one after the other on a router, and stop each again.

    Raises
    ------
    ExtraFails
        One ends, does not come alive, or does not end in order.
    """
    endpoint = f"tcp/127.0.0.1:{free_port()}"
    router = environment.start("python", "-m", "fras_common.router", "--listen", endpoint)
    try:
        bus = ZenohBus("extras", endpoint, f"extras/{uuid.uuid4().hex[:4]}", open_timeout_s=30.0)
        try:
            for module, name in services:
                _come_alive(environment, module, name, endpoint, lambda: bus.tokens(5.0))
        finally:
            bus.close()
    finally:
        router.send_signal(signal.SIGINT)
        router.wait()


def _come_alive(
    environment: Environment,
    module: str,
    name: str,
    endpoint: str,
    tokens: Callable[[], Iterable[str]],
) -> None:
    own = ["--port", "0"] if name == "monitor" else []
    process = environment.start(
        "python", "-m", module, "--cell", "extras", "--connect", endpoint, *own
    )
    deadline_s = time.monotonic() + PATIENCE_S
    try:
        while not any(token.startswith(f"alive/{name}/") for token in tokens()):
            if process.poll() is not None or time.monotonic() > deadline_s:
                process.kill()
                raise ExtraFails(
                    environment.extra, f"{module} does not come alive\n{process.communicate()[0]}"
                )
            time.sleep(0.2)  # the interval between two looks
        process.send_signal(signal.SIGINT)
        said, _ = process.communicate(timeout=30)
    finally:
        if process.poll() is None:
            process.kill()
            process.wait()
    if process.returncode:
        raise ExtraFails(environment.extra, f"{module} ended with {process.returncode}\n{said}")


def try_extra(extra: str, wheel: Path) -> str:
    """Try one in an environment of its own; return what was found, in one line.

    Raises
    ------
    ExtraFails
    """
    trial = TRIALS[extra]
    began_s = time.monotonic()
    with tempfile.TemporaryDirectory(prefix="fras-extra-") as folder:
        environment = Environment(Path(folder), extra)
        extras = (extra, *trial.beside)
        environment.install(wheel, extras)
        n_found = check_installed(environment, extras)
        megabytes = _size_mb(environment.folder)
        if trial.package:
            lazy = [module for module, needs in LAZY.items() if needs != extra]
            environment.run("python", "-c", IMPORT_ALL, trial.package, *lazy)
        if trial.services:
            come_alive(environment, trial.services)
        for words in trial.commands:
            environment.run(*words)
    named = f"{FRAS}[{','.join(extras)}]" if extra else FRAS
    took_s = time.monotonic() - began_s
    return f"{named:<20} {n_found:3} distributions, {megabytes:4.0f} MB; tried in {took_s:.0f} s"


def _size_mb(folder: Path) -> float:
    return sum(path.lstat().st_size for path in folder.rglob("*") if path.is_file()) / 1e6


def main(argv: list[str] | None = None) -> int:
    """Try those that are named, or all."""
    parser = argparse.ArgumentParser(prog="release.extras", description=__doc__)
    parser.add_argument("extra", nargs="*", help="which; default: all, FRAS itself first")
    parser.add_argument("--wheel", type=Path, help="default: the one in dist/")
    options = parser.parse_args(argv)
    asked: list[str] = options.extra or [one for one in extras_of_fras() if one not in WITHOUT]
    if unknown := [one for one in asked if one not in TRIALS]:
        parser.error(f"{', '.join(unknown)}: there are {', '.join(filter(None, TRIALS))}")
    wheels = [options.wheel] if options.wheel else sorted((ROOT / "dist").glob("*.whl"))
    if not wheels:
        parser.error("no wheel in dist/: make dist")
    failed = 0
    for extra in asked:
        try:
            print(try_extra(extra, wheels[-1].resolve()), flush=True)
        except ExtraFails as error:
            failed += 1
            print(error, file=sys.stderr, flush=True)
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
