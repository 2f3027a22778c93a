"""The world that a viewer looks at, in this process or in a sim process."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from contextlib import AbstractContextManager
from typing import Protocol

import mujoco
import numpy as np

from robosandbox.robots.robot import Robot
from robosandbox.sim.world import World
from robosandbox.types import Array, Observation, Pose, Scene
from robosandbox.values import frozen
from robosandbox.workcell.host import WorkcellHost


@frozen(kw_only=True)
class Frame:
    """State of the world at one moment.

    Attributes:
        model: Whose.
        seen: Joints, TCP and gripper of each arm, and the simulated time.
        hands: Id of what each hand holds, by the hand's name; None in an empty one.
        qpos: Generalized positions, shape (nq,).
        state: The whole state of the physics, which contact forces follow from; None where it is not known.
    """

    model: mujoco.MjModel
    seen: Observation
    hands: Mapping[str, str | None]
    qpos: Array
    state: Array | None = None


@frozen(kw_only=True)
class Blueprint:
    """Constant parts of a world: all that drawing needs besides a frame.

    Attributes:
        model: The compiled scene.
        robots: Its robots by the name of their arm.
        arm: The arm that calls are made with, which layers and gauges are about.
        names: What people call each body.
        object_bodies: Body ids of the objects.
        scene: What it was built from.
    """

    model: mujoco.MjModel
    robots: Mapping[str, Robot]
    arm: str
    names: Sequence[str]
    object_bodies: Mapping[str, int]
    scene: Scene

    @classmethod
    def of(cls, world: World, arm: str) -> Blueprint:
        """Return what of a compiled world is drawn while calls are made with an arm."""
        return cls(
            model=world.model,
            robots=world.robots,
            arm=arm,
            names=world.names,
            object_bodies=world.object_bodies,
            scene=world.scene,
        )

    @property
    def robot(self) -> Robot:
        """The robot of the arm that calls are made with."""
        return self.robots[self.arm]

    @property
    def robot_scene(self) -> Scene:
        """The scene with that robot as the only one."""
        named = (arm for arm in self.scene.arms if arm.name == self.arm)
        arm = next(named, None)
        return self.scene if arm is None else self.scene.for_arm(arm)

    def turns(self, index: int, robot: Robot | None = None) -> bool:
        """Tell whether an arm joint, by its place in `robot.joints`, turns; else it slides."""
        joint = int(self.model.dof_jntid[int((robot or self.robot).dof_indices[index])])
        return bool(self.model.jnt_type[joint] == mujoco.mjtJoint.mjJNT_HINGE)

    @property
    def speed_unit(self) -> str:
        """The unit that the arm's speed is told in: that of joints that turn, if there is one."""
        return "°/s" if any(self.turns(index) for index in range(len(self.robot.joints))) else "mm/s"

    def force_unit(self, robot: Robot | None = None) -> str:
        """Return the unit of the gripper's force: that of its primary joint's servo."""
        gripper = (robot or self.robot).gripper
        if gripper is None:
            return ""
        if gripper.qpos_index is None:
            return "N"
        joint = int(np.flatnonzero(self.model.jnt_qposadr == gripper.qpos_index)[0])
        return "N m" if self.model.jnt_type[joint] == mujoco.mjtJoint.mjJNT_HINGE else "N"

    def looks_like(self, other: Blueprint) -> bool:
        """Tell whether another world is drawn with the same shapes and colours; poses may differ."""
        if self.model is not other.model or len(self.scene.objects) != len(other.scene.objects):
            return False
        pairs = zip(self.scene.objects, other.scene.objects, strict=True)
        return all((a.id, a.size, a.rgba) == (b.id, b.size, b.rgba) for a, b in pairs)


OnFrame = Callable[[Frame], None]
# Told that the world was changed by somebody else: True for another task or robot, which `adopt` takes over.
OnElsewhere = Callable[[bool], None]


class WorldSource(Protocol):
    """Frames of a running cell that can be watched and steered."""

    @property
    def host(self) -> WorkcellHost:
        """The owner of the cell."""
        ...

    @property
    def blueprint(self) -> Blueprint:
        """Blueprint to draw; another one after a load, or when something else is believed: frames tell of which model they are."""
        ...

    @property
    def title(self) -> str:
        """Title that says where the world is, for people."""
        ...

    @property
    def teleop(self) -> Teleop | None:
        """Direct control by a person; None where the world is not in this process."""
        ...

    def start(self, on_frame: OnFrame, on_elsewhere: OnElsewhere) -> None:
        """Begin; frames and news come from any thread, frames as long as something moves."""
        ...

    def refresh(self) -> None:
        """Have a frame come, whether something moves or not."""
        ...

    def changing(self) -> AbstractContextManager[None]:
        """Draw nothing while the world is put into another state, and bring `blueprint` up to date; for jobs.

        Raises:
            InputError: What is there then cannot be drawn here.
        """
        ...

    def adopt(self) -> None:
        """Take over the task and robot that somebody else has loaded; for jobs.

        Raises:
            InputError: They cannot be drawn here.
        """
        ...

    def stop(self) -> None:
        """Send no more frames."""
        ...


class Teleop(Protocol):
    """Direct control by a person: objects are placed, the TCP is jogged; for jobs."""

    def place(self, object_id: str, pose: Pose) -> None:
        """Put an object somewhere, at rest; raises InputError where it would be inside something."""
        ...

    def let_go(self) -> None:
        """Let what was put somewhere fall and come to rest."""
        ...

    def jog(self, change: Pose) -> None:
        """Move the TCP by a small transform: xyz in the world, the rotation about its own axes; raises SkillError."""
        ...

    def grip(self, closed: bool) -> None:
        """Close or open the gripper."""
        ...
