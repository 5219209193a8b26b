"""What a viewer can show of a trial, as plain values: no message format, no file format."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from fras_common.messages import Quaternion, Vec3

FloatArray = NDArray[np.float64]
BlockKind = Literal["free", "fixed", "chosen", "held"]
Level = Literal["info", "warning", "error"]


@dataclass(frozen=True)
class Moment:
    """When something was, as the message says from which it is known.

    Parameters
    ----------
    tick : int
        Simulation tick; for what belongs to none, the latest one before it.
    stamp_ns, arrival_ns : int
        Producer's clock when it was published, recorder's when it arrived [ns since the epoch].
    seq : int
        Number of the message among its publisher's on its key.
    """

    tick: int
    stamp_ns: int
    arrival_ns: int
    seq: int


@dataclass(frozen=True, eq=False)
class Stage:
    """What stays where it is through the trial.

    Parameters
    ----------
    rest_m : ndarray, shape (n_nodes, 3) [m]
    surface : ndarray of int, shape (n_triangles, 3)
        Outer faces of the tissue, wound outwards.
    attachments_m : ndarray, shape (n, 3) [m]
        Attachment points (APs).
    roi_m : Vec3
        Region of interest (ROI).
    clear_m : float
        Distance that the tissue must have from it [m].
    limit_n, hard_limit_n : float
        Soft and hard limit of the force [N]; colours reach from 0 to the hard one.
    """

    moment: Moment
    rest_m: FloatArray
    surface: NDArray[np.int32]
    attachments_m: FloatArray
    roi_m: Vec3
    clear_m: float
    limit_n: float
    hard_limit_n: float


@dataclass(frozen=True, eq=False)
class Tissue:
    """The tissue at one tick.

    Parameters
    ----------
    nodes_m : ndarray, shape (n_nodes, 3) [m]
    force_n : ndarray, shape (n_nodes,) [N]
        Magnitude of each node's elastic force.
    """

    moment: Moment
    nodes_m: FloatArray
    force_n: FloatArray


@dataclass(frozen=True)
class Instrument:
    """One arm, as far as it is drawn.

    Parameters
    ----------
    tip_m, tip_xyzw : Vec3, Quaternion
        Tip in the world.
    jaw_rad : float
        Angle between the two blades; closed below 0.
    blades_m : tuple of two Vec3
        Ends of the two blades; at the tip where they are closed.
    hinge_m : Vec3
        Where they begin.
    wrist_m, remote_centre_m : Vec3
        Where the shaft ends, and the point of it that stays where it is.
    """

    tip_m: Vec3
    tip_xyzw: Quaternion
    jaw_rad: float
    blades_m: tuple[Vec3, Vec3]
    hinge_m: Vec3
    wrist_m: Vec3
    remote_centre_m: Vec3

    @property
    def shaft_m(self) -> tuple[Vec3, ...]:
        """From the remote centre to where the blades begin."""
        return (self.remote_centre_m, self.wrist_m, self.hinge_m)

    @property
    def jaws_m(self) -> tuple[Vec3, ...]:
        """From the end of one blade to that of the other."""
        return (self.blades_m[0], self.hinge_m, self.blades_m[1])


@dataclass(frozen=True)
class Arms:
    """Both arms at one tick."""

    moment: Moment
    instruments: Mapping[str, Instrument]


@dataclass(frozen=True, eq=False)
class Blocks:
    """The candidates for a grasp, where the tissue has carried them.

    Parameters
    ----------
    names : tuple of str
    places_m : ndarray, shape (n, 3) [m]
    kinds : tuple of BlockKind
        `fixed`: an attachment lies under it; `chosen`: the latest plan grasps it.
    """

    moment: Moment
    names: tuple[str, ...]
    places_m: FloatArray
    kinds: tuple[BlockKind, ...]

    def marked(self) -> Iterator[tuple[str, FloatArray, BlockKind]]:
        """Yield name, place and kind of each block that is chosen or held."""
        for name, place_m, kind in zip(self.names, self.places_m, self.kinds, strict=True):
            if kind in ("chosen", "held"):
                yield name, place_m, kind


@dataclass(frozen=True)
class Gauges:
    """The numbers to plot, once a verdict.

    Parameters
    ----------
    force_n, limit_n, hard_limit_n : float
        Force by the scenario's metric, and its limits [N].
    visibility, threshold : float
        Share of the ROI's surroundings that is clear, and above which it counts as visible.
    tick_ms, solve_ms : float
        From the tick before to this one on the wall clock, pauses for planning included, and what
        its finite elements took; not a number where the log lacks it [ms].
    """

    moment: Moment
    force_n: float
    limit_n: float
    hard_limit_n: float
    visibility: float
    threshold: float
    tick_ms: float
    solve_ms: float


@dataclass(frozen=True)
class Sentence:
    """Something said by a service, or by the export itself."""

    moment: Moment
    level: Level
    who: str
    text: str


Fact = Stage | Tissue | Arms | Blocks | Gauges | Sentence
