"""Whether a thing could have been picked up after all: grasps tried one after another on copies of the true world.

The oracle knows the truth, and may begin before an object with its hand already there: it tells whether a grasp exists, not whether
somebody finds a way to it. Each trial comes straight in, closes, rises by 80 mm and looks at raw contacts two seconds later. What lies
at a wall is also dragged away from it first, by closed fingers on its top.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable

import mujoco
import numpy as np
from odd_judge import STAYS, done, forces, lowest, places, raw_state
from odd_scenes import Odd

from robosandbox.motion.planning_scene import PlanningScene
from robosandbox.robots.kinematics import Kinematics
from robosandbox.sim.intervention import Intervention
from robosandbox.sim.mujoco_backend import MuJoCoBackend
from robosandbox.types import Trajectory, matrix_from_rotation_vector

# Headings of the closing direction and leans of the approach that are tried, radians, and how far it comes from, metres.
_HEADINGS = np.arange(6) * math.pi / 6.0
_LEANS = ((0.0, 0.0), (0.5, 0.0), (-0.5, 0.0), (0.0, 0.5), (0.0, -0.5), (1.0, 0.0), (-1.0, 0.0))
# Heights of the grasp over the middle, as shares of how far the thing reaches up from there.
_HEIGHTS = (0.0, 0.7)
# N with which closed fingers press on a thing's top while they drag it, how far they drag it, metres, and seconds a millimetre.
_PRESS, _DRAG, _STEP_SECONDS = 5.0, 0.035, 0.04
_COME_FROM, _RISE = 0.06, 0.08
# The most that a trial may press anything with but what it holds, N.
_GENTLE = 60.0
# Seconds for the way in and out; slow for the controllers that are judged.
_WAY_SECONDS = 0.8


def can_hold(sim: MuJoCoBackend, odd: Odd, planning: PlanningScene, *, trials: int = 30) -> bool:
    """Tell whether some grasp of so many holds the subject and lifts it.

    Args:
        sim: The world at the start; it is left as it is.
        odd: The scene.
        planning: The arm's kinematics there.
        trials: The most grasps that are simulated.
    """
    start = places(sim)
    bottom = lowest(sim, raw_state(sim, mujoco.MjData(sim.model)), odd.subject)
    if _grasped(sim, odd, planning, start, bottom, trials):
        return True
    if not odd.corner:
        return False
    away = start[odd.still[0]] - start[odd.subject]
    dragged = _dragged(sim.fork(), odd, planning, away * [1.0, 1.0, 0.0], start)
    return dragged is not None and _grasped(dragged, odd, planning, start, bottom, trials)


def _grasped(
    sim: MuJoCoBackend, odd: Odd, planning: PlanningScene, start: dict[str, np.ndarray], bottom: float, trials: int
) -> bool:
    """Tell whether one of so many grasps holds the subject where it is now."""
    data = raw_state(sim, mujoco.MjData(sim.model))
    geom = int(sim.model.body_geomadr[sim.object_bodies[odd.subject]])
    middle, axes = data.geom_xpos[geom].copy(), data.geom_xmat[geom].reshape(3, 3)
    up = middle[2] - lowest(sim, data, odd.subject)
    for lean, height, heading in itertools.product(_LEANS, _HEIGHTS, _HEADINGS):
        if trials <= 0:
            return False
        held = try_grasp(
            sim.fork(), odd, planning, middle + [0.0, 0.0, height * up], _hand(axes, heading, lean), start, bottom
        )
        if held:
            return True
        trials -= held is not None
    return False


def _dragged(
    sim: MuJoCoBackend, odd: Odd, planning: PlanningScene, away: np.ndarray, start: dict[str, np.ndarray]
) -> MuJoCoBackend | None:
    """Return a world in which closed fingers dragged the subject away from its corner by its top; None where they cannot."""
    kinematics, robot = planning.kinematics(), sim.robot
    data = raw_state(sim, mujoco.MjData(sim.model))
    at = data.xpos[sim.object_bodies[odd.subject]].copy()
    top = at + [0.0, 0.0, at[2] - lowest(sim, data, odd.subject)]
    way = away / max(float(np.linalg.norm(away)), 1e-9) * _DRAG
    for heading in _HEADINGS:
        rotation = _hand(np.eye(3), math.atan2(away[1], away[0]) + heading, (0.0, 0.0))
        above = kinematics.solve(top + [0.0, 0.0, 0.04], rotation, robot.home_q, restarts=4)
        if not above.solved:
            continue
        copy = sim.fork()
        _stand(copy, above.q)
        copy.set_gripper("hand", 1.0)
        copy.wait(1.0)
        if any("robot" in pair for pair in forces(copy, raw_state(copy, data))):
            continue
        worst, end = _felt(copy, odd)
        q = above.q
        for depth in np.arange(-0.04, 0.02, 0.001):
            q = _step(copy, kinematics, top - [0.0, 0.0, depth], rotation, q)
            pressed = forces(copy, raw_state(copy, data)).get(("robot", odd.subject), np.zeros(3))
            if np.linalg.norm(pressed) > _PRESS:
                break
        for share in np.linspace(0.0, 1.0, 36):
            q = _step(copy, kinematics, top - [0.0, 0.0, depth] + share * way, rotation, q)
        for rise in np.linspace(0.0, 0.1, 21):
            q = _step(copy, kinematics, top + way + [0.0, 0.0, rise - depth], rotation, q)
        end()
        went = float(np.linalg.norm((places(copy)[odd.subject] - at)[:2]))
        if worst[0] < _GENTLE and went > _DRAG / 3.0 and _stay(copy, odd, start):
            return copy
    return None


def _step(
    sim: MuJoCoBackend, kinematics: Kinematics, point: np.ndarray, rotation: np.ndarray, q: np.ndarray
) -> np.ndarray:
    """Move the hand a little; return the configuration, the old one where there is none."""
    solution = kinematics.solve(point, rotation, q, restarts=0)
    if solution.solved:
        q = solution.q
        sim.arms["arm"].follow(Trajectory(q=np.array([q, q]), dt=_STEP_SECONDS))
    return q


def _stand(sim: MuJoCoBackend, q: np.ndarray) -> None:
    """Put the arm somewhere, at rest."""
    robot = sim.robot
    with Intervention(sim).state() as data:
        data.qpos[robot.qpos_indices], data.qvel[:] = q, 0.0
        data.ctrl[robot.actuator_ids] = robot.control(q)


def _felt(sim: MuJoCoBackend, odd: Odd) -> tuple[list[float], Callable[[], None]]:
    """Return what the robot presses anything but the subject with at the most from now on, N, and what ends that."""
    data, worst = mujoco.MjData(sim.model), [0.0]

    def feel() -> None:
        for (who, whom), force in forces(sim, raw_state(sim, data)).items():
            if who == "robot" and whom != odd.subject:
                worst[0] = max(worst[0], float(np.linalg.norm(force)))

    return worst, sim.subscribe(feel)


def _hand(axes: np.ndarray, heading: float, lean: tuple[float, float]) -> np.ndarray:
    """Return the hand's frame: z along the approach, y along the closing, turned from the object's own axis seen from above."""
    flat = axes[:2, int(np.argmax(np.abs(axes[:2]).sum(axis=0)))]
    yaw = math.atan2(flat[1], flat[0]) + heading
    down = np.array([[1.0, 0.0, 0.0], [0.0, -1.0, 0.0], [0.0, 0.0, -1.0]])
    turned = matrix_from_rotation_vector(np.array([0.0, 0.0, yaw])) @ down
    return np.asarray(turned @ matrix_from_rotation_vector(np.array([*lean, 0.0])))


def try_grasp(
    sim: MuJoCoBackend, odd: Odd, planning: PlanningScene, point: np.ndarray, rotation: np.ndarray,
    start: dict[str, np.ndarray], bottom: float, *, closed: float = 0.0,
) -> bool | None:  # fmt: skip
    """Try one grasp in a copy of the world; return whether it holds, None where the arm cannot stand there.

    Args:
        sim: The copy; it is changed.
        odd: What is to be held.
        planning: The arm's kinematics.
        point: Where the TCP goes, metres, shape (3,).
        rotation: The TCP's frame there, shape (3, 3).
        start: Where the objects were.
        bottom: How high the subject's lowest point was, metres.
        closed: How far closed the fingers come, 0 to 1.
    """
    kinematics, robot = planning.kinematics(), sim.robot
    before = point - _COME_FROM * rotation[:, 2]
    far = kinematics.solve(before, rotation, robot.home_q, restarts=4)
    if not far.solved:
        return None
    near = kinematics.solve(point, rotation, far.q, restarts=0)
    if not near.solved or np.abs(near.q - far.q).max() > 1.0:
        return None
    _stand(sim, far.q)
    if any("robot" in pair for pair in forces(sim, raw_state(sim, mujoco.MjData(sim.model)))):
        return None
    worst, end = _felt(sim, odd)
    sim.hands["hand"].set_gripper(closed)
    sim.wait(0.1 if closed == 0.0 else 0.5)
    _go(sim, far.q, near.q)
    sim.hands["hand"].set_gripper(1.0)
    sim.wait(0.8)
    lifted = kinematics.solve(point + [0.0, 0.0, _RISE], rotation, near.q, restarts=0)
    if lifted.solved:
        _go(sim, near.q, lifted.q)
    end()
    return worst[0] < _GENTLE and _stay(sim, odd, start) and done(sim, odd, start, bottom)


def _stay(sim: MuJoCoBackend, odd: Odd, start: dict[str, np.ndarray]) -> bool:
    """Tell whether what is to stay has stayed."""
    now = places(sim)
    return all(float(np.linalg.norm(now[name] - start[name])) < STAYS for name in odd.still)


def _go(sim: MuJoCoBackend, begin: np.ndarray, end: np.ndarray) -> None:
    steps = round(_WAY_SECONDS / sim.control_timestep)
    share = (1.0 - np.cos(np.linspace(0.0, math.pi, steps + 1))) / 2.0
    sim.arms["arm"].follow(Trajectory(q=begin + share[:, None] * (end - begin), dt=sim.control_timestep))
