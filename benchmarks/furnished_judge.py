"""True state of a furnished scene, and what the robot pressed: from the raw state of MuJoCo and the drawing.

Nothing here is shared with skills, relations or the task's judge.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import mujoco
import numpy as np
from furnished_scenes import TABLE, Array, Furnished, Goal, Space
from odd_judge import raw_state

from robosandbox.sim.mujoco_backend import MuJoCoBackend

# Shares of its way from which on a part is open, and was pressed; metres that no point of it may be from shut where it is closed.
OPEN, PRESSED, CLOSED = 0.5, 0.7, 0.003
# Metres: how far a thing's lowest point may be from the face that it stands on, how far from its place for "at", how wide a gap
# still is beside, how far a thing may drift in the second that is waited, and what is granted besides.
RESTS, AT, BESIDE, DRIFT, SLACK = 0.006, 0.015, 0.10, 0.004, 0.002
# N: the least with which one thing bears another.
_BEARS = 0.02
_SIDES = {"left": (0.0, 1.0), "right": (0.0, -1.0), "front": (-1.0, 0.0), "back": (1.0, 0.0)}


def robot_bodies(sim: MuJoCoBackend) -> frozenset[int]:
    """Return the bodies of the robot."""
    return frozenset(int(body) for body in sim.world.robot.bodies)


def is_fixed(model: mujoco.MjModel, body: int) -> bool:
    """Tell whether a body moves by no joint."""
    return int(model.body_weldid[body]) == 0


def pushes(sim: MuJoCoBackend, data: mujoco.MjData) -> dict[tuple[int, int], Array]:
    """Return the net force with which one body presses another, N in the world, by (who, whom); all of the robot is -1."""
    model, robot, found = sim.model, robot_bodies(sim), dict[tuple[int, int], Array]()
    local = np.zeros(6)
    for index in range(data.ncon):
        contact = data.contact[index]
        a, b = (-1 if body in robot else body for body in (int(model.geom_bodyid[geom]) for geom in contact.geom))
        if a == b:
            continue
        mujoco.mj_contactForce(model, data, index, local)
        force = contact.frame.reshape(3, 3).T @ local[:3]
        for pair, signed in (((a, b), force), ((b, a), -force)):
            found[pair] = found.get(pair, np.zeros(3)) + signed
    return found


@dataclass
class Meter:
    """A listener to control ticks: the largest forces of the robot, and how far in what is pressed went.

    Attributes:
        sim: The world.
        room: The scene.
        fixed: The most that it pressed something fixed with, N, and what.
        part: The same of what turns or slides.
        thing: The same of a thing; the two sides of a grip cancel.
        carried: The same of a thing that it holds, on what is fixed.
        deepest: The largest share of its way of each part.
    """

    sim: MuJoCoBackend
    room: Furnished
    fixed: tuple[float, str] = (0.0, "")
    part: tuple[float, str] = (0.0, "")
    thing: tuple[float, str] = (0.0, "")
    carried: tuple[float, str] = (0.0, "")
    deepest: dict[str, float] = field(default_factory=dict)
    _data: mujoco.MjData | None = field(default=None, repr=False)

    def __call__(self) -> None:
        """Look at the contacts of this tick."""
        self._data = self._data or mujoco.MjData(self.sim.model)
        model, data = self.sim.model, raw_state(self.sim, self._data)
        found = pushes(self.sim, data)
        held = {whom for who, whom in found if who == -1}
        for (who, whom), force in found.items():
            size, name = float(np.linalg.norm(force)), model.body(whom).name if whom >= 0 else "robot"
            if whom >= 0 and who == -1:
                kind = "fixed" if is_fixed(model, whom) else "thing" if name in self.room.things else "part"
            elif who in held and whom >= 0 and is_fixed(model, whom) and model.body(who).name in self.room.things:
                kind = "carried"
            else:
                continue
            if size > getattr(self, kind)[0]:
                setattr(self, kind, (size, name))
        for part in self.room.joints:
            self.deepest[part] = max(self.deepest.get(part, 0.0), share(self.room, part, model, data))


def share(room: Furnished, part: str, model: mujoco.MjModel, data: mujoco.MjData) -> float:
    """Return the share of its way by which a part is open."""
    joint = room.joints[part]
    value = float(data.qpos[model.jnt_qposadr[model.joint(joint.name).id]])
    return (value - joint.shut) / (joint.far - joint.shut)


def _gap(room: Furnished, part: str, model: mujoco.MjModel, data: mujoco.MjData) -> float:
    """Return how far the outermost point of a part has gone from where it is shut, metres."""
    joint = room.joints[part]
    number = model.joint(joint.name).id
    gone = share(room, part, model, data) * abs(joint.far - joint.shut)
    if model.jnt_type[number] == mujoco.mjtJoint.mjJNT_SLIDE:
        return gone
    points = corners(model, data, int(model.body(joint.body).id)) - data.xanchor[number]
    return gone * float(np.linalg.norm(np.cross(points, data.xaxis[number]), axis=1).max())


def geoms_of(model: mujoco.MjModel, body: int) -> range:
    """Return the geoms of a body."""
    first = int(model.body_geomadr[body])
    return range(first, first + int(model.body_geomnum[body]))


def corners(model: mujoco.MjModel, data: mujoco.MjData, body: int) -> Array:
    """Return the corners of the boxes around a body's geoms in the world, metres, shape (n, 3)."""
    signs = np.array([(a, b, c) for a in (-1.0, 1.0) for b in (-1.0, 1.0) for c in (-1.0, 1.0)])
    return np.vstack(
        [
            data.geom_xpos[geom]
            + (model.geom_aabb[geom, :3] + signs * model.geom_aabb[geom, 3:]) @ data.geom_xmat[geom].reshape(3, 3).T
            for geom in geoms_of(model, body)
        ]
    )


