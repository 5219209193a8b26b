"""From element to body: its elastic energy, gradient and Hessian."""

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from fras_sim.fem.batches import LANES, make_batches
from fras_sim.fem.element import ElementKind, quadrature
from fras_sim.fem.element_kernels import element_kernels
from fras_sim.fem.materials import MaterialName, lame_parameters
from fras_sim.fem.mesh import Mesh
from fras_sim.fem.pattern import sparsity_pattern
from fras_sim.fem.second_core import second_core

# An annotation within a function is evaluated at each of its calls: a name costs nothing.
Floats = NDArray[np.float64]
# Batches of elements from which on a second core is worth being woken.
WORTH_SHARING = 120
# Adds the batches from one to another (exclusive) to an array: half, begin, end, array.
_Adding = Callable[[int, int, int, NDArray[np.float64]], None]


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

    Examples
    --------
    A block stretched by one per cent along x stores (lambda / 2 + mu) E_xx^2 a volume:

    >>> mesh = box_mesh((0.1, 0.12, 0.005), (3, 3, 2))
    >>> body = ElasticBody(mesh, 3000.0, 0.45, "hex8-sri", np.array([], dtype=np.int32))
    >>> force = np.zeros_like(mesh.nodes_m)
    >>> W = body.energy_gradient(mesh.nodes_m * [1.01, 1.0, 1.0], force)
    >>> lame_lambda, lame_mu = lame_parameters(3000.0, 0.45)
    >>> bool(np.isclose(W, (lame_lambda / 2 + lame_mu) * 0.01005**2 * 0.1 * 0.12 * 0.005))
    True

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
        points = quadrature(mesh, kind, poisson_ratio)
        lame_lambda, lame_mu = lame_parameters(young_modulus_pa, poisson_ratio)
        self.mesh = mesh
        self.nodal_volume_m3 = np.zeros(len(mesh.nodes_m))
        np.add.at(self.nodal_volume_m3, mesh.elements, points.nodal_volumes)
        self.pattern = sparsity_pattern(mesh.elements, mesh.nodes_m, fixed_nodes)
        self._kernels = element_kernels(mesh.elements.shape[1], material)
        batches = make_batches(mesh.elements, points)
        self._n_batches = len(batches.elements)
        self._mesh = (batches.elements, batches.gradients, batches.set_of)
        self._by_element = batches.by_element
        self._moduli = (lame_lambda * batches.bulk_weights, lame_mu * batches.shear_weights)
        n_points = points.gradients.shape[1]
        self.no_strain = np.zeros((self._n_batches, n_points, 6, LANES))
        # A mesh with fewer elements is done before a second core has been woken.
        self._halved = self._n_batches // 2 if self._n_batches >= WORTH_SHARING else 0
        self._kept: dict[tuple[int, int], NDArray[np.float64]] = {}

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
        before = self.no_strain if strain_before is None else strain_before
        given = (x, *self._mesh, *self._moduli, before, ratio)
        energy = np.zeros(2)

        def add(half: int, begin: int, end: int, to: Floats) -> None:
            energy[half] = self._kernels.energy_gradient(begin, end, *given, to)

        self._add_in_halves(add, force)
        return float(energy.sum())

    def hessian(
        self,
        x: NDArray[np.float64],
        ratio: float = 0.0,
        strain_before: NDArray[np.float64] | None = None,
        *,
        project: bool = True,
        out: NDArray[np.float64] | None = None,
    ) -> NDArray[np.float64]:
        """Return the entries of d²W/dx² in the pattern [N/m].

        With `project` the matrix is positive semidefinite (`materials`). `out` (n_entries,) is
        where to put them.
        """
        before = self.no_strain if strain_before is None else strain_before
        given = (x, *self._mesh, *self._moduli, before, ratio, project)
        given = (*given, self._by_element, self.pattern.scatter)
        n_entries = self.pattern.n_entries
        values = self._scratch(0, n_entries + 1)
        values[:] = 0.0

        def add(_: int, begin: int, end: int, to: Floats) -> None:
            self._kernels.hessian(begin, end, *given, to)

        self._add_in_halves(add, values)
        out = np.empty(n_entries) if out is None else out
        out[:] = values[:-1]
        return out

    def strain(self, x: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.int32]]:
        """Return the strain at each quadrature point and the ids of the inverted elements."""
        strain = np.empty_like(self.no_strain)
        inverted = np.empty((self._n_batches, LANES), dtype=np.int32)

        def write(_: int, begin: int, end: int) -> None:
            self._kernels.strains(begin, end, x, *self._mesh, strain, inverted)

        self._in_halves(write)
        ids = np.flatnonzero(inverted.ravel()[: len(self.mesh.elements)])
        return strain, ids.astype(np.int32)

    def _add_in_halves(self, add: _Adding, total: NDArray[np.float64]) -> None:
        """Add up the batches, each half to an array of its own."""
        second = self._scratch(1, total.size).reshape(total.shape) if self._halved else total

        def work(half: int, begin: int, end: int) -> None:
            if half:
                second[:] = 0.0
            add(half, begin, end, second if half else total)

        self._in_halves(work)
        if self._halved:
            total += second

    def _scratch(self, half: int, size: int) -> NDArray[np.float64]:
        """Return an array that is kept: fresh memory costs more than what is added up in it."""
        if (half, size) not in self._kept:
            self._kept[half, size] = np.empty(size)
        return self._kept[half, size]

    def _in_halves(self, work: Callable[[int, int, int], None]) -> None:
        """Do the batches (half, begin, end), the second half of a large mesh on the second core."""
        n, halved = self._n_batches, self._halved
        if halved:
            second_core.run(lambda: work(0, 0, halved), lambda: work(1, halved, n))
        else:
            work(0, 0, n)
