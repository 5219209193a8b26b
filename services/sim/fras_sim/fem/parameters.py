"""What a tissue is made of and how its motion is computed."""

import math
from dataclasses import dataclass

from fras_sim.fem.element import CELL_OF, ElementKind
from fras_sim.fem.errors import BadParameter
from fras_sim.fem.materials import MaterialName, lame_parameters, material_module

# A correction of so many tolerances is near the solution; so is the square of it for the residual,
# which falls faster.
NEAR = 5.0


@dataclass(frozen=True)
class TissueParameters:
    """Material, surroundings and time step.

    Parameters
    ----------
    young_modulus_pa, poisson_ratio, density_kg_m3 : float
    dt_s : float
        Time step [s].
    mass_damping_per_s : float
        Rayleigh's alpha [1/s]: force ``-alpha M v``, the drag of the surroundings.
    stiffness_damping_s : float
        Rayleigh's beta [s]: the viscosity of the tissue (`assembly.ElasticBody`).
    gravity : bool
        Whether the tissue weighs anything.
    bed : bool
        Whether the plane z = 0 carries it.
    bed_stiffness_pa_m : float
        Pressure of the bed for each metre of depth [Pa/m]. The default is that of 1 cm of the same
        tissue; a tenfold one doubles the iterations, as nodes touch down and lift off.
    quasi_static : bool
        Each step ends in the equilibrium for where the tools are: no inertia, no damping. Needs
        three fixed nodes that are not on one line.
    element : {"hex8-sri", "hex8", "tet4", "tet10"}
        Has to fit the cells of the mesh.
    material : {"svk", "neo-hookean"}

    Raises
    ------
    BadParameter
        Naming the first value that the equations don't allow.
    """

    young_modulus_pa: float = 3000.0
    poisson_ratio: float = 0.45
    density_kg_m3: float = 950.0
    dt_s: float = 0.02
    mass_damping_per_s: float = 2.0
    stiffness_damping_s: float = 0.01
    gravity: bool = False
    bed: bool = True
    bed_stiffness_pa_m: float = 3e5
    quasi_static: bool = False
    element: ElementKind = "hex8-sri"
    material: MaterialName = "svk"

    def __post_init__(self) -> None:
        lame_parameters(self.young_modulus_pa, self.poisson_ratio)
        material_module(self.material)
        if self.element not in CELL_OF:
            raise BadParameter("element", self.element, "one of " + ", ".join(CELL_OF))
        for name in ("density_kg_m3", "dt_s", "bed_stiffness_pa_m"):
            value = getattr(self, name)
            if not (math.isfinite(value) and value > 0.0):
                raise BadParameter(name, value, "a positive number")
        for name in ("mass_damping_per_s", "stiffness_damping_s"):
            value = getattr(self, name)
            if not (math.isfinite(value) and value >= 0.0):
                raise BadParameter(name, value, "zero or a positive number")


@dataclass(frozen=True)
class SolverOptions:
    """When a step counts as solved, and what is tried until it is.

    Parameters
    ----------
    step_tolerance_m : float
        A step is solved when its last full correction moved no node further than this [m].
    residual_tolerance_n : float
        ... and no free node is left with a larger force out of balance [N] ...
    balance_tolerance_n : float
        ... nor all of them together, which is what the forces on the body lack to balance [N].
    history : int
        Pairs that L-BFGS remembers.
    max_iterations : int
        Corrections before a step is given up.
    refactor_every : int
        Steps that one factor serves at most.
    refactor_within : int
        Corrections in one step after which the factor is renewed, and L-BFGS with it.
    newton_after : int
        Corrections in one step after which each has a factor of its own: projected Newton.
    slow_iterations : int
        A step that needed this many corrections has the next one start with a fresh factor.
    checkpoint_every : int
        Ticks after which factor and memory are dropped in every run, so that a replay from a
        checkpoint taken there gives the same bits.
    """

    step_tolerance_m: float = 3e-6
    residual_tolerance_n: float = 2e-4
    balance_tolerance_n: float = 1e-4
    history: int = 10
    max_iterations: int = 60
    refactor_every: int = 10
    refactor_within: int = 20
    newton_after: int = 40
    slow_iterations: int = 15
    checkpoint_every: int = 10

    def __post_init__(self) -> None:
        for name in ("step_tolerance_m", "residual_tolerance_n", "balance_tolerance_n"):
            value = getattr(self, name)
            if not value > 0.0:
                raise BadParameter(name, value, "a positive number")
        counts = ("history", "max_iterations", "refactor_every", "refactor_within")
        for name in (*counts, "newton_after", "checkpoint_every"):
            value = getattr(self, name)
            if value < 1:
                raise BadParameter(name, value, "1 or more")

    def accept(
        self, moved_before_m: float, moved_m: float, residual_n: float, resultant_n: float
    ) -> bool:
        """Whether a last full correction and the forces out of balance are small enough.

        Parameters
        ----------
        moved_before_m, moved_m : float
            What the last two corrections moved a node by at most.
        residual_n, resultant_n : float
            The largest force out of balance, and the norm of the sum of all.

        Notes
        -----
        A sequence that contracts by a factor r has ``r / (1 - r)`` of its last correction left
        (Hairer, Wanner, *Solving Ordinary Differential Equations II*, section IV.8). One quotient
        may flatter: it is believed near the tolerance, and where the residual is small as well.
        """
        if residual_n > self.residual_tolerance_n or resultant_n > self.balance_tolerance_n:
            return False
        if moved_m <= self.step_tolerance_m:
            return True
        is_near = moved_m <= NEAR * self.step_tolerance_m
        is_near &= residual_n <= self.residual_tolerance_n / NEAR**2
        if not is_near or moved_m >= moved_before_m:
            return False
        return moved_m**2 <= self.step_tolerance_m * (moved_before_m - moved_m)
