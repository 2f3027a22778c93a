"""What the parts ask of one another: complete protocols, so that any part can be replaced."""

from robosandbox.protocols.drivers import Driver, Guard, Refereed, Simulated
from robosandbox.protocols.planning import Glancing, GraspPlanner, MotionPlanner, Perception
from robosandbox.protocols.skills import Attempt, Ctx, Planner, Skill, SkillContext

__all__ = [
    "Attempt",
    "Ctx",
    "Driver",
    "Glancing",
    "GraspPlanner",
    "Guard",
    "MotionPlanner",
    "Perception",
    "Planner",
    "Refereed",
    "Simulated",
    "Skill",
    "SkillContext",
]
