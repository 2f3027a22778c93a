"""Skills that move the hand by itself, for clients that do not go by the verbs.

They are no part of the catalogue: a sentence may say them, and no plan is made of them to bring something about. Limits, collisions and errors are those of every skill.
"""

from __future__ import annotations

from robosandbox.skills.base import Skill
from robosandbox.skills.drop import Drop
from robosandbox.skills.flip import Flip
from robosandbox.skills.gripper import CloseGripper, OpenGripper
from robosandbox.skills.hand_over import HandOver
from robosandbox.skills.inspect import Inspect
from robosandbox.skills.lift import Lift
from robosandbox.skills.measure import Measure
from robosandbox.skills.move_beside import MoveBeside
from robosandbox.skills.move_by import MoveBy
from robosandbox.skills.move_joint import MoveJoint
from robosandbox.skills.move_joints import MoveJoints
from robosandbox.skills.move_over import MoveOver
from robosandbox.skills.move_through import MoveThrough
from robosandbox.skills.move_to import MoveTo
from robosandbox.skills.move_to_height import MoveToHeight
from robosandbox.skills.move_towards import MoveTowards
from robosandbox.skills.point_at import PointAt
from robosandbox.skills.poses import ForgetPose, MoveToPose, SavePose
from robosandbox.skills.press_down import PressDown
from robosandbox.skills.set_tempo import SetTempo
from robosandbox.skills.shake import Shake
from robosandbox.skills.squeeze import Squeeze
from robosandbox.skills.step_aside import StepAside
from robosandbox.skills.stir import Stir
from robosandbox.skills.trace import Trace
from robosandbox.skills.turn_hand import TurnHand
from robosandbox.skills.wait import Wait
from robosandbox.skills.weigh import Weigh
from robosandbox.skills.wipe import Wipe

MANUAL: tuple[Skill, ...] = (
    MoveTo(),
    MoveOver(),
    MoveTowards(),
    MoveBeside(),
    MoveToHeight(),
    MoveJoint(),
    TurnHand(),
    Lift(),
    MoveBy(),
    MoveThrough(),
    MoveJoints(),
    SavePose(),
    MoveToPose(),
    ForgetPose(),
    OpenGripper(),
    CloseGripper(),
    Squeeze(),
    SetTempo(),
    Wait(),
    PointAt(),
    Inspect(),
    Shake(),
    Weigh(),
    Measure(),
    HandOver(),
    Drop(),
    Trace(),
    PressDown(),
    Wipe(),
    Flip(),
    Stir(),
    StepAside(),
)
"""All of them, for `Agent`."""
