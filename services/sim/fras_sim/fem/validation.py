"""What a mesh made elsewhere must be before anything is computed on it, each fault by its name."""

# scipy.spatial and scipy.sparse.csgraph carry no types.
# pyright: reportUnknownVariableType=false, reportUnknownMemberType=false
# pyright: reportUnknownArgumentType=false

from typing import Final

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components

from fras_sim.fem.cells import TOPOLOGY, Cell
from fras_sim.fem.errors import BadMesh
from fras_sim.fem.reference import CORNERS, MIDSIDES, REFERENCE, TET_CORNERS

# A tissue's longest side lies between these, and most likely between those, in metres.
POSSIBLE_M: Final = (0.005, 1.0)
LIKELY_M: Final = (0.02, 0.5)
MISREAD_UNITS: Final = (
    (1e-3, "did you export in millimetres?"),
    (1e-2, "did you export in centimetres?"),
    (1e-6, "did you export in micrometres?"),
    (1e3, "was it brought from millimetres to metres twice?"),
    (1e2, "was it brought from centimetres to metres twice?"),
    (1e6, "was it brought from micrometres to metres twice?"),
)
# Determinants below this share of the longest edge cubed are rounding, not volume.
FLAT: Final = 1e-6
# Nodes closer than this share of the body's diagonal are the same place.
SAME_PLACE: Final = 1e-7
SHOWN: Final = 5

# Parent coordinates of the nodes of each cell.
_NODES: Final = {
    "hex8": CORNERS,
    "tet4": TET_CORNERS,
    "tet10": np.concatenate([TET_CORNERS, TET_CORNERS[MIDSIDES].mean(axis=1)]),
}


class EmptyMesh(BadMesh):
    """Neither nodes nor elements."""


class NoVolumeElements(BadMesh):
    """Elements that enclose no volume, or of a kind that no tissue is computed with.

    Attributes: ``cell``.
    """


class MalformedElements(BadMesh):
    """Arrays that are no mesh: wrong shapes, ids out of range, coordinates that are no numbers.

    Attributes: ``count`` and the first ``ids`` where single elements or nodes are at fault.
    """


class UnreferencedNodes(BadMesh):
    """Nodes that no element uses. Attributes: ``count``, first ``ids``."""


class ImplausibleSize(BadMesh):
    """A body much too large or too small: wrong units.

    Attributes: ``longest_m``; ``suggested_scale``, None where no usual unit explains it.
    """


class DuplicateNodes(BadMesh):
    """Nodes in the same place: the tissue is cut there. Attributes: ``count``, first ``ids``."""


class InvertedElements(BadMesh):
    """Elements turned inside out. Attributes: ``count``, first ``ids``."""


class DegenerateElements(BadMesh):
    """Elements without volume. Attributes: ``count``, first ``ids``."""


class OverlappingElements(BadMesh):
    """Elements that fill the same space. Attributes: ``count``, first ``ids``."""


class DisconnectedParts(BadMesh):
    """A body in pieces. Attributes: ``count``; ``sizes`` in elements, largest first."""


def validate_mesh(
    nodes_m: NDArray[np.float64],
    elements: NDArray[np.integer],
    cell: str,
    scale: float = 1.0,
) -> None:
    """Check that a volume mesh can be computed on.

    Parameters
    ----------
    nodes_m : ndarray, shape (n_nodes, 3), float64 [m]
    elements : ndarray of int, shape (n_elements, 8, 4 or 10)
        Node ids in the order of VTK_HEXAHEDRON, VTK_TETRA or VTK_QUADRATIC_TETRA.
    cell : {"hex8", "tet4", "tet10"}
    scale : float
        The factor that made metres of the numbers in the file; only the advice needs it.

    Raises
    ------
    EmptyMesh, NoVolumeElements, MalformedElements, UnreferencedNodes, ImplausibleSize, \
DuplicateNodes, DegenerateElements, InvertedElements, OverlappingElements, DisconnectedParts
        The first of these that holds, in this order: each check relies on those before it, and
        names the cause before its consequences (a body cut along duplicate nodes is in pieces).
    """
    known = _checked_cell(cell)
    _check_arrays(nodes_m, elements, known)
    _check_references(len(nodes_m), elements)
    _check_size(nodes_m, scale)
    _check_duplicates(nodes_m)
    _check_volumes(nodes_m, elements, known)
    _check_overlaps(elements, known)
    _check_connected(len(nodes_m), elements)


