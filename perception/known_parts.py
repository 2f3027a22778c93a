"""Parts of a scene whose file is known: measured by depth, led by the hand that holds one, and pushed by a hand that is in its way."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from functools import partial

import numpy as np

from robosandbox.motion.scene_depths import SceneDepths
from robosandbox.perception.frames import SegmentedFrame
from robosandbox.perception.holding import HoldTracker
from robosandbox.perception.known_things import KnownThing, KnownThings
from robosandbox.perception.part_values import PartValues
from robosandbox.perception.pushed_parts import PushedParts
from robosandbox.shapes.body import PartJoint
from robosandbox.shapes.compound import Geometry
from robosandbox.sim.world import World
from robosandbox.types import ArmState, Array, Pose
from robosandbox.values import frozen

# Metres from the hand within which a part is led by it.
_LED = 0.03


@frozen(eq=False)
class _Led:
    """A part that a hand leads: the joint's value and the TCP when the hand took it."""

    part: str
    value: float
    tcp: Pose


class KnownParts:
    """The parts of a scene; what lies in one goes along with it.

    Args:
        world: The compiled scene.
        depths: The same as it is believed to be; parts are put into it as they are found.
        things: What may lie in them.

    Attributes:
        by_id: The joint of each.
    """

    def __init__(self, world: World, depths: SceneDepths, things: KnownThings) -> None:
        self._world = world
        self._depths = depths
        self._things = things
        self._shapes: dict[str, tuple[Geometry, PartJoint]] = {
            item.id: (item.geometry, item.geometry.joint)
            for item in world.scene.objects
            if item.geometry is not None and item.geometry.joint is not None
        }
        self._pushed = PushedParts(world, depths)
        self._led: dict[str, _Led] = {}
        self.by_id = {name: PartValues(depths, world.object_bodies[name]) for name in self._shapes}

    def forget(self) -> None:
        """Take no part to be led by a hand."""
        self._led = {}

    def feel(
        self, hands: Mapping[str, HoldTracker], states: Mapping[str, ArmState], arms: Mapping[str, ArmState]
    ) -> None:
        """Note which parts hands have taken, and have those give way that a hand is in.

        Args:
            hands: By name.
            states: Of the arm that carries each hand, by the hand's name.
            arms: Likewise by the arm's name.
        """
        for name, hand in hands.items():
            self._lead(name, hand, states[name])
        led = {led.part for led in self._led.values()}
        free = {name: part for name, part in self.by_id.items() if name not in led}
        self._moving(free, partial(self._pushed.give_way, free, arms))

    def measure(self, views: Sequence[SegmentedFrame], states: Mapping[str, ArmState]) -> None:
        """Find out how far each part is open.

        Args:
            views: What cameras show.
            states: As for `feel`.
        """
        for name, part in self.by_id.items():
            led = [(hand, one) for hand, one in self._led.items() if one.part == name]
            likely = [
                float(np.clip(self._led_to(one, states[hand].tcp_pose), part.low, part.high)) for hand, one in led
            ]
            self._moving([name], partial(part.measure, views, likely))

    def _lead(self, name: str, hand: HoldTracker, state: ArmState) -> None:
        """Note which part a hand has taken, if any."""
        if hand.hold is not None or state.gripper is None or not hand.grips(state.gripper):
            self._led.pop(name, None)
        elif name not in self._led:
            near = [(self._distance(part, state.tcp_pose.position), part) for part in self.by_id]
            far, part = min(near, default=(np.inf, ""))
            if far < _LED:
                self._led[name] = _Led(part, self.by_id[part].value, state.tcp_pose)

    def _distance(self, part: str, point: Array) -> float:
        """Return how far a point (3,) is from the box around a part's nearest piece, metres."""
        data, body = self._depths.data, self._world.object_bodies[part]
        local = data.xmat[body].reshape(3, 3).T @ (point - data.xpos[body])
        return min(
            float(np.linalg.norm(np.maximum(np.maximum(low - local, local - high), 0.0)))
            for low, high in ((one.min(axis=0), one.max(axis=0)) for one in self._shapes[part][0].corners)
        )

    def _led_to(self, led: _Led, tcp: Pose) -> float:
        """Return the value of a joint by the hand that leads its part."""
        joint = self._shapes[led.part][1]
        axis, anchor = np.array(joint.axis), np.array(joint.anchor)
        if joint.kind == "slide":
            return led.value + float(axis @ (tcp.position - led.tcp.position))
        before, now = (one - anchor - axis * (axis @ (one - anchor)) for one in (led.tcp.position, tcp.position))
        return led.value + float(np.arctan2(axis @ np.cross(before, now), before @ now))

    def _moving(self, names: Iterable[str], move: Callable[[], object]) -> None:
        """Let parts be moved by something; what lies in one goes along."""
        before = [(name, self._frame(name), self._within(name)) for name in names]
        move()
        for name, frame, within in before:
            if within and self._frame(name) != frame:
                moved = self._frame(name) @ frame.inverse()
                for thing in within:
                    assert thing.pose is not None
                    thing.pose = moved @ thing.pose
        self._things.stand()

    def _frame(self, name: str) -> Pose:
        body = self._world.object_bodies[name]
        return Pose.from_matrix(self._depths.data.xpos[body], self._depths.data.xmat[body].reshape(3, 3))

    def _within(self, part: str) -> list[KnownThing]:
        """Return the things whose middle is within a part's box."""
        frame = self._frame(part)
        middle, half = self._shapes[part][0].box
        found = []
        for thing in self._things.by_id.values():
            if thing.pose is None:
                continue
            points = thing.mesh.corners @ thing.pose.rotation.T + thing.pose.position
            local = frame.rotation.T @ ((points.min(axis=0) + points.max(axis=0)) / 2.0 - frame.position)
            if (np.abs(local - middle) < half).all():
                found.append(thing)
        return found
