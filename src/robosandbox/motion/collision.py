"""Does the robot, or what it holds, touch something? Checked by MuJoCo on a model and data of its own."""

from __future__ import annotations

import copy
from bisect import bisect_right
from collections.abc import Collection, Iterable, Sequence

import mujoco
import numpy as np
from numpy.typing import NDArray

from robosandbox.robots.robot import Robot
from robosandbox.sim.objects.geoms import GRAIN_BIT
from robosandbox.sim.objects.standing import is_free, stand
from robosandbox.types import Array, Pose
from robosandbox.values import frozen

# A contact bit that only this module uses: movers carry it as type, obstacles as affinity, so that MuJoCo looks at
# robot-obstacle and robot-robot pairs and spends nothing on objects that stand on the table.
_BIT = 1 << 30
# The same of what the hand alone may touch: the links before it carry it as type.
_LINK_BIT = 1 << 28
# How far MuJoCo looks for obstacles, and so the longest way of any point of the robot between two checks of a path; metres.
_SIGHT = 0.02
# Shapes whose contacts come from the general convex solver, and by what share of the margin those of all solids may be off.
_GENERAL = [
    mujoco.mjtGeom.mjGEOM_CYLINDER.value,
    mujoco.mjtGeom.mjGEOM_ELLIPSOID.value,
    mujoco.mjtGeom.mjGEOM_MESH.value,
]
_DOUBT = 0.5
_BOX = mujoco.mjtGeom.mjGEOM_BOX.value
# Metres by which the robot may come nearer still to what it stands near; chosen as the Panda's repeatability in its maker's data sheet.
_REPEATS = 0.0001
# Shortest such way, metres; chosen so that a walk past a near thing comes to an end where no clearance is kept.
_LEAST_STRIDE = 0.001


@frozen
class DeepestContact:
    """The deepest contact of a configuration.

    Attributes:
        body: The moving body.
        other: What it touches.
        depth: Penetration, metres; negative inside the clearance.
        own: Both are parts of the robot.
    """

    body: str
    other: str
    depth: float
    own: bool = False


