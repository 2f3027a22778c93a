"""The force sensor at the wrist: what the hand presses and pulls with, its own weight and inertia taken out."""

from __future__ import annotations

import numpy as np
import pybullet

from robosandbox.types import Array
from robosandbox_pybullet.world import GRAVITY, PHYSICS_TIMESTEP, BulletWorld


class WristSensor:
    """Measures at the joint that carries the hand.

    Args:
        world: Whose robot; the sensor is switched on.

    Attributes:
        force: What the hand gave to the rest of the world in the last step, N in the world, shape (3,).
    """

    def __init__(self, world: BulletWorld) -> None:
        self._world = world
        world.call("enableJointForceTorqueSensor", world.robot, world.hand, enableSensor=True)
        links = (world.hand, *world.fingers)
        # kg; the fingers ride on the hand.
        self._mass = sum(world.call("getDynamicsInfo", world.robot, link)[0] for link in links)
        self._speed = np.zeros(3)
        self.force: Array = np.zeros(3)

    def sample(self) -> None:
        """Read it after a physics step: what the arm gave to the hand, less what carried and accelerated the hand."""
        reaction = self._world.call("getJointState", self._world.robot, self._world.hand)[2]
        state = self._world.call("getLinkState", self._world.robot, self._world.hand, computeLinkVelocity=True)
        rotation = np.array(pybullet.getMatrixFromQuaternion(state[5])).reshape(3, 3)
        before, self._speed = self._speed, np.array(state[6])
        acceleration = (self._speed - before) / PHYSICS_TIMESTEP
        self.force = rotation @ np.array(reaction[:3]) - self._mass * (acceleration + [0.0, 0.0, GRAVITY])
