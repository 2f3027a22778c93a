"""Conformance suites for those who add a skill, a planner or a sim."""

from robosandbox.testing.conformance import check_planner, check_sim, check_skill

__all__ = ["check_planner", "check_sim", "check_skill"]
