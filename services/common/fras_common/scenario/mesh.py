"""A scenario whose tissue is a mesh from a file: what is known of it, and whether both fit."""

from typing import Final

import msgspec

from fras_common.scenario.errors import ScenarioError
from fras_common.scenario.loader import check_places
from fras_common.scenario.model import Scenario, TissueSection

# A size that differs from the mesh's by less is the mesh's, written down.
SIZE_ROUNDING_M: Final = 1e-6


class MeshFacts(msgspec.Struct, frozen=True, kw_only=True):
    """What the simulator tells of a mesh that it can compute with.

    Attributes
    ----------
    cell : str
        hex8, tet4 or tet10.
    elements : tuple of str
        Values of `tissue.element` that these cells can be computed with.
    size_m : (3,)
        Bounding box, moved to the origin.
    """

    cell: str
    elements: tuple[str, ...]
    n_nodes: int
    n_elements: int
    size_m: tuple[float, float, float]


def fit_to_mesh(scenario: Scenario, mesh: MeshFacts, file: str = "scenario") -> Scenario:
    """Give a scenario with a mesh file its size, and check that it fits the mesh.

    Parameters
    ----------
    scenario : Scenario
        As `load` gave it.
    mesh : MeshFacts
    file : str
        What an error names.

    Raises
    ------
    ScenarioError
        The element is not one for the mesh's cells; the scenario says another size; ROI or discs
        off the bounding box; no room for a ROI.
    """
    tissue = scenario.tissue
    if tissue.element not in mesh.elements:
        raise ScenarioError(
            file, "tissue.element", tissue.element,
            f"the cells of {tissue.mesh_file} are {mesh.cell}: {' or '.join(mesh.elements)}",
        )  # fmt: skip
    given, size = tissue.size_m, mesh.size_m
    apart = max(abs(one - other) for one, other in zip(given, size, strict=True))
    if given != TissueSection().size_m and apart > SIZE_ROUNDING_M:
        raise ScenarioError(
            file, "tissue.size_m", list(given),
            f"the bounding box of {tissue.mesh_file} is "
            f"{[float(f'{extent:.6g}') for extent in size]} m: leave size_m out",
        )  # fmt: skip
    tissue = msgspec.structs.replace(tissue, size_m=size)
    fitted = msgspec.structs.replace(scenario, tissue=tissue)
    check_places(fitted, file)
    return fitted
