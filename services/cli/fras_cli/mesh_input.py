"""The mesh file of a scenario: read here, checked by the simulator's own command."""

import subprocess
import sys
from functools import lru_cache
from pathlib import Path

import msgspec

from fras_common.errors import FrasError
from fras_common.extras import MissingExtra
from fras_common.messages import Fault
from fras_common.scenario import MeshFacts, Scenario, ScenarioError, fit_to_mesh

CHECK_TIMEOUT_S = 120.0
# It travels by value, in a message with the scenario.
MAX_BYTES = 60 * 2**20


class MeshCheckFailed(FrasError):
    """The simulator's mesh check itself went wrong."""


def mesh_path(scenario: Scenario, file: Path) -> Path:
    """Where the mesh file of a scenario lies: its path is relative to the scenario's file."""
    return file.parent / (scenario.tissue.mesh_file or "")


def read_mesh_file(scenario: Scenario, file: Path) -> tuple[Scenario, bytes]:
    """Read the mesh file that a scenario names, and fit the scenario to it.

    Parameters
    ----------
    scenario : Scenario
        With a mesh file.
    file : Path
        The scenario's own.

    Returns
    -------
    Scenario
        With the mesh's size, and the mesh's bare name: what a trial is about must not depend on
        where its files lay.
    bytes
        The mesh file's content.

    Raises
    ------
    ScenarioError
        The mesh file can't be read or computed with, or scenario and mesh don't fit.
    MissingExtra
        The simulator's libraries are not installed.
    """
    tissue, path = scenario.tissue, mesh_path(scenario, file)
    problem = ""
    try:
        if not path.is_file():
            problem = f"{path} is no file" if path.exists() else f"there is no file {path}"
        elif (size := path.stat().st_size) > MAX_BYTES:
            problem = f"{path} has {size} bytes, at most {MAX_BYTES} are read: coarsen the mesh"
        data = b"" if problem else path.read_bytes()
    except (OSError, ValueError) as error:
        problem, data = f"{path} can't be read: {error}", b""
    if problem:
        raise ScenarioError(str(file), "tissue.mesh_file", tissue.mesh_file, problem)
    answer = _ask_simulator(data, path.name, tissue.mesh_scale)
    if isinstance(answer, MeshFacts):
        named = msgspec.structs.replace(tissue, mesh_file=path.name)
        return fit_to_mesh(msgspec.structs.replace(scenario, tissue=named), answer, str(file)), data
    if answer.kind == MissingExtra.__name__:
        raise MissingExtra(answer.text)
    if answer.kind == "ImplausibleSize":
        raise ScenarioError(str(file), "tissue.mesh_scale", tissue.mesh_scale, answer.text)
    raise ScenarioError(str(file), "tissue.mesh_file", tissue.mesh_file, answer.text)


# Many seeds of one scenario ask for the same mesh.
@lru_cache(maxsize=1)
def _ask_simulator(data: bytes, name: str, scale: float) -> MeshFacts | Fault:
    command = [sys.executable, "-m", "fras_sim.mesh_check", f"--scale={scale!r}", "--", name]
    try:
        done = subprocess.run(
            command, input=data, capture_output=True, timeout=CHECK_TIMEOUT_S, check=False
        )
    except subprocess.TimeoutExpired as error:
        raise MeshCheckFailed(
            f"the check of {name} took more than {CHECK_TIMEOUT_S:.0f} s: is the mesh too fine?"
        ) from error
    try:
        if done.returncode == 0:
            return msgspec.json.decode(done.stdout, type=MeshFacts)
        return msgspec.json.decode(done.stdout, type=Fault)
    except msgspec.DecodeError as error:
        said = done.stderr.decode(errors="replace").strip().splitlines()[-1:] or ["nothing"]
        raise MeshCheckFailed(
            f"the check of {name} ended with status {done.returncode} and said {said[0]!r}",
            status=done.returncode,
        ) from error
