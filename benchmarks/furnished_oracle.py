"""Proofs that a refusal in a furnished scene is right: conditions without which no arm could do it, looked at with kinematics of its own.

What stands freely is left out, as it could be put aside. A hand that holds a thing keeps its lean to the thing from where it is taken to where
it is left, so that one lean has to do for both. Coarse: so many headings, leans and places; a refusal of which every condition
holds is not proved, nor is it wrong.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator

import mujoco
import numpy as np
from furnished_judge import BESIDE, RESTS, geoms_of, is_fixed, robot_bodies
from furnished_scenes import HALF_OPENING, TABLE, Array, Furnished, Goal, Space
from odd_judge import raw_state

from robosandbox.sim.mujoco_backend import MuJoCoBackend

# Leans of the approach from straight down to level, headings around, and places in a space that are tried.
_LEANS = np.radians((0.0, 30.0, 60.0, 90.0))
_HEADINGS = np.arange(8) * math.pi / 4.0
_GRID = 4
# Metres and radians within which the hand is there; metres that what touches may be inside one another.
_NEAR, _TURNED, _TOUCH = 0.004, 0.03, 0.003


class Oracle:
    """Conditions of what is asked in one state of a world.

    Args:
        sim: The world as it was when it was asked.
        room: The scene.
    """

    def __init__(self, sim: MuJoCoBackend, room: Furnished) -> None:
        self._room, self._sim, self._model = room, sim, sim.model
        self._data = raw_state(sim, mujoco.MjData(sim.model))
        self._robot = robot_bodies(sim)
        self._q = np.asarray(sim.robot.qpos_indices)
        joints = [int(np.flatnonzero(self._model.jnt_qposadr == address)[0]) for address in self._q]
        self._dofs = self._model.jnt_dofadr[joints]
        self._range = self._model.jnt_range[joints]
        self._home = np.asarray(sim.robot.home_q)
        # The middle between the fingertips in the hand's frame; the hand approaches along its z and closes along its y.
        self._hand = int(self._model.body("robot/hand").id)
        self._tcp = np.array([0.0, 0.0, 0.1034])
        self._things = {int(self._model.body(name).id) for name in room.things}

    def impossible(self, goal: Goal) -> str:
        """Return why what is asked cannot be; "" where that is not proved."""
        if goal.subject in self._room.joints:
            return self._of_part(goal)
        half = self._room.things[goal.subject]
        is_hollow = goal.subject.endswith(("mug", "bowl"))
        if not is_hollow and min(half) > HALF_OPENING:
            return "too wide for the fingers"
        body = int(self._model.body(goal.subject).id)
        at = self._data.xpos[body].copy()
        door = self._shut_door_before(goal)
        if door and (why := self._of_part(Goal(relation="open", subject=door, said=""))):
            return f"{door}: {why}"
        picks = [lean for lean in _LEANS if self._reaches(self._grasps(at, half, lean, is_hollow), lean)]
        if not picks:
            return "no hand reaches it"
        spots = list(self._free_spots(goal, half))
        if not spots:
            return "no room there"
        for lean in picks:
            if any(self._reaches(self._grasps(spot, half, lean, is_hollow), lean) for spot in spots):
                return ""
        return "no hand reaches both with one lean"

    # Parts.

    def _of_part(self, goal: Goal) -> str:
        room, model, data = self._room, self._model, self._data
        joint = room.joints[goal.subject]
        if joint.locked:
            return "locked"
        body = int(model.body(joint.body).id)
        address = int(model.jnt_qposadr[model.joint(joint.name).id])
        start = float(data.qpos[address])
        shares = {"open": 0.5, "closed": 0.05, "pressed": 0.7}
        end = joint.shut + shares[goal.relation] * (joint.far - joint.shut)
        if goal.relation != "pressed":
            for value in np.linspace(start, end, 16):
                data.qpos[address] = value
                mujoco.mj_kinematics(model, data)
                mujoco.mj_collision(model, data)
                met = self._met({body}, depth=_TOUCH)
                if met:
                    data.qpos[address] = start
                    return f"{met} is in its way"
            data.qpos[address] = start
            mujoco.mj_kinematics(model, data)
        points = [data.geom_xpos[geom].copy() for geom in geoms_of(model, body)]
        points += [self._corner(geom, sign) for geom in geoms_of(model, body)[:1] for sign in (-1.0, 1.0)]
        for lean in _LEANS:
            for clear in (0.0, 0.02):
                if self._reaches(points, lean, clear=clear + self._thick(body)):
                    return ""
        return "no hand reaches it"

    def _corner(self, geom: int, sign: float) -> Array:
        turn, size = self._data.geom_xmat[geom].reshape(3, 3), self._model.geom_size[geom]
        return np.asarray(self._data.geom_xpos[geom] + sign * 0.8 * size[1] * turn[:, 1])

    def _thick(self, body: int) -> float:
        return float(min(self._model.geom_size[geom][:2].min() for geom in geoms_of(self._model, body)))

    def _shut_door_before(self, goal: Goal) -> str:
        door = self._room.doors.get(goal.target, "")
        if not door:
            return ""
        joint = self._room.joints[door]
        value = float(self._data.qpos[self._model.jnt_qposadr[self._model.joint(joint.name).id]])
        return door if (value - joint.shut) / (joint.far - joint.shut) < 0.5 else ""

    # Places and grasps.

    def _grasps(self, at: Array, half: tuple[float, float, float], lean: float, is_hollow: bool) -> list[Array]:
        """Return points at which a hand might hold a thing whose foot is at a place."""
        up, out = np.array([0.0, 0.0, 2.0 * half[2]]), max(half[:2])
        points = [at + share * up for share in (0.5, 0.9)]
        if is_hollow:
            points += [at + 0.95 * up + out * np.array([math.cos(t), math.sin(t), 0.0]) for t in _HEADINGS[::2]]
        elif lean > 1.0:
            points += [at + 0.5 * up + 0.5 * out * np.array([math.cos(t), math.sin(t), 0.0]) for t in _HEADINGS[::2]]
        return points

    def _free_spots(self, goal: Goal, half: tuple[float, float, float]) -> Iterator[Array]:
        """Yield places of a thing's foot in the world at which its box meets nothing fixed."""
        room, data = self._room, self._data
        if goal.relation == "at":
            # On the table, which is what is meant where no other height is said.
            is_there = self._is_over(room.spaces[TABLE], goal.xy)
            found: Iterable[Array] = [np.array([*goal.xy, room.height])] if is_there else []
        elif goal.relation == "beside":
            other = data.body(goal.target).xpos
            far = max(half[:2]) + max(room.things[goal.target][:2]) + 0.03
            ways = {"left": (0, 1, 0), "right": (0, -1, 0), "front": (-1, 0, 0), "back": (1, 0, 0)}
            # As near as they can be, off to a side by nearly as much as along, and as far off as is still beside.
            close = (min(half[:2]) + min(room.things[goal.target][:2])) / math.sqrt(2.0)
            most = math.hypot(*half[:2]) + math.hypot(*room.things[goal.target][:2]) + BESIDE
            way = np.array(ways[goal.side])
            tried = [
                other + s * (way + aside * np.cross(way, (0.0, 0.0, 1.0)))
                for s in (close, far, far + 0.03, far + 0.06)
                for aside in (0.0, -0.9, 0.9)
            ]
            found = [spot for spot in tried if np.linalg.norm(spot - other) < most and self._is_held(spot)]
        else:
            names = [goal.target]
            if goal.target == "shelf" and goal.relation == "inside":
                names = [name for name in room.spaces if name.startswith("in shelf")]
            found = [spot for name in names for spot in self._spots_in(room.spaces[name], half)]
        for spot in found:
            if not self._is_blocked(spot, half, goal):
                yield spot

    def _is_held(self, spot: Array) -> bool:
        """Tell whether what stands at a place has its middle over a face at the height of that place."""
        for space in self._room.spaces.values():
            frame = self._data.body(space.body)
            floor = float((frame.xpos + frame.xmat.reshape(3, 3) @ np.array([0.0, 0.0, space.low[2]]))[2])
            if abs(floor - float(spot[2])) < RESTS and self._is_over(space, (float(spot[0]), float(spot[1]))):
                return True
        return False

    def _is_over(self, space: Space, xy: tuple[float, float]) -> bool:
        frame = self._data.body(space.body)
        local = frame.xmat.reshape(3, 3).T @ (np.array([*xy, 0.0]) - frame.xpos)
        return bool((local[:2] > space.low[:2]).all() and (local[:2] < space.high[:2]).all())

    def _spots_in(self, space: Space, half: tuple[float, float, float]) -> Iterator[Array]:
        low, high = np.array(space.low), np.array(space.high)
        if high[2] - low[2] < 2.0 * half[2]:
            return
        frame, turn = self._data.body(space.body).xpos, self._data.body(space.body).xmat.reshape(3, 3)
        side = min(half[:2])
        ends = [(low[k] + side, high[k] - side) for k in range(2)]
        if any(a > b for a, b in ends):
            return
        # The shut drawer's place is where it will be when it is open.
        out = self._out_of(space.body)
        for x in np.linspace(*ends[0], _GRID):
            for y in np.linspace(*ends[1], _GRID):
                yield frame + out + turn @ np.array([x, y, low[2]])

    def _out_of(self, body: str) -> Array:
        for part, joint in self._room.joints.items():
            if joint.body == body and part.startswith("cabinet."):
                index = self._model.joint(joint.name).id
                value = float(self._data.qpos[self._model.jnt_qposadr[index]])
                return np.asarray(self._data.xaxis[index] * (0.9 * joint.far - value))
        return np.zeros(3)

    def _is_blocked(self, spot: Array, half: tuple[float, float, float], goal: Goal) -> bool:
        """Tell whether a thing at a place meets something fixed, in the turn that it has and in another."""
        model, data = self._model, self._data
        body = int(model.body(goal.subject).id)
        address = int(model.jnt_qposadr[model.body_jntadr[body]])
        before = data.qpos[address : address + 7].copy()
        try:
            for turn in np.arange(4) * math.pi / 4.0:
                data.qpos[address : address + 3] = spot + [0.0, 0.0, 0.002]
                data.qpos[address + 3 : address + 7] = math.cos(turn / 2.0), 0.0, 0.0, math.sin(turn / 2.0)
                mujoco.mj_kinematics(model, data)
                mujoco.mj_collision(model, data)
                if not self._met({body}, depth=_TOUCH, parts=False) and not (
                    goal.relation in ("at", "beside") and self._is_in_a_part(body)
                ):
                    return False
            return True
        finally:
            data.qpos[address : address + 7] = before
            mujoco.mj_kinematics(model, data)

    def _is_in_a_part(self, thing: int) -> bool:
        """Tell whether a thing where it is reaches into a door, drawer or button at all of some values of that one's joint, from shut to far."""
        model, data = self._model, self._data
        for joint in self._room.joints.values():
            body, address = int(model.body(joint.body).id), int(model.jnt_qposadr[model.joint(joint.name).id])
            before = float(data.qpos[address])
            values = (before,) if joint.locked else (before, *np.linspace(joint.shut, joint.far, 9))
            met = True
            for value in values:
                data.qpos[address] = value
                mujoco.mj_kinematics(model, data)
                mujoco.mj_collision(model, data)
                met = met and any(
                    contact.dist <= -_TOUCH and {int(model.geom_bodyid[geom]) for geom in contact.geom} == {thing, body}
                    for contact in data.contact
                )
            data.qpos[address] = before
            mujoco.mj_kinematics(model, data)
            if met:
                return True
        return False

    def _met(self, bodies: set[int], depth: float, *, parts: bool = True) -> str:
        """Return what fixed thing, or which part, some bodies reach into by more than a depth; "" for none."""
        model = self._model
        for contact in self._data.contact:
            if contact.dist > -depth:
                continue
            a, b = (int(model.geom_bodyid[geom]) for geom in contact.geom)
            for own, other in ((a, b), (b, a)):
                if own not in bodies or other in bodies or other in self._robot or other in self._things:
                    continue
                if is_fixed(model, other) or parts:
                    return str(model.body(other).name)
        return ""

    # The arm.

    def _reaches(self, points: Iterable[Array], lean: float, clear: float = 0.0) -> bool:
        """Tell whether the hand can be at one of some points with a lean, from any heading, reaching into nothing that is fixed."""
        for point in points:
            for heading in _HEADINGS:
                for spin in (0.0, math.pi / 2.0):
                    rotation = _hand(lean, float(heading), spin)
                    q = self._solve(point - clear * rotation[:, 2], rotation)
                    if q is not None and not self._touches():
                        return True
        return False

    def _touches(self) -> bool:
        mujoco.mj_collision(self._model, self._data)
        return bool(self._met(set(self._robot), depth=_TOUCH, parts=False))

    def _solve(self, point: Array, rotation: Array) -> Array | None:
        """Return a configuration by damped least squares from two starts; the data is left there."""
        model, data = self._model, self._data
        base = data.xpos[min(self._robot)]
        if np.linalg.norm(point - base) > 1.2:
            return None
        jp, jr = np.zeros((3, model.nv)), np.zeros((3, model.nv))
        turned = self._home.copy()
        turned[0] = math.atan2(point[1] - base[1], point[0] - base[0])
        for start in (turned, turned + np.array([0.0, 0.3, 0.0, -0.4, 0.0, 0.6, 1.2])[: len(turned)]):
            q = np.clip(start, *self._range.T)
            for _ in range(40):
                data.qpos[self._q] = q
                mujoco.mj_kinematics(model, data)
                mujoco.mj_comPos(model, data)
                turn = data.xmat[self._hand].reshape(3, 3)
                tip = data.xpos[self._hand] + turn @ self._tcp
                off = rotation @ turn.T
                error = np.concatenate([point - tip, _rotation_vector(off)])
                if np.linalg.norm(error[:3]) < _NEAR and np.linalg.norm(error[3:]) < _TURNED:
                    return np.asarray(q)
                mujoco.mj_jac(model, data, jp, jr, tip, self._hand)
                jac = np.vstack([jp[:, self._dofs], jr[:, self._dofs]])
                step = jac.T @ np.linalg.solve(jac @ jac.T + 1e-3 * np.eye(6), error)
                q = np.clip(q + np.clip(step, -0.4, 0.4), *self._range.T)
        return None


def _hand(lean: float, heading: float, spin: float) -> Array:
    """Return the hand's frame: z along the approach, which leans from straight down towards a heading."""
    z = np.array([math.sin(lean) * math.cos(heading), math.sin(lean) * math.sin(heading), -math.cos(lean)])
    y = np.array([-math.sin(heading), math.cos(heading), 0.0])
    x = np.cross(y, z)
    frame = np.column_stack([x, y, z])
    c, s = math.cos(spin), math.sin(spin)
    return np.asarray(frame @ np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]]))


def _rotation_vector(matrix: Array) -> Array:
    quat, found = np.zeros(4), np.zeros(3)
    mujoco.mju_mat2Quat(quat, matrix.flatten())
    mujoco.mju_quat2Vel(found, quat, 1.0)
    return found
