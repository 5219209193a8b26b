"""The scenario as types: every field, its unit in its name, its bounds in its type.

The same types are the file format (TOML), the message format (a scenario travels by value in
every reset) and the source of the reference page.
"""

from typing import Annotated, Literal

import msgspec
from msgspec import UNSET, Meta, UnsetType

Force = Annotated[float, Meta(gt=0, le=1e6)]
Distance = Annotated[float, Meta(ge=0, le=1.0)]
Fraction = Annotated[float, Meta(ge=0, le=1)]
Length = Annotated[float, Meta(gt=0, le=1.0)]
Coordinate = Annotated[float, Meta(ge=-1.0, le=1.0)]
NodeCount = Annotated[int, Meta(ge=2, le=200)]
Name = Annotated[str, Meta(max_length=200)]
PathName = Annotated[str, Meta(max_length=1000)]


class Section(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Base of every table of the file: immutable, unknown keys refused."""


class TissueSection(Section, frozen=True, kw_only=True):
    """Geometry, mesh and mechanics of the tissue.

    Attributes
    ----------
    size_m : (3,)
        Extents along x, y, z; the box starts at the origin. With a mesh file that is its bounding
        box, filled in when the file is read.
    node_counts : (3,)
        Nodes of the box along x, y, z.
    mesh_file : str or None
        A volume mesh to use instead of the box; relative to the scenario's file. Services never
        open it: its bytes travel beside the scenario, the name tells their format.
    mesh_scale : float
        What makes metres of the numbers in the mesh file.
    element : {"hex8-sri", "hex8", "tet4", "tet10"}
        Finite element; must be one for the cells of the mesh.
    material : {"svk", "neo-hookean"}
        St Venant-Kirchhoff or compressible neo-Hookean.
    gravity, bed : bool
        Weight, and the unilateral bed under the tissue.
    """

    size_m: tuple[Length, Length, Length] = (0.1, 0.12, 0.005)
    node_counts: tuple[NodeCount, NodeCount, NodeCount] = (21, 25, 2)
    mesh_file: PathName | None = None
    mesh_scale: Annotated[float, Meta(gt=0, le=1e6)] = 1.0
    element: Literal["hex8-sri", "hex8", "tet4", "tet10"] = "hex8-sri"
    material: Literal["svk", "neo-hookean"] = "svk"
    young_modulus_pa: Annotated[float, Meta(gt=0, le=1e9)] = 3000.0
    poisson_ratio: Annotated[float, Meta(ge=0, lt=0.5)] = 0.45
    density_kg_m3: Annotated[float, Meta(gt=0, le=1e5)] = 950.0
    dt_s: Annotated[float, Meta(ge=1e-4, le=0.1)] = 0.02
    gravity: bool = False
    bed: bool = True


class Disc(Section, frozen=True, kw_only=True):
    """An attachment patch on the bottom face."""

    center_m: tuple[Coordinate, Coordinate]
    radius_m: Distance


class SceneSection(Section, frozen=True, kw_only=True):
    """Where the region of interest (ROI) is and where the tissue is attached.

    Attributes
    ----------
    redraws : int
        How often the generator had to draw again before a ROI fitted.
    """

    roi_m: tuple[Coordinate, Coordinate, Coordinate]
    discs: Annotated[tuple[Disc, ...], Meta(max_length=1000)] = ()
    redraws: Annotated[int, Meta(ge=0)] = 0


class GeneratorSection(Section, frozen=True, kw_only=True):
    """How a scene is drawn from the seed when the file gives none.

    Attributes
    ----------
    disc_radius_min_m : float
        At least 3 mm: a smaller disc may lie between the raster's points, and drawing never end.
    """

    attached_fraction: Fraction = 0.4
    disc_radius_min_m: Annotated[float, Meta(ge=0.003, le=1.0)] = 0.02
    disc_radius_max_m: Length = 0.04
    roi_edge_margin_m: Distance = 0.015
    clearance_m: Distance = 0.01
    roi_depth_m: Annotated[float, Meta(ge=0, lt=0.01)] = 0.0


class AwarenessSection(Section, frozen=True, kw_only=True):
    """Thresholds of situation awareness; defaults are the paper's.

    Attributes
    ----------
    force_limit_n : float
        The soft limit, the paper's epsilon: a pull stops above it.
    hard_limit_n : float or None
        Every action stops above it; twice the soft limit if absent.
    no_limit : bool
        Switch both limits off.
    visible_fraction : float
        delta: the ROI counts as visible above it.
    blocks : int
        N of the N x N candidate grasping points.
    """

    force_limit_n: Force = 0.5
    hard_limit_n: Force | None = None
    no_limit: bool = False
    force_metric: Literal["nodal_max", "tool"] = "nodal_max"
    visible_fraction: Annotated[float, Meta(ge=0, lt=1)] = 0.7
    visible_distance_m: Length = 0.01
    at_distance_m: Length = 0.005
    closed_jaw_rad: Annotated[float, Meta(gt=-0.349, lt=1.047)] = 0.3490658503988659
    blocks: Annotated[int, Meta(ge=1, le=40)] = 7


class PlannerSection(Section, frozen=True, kw_only=True):
    """What the planner prefers and when it gives up.

    Attributes
    ----------
    ignore_ap : bool
        The first plan grasps nearest the ROI, whatever holds the tissue there (scenario C).
    goal : {"visible", "clear"}
        `clear` also asks that no arm stands at its maximal height.
    time_limit_s : float
        Seconds of search after which a plan is given up.
    confirm : bool
        Nothing of a new plan is done before a person has approved it.
    """

    criterion: Literal["sum", "literal", "lex", "nearest", "weighted", "capped"] = "capped"
    goal: Literal["visible", "clear"] = "visible"
    ignore_ap: bool = False
    max_replans: Annotated[int, Meta(ge=0, le=100)] = 5
    time_limit_s: Annotated[float, Meta(gt=0, le=600)] = 5.0
    confirm: bool = False


class Box(Section, frozen=True, kw_only=True):
    """A box along the axes of the world."""

    lower_m: tuple[Coordinate, Coordinate, Coordinate]
    upper_m: tuple[Coordinate, Coordinate, Coordinate]


class MotionSection(Section, frozen=True, kw_only=True):
    """Speeds and limits of the arms.

    Attributes
    ----------
    joint_time_constant_s, joint_delay_s : float
        Lag and dead time of simulated arms.
    joint_noise_rad, insertion_noise_m : float
        Standard deviation of what simulated arms measure; drawn from the scenario's seed.
    instrument_clearance_m : float
        Smallest distance between the surfaces of the two instruments.
    forbidden_boxes : tuple of Box
        Where no part of an instrument may be.
    """

    free_speed_m_s: Annotated[float, Meta(gt=0, le=0.5)] = 0.05
    holding_speed_m_s: Annotated[float, Meta(gt=0, le=0.2)] = 0.02
    acceleration_m_s2: Annotated[float, Meta(gt=0, le=5)] = 0.2
    jerk_m_s3: Annotated[float, Meta(gt=0, le=1000)] = 4.0
    stop_deceleration_m_s2: Annotated[float, Meta(gt=0, le=10)] = 1.25
    jaw_speed_rad_s: Annotated[float, Meta(gt=0, le=18)] = 2.0
    lift_height_m: Annotated[float, Meta(gt=0, le=0.06)] = 0.05
    clearance_height_m: Annotated[float, Meta(gt=0, le=0.06)] = 0.03
    retreat_max_m: Annotated[float, Meta(gt=0, le=0.02)] = 0.005
    joint_time_constant_s: Annotated[float, Meta(ge=0, le=1)] = 0.01
    joint_delay_s: Annotated[float, Meta(ge=0, le=1)] = 0.0
    joint_noise_rad: Annotated[float, Meta(ge=0, le=0.1)] = 0.0
    insertion_noise_m: Annotated[float, Meta(ge=0, le=0.01)] = 0.0
    instrument_clearance_m: Annotated[float, Meta(gt=0, le=0.03)] = 0.002
    forbidden_boxes: Annotated[tuple[Box, ...], Meta(max_length=100)] = ()


class RunSection(Section, frozen=True, kw_only=True):
    """How the trial is run; nothing here changes its result.

    Attributes
    ----------
    pace : float
        Simulated seconds per wall second; 0 = as fast as possible.
    peer_timeout_s : float
        Motion aborts the trial when a peer has not answered for so long.
    hold_timeout_s : float
        A hold that nobody lifts ends the trial; 0 = it waits for ever.
    require_log : bool
        Nothing moves that is not recorded.
    supervised : bool
        Nothing moves while nobody who could stop it looks at the surgeon's page.
    """

    pace: Annotated[float, Meta(ge=0, le=1000)] = 1.0
    peer_timeout_s: Annotated[float, Meta(gt=0, le=600)] = 10.0
    hold_timeout_s: Annotated[float, Meta(ge=0, le=86400)] = 30.0
    require_log: bool = True
    supervised: bool = False


class RecorderSection(Section, frozen=True, kw_only=True):
    """How the log is written; nothing here changes what it holds.

    Attributes
    ----------
    rotate_bytes : int
        The next file of the log begins when one has grown to this size; 0 = never.
    rotate_s : float
        And when one is so old; 0 = never.
    fsync : bool
        Each half second, wait until the disk has what was written: a power cut costs no more.
    """

    rotate_bytes: Annotated[int, Meta(ge=0, le=2**40)] = 2**28
    rotate_s: Annotated[float, Meta(ge=0, le=604800)] = 0.0
    fsync: bool = True


class PatientSection(Section, frozen=True, kw_only=True):
    """How the patient differs from the model of it, the twin; `patient_scenario` derives it.

    Attributes
    ----------
    young_modulus_factor, disc_radius_factor : float
        Of the trial's Young's modulus, and of the radius of each attachment disc.
    disc_shift_m : float
        By how much the centre of each disc is moved.
    seed : int
        Draws the directions.
    """

    young_modulus_factor: Annotated[float, Meta(gt=0, le=1000)] = 1.0
    disc_shift_m: Distance = 0.0
    disc_radius_factor: Annotated[float, Meta(gt=0, le=100)] = 1.0
    seed: Annotated[int, Meta(ge=0, lt=2**53)] = 0


class Scenario(Section, frozen=True, kw_only=True):
    """One trial: everything that decides its result, and how fast to run it.

    Attributes
    ----------
    patient : PatientSection, optional
        Tissue besides its model. Unset, and not None, where there is none: a scenario without it
        is encoded as before there could be one.
    """

    name: Name = "default"
    seed: Annotated[int, Meta(ge=0, lt=2**53)] = 0
    tissue: TissueSection = TissueSection()
    scene: SceneSection | None = None
    generator: GeneratorSection = GeneratorSection()
    awareness: AwarenessSection = AwarenessSection()
    planner: PlannerSection = PlannerSection()
    motion: MotionSection = MotionSection()
    run: RunSection = RunSection()
    recorder: RecorderSection = RecorderSection()
    patient: PatientSection | UnsetType = UNSET

    @property
    def has_patient(self) -> bool:
        """Whether the tissue that is seen is another one than its model."""
        return not isinstance(self.patient, UnsetType)
