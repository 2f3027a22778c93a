"""Whether a mesh could have been picked up: pairs of points that face away from each other, tried on copies of the true world.

Points are drawn evenly from the surface of what collides. Two whose normals lie along the line between them, and no farther apart
than fingers open, are a closing line; the hand comes at several angles about it. Where the hand touches nothing but what it is
to hold, fingers are closed in a simulation and the thing is lifted. Nothing is shared with the grasp planner.
"""

from __future__ import annotations

import math
from collections.abc import Iterator

import mujoco
import numpy as np
from odd_judge import forces, lowest, places, raw_state
from odd_oracle import try_grasp
from odd_scenes import Odd

from robosandbox.motion.planning_scene import PlanningScene
from robosandbox.sim.intervention import Intervention
from robosandbox.sim.mujoco_backend import MuJoCoBackend

_POINTS = 700  # Drawn from the surface.
_ALONG = 0.94  # Cosine between a normal and the closing line: friction of 1 holds at 0.71.
_LEAST, _MOST = 0.002, 0.074  # Metres between the points; an open hand has 80 mm.
_ANGLES = np.radians([0.0, 20.0, -20.0, 40.0, -40.0, 60.0, -60.0, 80.0, -80.0])
_DEPTHS = (0.0, -0.012)  # Metres by which the TCP lies behind the points.
_PAIRS = 120  # Closing lines that are looked at.
_SQUEEZE = 0.004  # Metres that the fingers are open beyond the points where the hand is looked at.


def can_hold(sim: MuJoCoBackend, odd: Odd, planning: PlanningScene, *, trials: int = 40) -> bool:
    """Tell whether some grasp of so many holds the subject and lifts it.

    Args:
        sim: The world at the start; it is left as it is.
        odd: The scene.
        planning: The arm's kinematics there.
        trials: The most grasps that are simulated.
    """
    start = places(sim)
    bottom = lowest(sim, raw_state(sim, mujoco.MjData(sim.model)), odd.subject)
    for point, rotation, width in _hands(sim, odd, planning):
        if trials <= 0:
            return False
        if not _is_free(sim.fork(), odd, planning, point, rotation, width):
            continue
        if try_grasp(sim.fork(), odd, planning, point, rotation, start, bottom, closed=_closed(sim, width)):
            return True
        trials -= 1
    return False


def _closed(sim: MuJoCoBackend, width: float) -> float:
    """Return how far closed fingers come that leave room on both sides of a width, 0 to 1."""
    gripper = sim.robot.gripper
    if gripper is None:
        return 0.0
    geometry = gripper.geometry
    return float(np.clip(geometry.closed_fraction(geometry.joint_for_aperture(width + 2.0 * _SQUEEZE)), 0.0, 1.0))


def _hands(sim: MuJoCoBackend, odd: Odd, planning: PlanningScene) -> Iterator[tuple[np.ndarray, np.ndarray, float]]:
    """Yield TCPs and widths: closing lines in a drawn order, at one angle after the other."""
    rng = np.random.default_rng(0)
    points, normals = _surface(sim, odd.subject, rng)
    apart = points[:, None] - points[None]
    width = np.linalg.norm(apart, axis=2)
    line = apart / np.maximum(width, 1e-9)[..., None]
    along = np.minimum((line * normals[:, None]).sum(axis=2), -(line * normals[None]).sum(axis=2))
    low, high = np.nonzero((along > _ALONG) & (width > _LEAST) & (width < _MOST) & (np.abs(line[..., 2]) < 0.7))
    middle = points.mean(axis=0)
    off = np.linalg.norm(((points[low] + points[high]) / 2.0 - middle)[:, :2], axis=1)
    # Half of them the nearest to the middle, half of them anywhere.
    order = [*np.argsort(off, kind="stable")[: _PAIRS // 2], *rng.permutation(len(low))[: _PAIRS // 2]]
    for angle in _ANGLES:
        for pair in order:
            closing = line[low[pair], high[pair]]
            down = -np.eye(3)[2] + closing * closing[2]
            down = down / np.linalg.norm(down)
            approach = math.cos(angle) * down + math.sin(angle) * np.cross(closing, down)
            rotation = np.column_stack([np.cross(closing, approach), closing, approach])
            between = (points[low[pair]] + points[high[pair]]) / 2.0
            for depth in _DEPTHS:
                yield between + depth * approach, rotation, float(width[low[pair], high[pair]])


def _surface(sim: MuJoCoBackend, name: str, rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
    """Return points (k, 3) on the outside of an object's geoms and the normals there (k, 3), world."""
    model = sim.model
    data = raw_state(sim, mujoco.MjData(model))
    geoms = np.flatnonzero(model.geom_bodyid == sim.object_bodies[name])
    found, planes = [], {}
    for geom in geoms:
        mesh, rotation = model.geom_dataid[geom], data.geom_xmat[geom].reshape(3, 3)
        if mesh < 0 or not model.geom_contype[geom]:
            continue
        first = model.mesh_vertadr[mesh]
        corners = model.mesh_vert[first : first + model.mesh_vertnum[mesh]] @ rotation.T + data.geom_xpos[geom]
        from scipy.spatial import ConvexHull

        hull = ConvexHull(corners)
        planes[int(geom)] = hull.equations
        a, b, c = (corners[hull.simplices[:, k]] for k in range(3))
        found.append((int(geom), a, b, c, hull.equations[:, :3], np.linalg.norm(np.cross(b - a, c - a), axis=1)))
    areas = np.concatenate([entry[5] for entry in found])
    owner = np.concatenate([np.full(len(entry[5]), entry[0]) for entry in found])
    a, b, c, normal = (np.concatenate([entry[k] for entry in found]) for k in range(1, 5))
    chosen = rng.choice(len(areas), size=2 * _POINTS, p=areas / areas.sum())
    u, v = rng.random((2, len(chosen), 1))
    u, v = np.where(u + v > 1.0, 1.0 - u, u), np.where(u + v > 1.0, 1.0 - v, v)
    points = a[chosen] + u * (b - a)[chosen] + v * (c - a)[chosen]
    outside = np.ones(len(points), dtype=bool)
    for geom, equations in planes.items():
        within = (points @ equations[:, :3].T + equations[:, 3] < 1e-6).all(axis=1)
        outside &= ~(within & (owner[chosen] != geom))
    kept = np.flatnonzero(outside)[:_POINTS]
    return points[kept], normal[chosen][kept]


def _is_free(
    sim: MuJoCoBackend, odd: Odd, planning: PlanningScene, point: np.ndarray, rotation: np.ndarray, width: float
) -> bool:
    """Tell whether the hand touches nothing where its fingers are about to close; the world is changed."""
    robot = sim.robot
    solution = planning.kinematics().solve(point, rotation, robot.home_q, restarts=4)
    if not solution.solved or robot.gripper is None:
        return False
    joint = robot.gripper.geometry.joint_for_aperture(width + 2.0 * _SQUEEZE)
    with Intervention(sim).state() as data:
        data.qpos[robot.qpos_indices], data.qvel[:] = solution.q, 0.0
        data.qpos[robot.gripper.joint_indices] = robot.gripper.joints_at(joint)
    return not any("robot" in pair for pair in forces(sim, raw_state(sim, mujoco.MjData(sim.model))))
