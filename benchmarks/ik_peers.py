"""Inverse kinematics of the bundled Panda beside other libraries: the same poses, in turn, in one process.

    uv run --group kinematics benchmarks/ik_peers.py [--poses 3000] [--json]

A pose is reachable because a random configuration within the joint limits gave it. Every solver starts at home, has to come within
1 mm and 0.5 deg, and may start again from configurations of its own choice. Its answer is judged by MuJoCo's forward kinematics and
the joint limits, not by what it says. Times are CPU of the solving thread; who comes first changes from pose to pose.

`roboplan` gets this model as a URDF of the same joints and axes; its first row has its default options, its second a full step and
as many restarts as ours. `mink` is a controller that follows a pose: it takes a step of its quadratic program until it is there, and
starts again from a random configuration when it is not after forty, as ours gives up after as many.
"""

from __future__ import annotations

import argparse
import json
import math
import time
from collections.abc import Callable, Mapping, Sequence

import mink
import mujoco
import numpy as np
from roboplan.core import (
    CartesianConfiguration,
    JointConfiguration,
    Scene as PeerScene,
    loadUrdfSceneDescriptionFromXml,
)
from roboplan.simple_ik import SimpleIk, SimpleIkOptions

from robosandbox.robots.kinematics import Kinematics
from robosandbox.robots.robot import Robot
from robosandbox.sim.mujoco_backend import MuJoCoBackend
from robosandbox.types import Array, Scene

POSITION_TOLERANCE = 1e-3
ORIENTATION_TOLERANCE = math.radians(0.5)
# Share of the tolerances that a peer is asked for, so that rounding at the border counts against nobody.
_ASKED = 0.99
_RESTARTS = 60
_STEPS = 40

Solve = Callable[[Array, Array], Array]


def ours(model: mujoco.MjModel, robot: Robot) -> Solve:
    """Return this project's solver."""
    solver = Kinematics.of(
        model, robot, position_tolerance=POSITION_TOLERANCE, orientation_tolerance=ORIENTATION_TOLERANCE
    )
    return lambda position, rotation: solver.solve(position, rotation, robot.home_q, restarts=_RESTARTS).q


def roboplan(kinematics: Kinematics, robot: Robot, **options: float) -> Solve:
    """Return RoboPlan's solver on a URDF of this arm."""
    links, group = urdf(kinematics, robot)
    scene = PeerScene("panda", loadUrdfSceneDescriptionFromXml(links))
    scene.importSrdf(group)
    asked = SimpleIkOptions(
        group_name="arm",
        max_linear_error_norm=_ASKED * POSITION_TOLERANCE,
        max_angular_error_norm=_ASKED * ORIENTATION_TOLERANCE,
        check_collisions=False,
        **options,
    )
    solver = SimpleIk(scene, asked)
    solver.setRngSeed(0)
    start = JointConfiguration(list(robot.joints), robot.home_q)
    target = np.eye(4, order="F")

    def solve(position: Array, rotation: Array) -> Array:
        target[:3, :3], target[:3, 3] = rotation, position
        found = JointConfiguration(list(robot.joints), robot.home_q)
        solver.solveIk(CartesianConfiguration("base", "tcp", target), start, found)
        return np.array(found.positions)

    return solve


def following(model: mujoco.MjModel, robot: Robot) -> Solve:
    """Return mink's controller, followed until it is there or has to start again."""
    configuration = mink.Configuration(model)
    task = mink.FrameTask(model.site(robot.tcp_site).name, "site", position_cost=1.0, orientation_cost=0.3)
    limits = [mink.ConfigurationLimit(model)]
    others = np.setdiff1d(np.arange(model.nv), robot.dof_indices)
    still = [mink.DofFreezingTask(model, dof_indices=others.tolist())]
    rest = model.qpos0.copy()

    def solve(position: Array, rotation: Array) -> Array:
        rng = np.random.default_rng(0)
        aim = mink.SO3.from_matrix(rotation @ robot.R_site_tcp.T)
        task.set_target(mink.SE3.from_rotation_and_translation(aim, position))
        q = robot.home_q
        for _ in range(1 + _RESTARTS):
            rest[robot.qpos_indices] = q
            configuration.update(rest)
            for _ in range(_STEPS):
                error = task.compute_error(configuration)
                there = np.linalg.norm(error[:3]) <= _ASKED * POSITION_TOLERANCE
                if there and np.linalg.norm(error[3:]) <= _ASKED * ORIENTATION_TOLERANCE:
                    return configuration.q[robot.qpos_indices]
                velocity = mink.solve_ik(configuration, [task], 1.0, "daqp", 1e-6, limits=limits, constraints=still)
                configuration.integrate_inplace(velocity, 1.0)
            q = rng.uniform(robot.lower, robot.upper)
        return configuration.q[robot.qpos_indices]

    return solve


