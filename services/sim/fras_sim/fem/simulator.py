"""The tissue as the service sees it: one call, one time step."""

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from fras_sim.fem.assembly import ElasticBody
from fras_sim.fem.checkpoint import Checkpoint
from fras_sim.fem.dynamics import ImplicitEuler, Motion
from fras_sim.fem.errors import BadParameter
from fras_sim.fem.grasp import ArmState, ToolInput, move_arms
from fras_sim.fem.healing import heal
from fras_sim.fem.linear.blas_threads import one_blas_thread
from fras_sim.fem.linear_solver import linear_solver
from fras_sim.fem.mesh import Mesh
from fras_sim.fem.parameters import SolverOptions, TissueParameters
from fras_sim.fem.supports import checked_fixed, fixed_patches

Array = NDArray[np.float64]


@dataclass(frozen=True)
class SolverReport:
    """How the last step was solved.

    ``residual`` is the largest force out of balance at a free node [N].
    """

    iterations: int
    residual: float
    refactored: bool
    converged: bool
    inverted_elements: int


@dataclass(frozen=True, eq=False)
class StepResult:
    """The tissue after a step; arrays are read-only.

    Parameters
    ----------
    nodes_m : ndarray, shape (n_nodes, 3), float64 [m]
    nodal_force_n : ndarray, shape (n_nodes, 3), float64 [N]
        Elastic internal force dW/dx of each node: what would have to be applied from outside to
        keep the node where it is. No inertia, no damping, no bed.
    max_force_n : float
        Largest norm among them, fixed and grasped nodes included [N].
    max_node_speed_m_s : float
    tool_force_n : dict of ndarray, shape (3,) [N]
        Force that each known arm exerts on the tissue, the sum over its nodes.
    fixed_force_n : ndarray, shape (3,) [N]
        Force that all fixed nodes together exert on the tissue.
    patch_force_n : ndarray, shape (n_patches, 3) [N]
        The same for each patch of fixed nodes (`TissueSimulator.patches`).
    balance_residual_n : float
        Norm of the sum of all forces on the body in the last step: inertia, damping, elasticity,
        bed, weight, supports and tools. Zero to the tolerance of the solver [N].
    grasped : dict of ndarray of int32
        Nodes that each known arm leads.
    grasped_force_n : dict of ndarray, shape (k, 3) [N]
        The share of ``tool_force_n`` that goes to each of these nodes.
    solver : SolverReport
    """

    nodes_m: Array
    nodal_force_n: Array
    max_force_n: float
    max_node_speed_m_s: float
    tool_force_n: dict[str, Array]
    fixed_force_n: Array
    patch_force_n: Array
    balance_residual_n: float
    grasped: dict[str, NDArray[np.int32]]
    grasped_force_n: dict[str, Array]
    solver: SolverReport


@dataclass(frozen=True, eq=False)
class TissueState:
    """Everything that a step starts from, apart from the solver's memory.

    ``support_n`` (n_nodes, 3) [N] is what supports and tools exerted in the last step;
    ``settling`` says that a release was the last thing the tools did.
    """

    tick: int

    motion: Motion
    support_n: Array
    balance_residual_n: float
    arms: dict[str, ArmState]
    settling: bool


