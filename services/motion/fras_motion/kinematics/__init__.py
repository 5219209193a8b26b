"""Kinematics of the PSM: model, closed-form inverse, placements."""

from .arm import ArmKinematics
from .cell import BASES_IN_WORLD, HOME_TIPS_M
from .errors import Unreachable
from .instrument import Instrument
from .inverse import Joints
from .pose import Pose, Quaternion, Vector3, matrix, quaternion
from .psm import JAW_LOWER_RAD, JAW_UPPER_RAD, JOINT_NAMES, JOINTS

__all__ = [
    "BASES_IN_WORLD",
    "HOME_TIPS_M",
    "JAW_LOWER_RAD",
    "JAW_UPPER_RAD",
    "JOINTS",
    "JOINT_NAMES",
    "ArmKinematics",
    "Instrument",
    "Joints",
    "Pose",
    "Quaternion",
    "Unreachable",
    "Vector3",
    "matrix",
    "quaternion",
]
