"""One arm in the world: forward and inverse kinematics of its tip."""

from __future__ import annotations

from .instrument import Instrument
from .inverse import Joints, inverse
from .model import PsmModel
from .pose import Matrix, Pose, Quaternion, Vector3, matrix, quaternion

__all__ = ["ArmKinematics"]


class ArmKinematics:
    """Kinematics of a placed PSM.

    Parameters
    ----------
    base_in_world : Pose
        The arm's remote centre of motion in the world.

    Attributes
    ----------
    base_in_world : Pose
        As given.
    tool_down_xyzw : tuple of float, length 4
        The fixed orientation this arm works in: the tip's z axis along the base's -z, the wrist
        straight when the shaft is vertical.
    """

    def __init__(self, base_in_world: Pose) -> None:
        self.base_in_world = base_in_world
        self._model = PsmModel(base_in_world)
        self._base_rotation = matrix(base_in_world.quaternion_xyzw)
        self._base_rows: list[list[float]] = self._base_rotation.T.tolist()
        _, down = self._model.forward((0.0, 0.0, 0.1, 0.0, 0.0, 0.0))
        self.tool_down_xyzw: Quaternion = quaternion(down)
        # The orientation rarely changes: its matrix in the base frame is kept.
        self._rotation_of: tuple[Quaternion, Matrix] | None = None

    def forward(self, joints: Joints) -> Pose:
        """Pose of the tip in the world.

        Parameters
        ----------
        joints : tuple of float, length 6
            Joint values [rad; m for the insertion].

        Returns
        -------
        Pose
            `tip_in_world`.
        """
        position, rotation = self._model.forward(joints)
        return Pose(position, quaternion(rotation))

    def instrument(self, joints: Joints, tip_in_world: Pose) -> Instrument:
        """Where the instrument's axis runs.

        Parameters
        ----------
        joints : tuple of float, length 6
            Joint values [rad; m for the insertion].
        tip_in_world : Pose
            The tip that belongs to them, from `forward`.

        Returns
        -------
        Instrument
            Remote centre, wrist and tip in the world.
        """
        centre = self.base_in_world.position_m
        return Instrument(centre, self._model.wrist(joints), tip_in_world.position_m)

    def jacobian(self, joints: Joints) -> Matrix:
        """Geometric Jacobian of the tip, see `PsmModel.jacobian`.

        Parameters
        ----------
        joints : tuple of float, length 6
            Joint values [rad; m for the insertion].

        Returns
        -------
        ndarray, shape (6, 6), float64
            Linear over angular velocity of the tip per joint velocity, world axes.
        """
        return self._model.jacobian(joints)

    def joint_origins(self, joints: Joints) -> Matrix:
        """Origins of the joints' frames in the world, see `PsmModel.joint_origins`.

        Parameters
        ----------
        joints : tuple of float, length 6
            Joint values [rad; m for the insertion].

        Returns
        -------
        ndarray, shape (6, 3), float64
            One row a joint [m].
        """
        return self._model.joint_origins(joints)

    def inverse(self, tip_in_world: Pose, near: Joints | None = None) -> Joints:
        """Joints that bring the tip to a pose, see `fras_motion.kinematics.inverse`.

        Parameters
        ----------
        tip_in_world : Pose
            Where the tip shall be.
        near : tuple of float, length 6, optional
            Joints whose roll the result's roll shall be next to.

        Returns
        -------
        tuple of float, length 6
            Joint values [rad; m for the insertion], inside the limits.

        Raises
        ------
        Unreachable
            A joint would have to leave its limits.
        """
        if self._rotation_of is None or self._rotation_of[0] != tip_in_world.quaternion_xyzw:
            in_base = self._base_rotation.T @ matrix(tip_in_world.quaternion_xyzw)
            self._rotation_of = (tip_in_world.quaternion_xyzw, in_base)
        return inverse(
            self._into_base(tip_in_world.position_m),
            self._rotation_of[1],
            0.0 if near is None else near[3],
        )

    def _into_base(self, position: Vector3) -> Vector3:
        ox, oy, oz = self.base_in_world.position_m
        x, y, z = position[0] - ox, position[1] - oy, position[2] - oz
        (a, b, c), (d, e, f), (g, h, i) = self._base_rows
        return (a * x + b * y + c * z, d * x + e * y + f * z, g * x + h * y + i * z)
