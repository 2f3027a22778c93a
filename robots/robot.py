"""A robot in a compiled model: which indices are its arm, its gripper, its TCP."""

from __future__ import annotations

from dataclasses import fields
from typing import Any

import mujoco
import numpy as np
from numpy.typing import NDArray

from robosandbox.types import Array, GripperState
from robosandbox.types.robot import GripperSpec, RobotSpec
from robosandbox.values import frozen

Indices = NDArray[np.integer[Any]]


@frozen(kw_only=True)
class Gripper(GripperSpec):
    """A gripper bound to a model.

    Attributes:
        qpos_index: Address of the primary joint in qpos; None of a suction cup.
        joint_indices: Addresses of all its joints in qpos, shape (g,).
        actuator_ids: Its actuators.
        bodies: Ids of the bodies that it moves, and of a fixed jaw.
        finger_bodies: The two sides' body ids.
        coupled_samples: All its joints at each of `geometry.joint_samples`, shape (k, g).
        driven: Columns of `coupled_samples` whose joints have an actuator of their own, shape (d,).
    """

    qpos_index: int | None
    joint_indices: Indices
    actuator_ids: Array
    bodies: frozenset[int]
    finger_bodies: tuple[frozenset[int], frozenset[int]]
    coupled_samples: Array
    driven: Indices

    def joints_at(self, joint: float) -> Array:
        """Return all gripper joint values, shape (g,), when the primary joint is at `joint`; a cup has none."""
        samples = self.geometry.joint_samples
        return np.array([np.interp(joint, samples, column) for column in self.coupled_samples.T])

    def state(self, data: mujoco.MjData) -> GripperState:
        """Return the gripper's own readings."""
        geometry = self.geometry
        force = float(np.abs(data.actuator_force[self.actuator_ids]).sum())
        if self.qpos_index is None:
            # A cup has no encoder: what it is told to do is what it does.
            sucking = float(
                np.interp(data.ctrl[self.actuator_ids[0]], geometry.control_samples[:, 0], geometry.joint_samples)
            )
            return GripperState(joint=sucking, width=0.0, closed=sucking, force=force)
        joint = float(data.qpos[self.qpos_index])
        return GripperState(
            joint=joint,
            width=max(0.0, geometry.aperture(joint if len(self.driven) < 2 else self._mean_joint(data))),
            closed=geometry.closed_fraction(joint),
            force=force,
        )

    def _mean_joint(self, data: mujoco.MjData) -> float:
        """Return the primary joint value at which fingers with motors of their own would be as far closed on average."""
        values = []
        for column in self.driven:
            samples = self.coupled_samples[:, column]
            order = np.argsort(samples, kind="stable")
            q = data.qpos[self.joint_indices[column]]
            values.append(np.interp(q, samples[order], self.geometry.joint_samples[order]))
        return float(np.mean(values))


@frozen(kw_only=True)
class Robot(RobotSpec):
    """A robot bound to a model. Arrays over arm joints have shape (n,), in sidecar order.

    Attributes:
        gripper: Likewise bound; None for an arm without one.
        qpos_indices: Addresses in qpos.
        dof_indices: Addresses in qvel.
        actuator_ids: Indices into ctrl.
        control_scale: Control per joint value, of the position servos.
        control_offset: Control at joint value 0.
        tcp_site: Id of the TCP site.
        R_site_tcp: Rotation from the site's frame to the TCP frame (z approach, y closing), shape (3, 3).
        bodies: Ids of all its bodies.
    """

    qpos_indices: Indices
    dof_indices: Indices
    actuator_ids: Array
    control_scale: Array
    control_offset: Array
    tcp_site: int
    R_site_tcp: Array
    bodies: frozenset[int]
    gripper: Gripper | None

    def control(self, q: Array) -> Array:
        """Return the servo controls, shape (..., n), that hold `q` (..., n)."""
        return q * self.control_scale + self.control_offset

    def tcp(self, data: mujoco.MjData) -> tuple[Array, Array]:
        """Return the TCP's position (3,) and rotation (3, 3) in the world."""
        return data.site_xpos[self.tcp_site].copy(), data.site_xmat[self.tcp_site].reshape(3, 3) @ self.R_site_tcp

    @property
    def spec(self) -> RobotSpec:
        """Specification of the robot, apart from the model."""
        values = {item.name: getattr(self, item.name) for item in fields(RobotSpec)}
        gripper = self.gripper
        if gripper is not None:
            values["gripper"] = GripperSpec(geometry=gripper.geometry, force_limits=gripper.force_limits)
        return RobotSpec(**values)