def lowest(model: mujoco.MjModel, data: mujoco.MjData, body: int) -> float:
    """Return the height of a body's lowest point, metres: of boxes and cylinders."""
    low = np.inf
    for geom in geoms_of(model, body):
        down, size = -data.geom_xmat[geom].reshape(3, 3)[2], model.geom_size[geom]
        if int(model.geom_type[geom]) == mujoco.mjtGeom.mjGEOM_BOX:
            reach = float(np.abs(down) @ size)
        else:
            reach = float(size[0] * np.hypot(down[0], down[1]) + size[1] * abs(down[2]))
        low = min(low, float(data.geom_xpos[geom][2]) - reach)
    return low


def middle(model: mujoco.MjModel, data: mujoco.MjData, body: int) -> Array:
    """Return the middle of the box around a body's geoms along its own axes in the world, a mug's handle included."""
    turn = data.xmat[body].reshape(3, 3)
    local = (corners(model, data, body) - data.xpos[body]) @ turn
    return np.asarray(data.xpos[body] + turn @ ((local.min(axis=0) + local.max(axis=0)) / 2.0))


def gap(model: mujoco.MjModel, data: mujoco.MjData, a: int, b: int) -> float:
    """Return the distance of two bodies, metres."""
    line = np.zeros(6)
    return min(
        mujoco.mj_geomDistance(model, data, g, h, 1.0, line) for g in geoms_of(model, a) for h in geoms_of(model, b)
    )


def is_within(space: Space, model: mujoco.MjModel, data: mujoco.MjData, thing: str) -> bool:
    """Tell whether the middle of a thing is over the floor of a space and under its ceiling, and the thing stands on that floor."""
    frame, body = data.body(space.body), int(model.body(thing).id)
    turn = frame.xmat.reshape(3, 3)
    middle = turn.T @ (data.xipos[body] - frame.xpos)
    floor = float((frame.xpos + turn @ np.array([0.0, 0.0, space.low[2]]))[2])
    return (
        bool((middle > space.low).all() and (middle < space.high).all())
        and abs(lowest(model, data, body) - floor) < RESTS
    )


def done(sim: MuJoCoBackend, room: Furnished, goal: Goal, meter: Meter) -> bool:
    """Tell whether what was asked is so now and a second on; a press, whether there was one.

    Args:
        sim: A copy of the world: time passes.
        room: The scene.
        goal: What was asked.
        meter: What it saw meanwhile.
    """
    if goal.relation == "pressed":
        return meter.deepest.get(goal.subject, 0.0) >= PRESSED
    data, model = mujoco.MjData(sim.model), sim.model
    first = so(sim, room, goal, raw_state(sim, data))
    body = model.body(goal.subject).id if goal.subject in room.things else None
    before = None if body is None else data.xpos[body].copy()
    sim.wait(1.0)
    last = so(sim, room, goal, raw_state(sim, data))
    return first and last and (before is None or float(np.linalg.norm(data.xpos[body] - before)) < DRIFT)


def so(sim: MuJoCoBackend, room: Furnished, goal: Goal, data: mujoco.MjData) -> bool:
    """Tell whether a relation holds in a state whose contacts are computed."""
    model = sim.model
    if goal.subject in room.joints:
        open_by = share(room, goal.subject, model, data)
        return open_by >= OPEN if goal.relation == "open" else _gap(room, goal.subject, model, data) <= CLOSED
    body, found = int(model.body(goal.subject).id), pushes(sim, data)
    if np.linalg.norm(found.get((-1, body), np.zeros(3))) > _BEARS or (-1, body) in found:
        return False
    if goal.relation == "at":
        off = float(np.linalg.norm(middle(model, data, body)[:2] - goal.xy))
        return off < AT + SLACK and is_within(room.spaces[TABLE], model, data, goal.subject)
    if goal.relation == "beside":
        other = int(model.body(goal.target).id)
        way = data.xpos[body][:2] - data.xpos[other][:2]
        levels = abs(lowest(model, data, body) - lowest(model, data, other))
        along = float(way @ _SIDES[goal.side])
        return (
            along > 0.0
            and along > abs(float(way @ np.array([[0.0, 1.0], [1.0, 0.0]]) @ _SIDES[goal.side])) - 0.01
            and gap(model, data, body, other) < BESIDE + SLACK
            and levels < RESTS
        )
    names = [goal.target]
    if goal.target == "shelf":
        # What stands on any of its boards is on the shelf.
        names = [name for name in room.spaces if name.startswith("in shelf")] + ["shelf"] * (goal.relation == "on")
    for name in names:
        space = room.spaces[name]
        holder = int(model.body(space.body).id)
        bears = float(found.get((holder, body), np.zeros(3))[2]) > _BEARS
        if bears and is_within(space, model, data, goal.subject):
            return True
    return False


def moved(before: dict[str, Array], now: dict[str, Array], named: set[str]) -> tuple[float, str]:
    """Return the farthest that something moved that was not named, metres, and what."""
    return max(
        ((float(np.linalg.norm(now[name] - at)), name) for name, at in before.items() if name not in named),
        default=(0.0, ""),
    )


def places(sim: MuJoCoBackend, room: Furnished) -> dict[str, Array]:
    """Return where the things are, metres."""
    data = raw_state(sim, mujoco.MjData(sim.model))
    return {name: data.body(name).xpos.copy() for name in room.things}
