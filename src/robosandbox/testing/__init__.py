"""Conformance suites for those who add a skill, a planner of any kind, a driver or a kind of object."""

from robosandbox.testing.conformance import check_planner, check_skill
from robosandbox.testing.driver_check import check_driver
from robosandbox.testing.hardware import Hardware
from robosandbox.testing.planner_check import check_grasp_planner, check_motion_planner
from robosandbox.testing.shape_check import check_shape

__all__ = [
    "Hardware",
    "check_driver",
    "check_grasp_planner",
    "check_motion_planner",
    "check_planner",
    "check_shape",
    "check_skill",
]
