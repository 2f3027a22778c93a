"""Conformance suites for those who add a skill, a planner of any kind, a driver, a perception or a kind of object."""

from robosandbox.apps.conformance.conformance import check_planner, check_skill
from robosandbox.apps.conformance.driver_check import check_driver
from robosandbox.apps.conformance.perception_check import check_perception
from robosandbox.apps.conformance.planner_check import check_grasp_planner, check_motion_planner
from robosandbox.apps.conformance.shape_check import check_shape

__all__ = [
    "check_driver",
    "check_grasp_planner",
    "check_motion_planner",
    "check_perception",
    "check_planner",
    "check_shape",
    "check_skill",
]
