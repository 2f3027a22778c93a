"""Random moves of the hand by itself in clutter, judged by the simulated state, refusals by an oracle.

    uv run benchmarks/hand_moves.py --moves 500 [--robot panda] [--seed 0] [--json]

Half of the moves are made with a cube held. A move is right if the tool centre point is within 2 mm and 1 degree of where it was
sent, nothing else has gone 2 mm, and the arm and what it holds touch nothing but each other. A refusal is right unless the oracle
finds a configuration: damped least squares from random starts on MuJoCo's own Jacobian, then MuJoCo's own contacts there. What it
finds may still have no free way to it, so `free` counts refusals that may be wrong.
"""

from __future__ import annotations

import argparse
import json
from collections import Counter
from typing import Any

import mujoco
import numpy as np
from odd_judge import raw_state

from robosandbox import Pose, Scene, SceneObject, open_session
from robosandbox.errors import InputError, SkillError
from robosandbox.sim.mujoco_backend import MuJoCoBackend
from robosandbox.sim.opening import mujoco_behind
from robosandbox.types import Array
from robosandbox.types.robot import RobotSpec
from robosandbox.workcell.embedded import EmbeddedWorkcell

_OFF, _TURNED, _GONE, _SAID = 0.002, 1.0, 0.002, 0.2
_MOVES_A_SCENE = 10
_STARTS, _STEPS, _DAMPING = 40, 80, 1e-3


def clutter(rng: np.random.Generator, spec: RobotSpec) -> Scene:
    """Return a scene of a cube to hold, three pillars and five low boxes, in the reach of a robot and as large as suits it."""
    size = spec.reach[1] / 0.8
    objects: list[SceneObject] = []
    spots: list[tuple[float, float]] = []
    while len(objects) < 9:
        x, y = _somewhere(rng, spec)
        if any(np.hypot(x - a, y - b) < 0.12 * size for a, b in spots):
            continue
        spots.append((x, y))
        wide = 0.012 if not objects else 0.025 * size
        tall = (
            wide
            if not objects
            else size * float(rng.uniform(0.1, 0.18) if len(objects) < 4 else rng.uniform(0.02, 0.05))
        )
        objects.append(
            SceneObject(
                id=f"thing_{len(objects)}" if objects else "cube",
                kind="box",
                size=(wide, wide, tall),
                pose=Pose(xyz=(x, y, 0.0405 + tall)),
                mass=1.0 if objects else 0.03,
            )
        )
    return Scene(objects=tuple(objects))


def _somewhere(rng: np.random.Generator, spec: RobotSpec) -> tuple[float, float]:
    """Return a place on the table within a robot's reach."""
    while True:
        radius, angle = rng.uniform(*spec.reach), rng.uniform(-1.2, 1.2)
        x, y = spec.base_position[:2] + radius * np.array([np.cos(angle), np.sin(angle)])
        if abs(x) < 0.45 and abs(y) < 0.45:
            return float(x), float(y)


