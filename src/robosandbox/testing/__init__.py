"""Conformance suites for those who add a skill, a planner or a sim."""
