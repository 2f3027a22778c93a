"""Skills that move the hand by itself, for clients that do not go by the verbs.

They are no part of the catalogue: no sentence and no plan means them. Limits, collisions and errors are those of every skill.
"""

from __future__ import annotations

from robosandbox.skills.base import Skill
from robosandbox.skills.gripper import CloseGripper, OpenGripper
from robosandbox.skills.move_by import MoveBy
from robosandbox.skills.move_joints import MoveJoints
from robosandbox.skills.move_through import MoveThrough
from robosandbox.skills.move_to import MoveTo
from robosandbox.skills.poses import MoveToPose, SavePose
from robosandbox.skills.set_tempo import SetTempo
from robosandbox.skills.wait import Wait

MANUAL: tuple[Skill, ...] = (
    MoveTo(),
    MoveBy(),
    MoveThrough(),
    MoveJoints(),
    SavePose(),
    MoveToPose(),
    OpenGripper(),
    CloseGripper(),
    SetTempo(),
    Wait(),
)
"""All of them, for `Agent`."""
