"""`python -m fras_sim.mesh_parser FORMAT IN OUT`: meshio, in a process that may die of a bad file.

One damaged byte can have its readers allocate gigabytes or count to billions. Here that ends with
this process, at its limits, and not with the simulator.
"""

# meshio carries no types.
# pyright: reportMissingTypeStubs=false, reportUnknownVariableType=false
# pyright: reportUnknownMemberType=false, reportUnknownArgumentType=false

import importlib
import resource
import sys
from typing import Any

import numpy as np

MEMORY_BYTES = 4 * 2**30
CPU_S = 20


def main() -> None:
    """Write points, and of each block of cells its kind, dimension and nodes, as an NPZ file."""
    format_name, source, target = sys.argv[1:]
    resource.setrlimit(resource.RLIMIT_AS, (MEMORY_BYTES, MEMORY_BYTES))
    resource.setrlimit(resource.RLIMIT_CPU, (CPU_S, CPU_S))
    parsed = importlib.import_module(f"meshio.{format_name}").read(source)
    blocks: dict[str, Any] = {
        f"{index} {block.dim} {block.type}": np.asarray(block.data, dtype=np.int64)
        for index, block in enumerate(parsed.cells)
    }
    np.savez(target, points=np.asarray(parsed.points, dtype=np.float64), **blocks)


if __name__ == "__main__":
    main()