def _checked_cell(cell: str) -> Cell:
    for known in TOPOLOGY:
        if cell == known:
            return known
    raise NoVolumeElements(
        f"the mesh consists of {cell!r} cells: export volume elements, all of one kind of "
        f"{', '.join(TOPOLOGY)}",
        cell=cell,
    )


def _check_arrays(nodes_m: NDArray[np.float64], elements: NDArray[np.integer], cell: Cell) -> None:
    if len(nodes_m) == 0 or len(elements) == 0:
        raise EmptyMesh(
            f"the mesh has {len(nodes_m)} nodes and {len(elements)} elements: is it the file "
            "that you meant?",
            n_nodes=len(nodes_m),
            n_elements=len(elements),
        )
    wanted = TOPOLOGY[cell].n_nodes
    if nodes_m.ndim != 2 or nodes_m.shape[1] != 3:
        raise MalformedElements(
            f"nodes of shape {nodes_m.shape}: give three coordinates each", shape=nodes_m.shape
        )
    if elements.ndim != 2 or elements.shape[1] != wanted:
        raise MalformedElements(
            f"elements of shape {elements.shape}: a {cell} has {wanted} nodes",
            shape=elements.shape,
        )
    bad = np.flatnonzero(~np.isfinite(nodes_m).all(axis=1))
    if len(bad):
        raise MalformedElements(
            f"{_some(bad, len(nodes_m), 'node')} with a coordinate that is not finite: "
            "export the mesh anew",
            **_which(bad),
        )


def _check_references(n_nodes: int, elements: NDArray[np.integer]) -> None:
    bad = np.flatnonzero(((elements < 0) | (elements >= n_nodes)).any(axis=1))
    if len(bad):
        raise MalformedElements(
            f"{_some(bad, len(elements), 'element')} naming a node outside 0..{n_nodes - 1}: "
            "the file is damaged, or counts its nodes otherwise than its format says",
            **_which(bad),
        )
    ordered = np.sort(elements, axis=1)
    bad = np.flatnonzero((ordered[:, 1:] == ordered[:, :-1]).any(axis=1))
    if len(bad):
        raise DegenerateElements(
            f"{_some(bad, len(elements), 'element')} naming a node twice (collapsed): "
            "mesh the body with tetrahedra, or without collapsed elements",
            **_which(bad),
        )
    loose = np.flatnonzero(np.bincount(elements.ravel(), minlength=n_nodes) == 0)
    if len(loose):
        raise UnreferencedNodes(
            f"{_some(loose, n_nodes, 'node')} that no element uses: remove them, or export the "
            "elements that they belong to",
            **_which(loose),
        )


def _check_size(nodes_m: NDArray[np.float64], scale: float) -> None:
    longest_m = float(np.ptp(nodes_m, axis=0).max())
    if POSSIBLE_M[0] <= longest_m <= POSSIBLE_M[1]:
        return
    possible = f"a tissue is between {POSSIBLE_M[0]:g} and {POSSIBLE_M[1]:g} m long"
    for factor, question in MISREAD_UNITS:
        if LIKELY_M[0] <= longest_m * factor <= LIKELY_M[1]:
            suggested = float(f"{scale * factor:.12g}")
            raise ImplausibleSize(
                f"the mesh is {longest_m:g} m long, {possible}: {question} scale = {suggested:g} "
                f"makes it {longest_m * factor:g} m",
                longest_m=longest_m,
                suggested_scale=suggested,
            )
    raise ImplausibleSize(
        f"the mesh is {longest_m:g} m long, {possible}: check its units and the scale",
        longest_m=longest_m,
        suggested_scale=None,
    )


def _check_duplicates(nodes_m: NDArray[np.float64]) -> None:
    if len(nodes_m) < 2:
        return
    # Not at the top: a box needs no search, and each start of the simulator would load it.
    from scipy.spatial import KDTree

    nearest_m = KDTree(nodes_m).query(nodes_m, k=2)[0][:, 1]
    diagonal_m = float(np.linalg.norm(np.ptp(nodes_m, axis=0)))
    twins = np.flatnonzero(nearest_m <= SAME_PLACE * diagonal_m)
    if len(twins):
        raise DuplicateNodes(
            f"{_some(twins, len(nodes_m), 'node')} in the same place as another: the tissue would "
            "be cut there; merge coincident nodes before the export",
            **_which(twins),
        )


