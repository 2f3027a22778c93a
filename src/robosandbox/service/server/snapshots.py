"""Messages that describe a world: what it is, its state, what is true in it, and what a skill intends."""

from __future__ import annotations

import time
from dataclasses import replace
from typing import Literal

import numpy as np

from robosandbox.service.messages import Camera, GripperInfo, Info, Joint, SkillInfo, State, TrueState
from robosandbox.service.server.goals import LiveGoal
from robosandbox.sim.modelled import Modelled, modelled
from robosandbox.tasks.embedded import EmbeddedWorkcell
from robosandbox.types import GraspSearch, Intent, Trajectory, frozen_array

_MOST_SHOWN = 64


def info_of(
    served: EmbeddedWorkcell, *, robot_id: str, boot_id: str, truth: bool, pace: Literal["realtime", "fast"]
) -> Info:
    """Return what a loaded task is."""
    sim, robot = modelled(served.sim, "a sim process tells what it is"), served.sim.spec
    height, width = sim.render_size
    joints = zip(robot.joints, robot.lower, robot.upper, robot.velocity_limits, strict=True)
    geometry = robot.gripper.geometry if robot.gripper else None
    return Info(
        robot_id=robot_id,
        boot_id=boot_id,
        robot=robot.name,
        joints=tuple(
            Joint(name=name, lower=float(low), upper=float(high), velocity=float(speed))
            for name, low, high, speed in joints
        ),
        home_q=tuple(float(value) for value in robot.home_q),
        base_xy=(float(robot.base_position[0]), float(robot.base_position[1])),
        gripper=GripperInfo(min_aperture=geometry.min_aperture, max_aperture=geometry.max_aperture)
        if geometry
        else None,
        cameras=tuple(Camera(name=name, width=width, height=height) for name in sim.cameras),
        skills=tuple(
            SkillInfo(name=skill.name, description=skill.description, arguments=dict(skill.schema))
            for skill in served.skills
        ),
        task=served.task.model_dump(mode="json"),
        seed=served.seed,
        pace=pace,
        control_timestep=sim.control_timestep,
        truth=truth,
    )


def state_of(sim: Modelled, boot_id: str, running: LiveGoal | None, phase: str, loads: int) -> State:
    """Return how the robot stands."""
    return State(
        boot_id=boot_id,
        seq=0,
        stamp=time.time(),
        robot=sim.state(),
        held=sim.held(),
        goal_id=running.goal.goal_id if running else None,
        skill=running.goal.skill if running else None,
        phase=phase if running else None,
        physics_steps=sim.physics_steps,
        loads=loads,
    )


def true_state_of(sim: Modelled, boot_id: str, *, with_objects: bool) -> TrueState:
    """Return the simulated state."""
    truth = sim.truth()
    return TrueState(
        boot_id=boot_id,
        physics_steps=sim.physics_steps,
        truth=truth if with_objects else replace(truth, objects={}, held=None),
    )


def thinned(intent: Intent) -> Intent:
    """Return what a skill is about to do, thinned out to what a picture needs."""
    if isinstance(intent, GraspSearch):
        kept = list(range(min(len(intent.candidates), _MOST_SHOWN)))
        if intent.chosen is not None and intent.chosen >= len(kept):
            kept[-1] = intent.chosen
        return GraspSearch(
            candidates=tuple(intent.candidates[index] for index in kept),
            chosen=None if intent.chosen is None else kept.index(intent.chosen),
        )
    rows = len(intent.q)
    picked = np.linspace(0, rows - 1, min(rows, _MOST_SHOWN)).round().astype(int)
    return Trajectory(q=frozen_array(intent.q[picked]), dt=intent.duration / max(1, len(picked) - 1))
