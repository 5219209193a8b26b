"""One implicit Euler step as the minimisation of an energy."""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fras_sim.fem import kernels
from fras_sim.fem.assembly import ElasticBody
from fras_sim.fem.contact import bed_stiffness, penetrating
from fras_sim.fem.errors import FactorizationFailed
from fras_sim.fem.kernels import largest
from fras_sim.fem.lbfgs import LbfgsMemory
from fras_sim.fem.linear_solver import LinearSolver
from fras_sim.fem.parameters import SolverOptions, TissueParameters
from fras_sim.fem.pattern import IdentityRows

STANDARD_GRAVITY_M_S2 = 9.80665
ARMIJO = 1e-4
# Enough for a first step of a metre to become one that the bed bears.
MAX_HALVINGS = 20
# Two energies that differ by less than this share, or by less than this share of the work of the
# tolerated force over the tolerated step, are the same number but for rounding.
ENERGY_ROUNDING = 1e-13
WORK_ROUNDING = 1e-6
# Steps below this share of the tolerance teach L-BFGS nothing but rounding.
STEP_ROUNDING = 1e-3
# Corrections of a step after which the next guess goes on at its acceleration: a tenth fewer
# corrections, as many more after harder ones.
EASY = 8
# Forces of a body at rest are rounding: this share of stiffness times length.
FORCE_ROUNDING = 1e-14
# A held node this close to where it must be is there.
LEAD_ROUNDING_M = 1e-12

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Motion:
    """Positions [m], velocities [m/s], both (n_nodes, 3), and the strain they imply."""

    x: Array
    v: Array
    strain: Array


@dataclass(frozen=True, eq=False)
class StepSolution:
    """What the minimisation found.

    ``gradient`` (n_nodes, 3) [N] is that of the whole energy: zero, up to ``residual_n``, at the
    free nodes; at a fixed or held node the force that its support exerts on the tissue.
    """

    x: Array
    gradient: Array
    iterations: int
    residual_n: float
    refactored: bool
    converged: bool


@dataclass(frozen=True, eq=False)
class _Step:
    """Where one step starts and where inertia alone would take it."""

    before: Motion
    target: Array