class TissueSimulator:
    """A soft body, fixed at some nodes, that tools grasp and pull.

    Parameters
    ----------
    mesh : Mesh
    parameters : TissueParameters
    fixed_nodes : array_like of int
        Nodes that never move; none only if there is a bed.
    solver : str
        Name of a linear solver (`linear_solver.SOLVERS`).
    options : SolverOptions, optional

    Raises
    ------
    BadParameter, BadMesh
        What the body can't be computed with, by name.

    Examples
    --------
    >>> mesh = box_mesh(node_counts=(11, 13, 2))
    >>> tissue = TissueSimulator(mesh, TissueParameters(), mesh.bottom_nodes[:40])
    >>> tip_m = np.array([0.05, 0.06, 0.005])
    >>> result = tissue.measure({"psm1": ToolInput(tip_m, jaw_rad=1.0)})
    >>> result = tissue.step({"psm1": ToolInput(tip_m, jaw_rad=-0.3)})

    Notes
    -----
    Nothing is shared between simulators and nothing depends on time, or on how many cores there
    are: the same calls give the same bits.
    """

    def __init__(
        self,
        mesh: Mesh,
        parameters: TissueParameters,
        fixed_nodes: ArrayLike,
        solver: str = "auto",
        options: SolverOptions | None = None,
    ) -> None:
        self.mesh = mesh
        self.parameters = parameters
        self.fixed_nodes = checked_fixed(mesh, fixed_nodes, parameters)
        self._is_fixed = np.zeros(len(mesh.nodes_m), dtype=bool)
        self._is_fixed[self.fixed_nodes] = True
        self._body = ElasticBody(
            mesh,
            parameters.young_modulus_pa,
            parameters.poisson_ratio,
            parameters.element,
            self.fixed_nodes,
            parameters.material,
        )
        self._solver = linear_solver(solver, self._body.pattern)
        self._options = options or SolverOptions()
        self._stepper = ImplicitEuler(self._body, parameters, self._solver, self._options)
        self.patches = fixed_patches(mesh, self.fixed_nodes)
        self._state: TissueState = self._rest()

    @property
    def solver_name(self) -> str:
        """Name of the linear solver in use."""
        return self._solver.name

    def reset(self) -> None:
        """Return to rest, without tools; the next step is that of a new simulator."""
        self._stepper.forget()
        self._state = self._rest()

    def measure(self, tools: Mapping[str, ToolInput]) -> StepResult:
        """Return the state as it is, without a step.

        Arms seen for the first time are registered where they are: a jaw that is closed now has
        nothing in it. Arms already known are only checked.

        Raises
        ------
        BadToolInput
            If a pose is not finite or too far from the last one.
        """
        seen = move_arms(
            self._state.arms, tools, self._state.motion.x, self._is_fixed, self.mesh.spacing_m
        )
        arms = {**seen, **self._state.arms}
        state = self._state
        self._state = replace(state, arms=arms)
        inverted = len(self._body.strain(state.motion.x)[1])
        return self._result(SolverReport(0, 0.0, False, True, inverted))

    def step(self, tools: Mapping[str, ToolInput]) -> StepResult:
        """Move the tools to where they are now and the tissue on by one time step.

        Parameters
        ----------
        tools : mapping of ToolInput by arm
            Every known arm; see `grasp.move_arms`.

        Returns
        -------
        StepResult
            If the step could not be solved, ``solver.converged`` is false and everything else, the
            tools included, is as before the call.

        Raises
        ------
        BadToolInput
            If a pose is refused; everything is as before the call.
        """
        state = self._state
        arms = move_arms(state.arms, tools, state.motion.x, self._is_fixed, self.mesh.spacing_m)
        settling = _settling(state, arms)
        motion = self._healed(state.motion) if settling else state.motion
        held = [arms[arm] for arm in sorted(arms) if len(arms[arm].nodes)]
        nodes = np.concatenate([arm.nodes for arm in held] or [np.zeros(0, dtype=np.int32)])
        nodes_at_m = np.concatenate([arm.nodes_at_m for arm in held] or [np.zeros((0, 3))])
        with one_blas_thread():
            solution = self._stepper.step(motion, nodes, nodes_at_m)
        if solution.converged:
            velocity = (solution.x - motion.x) / self.parameters.dt_s
            strain, inverted = self._body.strain(solution.x)
            supported = self._is_fixed.copy()
            supported[nodes] = True
            imbalance_n = self._stepper.imbalance_n(motion, solution, supported)
            after = Motion(solution.x, velocity, strain)
            tick = state.tick + 1
            self._state = TissueState(tick, after, solution.gradient, imbalance_n, arms, settling)
        else:
            self._state = replace(state, tick=state.tick + 1)
            _, inverted = self._body.strain(state.motion.x)
        if self.checkpoint_due or not solution.converged:
            self._stepper.forget()
        return self._result(
            SolverReport(
                solution.iterations,
                solution.residual_n,
                solution.refactored,
                solution.converged,
                len(inverted),
            )
        )

    @property
    def checkpoint_due(self) -> bool:
        """Whether a replay from a checkpoint taken now gives the same bits."""
        return self._state.tick % self._options.checkpoint_every == 0

    def checkpoint(self) -> Checkpoint:
        """Return everything that the next step starts from.

        A simulator of the same mesh, parameters, fixed nodes, solver and options that restores it
        and is given the same tools computes the same bits as this one, if the checkpoint was taken
        when `checkpoint_due`: at such ticks, in every run, the factor and the memory of the solver
        are dropped. Restored from other ticks it agrees to the solver's tolerance.
        """
        state = self._state
        return Checkpoint(
            state.tick,
            _read_only(state.motion.x.copy()),
            _read_only(state.motion.v.copy()),
            _read_only(state.support_n.copy()),
            state.balance_residual_n,
            dict(state.arms),
            state.settling,
        )

    def restore(self, checkpoint: Checkpoint) -> None:
        """Go on from a checkpoint.

        Raises
        ------
        BadParameter
            If it belongs to another mesh.
        """
        arrays = (checkpoint.nodes_m, checkpoint.velocity_m_s, checkpoint.support_n)
        if any(array.shape != self.mesh.nodes_m.shape for array in arrays):
            raise BadParameter(
                "checkpoint", checkpoint.nodes_m.shape, f"arrays {self.mesh.nodes_m.shape}"
            )
        x, v, support_n = (np.array(array, dtype=np.float64, order="C") for array in arrays)
        self._stepper.forget()
        self._state = TissueState(
            checkpoint.tick,
            Motion(x, v, self._body.strain(x)[0]),
            support_n,
            checkpoint.balance_residual_n,
            dict(checkpoint.arms),
            checkpoint.settling,
        )

    def mechanical_energy_j(self) -> float:
        """Return kinetic and potential energy of the present state [J]."""
        motion = self._state.motion
        kinetic = 0.5 * float(self._stepper.mass_kg @ (motion.v**2).sum(axis=1))
        return kinetic + self._stepper.potential_energy_j(motion.x)

    def _rest(self) -> TissueState:
        x = self.mesh.nodes_m.copy()
        motion = Motion(x, np.zeros_like(x), np.zeros_like(self._body.no_strain))
        return TissueState(0, motion, np.zeros_like(x), 0.0, {}, settling=False)

    def _healed(self, motion: Motion) -> Motion:
        x, moved = heal(self._body, self._solver, motion.x)
        if len(moved) == 0:
            return motion
        self._stepper.forget()
        velocity = motion.v.copy()
        velocity[moved] = 0.0
        return Motion(x, velocity, self._body.strain(x)[0])

    def _result(self, report: SolverReport) -> StepResult:
        state = self._state
        force = np.zeros_like(state.motion.x)
        self._body.energy_gradient(state.motion.x, force)
        return StepResult(
            nodes_m=_read_only(state.motion.x),
            nodal_force_n=_read_only(force),
            max_force_n=float(np.linalg.norm(force, axis=1).max()),
            max_node_speed_m_s=float(np.linalg.norm(state.motion.v, axis=1).max()),
            tool_force_n={
                arm: state.support_n[held.nodes].sum(axis=0) for arm, held in state.arms.items()
            },
            fixed_force_n=state.support_n[self.fixed_nodes].sum(axis=0),
            patch_force_n=np.array(
                [state.support_n[patch].sum(axis=0) for patch in self.patches]
            ).reshape(-1, 3),
            balance_residual_n=state.balance_residual_n,
            grasped={arm: held.nodes.copy() for arm, held in state.arms.items()},
            grasped_force_n={arm: state.support_n[held.nodes] for arm, held in state.arms.items()},
            solver=report,
        )


def _settling(state: TissueState, arms: Mapping[str, ArmState]) -> bool:
    """Whether the tools have let go and not grasped since."""
    if any(len(arm.nodes) for arm in arms.values()):
        return False
    return state.settling or any(len(arm.nodes) for arm in state.arms.values())


def _read_only(array: Array) -> Array:
    view = array.view()
    view.flags.writeable = False
    return view
