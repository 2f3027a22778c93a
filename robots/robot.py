"""A robot in a compiled model: which indices are its arm, its gripper, its TCP, and what was derived of them."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import mujoco
import numpy as np
from numpy.typing import NDArray

from robosandbox.types import Array, GripperState, Limits

Indices = NDArray[np.integer[Any]]


@dataclass(frozen=True, slots=True, kw_only=True)
class GripperGeometry:
    """What the model says of a gripper; lengths in metres, directions in the TCP frame (z approach, y closing).

    Attributes:
        joint_samples: Primary joint values, increasing, shape (k,).
        aperture_samples: Gap between the pads at each, shape (k,).
        centre_samples: Where the middle of the gap lies at each, along the closing direction from the TCP, shape (k,): 0
            for fingers that meet in the middle, half the gap for a single moving jaw.
        control_samples: Actuator controls that hold each, shape (k, actuators).
        open_joint: The sidecar's open_qpos.
        closed_joint: The sidecar's closed_qpos.
        max_aperture: Gap at open.
        min_aperture: Gap at closed.
        tip_depth: How far the fingertips reach beyond the TCP along the approach.
        palm_depth: Free length between the fingers behind the TCP, up to the palm.
        finger_thickness: Of one finger along the closing direction, near its tip.
        finger_width: Of the pads across closing and approach.
        pads: Names of the two pad geoms or of their bodies, for messages.
    """

    joint_samples: Array
    aperture_samples: Array
    centre_samples: Array
    control_samples: Array
    open_joint: float
    closed_joint: float
    max_aperture: float
    min_aperture: float
    tip_depth: float
    palm_depth: float
    finger_thickness: float
    finger_width: float
    pads: tuple[str, str]

    def aperture(self, joint: float) -> float:
        """Return the gap between the pads at a primary joint value."""
        return float(np.interp(joint, self.joint_samples, self.aperture_samples))

    def joint_for_aperture(self, aperture: float) -> float:
        """Return the primary joint value whose gap comes closest to `aperture`."""
        order = np.argsort(self.aperture_samples, kind="stable")
        return float(np.interp(aperture, self.aperture_samples[order], self.joint_samples[order]))

    def centre(self, aperture: float) -> float:
        """Return where along the closing direction, from the TCP, the middle of a gap of `aperture` lies, metres."""
        return float(np.interp(self.joint_for_aperture(aperture), self.joint_samples, self.centre_samples))

    def closed_fraction(self, joint: float) -> float:
        """Return 0 at open, 1 at closed, not clipped."""
        return (joint - self.open_joint) / (self.closed_joint - self.open_joint)

    def control(self, closed: float) -> Array:
        """Return the actuator controls, shape (actuators,), for a closed fraction in 0..1."""
        joint = self.open_joint + closed * (self.closed_joint - self.open_joint)
        return np.array([np.interp(joint, self.joint_samples, column) for column in self.control_samples.T])


@dataclass(frozen=True, slots=True, kw_only=True)
class Gripper:
    """A gripper bound to a model.

    Attributes:
        geometry: What was derived of it.
        qpos_index: Address of the primary joint in qpos.
        joint_indices: Addresses of all its joints in qpos, shape (g,).
        actuator_ids: Its actuators.
        bodies: Ids of the bodies that it moves, and of a fixed jaw.
        finger_bodies: The two sides' body ids.
        coupled_samples: All its joints at each of `geometry.joint_samples`, shape (k, g).
        driven: Columns of `coupled_samples` whose joints have an actuator of their own, shape (d,).
        force_limits: Largest actuator force, shape (actuators,); infinite when the model sets none.
    """

    geometry: GripperGeometry
    qpos_index: int
    joint_indices: Indices
    actuator_ids: Array
    bodies: frozenset[int]
    finger_bodies: tuple[frozenset[int], frozenset[int]]
    coupled_samples: Array
    driven: Indices
    force_limits: Array

    def joints_at(self, joint: float) -> Array:
        """Return all gripper joint values, shape (g,), when the primary joint is at `joint`."""
        samples = self.geometry.joint_samples
        return np.array([np.interp(joint, samples, column) for column in self.coupled_samples.T])

    def state(self, data: mujoco.MjData) -> GripperState:
        """Return the gripper's own readings."""
        joint = float(data.qpos[self.qpos_index])
        geometry = self.geometry
        return GripperState(
            joint=joint,
            width=max(0.0, geometry.aperture(joint if len(self.driven) < 2 else self._mean_joint(data))),
            closed=geometry.closed_fraction(joint),
            force=float(np.abs(data.actuator_force[self.actuator_ids]).sum()),
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


@dataclass(frozen=True, slots=True, kw_only=True)
class RobotFiles:
    """The files of a robot whose sidecar somebody wrote for it.

    Attributes:
        model: The URDF or MJCF, resolved.
        sidecar: Resolved.
        package_paths: Where the model's package:// names are looked up.
    """

    model: Path
    sidecar: Path
    package_paths: tuple[Path, ...] = ()


@dataclass(frozen=True, slots=True, kw_only=True)
class Robot:
    """A robot bound to a model. Arrays over arm joints have shape (n,), in sidecar order.

    Attributes:
        name: The model's stem.
        joints: Arm joint names as in the sidecar.
        qpos_indices: Addresses in qpos.
        dof_indices: Addresses in qvel.
        actuator_ids: Indices into ctrl.
        control_scale: Control per joint value, of the position servos.
        control_offset: Control at joint value 0.
        lower: Joint limits; -inf where there is none.
        upper: Joint limits; inf where there is none.
        velocity_limits: rad/s or m/s.
        acceleration_limits: rad/s^2 or m/s^2.
        home_q: The sidecar's home.
        tcp_site: Id of the TCP site.
        R_site_tcp: Rotation from the site's frame to the TCP frame (z approach, y closing), shape (3, 3).
        bodies: Ids of all its bodies.
        base_position: Its base in the world, shape (3,).
        gripper: None for an arm without one.
        tool_bounds: (x_min, x_max, y_min, y_max) of what is at the TCP, in its frame; of an arm without a gripper its last link.
        reach: Least and largest horizontal distance from its first axis at which the tool points down at a table.
        limits: The sidecar's; what nobody's plan may pass.
        files: Where it comes from, if it has a sidecar of its own; None for a bundled or an inferred one.
    """

    name: str
    joints: tuple[str, ...]
    qpos_indices: Indices
    dof_indices: Indices
    actuator_ids: Array
    control_scale: Array
    control_offset: Array
    lower: Array
    upper: Array
    velocity_limits: Array
    acceleration_limits: Array
    home_q: Array
    tcp_site: int
    R_site_tcp: Array
    bodies: frozenset[int]
    base_position: Array
    gripper: Gripper | None
    reach: tuple[float, float]
    tool_bounds: tuple[float, float, float, float] = (-0.01, 0.01, -0.01, 0.01)
    limits: Limits | None = None
    files: RobotFiles | None = None

    @property
    def n(self) -> int:
        """The number of arm joints."""
        return len(self.joints)

    def control(self, q: Array) -> Array:
        """Return the servo controls, shape (..., n), that hold `q` (..., n)."""
        return q * self.control_scale + self.control_offset

    def tcp(self, data: mujoco.MjData) -> tuple[Array, Array]:
        """Return the TCP's position (3,) and rotation (3, 3) in the world."""
        return data.site_xpos[self.tcp_site].copy(), data.site_xmat[self.tcp_site].reshape(3, 3) @ self.R_site_tcp