class CollisionChecker:
    """Checks configurations of one robot among placed objects.

    Args:
        model: The world model; it is copied, never changed.
        robot: The robot bound to it.
        names: What people call each body.
        clearance: Distance to obstacles that already counts as a touch, metres.
        movers: Bodies of the robot that are checked; None for all. Of the others nothing is known then.
        hand: Bodies of the robot that are its hand, which alone may touch some things.
    """

    def __init__(
        self,
        model: mujoco.MjModel,
        robot: Robot,
        names: Sequence[str],
        *,
        clearance: float = 0.001,
        movers: Collection[int] | None = None,
        hand: Collection[int] = (),
    ) -> None:
        self.model: mujoco.MjModel = copy.copy(model)
        self.robot = robot
        self.names = names
        self.clearance = clearance
        self.data: mujoco.MjData = mujoco.MjData(self.model)
        # A view: making it anew for each configuration costs as much as setting it.
        self._qpos = self.data.qpos
        self._robot_geoms = np.isin(model.geom_bodyid, list(robot.bodies))
        # Beads give way, so nobody plans around them.
        beads = model.geom_contype & GRAIN_BIT != 0
        self.model.geom_contype[beads] = 0
        self.model.geom_conaffinity[beads] = 0
        self._solid = ((model.geom_contype != 0) | (model.geom_conaffinity != 0)) & ~beads
        self._held: tuple[int, int, Array, Array] | None = None
        self._robot_body = np.isin(np.arange(model.nbody), list(robot.bodies))
        self._finger = np.isin(np.arange(model.nbody), list(robot.gripper.bodies if robot.gripper else ()))
        self._allowed = np.zeros(model.nbody, dtype=np.bool_)
        self._by_hand = np.zeros(model.nbody, dtype=np.bool_)
        self._stood: Array | None = None
        self._stands: Array | None = None
        self._stays_in_touch = False
        self._near: dict[tuple[int, int], float] = {}
        self._movers, self._obstacles = self._robot_geoms & self._solid, ~self._robot_geoms & self._solid
        if movers is not None:
            unseen = self._robot_geoms & ~np.isin(model.geom_bodyid, list(movers))
            self.model.geom_contype[unseen] = self.model.geom_conaffinity[unseen] = 0
            self._movers = self._movers & ~unseen
        self._links = self._movers & ~np.isin(model.geom_bodyid, list(hand))
        self._general = np.isin(model.geom_type, _GENERAL)
        self._boxes = model.geom_type == _BOX
        self._levers = _levers(model, robot)
        self._apply_bits()

    def place(self, body: int, pose: Pose) -> None:
        """Put a loose object's body at a pose; what is fixed stays."""
        stand(self.model, self.data.qpos, body, pose)

    def slide(self, body: int, opening: float) -> None:
        """Open the drawer whose cabinet a body is by so many metres, or put a part's own joint to a value."""
        own = int(self.model.body_jntadr[body])
        if own >= 0 and not is_free(self.model, body):
            self.data.qpos[int(self.model.jnt_qposadr[own])] = opening
            return
        for part in np.flatnonzero(self.model.body_parentid == body):
            joint = int(self.model.body_jntadr[part])
            if joint >= 0 and self.model.jnt_type[joint] == mujoco.mjtJoint.mjJNT_SLIDE:
                self.data.qpos[int(self.model.jnt_qposadr[joint])] = opening

    def set_gripper(self, joint: float) -> None:
        """Put the gripper's joints where its primary joint's value puts them."""
        if self.robot.gripper:
            self.data.qpos[self.robot.gripper.joint_indices] = self.robot.gripper.joints_at(joint)

    def hold(self, body: int | None, tcp_to_object: Pose | None = None) -> None:
        """Let an object move with the TCP; None lets go."""
        if body is None or tcp_to_object is None or not is_free(self.model, body):
            self._held = None
        else:
            address = int(self.model.jnt_qposadr[self.model.body_jntadr[body]])
            self._held = (body, address, tcp_to_object.position, tcp_to_object.rotation)
        self._apply_bits()

    def allow(self, bodies: Iterable[int], by_hand: Iterable[int] = ()) -> None:
        """Let movers touch these bodies, and the hand and what it holds some more; replaces what was allowed before."""
        self._allowed[:] = self._by_hand[:] = False
        self._allowed[list(bodies)] = True
        self._by_hand[list(by_hand)] = True
        self._apply_bits()

    def stand(self, q: Array) -> None:
        """Let the robot come as near to things as it is to them at `q` (n,), where that is nearer than the clearance.

        Else one that stands half a clearance from a wall could not leave it.
        """
        self._stood, self._stays_in_touch = q, False
        self._stands, self._near = q, {}

    def stay_in_touch(self, stays: bool = True) -> None:
        """Let the robot touch what it touches where it stands, but no deeper by the clearance; or, with False, no longer."""
        if stays != self._stays_in_touch:
            self._stays_in_touch = stays
            self._stands, self._near = self._stood, {}

    def touch(self, q: Array) -> DeepestContact | None:
        """Return the deepest contact at `q` (n,), or None when it is free."""
        return self._examine(q)[0]

    def is_narrow(self, path: Array, room: float) -> bool:
        """Tell whether a free path (k, n) passes something nearer than `room` metres between coming away and arriving.

        How near its ends are to things is theirs: what is narrow from the start on, or up to the goal, does not count.
        """
        gaps: list[float] = []
        if self._walk(path, gaps) is not None:
            return True
        narrow = [gap < room - self.clearance for gap in gaps]
        while narrow and narrow[0]:
            narrow.pop(0)
        while narrow and narrow[-1]:
            narrow.pop()
        return any(narrow)

    def first_touch(self, path: Array) -> tuple[int, DeepestContact] | None:
        """Return the index of the first touching stretch of `path` (k, n) and its contact.

        Between configurations the joints are taken to move straight. From each configuration the walk goes on by no more
        than the distance to the nearest obstacle, so nothing is stepped over (Schwarzer, Saha and Latombe, 2005, in the
        simple form for one moving chain).
        """
        return self._walk(path, [])

    def _walk(self, path: Array, gaps: list[float]) -> tuple[int, DeepestContact] | None:
        """Walk along a path as `first_touch` says; put what is free around the clearance into `gaps`, metres."""
        travel = [0.0, *np.cumsum(np.abs(np.diff(path, axis=0)) @ self._levers).tolist()]
        at, end, last = 0.0, travel[-1], len(path) - 1
        while True:
            index = min(bisect_right(travel, at) - 1, last)
            q = path[index]
            if at > travel[index] and index < last:
                share = (at - travel[index]) / (travel[index + 1] - travel[index])
                q = q + share * (path[index + 1] - q)
            touch, gap = self._examine(q)
            if touch is not None:
                return index, touch
            gaps.append(gap)
            if at >= end:
                return None
            at = min(end, at + max(gap, self.clearance, _LEAST_STRIDE))

    def _examine(self, q: Array) -> tuple[DeepestContact | None, float]:
        """Return the deepest contact at `q`, and how far it is from the nearest obstacle to the clearance around it."""
        touch, gap = self._look(q)
        if self._stands is None or touch is None or touch.own or (touch.depth > 0.0 and not self._stays_in_touch):
            return touch, gap
        self._near, self._stands = self._near_at(self._stands), None
        return self._look(q) if self._near else (touch, gap)

    def _near_at(self, q: Array) -> dict[tuple[int, int], float]:
        """Return which pairs of bodies are within the clearance at `q`, apart unless they stay in touch, and how near they may come, metres."""
        pairs, distance, own = self._distances(q)
        near: dict[tuple[int, int], float] = {}
        for (first, second), gap in zip(pairs[~own].tolist(), distance[~own].tolist(), strict=True):
            if gap < self.clearance:
                pair = (min(first, second), max(first, second))
                near[pair] = min(near.get(pair, np.inf), gap)
        apart = {pair: max(gap - _REPEATS, 0.0) for pair, gap in near.items() if gap > 0.0}
        if not self._stays_in_touch:
            return apart
        return apart | {pair: gap - self.clearance for pair, gap in near.items() if gap <= 0.0}

    def _look(self, q: Array) -> tuple[DeepestContact | None, float]:
        pairs, distance, own = self._distances(q)
        if not len(pairs):
            return None, _SIGHT
        keep = np.full(len(pairs), self.clearance)
        if self._near:
            keep = np.array([self._near.get((min(pair), max(pair)), self.clearance) for pair in pairs.tolist()])
        # Parts of the robot may come as close as they like; only touching counts.
        depth = np.where(own, -distance, keep - distance)
        worst = int(depth.argmax())
        if depth[worst] <= 0.0:
            return None, float(min(_SIGHT, (distance - keep)[~own].min(initial=_SIGHT)))
        first, second = (int(b) for b in pairs[worst])
        moving = self._robot_body[first] or (self._held is not None and self._with_held()[first])
        body, other = (first, second) if moving else (second, first)
        return DeepestContact(
            self.names[body], self.names[other], float(-distance[worst]), bool({body, other} <= self.robot.bodies)
        ), 0.0

    def _distances(self, q: Array) -> tuple[NDArray[np.int32], Array, NDArray[np.bool_]]:
        """Return the pairs of bodies in sight of each other at `q` (k, 2), metres between them (k,), and which are the robot's own."""
        model, data = self.model, self.data
        self._qpos[self.robot.qpos_indices] = q
        mujoco.mj_kinematics(model, data)
        if self._held is not None:
            self._carry()
        mujoco.mj_collision(model, data)
        if data.ncon == 0:
            return np.empty((0, 2), dtype=np.int32), np.empty(0), np.empty(0, dtype=np.bool_)
        geoms = data.contact.geom
        pairs = model.geom_bodyid[geoms]
        own = np.asarray(self._robot_body[pairs].all(axis=1), dtype=np.bool_)
        distance = self._sharpened(geoms, data.contact.dist, own)
        # Closed fingers touch each other wherever the arm is.
        return pairs, np.where(self._finger[pairs].all(axis=1), _SIGHT, distance), own

    def _sharpened(self, geoms: NDArray[np.int32], distance: Array, own: NDArray[np.bool_]) -> Array:
        """Return the contacts' distances (k,), those of general convex pairs and of two boxes measured anew where they may touch.

        Between such pairs MuJoCo's contacts at a margin may report several millimetres more than there is.
        """
        solids = self._general[geoms].any(axis=1) | self._boxes[geoms].all(axis=1)
        doubtful = solids & ~own & (distance < self.clearance + _DOUBT * _SIGHT)
        if not doubtful.any():
            return distance
        exact = distance.copy()
        measured: dict[tuple[int, int], float] = {}
        for index in np.flatnonzero(doubtful):
            pair = (int(geoms[index, 0]), int(geoms[index, 1]))
            if pair not in measured:
                measured[pair] = mujoco.mj_geomDistance(self.model, self.data, *pair, _SIGHT, None)
            exact[index] = min(distance[index], measured[pair])
        return exact

    def _carry(self) -> None:
        assert self._held is not None
        _, address, offset, rotation = self._held
        position, tcp_rotation = self.robot.tcp(self.data)
        qpos = self._qpos
        qpos[address : address + 3] = position + tcp_rotation @ offset
        mujoco.mju_mat2Quat(qpos[address + 3 : address + 7], (tcp_rotation @ rotation).ravel())
        mujoco.mj_kinematics(self.model, self.data)

    def _with_held(self) -> NDArray[np.bool_]:
        """Return which bodies are what is held, or parts of it, shape (nbody,)."""
        assert self._held is not None
        return np.asarray(self.model.body_rootid == self.model.body_rootid[self._held[0]], dtype=np.bool_)

    def _apply_bits(self) -> None:
        model, bodies = self.model, self.model.geom_bodyid
        movers, obstacles = self._movers, self._obstacles
        model.geom_contype[movers] |= _BIT
        model.geom_contype[self._links] |= _LINK_BIT
        model.geom_contype[obstacles] = 0
        model.geom_conaffinity[obstacles] = _BIT
        sight = max(self.clearance, _SIGHT)
        model.geom_margin[obstacles] = sight
        # Pairs of bodies with several geoms are looked for in trees of boxes, which grow by the margin of the body: with the
        # compiled one, 0, all that is near without touching would be missed.
        model.body_margin[:] = sight
        model.geom_conaffinity[self._by_hand[bodies] & obstacles] = _LINK_BIT
        model.geom_conaffinity[self._allowed[bodies] & obstacles] = 0
        if self._held is not None:
            held = self._with_held()[bodies] & self._solid
            model.geom_contype[held] = _BIT
            model.geom_conaffinity[held] = 0