def jacobian_determinants(
    nodes_m: NDArray[np.float64], elements: NDArray[np.integer], cell: Cell
) -> NDArray[np.float64]:
    """Return det dX/dxi at the nodes of each element, where it fails first, and at its quadrature.

    Returns
    -------
    ndarray, shape (n_elements, n_points), float64 [m³]
        Parent coordinates are those of `reference.REFERENCE`.
    """
    reference = REFERENCE[cell]
    parent = reference.derivatives(np.concatenate([_NODES[cell], reference.points]))
    jacobian = np.einsum("eai,qaj->eqij", nodes_m[elements], parent)
    determinants: NDArray[np.float64] = np.linalg.det(jacobian)
    return determinants


def _check_volumes(nodes_m: NDArray[np.float64], elements: NDArray[np.integer], cell: Cell) -> None:
    corners_m = nodes_m[elements]
    longest_m = np.ptp(corners_m, axis=1).max(axis=1)
    lowest = jacobian_determinants(nodes_m, elements, cell).min(axis=1) / longest_m**3
    total = len(elements)
    flat = np.flatnonzero(np.abs(lowest) <= FLAT)
    if len(flat):
        raise DegenerateElements(
            f"{_some(flat, total, 'element')} without volume: improve the mesh's quality",
            **_which(flat),
        )
    inverted = np.flatnonzero(lowest < 0.0)
    if len(inverted) == total:
        raise InvertedElements(
            f"every one of the {total} elements is inverted: the body is mirrored, or its nodes "
            f"are not in the order of VTK's {cell}",
            **_which(inverted),
        )
    if len(inverted):
        raise InvertedElements(
            f"{_some(inverted, total, 'element')} inverted: smooth or refine the mesh there",
            **_which(inverted),
        )


def _check_overlaps(elements: NDArray[np.integer], cell: Cell) -> None:
    faces = np.sort(elements[:, TOPOLOGY[cell].faces], axis=2)
    n_faces = faces.shape[1]
    _, of_face, count = np.unique(
        faces.reshape(-1, faces.shape[2]), axis=0, return_inverse=True, return_counts=True
    )
    crowded = (count[of_face.reshape(-1, n_faces)] > 2).any(axis=1)
    _, of_body, copies = np.unique(
        np.sort(elements, axis=1), axis=0, return_inverse=True, return_counts=True
    )
    bad = np.flatnonzero(crowded | (copies[of_body.ravel()] > 1))
    if len(bad):
        raise OverlappingElements(
            f"{_some(bad, len(elements), 'element')} sharing a face with two others or all nodes "
            "with another: they fill the same space, remove the copies",
            **_which(bad),
        )


def _check_connected(n_nodes: int, elements: NDArray[np.integer]) -> None:
    first = np.repeat(elements[:, 0], elements.shape[1])
    links = coo_matrix((np.ones(elements.size), (first, elements.ravel())), (n_nodes, n_nodes))
    n_parts, part_of = connected_components(links, directed=False)
    if n_parts > 1:
        counts = np.bincount(part_of[elements[:, 0]], minlength=n_parts)
        sizes = [int(size) for size in np.sort(counts)[::-1]]
        shown = ", ".join(str(size) for size in sizes[:SHOWN])
        raise DisconnectedParts(
            f"the mesh is in {n_parts} parts of {shown}{', ...' if n_parts > SHOWN else ''} "
            "elements: keep one, or join them",
            count=n_parts,
            sizes=sizes,
        )


def _which(bad: NDArray[np.intp]) -> dict[str, object]:
    return {"count": len(bad), "ids": [int(one) for one in bad[:SHOWN]]}


def _some(bad: NDArray[np.intp], total: int, what: str) -> str:
    """`3 of 80 elements (ids 4, 7, 9)`."""
    ids = ", ".join(str(one) for one in bad[:SHOWN])
    more = ", ..." if len(bad) > SHOWN else ""
    return f"{len(bad)} of {total} {what}s (id{'s' if len(bad) > 1 else ''} {ids}{more})"
