"""Conformance suites for those who add a skill, a planner, a sim or a kind of object."""

from robosandbox.testing.conformance import check_planner, check_sim, check_skill
from robosandbox.testing.hardware import Hardware
from robosandbox.testing.shape_check import check_shape

__all__ = ["Hardware", "check_planner", "check_shape", "check_sim", "check_skill"]
