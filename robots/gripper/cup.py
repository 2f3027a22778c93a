"""A suction cup measured on its model: the lip, what it sucks with, and how far it seals."""

from __future__ import annotations

import mujoco
import numpy as np

from robosandbox.errors import InputError
from robosandbox.robots.gripper.calibrate import collision_geoms
from robosandbox.robots.gripper.geometry import DerivedGripper
from robosandbox.robots.sidecar import SuctionRoles
from robosandbox.robots.surfaces import world_points
from robosandbox.types import Array, frozen_array
from robosandbox.types.robot import GripperGeometry

# Metres behind its foremost point within which a cup's shape is its lip. Chosen: a lip of rubber gives way by about as much.
_LIP = 0.001
# Metres between the TCP and the plane of the lip, above which a sidecar's is no cup's. Chosen as a thin cup's height.
_OFF_LIP = 0.01
_SPACING = 0.0005  # Metres between points on a lip. Chosen: half of `_LIP`.


def suctions(model: mujoco.MjModel) -> list[str]:
    """Return the names of a model's adhesion actuators."""
    found = np.flatnonzero(model.actuator_trntype == mujoco.mjtTrn.mjTRN_BODY.value)
    return [str(model.actuator(int(a)).name) for a in found]


def lip(model: mujoco.MjModel, data: mujoco.MjData, body: int, approach: Array) -> Array:
    """Return points of a cup's lip in the world, shape (k, 3): what of its colliding shape lies farthest along `approach` (3,)."""
    points = world_points(model, data, collision_geoms(model, frozenset({body})), _SPACING)
    along = points @ approach
    return np.asarray(points[along > along.max(initial=-np.inf) - _LIP])


def derive_cup(model: mujoco.MjModel, roles: SuctionRoles, tcp_site: int, R_site_tcp: Array) -> DerivedGripper:
    """Measure the cup of a robot compiled alone.

    Args:
        model: The robot without a world.
        roles: The sidecar's gripper, complete.
        tcp_site: Id of the TCP site.
        R_site_tcp: Rotation from its frame to the TCP frame, shape (3, 3).

    Raises:
        InputError: The cup has no shape, its control no range, or the TCP lies off its lip.
    """
    actuator = int(model.actuator(roles.actuator_names[0]).id)
    body = int(model.actuator_trnid[actuator, 0])
    name = str(model.body(body).name)
    low, high = (float(end) for end in model.actuator_ctrlrange[actuator])
    if not model.actuator_ctrllimited[actuator] or high <= low:
        raise InputError(
            f"gripper.actuator: {roles.actuator_names[0]!r} has no control range, so nobody knows how to suck"
        )
    data = mujoco.MjData(model)
    mujoco.mj_fwdPosition(model, data)
    rotation = data.site_xmat[tcp_site].reshape(3, 3) @ R_site_tcp
    points = (lip(model, data, body, rotation[:, 2]) - data.site_xpos[tcp_site]) @ rotation
    if not len(points):
        raise InputError(f"gripper.actuator: {name!r} has no shape that could seal")
    off = float(points[:, 2].max())
    if abs(off) > _OFF_LIP:
        raise InputError(
            f"ee_site: is {abs(off) * 1000:.0f} mm off the lip of {name!r}; put it in the plane of the lip"
        )
    solid = (world_points(model, data, collision_geoms(model, frozenset({body}))) - data.site_xpos[tcp_site]) @ rotation
    diameter = float(np.ptp(points[:, :2], axis=0).min())
    geometry = GripperGeometry(
        joint_samples=frozen_array([0.0, 1.0]),
        aperture_samples=frozen_array([0.0, 0.0]),
        centre_samples=frozen_array([0.0, 0.0]),
        control_samples=frozen_array([[low], [high]]),
        open_joint=0.0,
        closed_joint=1.0,
        max_aperture=0.0,
        min_aperture=0.0,
        tip_depth=max(0.0, off),
        palm_depth=max(0.0, -float(solid[:, 2].min())),
        finger_thickness=0.5 * diameter,
        finger_width=diameter,
        pads=(name, name),
        cup=diameter,
    )
    return DerivedGripper(
        geometry=geometry, coupled_samples=frozen_array(np.zeros((2, 0))), fingers=((name,), ()), R_site_tcp=R_site_tcp
    )
