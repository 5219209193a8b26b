"""From element to body: where each entry of the Hessian goes, and the body's elastic energy."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fras_sim.fem.element import ElementKind, quadrature
from fras_sim.fem.element_kernels import element_kernels
from fras_sim.fem.materials import MaterialName, lame_parameters
from fras_sim.fem.mesh import Mesh

FIXED = -1


@dataclass(frozen=True, eq=False)
class SparsityPattern:
    """Upper triangle, by rows, of the Hessian over the degrees of freedom that are not fixed.

    Parameters
    ----------
    indptr, indices : ndarray, int32
        Compressed rows; columns ascend, the first entry of a row is its diagonal.
    rows : ndarray, shape (n_entries,), int32
        Row of each entry.
    free : ndarray, shape (n,), int64
        For each row, its place in a flattened (n_nodes, 3) array.
    row_of : ndarray, shape (n_nodes, 3), int32
        For each degree of freedom, its row, or -1 if its node is fixed.
    scatter : ndarray, shape (n_elements, n_pairs, 9), int32
        Target of each entry of an element's Hessian; what belongs nowhere goes to ``n_entries``.
    """

    indptr: NDArray[np.int32]
    indices: NDArray[np.int32]
    rows: NDArray[np.int32]
    free: NDArray[np.int64]
    row_of: NDArray[np.int32]
    scatter: NDArray[np.int32]

    @property
    def n(self) -> int:
        """Number of rows."""
        return len(self.free)

    @property
    def n_entries(self) -> int:
        """Number of stored entries."""
        return len(self.indices)

    @property
    def diagonal(self) -> NDArray[np.int32]:
        """Place of each row's diagonal among the entries."""
        return self.indptr[:-1]


