"""`python -m fras_sim.mesh_check NAME < FILE`: whether the simulator can compute with a mesh.

Whoever starts a trial asks before starting anything; the command line is not to import services.
"""

import argparse
import sys
from typing import NoReturn

import msgspec

from fras_common.errors import FrasError
from fras_common.extras import require_extra
from fras_common.messages import Fault
from fras_common.scenario import MeshFacts

EXIT_REFUSED = 2


def describe(data: bytes, name: str, scale: float) -> MeshFacts:
    """Read and check a mesh; see `mesh_file.read_mesh` for what is raised."""
    with require_extra("sim"):
        from fras_sim.mesh_file import mesh_facts, read_mesh
    return mesh_facts(read_mesh(data, name, scale))


def main(argv: list[str] | None = None) -> NoReturn:
    """Print `MeshFacts`, or a `Fault` and exit with 2, as one JSON object."""
    parser = argparse.ArgumentParser(prog="python -m fras_sim.mesh_check", description=__doc__)
    parser.add_argument("name", help="name of the file; its suffix tells the format")
    parser.add_argument("--scale", type=float, default=1.0, help="what makes metres of its numbers")
    arguments = parser.parse_args(argv)
    try:
        answer = describe(sys.stdin.buffer.read(), arguments.name, arguments.scale)
    except FrasError as error:
        answer = Fault(kind=error.kind, text=str(error))
    print(msgspec.json.encode(answer).decode())
    sys.exit(EXIT_REFUSED if isinstance(answer, Fault) else 0)


if __name__ == "__main__":
    main()
