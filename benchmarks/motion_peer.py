# pyright: reportUnknownMemberType=false, reportUnknownVariableType=false
# pyright: reportUnknownArgumentType=false, reportAttributeAccessIssue=false
# pyright: reportMissingImports=false, reportMissingTypeStubs=false
"""The generic way to invert kinematics: damped least squares with Pinocchio's Jacobian.

The loop is that of Pinocchio's own example of inverse kinematics, from the joints of the tick
before, to the accuracy that is asked of ours.
"""

from math import cos, sin
from typing import Any

import numpy as np
import pinocchio as pin
from benchmarks import psm_reference as psm
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Placement = Any  # pinocchio.SE3
TOLERANCE = 1e-6  # m and rad
DAMPING = 1e-12
MOST_ITERATIONS = 100


def _placement(alpha: float, a: float, theta: float, d: float) -> Placement:
    c, s = cos(alpha), sin(alpha)
    about_x = pin.SE3(np.array([[1, 0, 0], [0, c, -s], [0, s, c]]), np.array([a, 0.0, 0.0]))
    c, s = cos(theta), sin(theta)
    about_z = pin.SE3(np.array([[c, -s, 0], [s, c, 0], [0, 0, 1.0]]), np.array([0.0, 0.0, d]))
    return about_x * about_z


class DampedLeastSquares:
    """Inverse kinematics of one arm.

    Parameters
    ----------
    arm : str
        Which one, of `psm_reference.BASES`.
    """

    def __init__(self, arm: str) -> None:
        (x, y, z), turn = psm.BASES[arm]
        placement = pin.SE3(_placement(0.0, 0.0, turn, 0.0).rotation, np.array([x, y, z]))
        model, parent = pin.Model(), 0
        for number, row in enumerate(psm.TABLE):
            kind = pin.JointModelPZ() if number == psm.INSERTION else pin.JointModelRZ()
            parent = model.addJoint(parent, kind, placement * _placement(*row), psm.NAMES[number])
            placement = pin.SE3.Identity()
        tip = pin.Frame("tip", parent, 0, pin.SE3(psm.TO_TIP, np.zeros(3)), pin.FrameType.OP_FRAME)
        self._tip: int = model.addFrame(tip)
        self._model = model
        self._data = model.createData()
        self.iterations = 0

    def solve(self, target: Placement, start: Floats) -> Floats | None:
        """Joints near `start` that bring the tip to a target; None without convergence."""
        joints = start
        for iteration in range(MOST_ITERATIONS):
            pin.computeJointJacobians(self._model, self._data, joints)
            here = pin.updateFramePlacement(self._model, self._data, self._tip)
            error = pin.log6(here.actInv(target)).vector
            if max(error[:3] @ error[:3], error[3:] @ error[3:]) <= TOLERANCE**2:
                self.iterations = iteration
                return joints
            jacobian = pin.getFrameJacobian(
                self._model, self._data, self._tip, pin.ReferenceFrame.LOCAL
            )
            square = jacobian @ jacobian.T
            square[np.diag_indices(6)] += DAMPING
            joints = joints + jacobian.T @ np.linalg.solve(square, error)
        return None


def targets(positions: Floats, rotation: Floats) -> list[Placement]:
    """Return the peer's own form of poses of one orientation."""
    return [pin.SE3(rotation, position) for position in positions]
