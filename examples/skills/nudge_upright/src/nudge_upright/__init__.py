"""Nudge upright: set something that has fallen over upright again, where it lies.

A skill of another package: this file and one line under `robosandbox.skills` make it spoken, checked, monitored and offered over MCP.
"""

from __future__ import annotations

import numpy as np

from robosandbox.errors import CollisionError, Phase, SkillError, UnreachableError
from robosandbox.skills.base import Skill
from robosandbox.skills.pick import Pick
from robosandbox.skills.primitives.manipulator import (
    Manipulator,
    most_telling,
    raised,
    withdrawn,
)
from robosandbox.skills.protocols import SkillContext
from robosandbox.skills.words import Words
from robosandbox.types import DetectedObject, Pose, SkillResult, matrix_about_axis
from robosandbox.world.contracts import Contract
from robosandbox.world.facts import fact
from robosandbox.world.placement_sampling import with_pose
from robosandbox.world.relations import bottom
from robosandbox.world.standing import TIPPED, tilt

# Of the lean at which a thing falls back on its base, what it is let go at: less than one leaves room for errors.
_SHARE = 0.75
# Headings of the hand that are tried, degrees from the one in which it picked the thing up.
_TURNS = (0.0, 45.0, -45.0, 90.0, -90.0, 135.0, -135.0, 180.0)
# Height over the table at which it is let go, and how far the hand goes back then where it can, metres.
_ABOVE = 0.002
_BACK = (0.06, 0.03, 0.015)


class NudgeUpright(Skill):
    """Set something that has fallen over upright."""

    name = "nudge_upright"
    words = Words(verbs=("nudge {} upright", "nudge {} up", "tip {} up"), object="object")

    def contract(self, *, object: str) -> Contract:
        """Return what setting an object upright needs and brings about."""
        return Contract(needs=Pick().contract(object=object).needs, gives=(fact("upright", object), fact("hand_empty")))

    def run(self, ctx: SkillContext, *, object: str) -> SkillResult:
        """Set something that has fallen over upright again, where it lies.

        Args:
            ctx: What the skill may use.
            object: Id of the object.

        Raises:
            SkillError: As pick and place_at raise them.
        """
        before = Manipulator(ctx).find(object)
        if tilt(before) < TIPPED:
            return SkillResult(skill=self.name, detail={"object": object, "already_upright": True})
        Pick().run(ctx, object=object)
        arm = Manipulator(ctx)
        _tip(arm, arm.find(object))
        _let_fall(arm, object)
        after = arm.find(object, arm.settle(object))
        return SkillResult(skill=self.name, detail={"object": object, "tilt_deg": float(np.degrees(tilt(after)))})


def _tip(arm: Manipulator, item: DetectedObject) -> None:
    """Turn the hand about its closing direction until what it holds falls upright when it is let go.

    Upright all the way the hand would lie on the table: what leans by less than its base is wide rights itself.
    """
    arm.ctx.enter(Phase.PLAN)
    arm.use(arm.start, held=item.id)
    tcp = arm.state.tcp_pose
    half = item.shape.hull(item.size).half_extents
    lean = _SHARE * float(np.arctan2(min(half[0], half[1]), half[2]))
    failures: list[SkillError] = []
    for angle in (np.pi / 2.0 - lean, lean - np.pi / 2.0):
        rotation = matrix_about_axis(tcp.rotation[:, 1], angle) @ tcp.rotation
        for turn in np.radians(_TURNS):
            goal = Pose.from_matrix(tcp.position, matrix_about_axis(np.array([0.0, 0.0, 1.0]), turn) @ rotation)
            try:
                way = arm.motion.plan_joints(arm.q, arm.motion.ik(goal, arm.q), speed=arm.tempo.carry)
                arm.motion.allow("table", item.id)
                arm.motion.plan_line(way.q[-1], raised(goal, _drop(arm, item, goal)), speed=arm.tempo.lower)
            except (UnreachableError, CollisionError) as error:
                failures.append(error)
                continue
            finally:
                arm.motion.allow()
            arm.follow(way, Phase.TRANSFER)
            return
    raise most_telling(failures)


def _drop(arm: Manipulator, item: DetectedObject, tcp: Pose) -> float:
    """Return by how much the hand has to rise at a TCP pose so that what it holds touches the table; negative is down."""
    there = tcp @ (arm.state.tcp_pose.inverse() @ item.pose)
    return arm.start.table_height + _ABOVE - bottom(with_pose(item, there))


def _let_fall(arm: Manipulator, name: str) -> None:
    """Lower what is held onto the table, let go, and withdraw the hand."""
    scene = arm.look()
    arm.use(scene, held=name)
    arm.motion.allow("table", name)
    tcp = arm.state.tcp_pose
    down = arm.motion.plan_line(arm.q, raised(tcp, _drop(arm, arm.find(name, scene), tcp)), speed=arm.tempo.lower)
    arm.follow(down, Phase.LOWER, yielding=True)
    arm.ctx.enter(Phase.RELEASE)
    arm.open()
    arm.use(arm.look())
    arm.motion.allow("table", name)
    tcp = arm.state.tcp_pose
    for distance in _BACK:
        try:
            arm.follow(arm.motion.plan_line(arm.q, withdrawn(tcp, distance), speed=arm.tempo.lower), Phase.RETREAT)
        except UnreachableError:
            continue
        return
