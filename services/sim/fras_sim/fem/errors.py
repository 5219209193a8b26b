"""What the finite-element core refuses, by name."""

from fras_common.errors import FrasError


class FemError(FrasError):
    """Base of the errors of `fras_sim.fem`."""


class BadMesh(FemError):
    """A mesh that no tissue can be computed on."""


class BadParameter(FemError):
    """A material, time or solver parameter outside what the equations allow.

    Attributes: ``name``, ``value``, ``allowed``.
    """

    def __init__(self, name: str, value: object, allowed: str) -> None:
        super().__init__(
            f"{name} = {value!r} is not allowed: give {allowed}",
            name=name,
            value=value,
            allowed=allowed,
        )


class BadToolInput(FemError):
    """A tool pose that was refused; the tissue is as it was before the call.

    Attributes: ``arm`` and the offending numbers.
    """


class FactorizationFailed(FemError):
    """The linear solver met a matrix that is not positive definite.

    Attributes: ``row`` of the reduced system (fixed nodes eliminated).
    """


class NotConverged(FemError):
    """A static problem for which no equilibrium was found.

    Attributes: ``load`` (share of the prescribed displacements that was reached), ``residual``
    [N], ``iterations``.
    """
