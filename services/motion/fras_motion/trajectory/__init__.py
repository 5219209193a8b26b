"""Straight lines, jerk-limited time scaling, stops and retreats along the path."""

from .braking import brake, retreat
from .joint_rates import limits_for_slopes, within_joint_rates
from .line import Line
from .profile import Limits, Profile, ProfileImpossible, rest_to_rest

__all__ = [
    "Limits",
    "Line",
    "Profile",
    "ProfileImpossible",
    "brake",
    "limits_for_slopes",
    "rest_to_rest",
    "retreat",
    "within_joint_rates",
]
