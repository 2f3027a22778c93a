"""Readings of a world as messages: what it is, its state, what is true in it, and what a skill intends."""

from __future__ import annotations

import time
from collections.abc import Mapping
from dataclasses import replace
from typing import Any, Literal

import numpy as np

from robosandbox.agent.gate import Gate
from robosandbox.sim.opening import mujoco_behind
from robosandbox.types import ArmTruth, GraspSearch, Intent, Trajectory, Truth, frozen_array
from robosandbox.types.robot import RobotSpec
from robosandbox.workcell.embedded import EmbeddedWorkcell
from robosandbox.workcell.host import Activity, WorkcellHost
from robosandbox.workcell.zenoh.messages import (
    ArmInfo,
    Camera,
    GripperInfo,
    Info,
    Joint,
    Objects,
    SkillInfo,
    State,
    TrueState,
)

# Configurations or grasps of an intent that are sent; chosen as many as a viewer can draw apart.
_MOST_SHOWN = 64


def info_of(
    served: EmbeddedWorkcell,
    *,
    robot_id: str,
    boot_id: str,
    truth: bool,
    pace: Literal["realtime", "fast"],
    sizes: Mapping[str, tuple[int, int]],
) -> Info:
    """Return what a loaded task is.

    Args:
        served: The task.
        robot_id: In keys.
        boot_id: The sim process.
        truth: Whether `truth` answers.
        pace: How simulated time passes.
        sizes: (height, width) of pictures in pixels, by camera.
    """
    arms = {name: _arm_info(arm.spec) for name, arm in served.driver.arms.items()}
    return Info(
        robot_id=robot_id,
        boot_id=boot_id,
        **dict(next(iter(arms.values()))),
        cameras=tuple(Camera(name=name, width=width, height=height) for name, (height, width) in sizes.items()),
        skills=tuple(
            SkillInfo(
                name=name,
                description=skill.description,
                arguments=dict(skill.schema),
                by_hand=name not in served.agent.skills,
            )
            for name, skill in served.calls.items()
        ),
        task=served.task.model_dump(mode="json"),
        seed=served.seed,
        pace=pace,
        control_timestep=served.driver.control_timestep,
        truth=truth,
        unprotected=served.ctx.safety.unprotected if served.ctx.safety is not None else (),
        confirms=isinstance(served.agent.approve, Gate),
        arms=arms if len(arms) > 1 else {},
    )


def _arm_info(robot: RobotSpec) -> ArmInfo:
    joints = zip(robot.joints, robot.lower, robot.upper, robot.velocity_limits, strict=True)
    geometry = robot.gripper.geometry if robot.gripper else None
    return ArmInfo(
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
    )


class Readings:
    """Values that are asked again and again: state, objects, truth; only in the world's thread.

    Args:
        host: Owns the world.
        boot_id: The sim process.
        with_truth: Whether the truth is told with its objects.

    Attributes:
        loads: Tasks that were loaded since the process began.
    """

    def __init__(self, host: WorkcellHost, *, boot_id: str, with_truth: bool) -> None:
        self.loads: int = 0
        self._host = host
        self._cell = host.embedded
        self._boot_id = boot_id
        self._with_truth = with_truth

    @property
    def _goal(self) -> Activity[Any] | None:
        """The goal that runs."""
        running = self._host.running
        return running if running is not None and running.goal_id is not None else None

    def state(self) -> State:
        """Return how the robot stands and what it does."""
        cell, goal = self._cell, self._goal
        return State(
            boot_id=self._boot_id,
            seq=0,
            stamp=time.time(),
            robot=cell.driver.state(),
            hands=self._hands(),
            goal_id=goal.goal_id if goal else None,
            skill=goal.what if goal else None,
            phase=cell.ctx.phase if goal else None,
            physics_steps=self._physics_steps(),
            loads=self.loads,
            arm=cell.ctx.arm.name,
        )

    def objects(self) -> Objects:
        """Return what perception sees; while a goal runs in a world that does not stand still for a look, what it saw last."""
        ctx = self._cell.ctx
        moving = self._goal is not None and not self._cell.driver.capabilities.truth
        return Objects(boot_id=self._boot_id, scene=ctx.seen if moving and ctx.seen is not None else ctx.look())

    def truth(self) -> TrueState:
        """Return the simulated state; without objects where it is not told or not known."""
        driver = self._cell.driver
        if driver.simulation is not None:
            truth = driver.simulation.truth()
        else:
            truth = Truth(
                time=driver.time,
                arms={name: ArmTruth(q=arm.state().q, home_q=arm.spec.home_q) for name, arm in driver.arms.items()},
                table_height=self._cell.task.scene.table_height,
                objects={},
                hands=dict.fromkeys(driver.hands),
            )
        return TrueState(
            boot_id=self._boot_id,
            physics_steps=self._physics_steps(),
            truth=truth if self._with_truth else replace(truth, objects={}, hands=dict.fromkeys(truth.hands)),
        )

    def _hands(self) -> dict[str, str | None]:
        """Return what contacts say is held in each hand, where they are known, else what perception believed at its last look."""
        world, seen = mujoco_behind(self._cell.driver), self._cell.ctx.seen
        if world is not None:
            return world.in_hands()
        return dict(seen.hands) if seen is not None else dict.fromkeys(self._cell.driver.hands)

    def _physics_steps(self) -> int | None:
        world = self._cell.driver.simulation
        return None if world is None else world.physics_steps


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
