"""Held object, from the gripper's own readings: what was between the fingers when they met resistance."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace
from typing import Protocol

import numpy as np

from robosandbox.perception.drawers import grip_of
from robosandbox.perception.track import Track
from robosandbox.perception.tracker import slide_contents
from robosandbox.shapes.drawer import DrawerParts
from robosandbox.shapes.hull import BoxHull
from robosandbox.types import ArmState, Array, DetectedObject, GripperState, Pose
from robosandbox.types.robot import GripperGeometry
from robosandbox.world.relations import support

# Metres that the fingers stay open beyond closed, if something is between them. Chosen: no bundled object is thinner.
_SOMETHING = 0.0015
_WITHIN = 0.02  # Metres by which a place may be off to be the fingers' or the grip's. Chosen: half of a small cube.
_FITS = 0.012  # Metres by which the width between the fingers and a thing's extent may differ. Chosen.
_OPENED = 0.003  # Metres by which the fingers may open and still hold. Chosen.
_SPARE = 0.5
_CLOSED = 0.6  # Share of the width at which a thing was gripped below which it has slipped out. Chosen.
_PRESSING = 0.25  # Share of the gripper's largest force from which it presses on something. Chosen.
# Share of the fingers' travel by which they stop short of their command when something is between them. Chosen: a few times
# what encoder noise and the servos' sag make up for on the bundled arms (the driver `hardware` draws 0.2 % of it).
_SHORT_OF_COMMAND = 0.02


class Holdable(Protocol):
    """Memory of something that a hand may take: its id, and whether the last look did not show it."""

    id: str
    hidden: bool

    def detected(self) -> DetectedObject:
        """Return it in the planner's words."""
        ...

    def carry(self, pose: Pose) -> None:
        """Take it to be somewhere else than it was seen."""
        ...


@dataclass(slots=True)
class Hold:
    """Something in the gripper.

    Attributes:
        id: What.
        object_in_tcp: Where it sits.
        spread: How far the fingers were apart when it was taken, metres (`GripperGeometry.spread`).
    """

    id: str
    object_in_tcp: Pose
    spread: float


class HoldTracker:
    """Follows what the gripper holds.

    Args:
        geometry: The gripper's measured figures; None for an arm without one.
        force_limit: With which the fingers press at most, in the actuator's unit; infinite where the model sets none.
    """

    def __init__(self, geometry: GripperGeometry | None, force_limit: float) -> None:
        self._geometry = geometry
        self._force_limit = force_limit
        self.hold: Hold | None = None

    def update(self, seen: ArmState, tracks: Iterable[Holdable]) -> None:
        """Take the gripper's readings; what is held moves with the TCP.

        Args:
            seen: Proprioception of now.
            tracks: What is remembered; the held one's pose is set.
        """
        known = {track.id: track for track in tracks}
        state, geometry = seen.gripper, self._geometry
        if geometry is None or state is None:
            return
        if self.hold is not None and (self.hold.id not in known or not self._still_holds(state)):
            if self.hold.id in known:
                # It stays where the hand leaves it, until a look says otherwise.
                known[self.hold.id].carry(seen.tcp_pose @ self.hold.object_in_tcp)
            self.hold = None
        if self.hold is None and self.grips(state):
            held = _between_fingers(seen.tcp_pose, state.width, geometry, known.values())
            if held is not None:
                pose = _centred(held, seen.tcp_pose, state.width, geometry)
                self.hold = Hold(held.id, seen.tcp_pose.inverse() @ pose, geometry.spread(state.joint))
        if self.hold is not None:
            track = known[self.hold.id]
            track.carry(seen.tcp_pose @ self.hold.object_in_tcp)
            track.hidden = False

    def move_drawers(self, seen: ArmState, tracks: Iterable[Track]) -> None:
        """Let drawers follow the hand: one whose grip it holds goes along, one that it would reach into is pushed shut.

        The hand covers what a look would need to see of them. What lies in them goes along.
        """
        known = list(tracks)
        geometry, state, tcp = self._geometry, seen.gripper, seen.tcp_pose
        if geometry is None or state is None or self.hold is not None:
            return
        for track in known:
            thing = track.thing
            if not thing.shape.opens or thing.opening is None:
                continue
            shape = DrawerParts.of(thing.size)
            local = thing.pose.rotation.T @ (tcp.position - grip_of(thing.size, thing.pose, 0.0))
            if abs(float(local[1])) > _WITHIN or abs(float(local[2])) > float(shape.grip[2]) + _WITHIN:
                continue
            # The opening at which its grip would be where the TCP is.
            opening, there = thing.opening, -float(local[0])
            if self.grips(state) and abs(state.width - 2.0 * float(shape.grip[1])) < _OPENED:
                if -_WITHIN < there < shape.max_open + _WITHIN:
                    opening = there
            elif there > opening:
                # Two solid things are not in one place.
                opening = min(opening, there - float(shape.grip[0]) - geometry.finger_width / 2.0)
            opening = float(np.clip(opening, 0.0, shape.max_open))
            slide_contents(track, opening - thing.opening, known)
            track.thing = replace(thing, opening=opening)

    def grips(self, state: GripperState) -> bool:
        """Tell whether the fingers press on something: stopped before they are closed, and pressing on."""
        geometry = self._geometry
        assert geometry is not None
        if geometry.cup is not None:
            return _sucks(state, geometry)
        spread = geometry.spread(state.joint)
        if not geometry.min_aperture + _SOMETHING <= spread <= geometry.spread(geometry.open_joint) - 1e-4:
            return False
        if state.force is None:
            # Without a reading of force, fingers that stopped short of where they were sent have something between them.
            return state.commanded is not None and state.commanded - state.closed > _SHORT_OF_COMMAND
        return state.force > _PRESSING * self._force_limit if np.isfinite(self._force_limit) else state.force > 1e-3

    def _still_holds(self, state: GripperState) -> bool:
        """Tell whether the fingers are as far apart as when they closed; how hard they press is the skill's choice."""
        hold, geometry = self.hold, self._geometry
        assert hold is not None and geometry is not None
        if geometry.cup is not None:
            return _sucks(state, geometry)
        if (
            state.force is None
            and state.commanded is not None
            and state.commanded - state.closed < _SHORT_OF_COMMAND / 2.0
        ):
            # They are where they were sent, as after a loss of power: nothing presses, however near it is.
            return False
        empty = max(geometry.min_aperture + _SOMETHING, _CLOSED * hold.spread)
        # A wide thing leaves the fingers little way to open.
        spare = geometry.spread(geometry.open_joint) - hold.spread
        return empty < geometry.spread(state.joint) < hold.spread + min(_OPENED, _SPARE * max(spare, 0.0))


