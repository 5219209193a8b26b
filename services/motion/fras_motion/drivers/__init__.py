"""Drivers: the robots behind one small interface."""

from .base import Driver, DriverFault, Measured, Setpoint
from .crtk import ArmsLink, CrtkDriver
from .simulated import SimulatedDriver

__all__ = [
    "ArmsLink",
    "CrtkDriver",
    "Driver",
    "DriverFault",
    "Measured",
    "Setpoint",
    "SimulatedDriver",
]
