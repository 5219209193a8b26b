"""Drivers: the robots behind one small interface."""

from .base import Driver, Measured, Setpoint
from .simulated import SimulatedDriver

__all__ = ["Driver", "Measured", "Setpoint", "SimulatedDriver"]