def _levers(model: mujoco.MjModel, robot: Robot) -> Array:
    """Return, per arm joint, how far any point of what it moves can be from its axis, metres, shape (n,).

    A sum of link lengths, so it holds in every configuration; for a slide joint each point moves as far as the joint.
    """
    reach = np.zeros(model.nbody)
    for geom in range(model.ngeom):
        body = int(model.geom_bodyid[geom])
        if body in robot.bodies:
            reach[body] = max(reach[body], float(np.linalg.norm(model.geom_pos[geom])) + float(model.geom_rbound[geom]))
    for body in range(model.nbody - 1, 0, -1):
        if body in robot.bodies:
            parent = int(model.body_parentid[body])
            slide = sum(
                float(np.abs(model.jnt_range[j]).max())
                for j in range(
                    int(model.body_jntadr[body]), int(model.body_jntadr[body]) + int(model.body_jntnum[body])
                )
                if model.jnt_type[j] == mujoco.mjtJoint.mjJNT_SLIDE
            )
            reach[parent] = max(reach[parent], reach[body] + float(np.linalg.norm(model.body_pos[body])) + slide)
    levers = np.empty(len(robot.joints))
    for index, dof in enumerate(robot.dof_indices):
        joint = int(model.dof_jntid[dof])
        revolute = model.jnt_type[joint] == mujoco.mjtJoint.mjJNT_HINGE
        anchor = float(np.linalg.norm(model.jnt_pos[joint]))
        levers[index] = reach[int(model.jnt_bodyid[joint])] + anchor if revolute else 1.0
    return levers