def _sucks(state: GripperState, geometry: GripperGeometry) -> bool:
    """Tell whether a cup is told to suck and lies on something all round."""
    return state.closed > 0.0 and state.seal is not None and state.seal >= geometry.seal


def _between_fingers(tcp: Pose, width: float, geometry: GripperGeometry, tracks: Iterable[Holdable]) -> Holdable | None:
    """Return the thing whose place is between the fingers and whose width fits the aperture best."""
    closing = tcp.rotation[:, 1]
    middle = tcp.position + geometry.centre(width) * closing
    options = []
    for track in tracks:
        item = track.detected()
        if item.shape.opens:
            continue
        directions = np.vstack([np.eye(3), -np.eye(3), closing, -closing])
        reach = support(item, directions)
        outside = float((directions[:6] @ middle - reach[:6]).max())
        extent = float(reach[6] + reach[7])
        if outside < _WITHIN:
            options.append((max(outside, 0.0) + 0.3 * abs(extent - width), track))
    return min(options, key=lambda option: option[0])[1] if options else None


def _centred(track: Holdable, tcp: Pose, width: float, geometry: GripperGeometry) -> Pose:
    """Return the held thing's pose as the closed fingers have it: in their middle, its sides along the pads; a cup moves nothing."""
    item, closing = track.detected(), tcp.rotation[:, 1]
    if geometry.cup is not None or not item.shape.size_fields:
        # Of a mesh the fingers hold a part, whose extent its box does not tell.
        return item.pose
    rotation = item.pose.rotation
    if isinstance(item.shape.hull(item.size), BoxHull) and not item.shape.holds_things and abs(closing[2]) < 0.2:
        rotation = _squared(rotation, closing)
    turned = Pose.from_matrix(item.pose.position, rotation)
    reach = support(replace(item, pose=turned), np.vstack([closing, -closing]))
    if abs(float(reach.sum()) - width) > _FITS:
        return item.pose
    middle = tcp.position + geometry.centre(width) * closing
    along = float(closing @ middle - (reach[0] - reach[1]) / 2.0)
    return Pose.from_matrix(turned.position + along * closing, rotation)


def _squared(rotation: Array, closing: Array) -> Array:
    """Return the rotation turned about the vertical by the least angle that puts a side across the closing direction."""
    heading = float(np.arctan2(closing[1], closing[0]))
    yaw = float(np.arctan2(rotation[1, 0], rotation[0, 0]))
    turn = (heading - yaw + np.pi / 4.0) % (np.pi / 2.0) - np.pi / 4.0
    if abs(rotation[2, 2]) < 0.9 or abs(turn) > 0.3:
        return rotation
    c, s = np.cos(turn), np.sin(turn)
    return np.asarray(np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]]) @ rotation)
