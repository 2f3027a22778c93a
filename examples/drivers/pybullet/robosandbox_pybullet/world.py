"""A scene in Bullet: table, floor, the Panda of `pybullet_data`, and objects."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pybullet
import pybullet_data

from robosandbox.types import Array, Pose, Scene
from robosandbox.types.robot import RobotSpec
from robosandbox_pybullet.objects import add_object

ROBOT_MODEL = Path(pybullet_data.getDataPath()) / "franka_panda" / "panda.urdf"
ROBOT_SIDECAR = Path(__file__).with_name("panda.robosandbox.yaml")
HAND = "panda_hand"
# Seconds of a physics step, which is a control tick too: with 240 Hz, Bullet's own, a cube of 30 mm rocks in the fingers, and
# with five steps to a tick a touch at 10 mm/s presses with 60 N before it is felt. Franka's own control runs at 1 kHz.
PHYSICS_TIMESTEP = 0.002
# m/s^2, as MuJoCo's worlds have it.
GRAVITY = 9.81
# Iterations of the contact solver; Bullet's own 50 let a stack of three creep.
_SOLVER_ITERATIONS = 150
# Within how many metres contact points are kept; Bullet's own 0.02 is as large as the objects.
_CONTACT_DISTANCE = 0.002
_TABLE_HALF_EXTENT = 0.5
_TABLE_RGBA = (0.80, 0.74, 0.66, 1.0)
_FLOOR_RGBA = (0.50, 0.53, 0.57, 1.0)
# Coefficients of sliding friction, of which Bullet multiplies those of two that touch: rubber pads, and a wooden table
# (0.5: what `skills` count on of most pairs of materials).
_FRICTION, _TABLE_FRICTION = 1.0, 0.5
# Lever arms of friction of the finger pads against spinning, metres: half of a pad's width.
_PAD_SPINNING = 0.01
# Of the pads, N/m and N s/m: they yield 0.35 mm under the fingers' force, and a touch at 10 mm/s gives them 1 N at once. The
# file's 30 N/mm let a finger sink 7 mm into a cube that it pushes.
_PAD_STIFFNESS, _PAD_DAMPING = 1e5, 1e2
# Force of each finger's motor, N: half of the 70 N with which the Franka Hand holds continuously, as its data sheet says.
_FINGER_FORCE = 35.0


class BulletWorld:
    """What is simulated: bodies by their names.

    Args:
        scene: What is in it; its robot is not read.
        robot: What the driver knows of the robot: joint names and where it stands.

    Attributes:
        client: Bullet's number of this world.
        robot: Bullet's number of the robot.
        arm: Its arm joints.
        fingers: Its finger joints, the primary one first.
        hand: The link that carries the TCP.
        names: What people call each body.
        bodies: Bullet's numbers of each object's bodies.
    """

    def __init__(self, scene: Scene, robot: RobotSpec) -> None:
        self.scene = scene
        self.client: int = pybullet.connect(pybullet.DIRECT)
        self._set_options()
        self.names: dict[int, str] = {}
        self._add_room(scene.table_height)
        self.robot = self._add_robot(robot)
        joints, links = self._joints()
        self.arm = [joints[name] for name in robot.joints]
        self.fingers = [joints["panda_finger_joint1"], joints["panda_finger_joint2"]]
        self.hand = links[HAND]
        self._couple_fingers()
        self.bodies: dict[str, list[int]] = {item.id: add_object(self.call, scene, item) for item in scene.objects}
        self.names |= {body: name for name, bodies in self.bodies.items() for body in bodies}

    def call(self, name: str, *arguments: Any, **options: Any) -> Any:
        """Call one of Bullet's functions in this world."""
        return getattr(pybullet, name)(*arguments, physicsClientId=self.client, **options)

    def close(self) -> None:
        """Free it."""
        if pybullet.isConnected(self.client):
            pybullet.disconnect(self.client)

    # Reading.

    def joint_states(self, joints: Sequence[int]) -> Array:
        """Return positions, velocities and motor forces of joints, shape (k, 3)."""
        states = self.call("getJointStates", self.robot, joints)
        return np.array([(position, velocity, force) for position, velocity, _, force in states])

    def hand_pose(self) -> Pose:
        """Return where the hand's link is in the world."""
        state = self.call("getLinkState", self.robot, self.hand, computeForwardKinematics=True)
        return Pose(xyz=state[4], quat_xyzw=state[5])

    def object_pose(self, body: int) -> Pose:
        """Return a body's own frame in the world; Bullet tells where its centre of mass is."""
        centre, quat = self.call("getBasePositionAndOrientation", body)
        local = self.call("getDynamicsInfo", body, -1)
        inner = pybullet.invertTransform(local[3], local[4])
        xyz, quat = pybullet.multiplyTransforms(centre, quat, *inner)
        return Pose(xyz=xyz, quat_xyzw=quat)

    # Building.

    def _set_options(self) -> None:
        self.call("setGravity", 0.0, 0.0, -GRAVITY)
        self.call(
            "setPhysicsEngineParameter",
            fixedTimeStep=PHYSICS_TIMESTEP,
            numSolverIterations=_SOLVER_ITERATIONS,
            contactBreakingThreshold=_CONTACT_DISTANCE,
            deterministicOverlappingPairs=1,
        )

    def _add_room(self, table_height: float) -> None:
        half = [_TABLE_HALF_EXTENT, _TABLE_HALF_EXTENT, table_height / 2.0]
        for name, extents, middle, rgba in (
            ("table", half, (0.0, 0.0, table_height / 2.0), _TABLE_RGBA),
            ("floor", [3.0, 3.0, 0.05], (0.0, 0.0, -0.05), _FLOOR_RGBA),
        ):
            body = self.call(
                "createMultiBody",
                0.0,
                self.call("createCollisionShape", pybullet.GEOM_BOX, halfExtents=extents),
                self.call("createVisualShape", pybullet.GEOM_BOX, halfExtents=extents, rgbaColor=rgba),
                middle,
            )
            self.call("changeDynamics", body, -1, lateralFriction=_TABLE_FRICTION)
            self.names[body] = name

    def _add_robot(self, robot: RobotSpec) -> int:
        body: int = self.call("loadURDF", str(ROBOT_MODEL), list(robot.base_position), useFixedBase=True)
        self.names[body] = "robot"
        return body

    def _joints(self) -> tuple[dict[str, int], dict[str, int]]:
        """Return the robot's joints and links by name."""
        told = [self.call("getJointInfo", self.robot, i) for i in range(self.call("getNumJoints", self.robot))]
        return {one[1].decode(): one[0] for one in told}, {one[12].decode(): one[0] for one in told}

    def _couple_fingers(self) -> None:
        """Let the fingers move alike, as the hand's gear does; Bullet does not read the file's mimic joint."""
        first, second = self.fingers
        axis, origin = (1.0, 0.0, 0.0), (0.0, 0.0, 0.0)
        gear = self.call(
            "createConstraint", self.robot, first, self.robot, second, pybullet.JOINT_GEAR, axis, origin, origin
        )
        self.call("changeConstraint", gear, gearRatio=-1.0, erp=0.1, maxForce=2.0 * _FINGER_FORCE)
        for finger in self.fingers:
            self.call(
                "changeDynamics",
                self.robot,
                finger,
                lateralFriction=_FRICTION,
                spinningFriction=_PAD_SPINNING,
                contactStiffness=_PAD_STIFFNESS,
                contactDamping=_PAD_DAMPING,
                frictionAnchor=0,
            )
