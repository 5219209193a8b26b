# pyright: reportUnknownMemberType=false, reportUnknownVariableType=false
# pyright: reportUnknownArgumentType=false, reportAttributeAccessIssue=false
# pyright: reportMissingImports=false, reportMissingTypeStubs=false
"""The PSM as a Pinocchio model (this file alone sees Pinocchio, which ships no types)."""

from __future__ import annotations

from math import cos, sin

import numpy as np
import pinocchio as pin

from .inverse import Joints
from .pose import Matrix, Pose, Vector3, matrix
from .psm import JOINTS, TIP_ROTATION

__all__ = ["PsmModel"]


def _rotation_x(angle: float) -> Matrix:
    c, s = cos(angle), sin(angle)
    return np.array([[1.0, 0.0, 0.0], [0.0, c, -s], [0.0, s, c]])


def _rotation_z(angle: float) -> Matrix:
    c, s = cos(angle), sin(angle)
    return np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])


class PsmModel:
    """Forward kinematics and Jacobian of one arm, placed in the world.

    Parameters
    ----------
    base_in_world : Pose
        Where the arm's remote centre of motion stands and how its base is turned.

    Notes
    -----
    A joint's fixed placement is everything of its row but the joint's value; Rz and Tz commute,
    so a revolute joint's ``d`` and a prismatic joint's ``theta`` belong to it.
    """

    def __init__(self, base_in_world: Pose) -> None:
        model = pin.Model()
        placement = pin.SE3(
            matrix(base_in_world.quaternion_xyzw), np.array(base_in_world.position_m)
        )
        parent = 0
        for joint in JOINTS:
            theta, d = (0.0, joint.offset) if joint.prismatic else (joint.offset, joint.d_m)
            placement = (
                placement
                * pin.SE3(_rotation_x(joint.alpha_rad), np.array([joint.a_m, 0.0, 0.0]))
                * pin.SE3(_rotation_z(theta), np.array([0.0, 0.0, d]))
            )
            kind = pin.JointModelPZ() if joint.prismatic else pin.JointModelRZ()
            parent = model.addJoint(parent, kind, placement, joint.name)
            placement = pin.SE3.Identity()
        tip = pin.Frame(
            "tip", parent, 0, pin.SE3(TIP_ROTATION, np.zeros(3)), pin.FrameType.OP_FRAME
        )
        self._tip: int = model.addFrame(tip)
        self._model = model
        self._data = model.createData()

    def forward(self, joints: Joints) -> tuple[Vector3, Matrix]:
        """Where the tip is.

        Parameters
        ----------
        joints : tuple of float, length 6
            Joint values [rad; m for the insertion].

        Returns
        -------
        position : tuple of float, length 3
            The tip in the world frame [m].
        rotation : ndarray, shape (3, 3), float64
            Its rotation in the world frame.
        """
        pin.forwardKinematics(self._model, self._data, np.array(joints))
        placement = pin.updateFramePlacement(self._model, self._data, self._tip)
        x, y, z = placement.translation.tolist()
        return (x, y, z), placement.rotation.copy()

    def jacobian(self, joints: Joints) -> Matrix:
        """Velocity of the tip per joint velocity.

        Parameters
        ----------
        joints : tuple of float, length 6
            Joint values [rad; m for the insertion].

        Returns
        -------
        ndarray, shape (6, 6), float64
            Rows: linear velocity [m/s], angular velocity [rad/s], both of the tip and in the
            axes of the world; columns: joints.
        """
        return pin.computeFrameJacobian(
            self._model,
            self._data,
            np.array(joints),
            self._tip,
            pin.ReferenceFrame.LOCAL_WORLD_ALIGNED,
        ).copy()

    def wrist(self, joints: Joints) -> Vector3:
        """Where the shaft ends: the centre of the wrist.

        Parameters
        ----------
        joints : tuple of float, length 6
            Joint values [rad; m for the insertion].

        Returns
        -------
        tuple of float, length 3
            The origin of the wrist pitch joint's frame in the world [m].
        """
        pin.forwardKinematics(self._model, self._data, np.array(joints))
        x, y, z = self._data.oMi[5].translation.tolist()
        return (x, y, z)

    def joint_origins(self, joints: Joints) -> Matrix:
        """Origins of the joints' frames in the world, for the remote centre and the shaft.

        Parameters
        ----------
        joints : tuple of float, length 6
            Joint values [rad; m for the insertion].

        Returns
        -------
        ndarray, shape (6, 3), float64
            One row a joint [m].
        """
        pin.forwardKinematics(self._model, self._data, np.array(joints))
        return np.array([placement.translation for placement in self._data.oMi[1:]])