class Oracle:
    """Searches configurations of a world's arm with MuJoCo alone.

    Args:
        world: Whose arm, and all around it as it stands.
        held: Id of what it holds.
    """

    def __init__(self, world: MuJoCoBackend, held: str | None) -> None:
        self._world, self._robot, self._model = world, world.robot, world.model
        self._data = raw_state(world, mujoco.MjData(world.model))
        self._held = held

    def finds_free(self, position: Array, rotation: Array, rng: np.random.Generator) -> bool:
        """Tell whether some configuration has the tool centre point there and touches nothing."""
        starts = [self._robot.home_q, *rng.uniform(self._low(), self._high(), (_STARTS, len(self._robot.home_q)))]
        return any(
            q is not None and self._is_free(q) for q in (self._solve(start, position, rotation) for start in starts)
        )

    def _low(self) -> Array:
        return np.maximum(self._robot.lower, -np.pi)

    def _high(self) -> Array:
        return np.minimum(self._robot.upper, np.pi)

    def _solve(self, q: Array, position: Array, rotation: Array) -> Array | None:
        robot, model, data = self._robot, self._model, self._data
        site = model.site(robot.tcp_site).id
        jacobian = np.zeros((6, model.nv))
        for _ in range(_STEPS):
            data.qpos[robot.qpos_indices] = q
            mujoco.mj_kinematics(model, data)
            mujoco.mj_comPos(model, data)
            now = data.site_xmat[site].reshape(3, 3) @ robot.R_site_tcp
            turn = np.zeros(3)
            quat = np.zeros(4)
            mujoco.mju_mat2Quat(quat, (rotation @ now.T).ravel())
            mujoco.mju_quat2Vel(turn, quat, 1.0)
            error = np.concatenate([position - data.site_xpos[site], turn])
            if np.linalg.norm(error[:3]) < 0.5 * _OFF and np.degrees(np.linalg.norm(turn)) < 0.5 * _TURNED:
                return q
            mujoco.mj_jacSite(model, data, jacobian[:3], jacobian[3:], site)
            arm = jacobian[:, robot.dof_indices]
            step = arm.T @ np.linalg.solve(arm @ arm.T + _DAMPING * np.eye(6), error)
            q = np.clip(q + step, robot.lower, robot.upper)
        return None

    def _is_free(self, q: Array) -> bool:
        model, data = self._model, self._data
        before = data.qpos.copy()
        data.qpos[self._robot.qpos_indices] = q
        if self._held is not None:
            # What is held is taken along by where it is in the hand.
            self._carry(before)
        mujoco.mj_forward(model, data)
        free = not _touching(self._world, data, self._held, itself=True)
        data.qpos[:] = before
        return free

    def _carry(self, before: Array) -> None:
        model, data = self._model, self._data
        after = data.qpos.copy()
        site = model.site(self._robot.tcp_site).id
        data.qpos[:] = before
        mujoco.mj_kinematics(model, data)
        rotation, point = data.site_xmat[site].reshape(3, 3).copy(), data.site_xpos[site].copy()
        body = model.body(f"object/{self._held}").id
        local, turned = rotation.T @ (data.xpos[body] - point), rotation.T @ data.xmat[body].reshape(3, 3)
        data.qpos[:] = after
        mujoco.mj_kinematics(model, data)
        rotation, point = data.site_xmat[site].reshape(3, 3), data.site_xpos[site]
        start = model.jnt_qposadr[model.body_jntadr[body]]
        quat = np.zeros(4)
        mujoco.mju_mat2Quat(quat, (rotation @ turned).ravel())
        data.qpos[start : start + 7] = [*(point + rotation @ local), *quat]


def _touching(world: MuJoCoBackend, data: mujoco.MjData, held: str | None, *, itself: bool = False) -> list[str]:
    """Return pairs that touch, one of which is of the arm beyond its base or what it holds, and the other neither.

    With `itself` also two parts of the arm; what is held touches the hand anyway.
    """
    model = world.model
    first = int(model.jnt_bodyid[model.dof_jntid[world.robot.dof_indices[0]]])
    mine_held = {model.body(f"object/{held}").id} if held else set()
    mine = set(mine_held)
    for body in range(first, model.nbody):
        if body == first or int(model.body_parentid[body]) in mine:
            mine.add(body)
    found = []
    for contact in data.contact[: data.ncon]:
        pair = [int(model.geom_bodyid[geom]) for geom in (contact.geom1, contact.geom2)]
        own = itself and set(pair) <= mine - mine_held
        if contact.dist < 0.0 and ((pair[0] in mine) != (pair[1] in mine) or own):
            found.append(f"{model.body(pair[0]).name} on {model.body(pair[1]).name}")
    return found