def sparsity_pattern(
    elements: NDArray[np.int32], n_nodes: int, fixed_nodes: NDArray[np.int32]
) -> SparsityPattern:
    """Return the pattern of the Hessian with the fixed nodes eliminated."""
    is_free = np.ones((n_nodes, 3), dtype=bool)
    is_free[fixed_nodes] = False
    free = np.flatnonzero(is_free)
    n = len(free)
    row_of = np.full((n_nodes, 3), FIXED, dtype=np.int32)
    row_of[is_free] = np.arange(n, dtype=np.int32)

    first, second = np.triu_indices(elements.shape[1])
    rows_a = np.repeat(row_of[elements[:, first]], 3, axis=2).astype(np.int64)
    rows_b = np.tile(row_of[elements[:, second]], (1, 1, 3)).astype(np.int64)
    low, high = np.minimum(rows_a, rows_b), np.maximum(rows_a, rows_b)
    # The block of a node with itself is symmetric: its lower half would be counted twice.
    lower_half = (first == second)[:, None] & np.tril(np.ones((3, 3), dtype=bool), -1).ravel()
    stored = (low != FIXED) & ~lower_half

    keys, place = np.unique(low[stored] * n + high[stored], return_inverse=True)
    scatter = np.full(low.shape, len(keys), dtype=np.int32)
    scatter[stored] = place
    rows = (keys // n).astype(np.int32)
    indptr = np.searchsorted(rows, np.arange(n + 1)).astype(np.int32)
    return SparsityPattern(indptr, (keys % n).astype(np.int32), rows, free, row_of, scatter)


def with_identity_rows(
    pattern: SparsityPattern, values: NDArray[np.float64], rows: NDArray[np.int32]
) -> NDArray[np.float64]:
    """Return the entries of the same matrix with some rows and columns those of the identity.

    This prescribes unknowns without a new pattern.
    """
    is_prescribed = np.zeros(pattern.n, dtype=bool)
    is_prescribed[rows] = True
    result = values[: pattern.n_entries].copy()
    result[is_prescribed[pattern.rows] | is_prescribed[pattern.indices]] = 0.0
    result[pattern.diagonal[rows]] = 1.0
    return result


class ElasticBody:
    """The elastic energy of a mesh, its gradient and its Hessian.

    Parameters
    ----------
    mesh : Mesh
    young_modulus_pa, poisson_ratio : float
    kind : {"hex8-sri", "hex8", "tet4", "tet10"}
    fixed_nodes : ndarray of int32
        Nodes that are eliminated from the Hessian.
    material : {"svk", "neo-hookean"}

    Raises
    ------
    BadParameter, BadMesh
        See `lame_parameters`, `quadrature`, `materials.material_module`.

    Notes
    -----
    Viscosity is part of the same formula. With the ratio ``c = beta / h`` the incremental potential
    of a Kelvin-Voigt solid is ``W(F) + (c / 2) (E - E_n) : C : (E - E_n)``, C the stiffness at
    rest. It dissipates, is blind to rigid rotation, and at rest is Rayleigh's ``beta K`` (Ortiz,
    Stainier, *Comput. Methods Appl. Mech. Eng.* 171, 1999, for the variational form).
    """

    def __init__(
        self,
        mesh: Mesh,
        young_modulus_pa: float,
        poisson_ratio: float,
        kind: ElementKind,
        fixed_nodes: NDArray[np.int32],
        material: MaterialName = "svk",
    ) -> None:
        points = quadrature(mesh, kind)
        lame_lambda, lame_mu = lame_parameters(young_modulus_pa, poisson_ratio)
        self.mesh = mesh
        self.nodal_volume_m3 = np.zeros(len(mesh.nodes_m))
        np.add.at(self.nodal_volume_m3, mesh.elements, points.nodal_volumes)
        self.pattern = sparsity_pattern(mesh.elements, len(mesh.nodes_m), fixed_nodes)
        self.no_strain = np.zeros((*points.gradients.shape[:2], 6))
        self._kernels = element_kernels(mesh.elements.shape[1], material)
        self._elements = np.ascontiguousarray(mesh.elements, dtype=np.int32)
        self._gradients = points.gradients
        self._bulk = lame_lambda * points.bulk_weights
        self._shear = lame_mu * points.shear_weights

    def energy_gradient(
        self,
        x: NDArray[np.float64],
        force: NDArray[np.float64],
        ratio: float = 0.0,
        strain_before: NDArray[np.float64] | None = None,
    ) -> float:
        """Add dW/dx [N] at the positions `x`, shape (n_nodes, 3), to `force`; return W [J].

        With `ratio` c > 0 and the strain at the start of the step, viscosity is included. The
        energy is infinite where the material cannot be; the gradient means nothing then.
        """
        return self._kernels.energy_gradient(
            x,
            self._elements,
            self._gradients,
            self._bulk,
            self._shear,
            self.no_strain if strain_before is None else strain_before,
            ratio,
            force,
        )

    def hessian(
        self,
        x: NDArray[np.float64],
        ratio: float = 0.0,
        strain_before: NDArray[np.float64] | None = None,
        *,
        project: bool = True,
    ) -> NDArray[np.float64]:
        """Return the entries of d²W/dx² in the pattern [N/m].

        With `project` the matrix is positive semidefinite (`materials`).
        """
        values = np.zeros(self.pattern.n_entries + 1)
        self._kernels.hessian(
            x,
            self._elements,
            self._gradients,
            self._bulk,
            self._shear,
            self.no_strain if strain_before is None else strain_before,
            ratio,
            project,
            self.pattern.scatter,
            values,
        )
        return values[:-1]

    def strain(self, x: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.int32]]:
        """Return the strain at each quadrature point and the ids of the inverted elements."""
        strain = np.empty_like(self.no_strain)
        inverted = np.empty(len(self._elements), dtype=np.int32)
        count = self._kernels.strains(x, self._elements, self._gradients, strain, inverted)
        return strain, np.flatnonzero(inverted).astype(np.int32) if count else inverted[:0]