class ImplicitEuler:
    """Minimises, over the free nodes, the energy of one step.

    Parameters
    ----------
    body : ElasticBody
    parameters : TissueParameters
    solver : LinearSolver
        For the pattern of `body`.
    options : SolverOptions

    Notes
    -----
    With mass M (lumped), drag alpha and step h the new positions minimise ::

        1/2 |x - y|²_D + W(x) + viscosity(x; E_n) + sum k/2 min(z, 0)² + sum m g z
        D = M (1/h² + alpha/h),   y = x_n + h v_n / (1 + alpha h)

    whose gradient is the implicit Euler equation (Martin et al., *Example-based elastic
    materials*, 2011, section 4; Liu et al., *Quasi-Newton methods for real-time simulation of
    hyperelastic materials*, 2017, for L-BFGS on top of a factored Hessian). The factor is that of
    an earlier step's projected Hessian: L-BFGS makes up for what has changed since. The memory of
    L-BFGS and the factor outlive a step; `forget` clears both. In the quasi-static mode D and the
    viscosity are zero: what remains is the equilibrium.
    """

    def __init__(
        self,
        body: ElasticBody,
        parameters: TissueParameters,
        solver: LinearSolver,
        options: SolverOptions,
    ) -> None:
        h = parameters.dt_s
        n_nodes = len(body.mesh.nodes_m)
        self.mass_kg = parameters.density_kg_m3 * body.nodal_volume_m3
        self._body = body
        self._solver = solver
        self._options = options
        self._dt_s = h
        self._drag = 1.0 + parameters.mass_damping_per_s * h
        moves_on = not parameters.quasi_static
        self._moves_on = 1.0 if moves_on else 0.0
        self._inertia = self._moves_on * self.mass_kg * self._drag / h**2
        self._ratio = self._moves_on * parameters.stiffness_damping_s / h
        self._weight = self.mass_kg * (STANDARD_GRAVITY_M_S2 if parameters.gravity else 0.0)
        self._bed = (
            bed_stiffness(body.mesh, parameters.bed_stiffness_pa_m)
            if parameters.bed
            else np.zeros(n_nodes)
        )
        self._hessian = body.hessian(body.mesh.nodes_m, self._ratio)
        stiffest = float(np.abs(self._hessian).max())
        length_m = float(np.ptp(body.mesh.nodes_m, axis=0).max())
        self._rounding_n = FORCE_ROUNDING * stiffest * length_m
        self._memory = LbfgsMemory(options.history, body.pattern.n)
        self._matrix = np.empty_like(self._hessian)
        self._held_rows = np.zeros(0, dtype=np.int32)
        self._led = IdentityRows(body.pattern, self._held_rows)
        self._factor_age: int | None = None
        # The velocity before the last step, if that was an easy one.
        self._v_before: Array | None = None

    def forget(self) -> None:
        """Drop the factor and the memory: the next step depends on its arguments alone."""
        self._factor_age = None
        self._v_before = None
        self._memory.clear()

    def step(self, before: Motion, held: NDArray[np.int32], held_at_m: Array) -> StepSolution:
        """Return the positions one time step later.

        Parameters
        ----------
        before : Motion
        held : ndarray of int32
            Nodes that are led; none of them fixed.
        held_at_m : ndarray, shape (len(held), 3) [m]
            Where they are led to.

        Notes
        -----
        The first guess goes on at the old velocity, and after an easy step at the old acceleration
        as well; where the held nodes don't, the others take the linear answer to the difference. If
        that doubles the energy, or goes beyond what the material can be, the answer is sought from
        where the body was, too. A matrix that
        can't be factored ends the step as not converged, as does a material that no first guess
        keeps within its bounds.
        """
        self._hold(held)
        problem = _Step(before, before.x + self._dt_s * before.v / self._drag)
        stale = self._factor_age is None or self._factor_age >= self._options.refactor_every
        try:
            if stale:
                self._refactor(before.x, problem)
            x, energy, gradient = self._guess(problem, held, held_at_m)
            solution = self._minimise(x, energy, gradient, problem, refactored=stale)
        except FactorizationFailed:
            self.forget()
            _, gradient = self._energy(before.x, problem)
            residual = largest(self._reduced(gradient))
            return StepSolution(before.x, gradient, 0, residual, refactored=True, converged=False)
        self._v_before = before.v if solution.iterations <= EASY else None
        slow = solution.iterations >= self._options.slow_iterations
        self._factor_age = None if slow or self._factor_age is None else self._factor_age + 1
        return solution

    def potential_energy_j(self, x: Array) -> float:
        """Return elastic energy, that of the bed and that of the weight, the last from z = 0."""
        energy = self._body.energy_gradient(x, np.zeros_like(x))
        energy += 0.5 * float(self._bed @ np.minimum(x[:, 2], 0.0) ** 2)
        return energy + float(self._weight @ x[:, 2])

    def imbalance_n(
        self, before: Motion, solution: StepSolution, supported: NDArray[np.bool_]
    ) -> float:
        """Return the norm of the sum of all forces on the body [N].

        Inertia, drag, bed and weight of all nodes, less what supports and tools exert. Elastic and
        viscous forces are absent from the sum, which they leave as it is only if they balance
        within the body: so this checks them too.
        """
        target = before.x + self._dt_s * before.v / self._drag
        total = self._inertia @ (solution.x - target)
        total[2] += self._bed @ np.minimum(solution.x[:, 2], 0.0) + self._weight.sum()
        return float(np.linalg.norm(total - solution.gradient[supported].sum(axis=0)))

    def _hold(self, held: NDArray[np.int32]) -> None:
        rows = self._body.pattern.row_of[held].ravel()
        if not np.array_equal(rows, self._held_rows):
            self._held_rows = rows
            self._led = IdentityRows(self._body.pattern, rows)
            self.forget()

    def _energy(self, x: Array, problem: _Step) -> tuple[float, Array]:
        gradient = np.zeros_like(x)
        energy = self._body.energy_gradient(x, gradient, self._ratio, problem.before.strain)
        energy += kernels.nodal_terms(
            x, problem.target, self._inertia, self._bed, self._weight, gradient
        )
        return energy, gradient

    def _reduced(self, gradient: Array) -> Array:
        reduced = gradient.ravel()[self._body.pattern.free]
        reduced[self._held_rows] = 0.0
        return reduced

    def _expanded(self, reduced: Array, like: Array) -> Array:
        full = np.zeros(like.size)
        full[self._body.pattern.free] = reduced
        return full.reshape(like.shape)

    def _refactor(self, x: Array, problem: _Step) -> None:
        pattern = self._body.pattern
        self._body.hessian(x, self._ratio, problem.before.strain, out=self._hessian)
        diagonal = np.repeat(self._inertia, 3).reshape(-1, 3)
        diagonal[:, 2] += np.where(penetrating(x), self._bed, 0.0)
        self._hessian[pattern.diagonal] += diagonal.ravel()[pattern.free]
        self._matrix[:] = self._hessian
        self._solver.factorize(self._led.put_into(self._matrix))
        self._memory.clear()
        self._factor_age = 0

    def _coasting(self, before: Motion) -> Array:
        velocity = before.v if self._v_before is None else 2.0 * before.v - self._v_before
        return before.x + self._moves_on * self._dt_s * velocity

    def _guess(
        self, problem: _Step, held: NDArray[np.int32], held_at_m: Array
    ) -> tuple[Array, float, Array]:
        """Return the first guess, its energy and gradient."""
        coasting = self._coasting(problem.before)
        guess, before = self._lead(coasting, problem, held, held_at_m)
        if np.isfinite(guess[1]) and guess[1] <= before + abs(before):
            return guess
        other, _ = self._lead(problem.before.x, problem, held, held_at_m)
        return min(guess, other, key=lambda x: x[1] if np.isfinite(x[1]) else np.inf)

    def _lead(
        self, x: Array, problem: _Step, held: NDArray[np.int32], held_at_m: Array
    ) -> tuple[tuple[Array, float, Array], float]:
        """Lead the held nodes to where they must be, the others by the linear answer to it.

        Returns
        -------
        tuple
            The positions, their energy and its gradient; and the energy at `x`, infinite where
            that was not asked for.
        """
        pattern = self._body.pattern
        lead = held_at_m - x[held]
        energy = np.inf
        if np.abs(lead).max(initial=0.0) > LEAD_ROUNDING_M:
            energy, gradient = self._energy(x, problem)
            moved = np.zeros(pattern.n)
            moved[self._held_rows] = lead.ravel()
            pull = kernels.symmetric_product(pattern.indptr, pattern.indices, self._hessian, moved)
            pull[self._held_rows] = 0.0
            answer = self._solver.solve(-self._reduced(gradient) - pull)
            answer[self._held_rows] = lead.ravel()
            x = x + self._expanded(answer, x)
        else:
            x = x.copy()
        x[held] = held_at_m
        return (x, *self._energy(x, problem)), energy

    def _minimise(
        self, x: Array, energy: float, gradient: Array, problem: _Step, *, refactored: bool
    ) -> StepSolution:
        options = self._options
        reduced = self._reduced(gradient)
        if not np.isfinite(energy):
            return StepSolution(x, gradient, 0, largest(reduced), refactored, converged=False)
        iteration = 0
        exact = refactored
        moved_m = 0.0
        converged = largest(reduced) <= self._rounding_n
        while not converged and iteration < options.max_iterations:
            iteration += 1
            if iteration % options.refactor_within == 0 or iteration > options.newton_after:
                self._refactor(x, problem)
                refactored = exact = True
            direction = self._direction(reduced)
            found = self._search(x, direction, energy, float(direction @ reduced), problem)
            if found is None:
                if exact:
                    break
                self._refactor(x, problem)
                refactored = exact = True
                continue
            exact = False
            length, x, energy, gradient = found
            reduced_before, reduced = reduced, self._reduced(gradient)
            moved_before_m, moved_m = moved_m, length * largest(direction)
            if moved_m > STEP_ROUNDING * options.step_tolerance_m:
                self._memory.add(length * direction, reduced - reduced_before)
            converged = length == 1.0 and self._is_solved(moved_before_m, moved_m, reduced)
        return StepSolution(x, gradient, iteration, largest(reduced), refactored, converged)

    def _is_solved(self, moved_before_m: float, moved_m: float, reduced: Array) -> bool:
        residual_n = largest(reduced)
        return residual_n <= self._rounding_n or self._options.accept(
            moved_before_m, moved_m, residual_n, _resultant(reduced)
        )

    def _direction(self, reduced: Array) -> Array:
        direction = self._memory.direction(reduced, self._solver.solve)
        if direction @ reduced > 0.0:
            self._memory.clear()
            direction = -self._solver.solve(reduced)
        return direction

    def _search(
        self, x: Array, direction: Array, energy: float, slope: float, problem: _Step
    ) -> tuple[float, Array, float, Array] | None:
        """Halve the step until Armijo's condition holds for the exact energy."""
        full = self._expanded(direction, x)
        options = self._options
        work_j = options.step_tolerance_m * options.residual_tolerance_n
        allowed = energy + ENERGY_ROUNDING * abs(energy) + WORK_ROUNDING * work_j
        length = 1.0
        for _ in range(MAX_HALVINGS):
            x_new = x + length * full
            energy_new, gradient_new = self._energy(x_new, problem)
            if energy_new <= allowed + ARMIJO * length * slope:
                return length, x_new, energy_new, gradient_new
            length *= 0.5
        return None


def _resultant(reduced: Array) -> float:
    """Return the norm of the sum of forces, each node's three after each other."""
    x, y, z = reduced.reshape(-1, 3).sum(axis=0).tolist()
    return math.hypot(x, y, z)