def move(cell: EmbeddedWorkcell, held: str | None, rng: np.random.Generator) -> dict[str, Any]:
    """Make a random move and return what came of it."""
    world = mujoco_behind(cell.driver)
    assert world is not None
    spec = cell.driver.arms["arm"].spec
    radius, angle = 1.1 * rng.uniform(0.1, 1.0) * spec.reach[1], rng.uniform(-1.2, 1.2)
    point = spec.base_position + np.array([radius * np.cos(angle), radius * np.sin(angle), 0.0])
    asked = {
        "x": float(point[0]),
        "y": float(point[1]),
        "z": float(0.05 + rng.uniform(0.0, 0.6) * spec.reach[1]),
        "heading": float(rng.uniform(-np.pi, np.pi)),
        "tilt": float(rng.uniform(0.0, 1.2) if rng.random() < 0.5 else 0.0),
        "towards": float(rng.uniform(-np.pi, np.pi)),
    }
    before = {item.id: item.pose.position for item in cell.truth().objects.values()}
    goal = _pose(asked)
    try:
        told = cell.do("move_to", **asked).detail
    except SkillError as error:
        rotation = goal.rotation
        free = Oracle(world, held).finds_free(goal.position, rotation, rng)
        return {"asked": asked, "outcome": "refused", "code": error.code, "free": free, "said": str(error)}
    there = cell.driver.arms["arm"].state().tcp_pose
    turn = np.degrees(np.arccos(np.clip((np.trace(goal.rotation.T @ there.rotation) - 1.0) / 2.0, -1.0, 1.0)))
    gone = {
        item.id: float(np.linalg.norm(item.pose.position - before[item.id]))
        for item in cell.truth().objects.values()
        if item.id != held
    }
    off = float(np.linalg.norm(there.position - goal.position))
    touching = _touching(world, raw_state(world, mujoco.MjData(world.model)), held)
    right = off < _OFF and max(gone.values()) < _GONE and not touching
    # An arm of fewer than six joints gives up some of the turn, and says how much.
    given_up = spec.n < 6 and abs(turn - float(told["off_deg"])) < _SAID
    return {
        "asked": asked,
        "outcome": "wrong" if not right else "done" if turn < _TURNED else "turned" if given_up else "wrong",
        "off_mm": 1e3 * off,
        "off_deg": float(turn),
        "gone_mm": 1e3 * max(gone.values()),
        "touching": touching,
    }


def _pose(asked: dict[str, float]) -> Pose:
    """Return the pose that `move_to` documents, by quaternions of its own."""
    heading, tilt, towards = asked["heading"], asked["tilt"], asked["towards"]
    closing = np.array([np.cos(heading), np.sin(heading), 0.0])
    down = np.array([0.0, 0.0, -1.0])
    rotation = np.column_stack([np.cross(closing, down), closing, down])
    quat, turned, matrix = np.zeros(4), np.zeros(4), np.zeros(9)
    # About the horizontal axis by which straight down turns towards the direction.
    axis = np.cross(down, [np.cos(towards), np.sin(towards), 0.0])
    mujoco.mju_axisAngle2Quat(quat, axis, tilt)
    mujoco.mju_mat2Quat(turned, rotation.ravel())
    result = np.zeros(4)
    mujoco.mju_mulQuat(result, quat, turned)
    mujoco.mju_quat2Mat(matrix, result)
    return Pose.from_matrix(np.array([asked["x"], asked["y"], asked["z"]]), matrix.reshape(3, 3))


def main() -> None:
    """Make the moves and print the counts."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--moves", type=int, default=500)
    parser.add_argument("--robot", default=None)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--json", action="store_true")
    given = parser.parse_args()
    rows: list[dict[str, Any]] = []
    scene = 0
    with open_session(task=Scene(objects=()), robot=given.robot) as empty:
        spec = empty.driver.arms["arm"].spec
    while len(rows) < given.moves:
        rng = np.random.default_rng([given.seed, scene])
        holding = scene % 2 == 1
        scene += 1
        try:
            opened = open_session(task=clutter(rng, spec), robot=given.robot, what_if=False)
        except InputError:
            # A pillar stands where the arm does at home.
            continue
        with opened as cell:
            if holding:
                try:
                    cell.do("pick", object="cube")
                except SkillError:
                    continue
            for _ in range(min(_MOVES_A_SCENE, given.moves - len(rows))):
                rows.append(move(cell, "cube" if holding else None, rng) | {"scene": scene - 1, "held": holding})
    counts = Counter(row["outcome"] for row in rows)
    refused = Counter((row["code"], row["free"]) for row in rows if row["outcome"] == "refused")
    if given.json:
        print(json.dumps(rows))
        return
    print(f"{len(rows)} moves: {counts['done']} done, {counts['wrong']} wrong, {counts['refused']} refused")
    if turned := [row["off_deg"] for row in rows if row["outcome"] == "turned"]:
        print(
            f"  {len(turned)} done but for a turn that the arm cannot make and tells: {max(turned):.1f} degrees at most"
        )
    for (code, free), count in sorted(refused.items()):
        print(f"  refused as {code}: {count}{' although the oracle found a free configuration' if free else ''}")
    for row in rows:
        if row["outcome"] == "wrong" or row.get("free"):
            print(" ", {key: value for key, value in row.items() if key != "said"}, row.get("said", ""))


if __name__ == "__main__":
    main()