def urdf(kinematics: Kinematics, robot: Robot) -> tuple[str, str]:
    """Return a URDF of the arm from the world to its TCP, without shapes, and an SRDF that names its group."""
    model, tool = kinematics.model, kinematics.tool
    links, joints, parent = ['<link name="base"/>'], [], "base"
    chain, body = [], tool.body
    while body:
        chain.insert(0, body)
        body = int(model.body_parentid[body])
    names = dict(zip((int(model.jnt_bodyid[joint]) for joint in kinematics.joints), robot.joints, strict=True))
    for body in chain:
        rotation = np.zeros(9)
        mujoco.mju_quat2Mat(rotation, model.body_quat[body])
        moves = ""
        if body in names:
            index = robot.joints.index(names[body])
            axis = " ".join(map(repr, model.jnt_axis[kinematics.joints[index]].tolist()))
            ends = f'lower="{robot.lower[index]}" upper="{robot.upper[index]}"'
            moves = f'<axis xyz="{axis}"/><limit {ends} velocity="{robot.velocity_limits[index]}" effort="100"/>'
        links.append(f'<link name="body{body}"/>')
        joints.append(
            _joint(names.get(body, f"to{body}"), parent, f"body{body}", model.body_pos[body], rotation, moves)
        )
        parent = f"body{body}"
    links.append('<link name="tcp"/>')
    joints.append(_joint("to_tcp", parent, "tcp", tool.position, tool.rotation, ""))
    group = '<group name="arm"><chain base_link="base" tip_link="tcp"/></group>'
    return f'<robot name="arm">{"".join(links + joints)}</robot>', f'<robot name="arm">{group}</robot>'


def _joint(name: str, parent: str, child: str, position: Array, rotation: Array, moves: str) -> str:
    matrix = np.reshape(rotation, (3, 3))
    pitch = math.atan2(-matrix[2, 0], math.hypot(matrix[0, 0], matrix[1, 0]))
    roll, yaw = math.atan2(matrix[2, 1], matrix[2, 2]), math.atan2(matrix[1, 0], matrix[0, 0])
    place = f'<origin xyz="{" ".join(map(repr, np.asarray(position).tolist()))}" rpy="{roll!r} {pitch!r} {yaw!r}"/>'
    kind = "revolute" if moves else "fixed"
    ends = f'<parent link="{parent}"/><child link="{child}"/>'
    return f'<joint name="{name}" type="{kind}">{place}{ends}{moves}</joint>'


def measure(poses: int, seed: int) -> list[dict[str, object]]:
    """Return a row for each solver."""
    with MuJoCoBackend() as sim:
        sim.load(Scene())
        robot, judge = sim.robot, Kinematics.of(sim.model, sim.robot)
        solvers: dict[str, Solve] = {
            "robosandbox": ours(sim.model, robot),
            "roboplan, as it comes": roboplan(judge, robot),
            "roboplan, full step": roboplan(judge, robot, step_size=1.0, max_restarts=_RESTARTS, max_time=1.0),
            "mink with daqp": following(sim.model, robot),
        }
        rng = np.random.default_rng(seed)
        took: Mapping[str, list[float]] = {name: [] for name in solvers}
        solved = dict.fromkeys(solvers, 0)
        order = list(solvers)
        for _ in range(poses):
            position, rotation = judge.forward(rng.uniform(robot.lower, robot.upper))
            for name in order:
                begin = time.thread_time_ns()
                q = solvers[name](position, rotation)
                took[name].append((time.thread_time_ns() - begin) / 1e6)
                solved[name] += right(judge, robot, q, position, rotation)
            order.append(order.pop(0))
    return [row(name, solved[name], took[name]) for name in solvers]


def right(judge: Kinematics, robot: Robot, q: Array, position: Array, rotation: Array) -> bool:
    """Tell whether a configuration is within the limits and puts the TCP there."""
    found, turned = judge.forward(q)
    angle = math.acos(min(1.0, max(-1.0, (np.trace(turned.T @ rotation) - 1.0) / 2.0)))
    near = np.linalg.norm(found - position) <= POSITION_TOLERANCE and angle <= ORIENTATION_TOLERANCE
    return bool(near and (q >= robot.lower).all() and (q <= robot.upper).all())


def row(name: str, solved: int, took: Sequence[float]) -> dict[str, object]:
    """Return what is told of a solver."""
    median, p95, p99 = (round(float(each), 3) for each in np.percentile(took, (50, 95, 99)))
    share = round(100.0 * solved / len(took), 2)
    return {"solver": name, "solved_percent": share, "median_ms": median, "p95_ms": p95, "p99_ms": p99}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--poses", type=int, default=3_000)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--json", action="store_true")
    arguments = parser.parse_args()
    rows = measure(arguments.poses, arguments.seed)
    if arguments.json:
        print(json.dumps(rows, indent=2))
        return
    for each in [dict(zip(rows[0], rows[0], strict=True)), *rows]:
        print(" ".join(f"{value!s:>{24 if key == 'solver' else 15}}" for key, value in each.items()))


if __name__ == "__main__":
    main()
