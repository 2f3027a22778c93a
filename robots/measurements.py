"""Measurements on a compiled robot, cached: each model is measured once on a machine."""

from __future__ import annotations

import json
import platform
from functools import cache
from pathlib import Path

import mujoco
import numpy as np

from robosandbox.cache import as_data, cached, content_key
from robosandbox.robots.gripper.calibrate import collision_geoms
from robosandbox.robots.gripper.cup import derive_cup
from robosandbox.robots.gripper.geometry import DerivedGripper, derive_gripper
from robosandbox.robots.infer.placement import TableWorkspace
from robosandbox.robots.infer.reach import measured_workspace
from robosandbox.robots.infer.tcp import flange_tool
from robosandbox.robots.sidecar import Sidecar
from robosandbox.robots.surfaces import world_points
from robosandbox.types import Array
from robosandbox.values import frozen

_TOOL_LENGTH = 0.025  # Metres along the approach from the TCP within which a shape counts as being at it. Chosen.


@frozen(kw_only=True)
class Measurements:
    """Measurements of a robot that skills need and its sidecar does not say.

    Attributes:
        gripper: Travel, pads and depth; None without a gripper.
        R_site_tcp: Rotation from the TCP site's frame to the TCP frame, shape (3, 3).
        workspace: What it reaches over its table.
        tool_bounds: x_min, x_max, y_min, y_max of what is at the TCP, in its frame, metres.
    """

    gripper: DerivedGripper | None
    R_site_tcp: Array
    workspace: TableWorkspace
    tool_bounds: tuple[float, float, float, float]


def measurements(
    model: mujoco.MjModel, sidecar: Sidecar, tcp_site: str, *, table_height: float, workspace: TableWorkspace | None
) -> Measurements:
    """Measure a robot, or return what was measured of the same one before.

    Args:
        model: The robot compiled alone, its TCP site in it.
        sidecar: Its complete roles.
        tcp_site: Name of the site.
        table_height: Of the table that it works on, metres.
        workspace: What it reaches, if that is known already.

    Raises:
        InputError: The gripper cannot be as the sidecar says.
    """

    def key() -> str:
        # The compiled model is what the robot's files come to, whatever they include and wherever their meshes lie.
        compiled = np.zeros(mujoco.mj_sizeModel(model), np.uint8)
        mujoco.mj_saveModel(model, None, compiled)
        said = (sidecar.model_dump_json(), tcp_site, repr(table_height), json.dumps(as_data(workspace)))
        return content_key((*_versions(), *said, compiled.tobytes()))

    return cached(
        "robot",
        Measurements,
        key,
        lambda: _measure(model, sidecar, tcp_site, table_height=table_height, workspace=workspace),
    )


def _measure(
    model: mujoco.MjModel, sidecar: Sidecar, tcp_site: str, *, table_height: float, workspace: TableWorkspace | None
) -> Measurements:
    site = int(model.site(tcp_site).id)
    oriented = sidecar.ee_site.inject is not None and sidecar.ee_site.inject.quat_xyzw is not None
    gripper = None
    if sidecar.fingers:
        gripper = derive_gripper(model, sidecar.fingers, site, home_by_address(model, sidecar), oriented=oriented)
    R_site_tcp = gripper.R_site_tcp if gripper else _bare_tool(model, sidecar, site, oriented)
    if sidecar.suction:
        gripper = derive_cup(model, sidecar.suction, site, R_site_tcp)
    if workspace is None:
        workspace = measured_workspace(model, sidecar, site, R_site_tcp, gripper, table_height)
    return Measurements(
        gripper=gripper,
        R_site_tcp=R_site_tcp,
        workspace=workspace,
        tool_bounds=_tool_bounds(model, site, R_site_tcp),
    )


def home_by_address(model: mujoco.MjModel, sidecar: Sidecar) -> dict[int, float]:
    """Return the arm's home: qpos address -> value."""
    return {
        int(model.jnt_qposadr[model.joint(name).id]): value
        for name, value in zip(sidecar.arm.joints, sidecar.arm.home_qpos, strict=True)
    }


@cache
def _versions() -> tuple[str, ...]:
    """Return what measures: this package's source as it is, and the libraries that compute."""
    source = content_key(path.read_bytes() for path in sorted(Path(__file__).parent.rglob("*.py")))
    return source, mujoco.__version__, np.__version__, platform.machine()


def _tool_bounds(model: mujoco.MjModel, site: int, R_site_tcp: Array) -> tuple[float, float, float, float]:
    """Return x_min, x_max, y_min, y_max of what is at the TCP, near its end and in its frame."""
    data = mujoco.MjData(model)
    mujoco.mj_fwdPosition(model, data)
    body = int(model.body_weldid[model.site_bodyid[site]])
    while body:
        bodies = frozenset(b for b in range(1, model.nbody) if int(model.body_weldid[b]) == body)
        points = world_points(model, data, collision_geoms(model, bodies), 0.004)
        local = (points - data.site_xpos[site]) @ data.site_xmat[site].reshape(3, 3) @ R_site_tcp
        near = local[(local[:, 2] > -_TOOL_LENGTH) & (local[:, 2] < _TOOL_LENGTH)]
        if len(near):
            (x_min, y_min), (x_max, y_max) = near[:, :2].min(axis=0), near[:, :2].max(axis=0)
            return float(x_min), float(x_max), float(y_min), float(y_max)
        # A last link without a shape: the one before it does the work.
        body = int(model.body_weldid[model.body_parentid[body]])
    return -0.01, 0.01, -0.01, 0.01


def _bare_tool(model: mujoco.MjModel, sidecar: Sidecar, site: int, oriented: bool) -> Array:
    """Return R_site_tcp of an arm without a gripper: z as given, else along the last joint's axis, outwards."""
    if oriented:
        return np.eye(3)
    data = mujoco.MjData(model)
    mujoco.mj_fwdPosition(model, data)
    joints = tuple(model.joint(name).id for name in sidecar.arm.joints)
    body, _, rotation, _ = flange_tool(model, joints, str(model.body(model.site_bodyid[site]).name))
    R_world = data.xmat[model.body(body).id].reshape(3, 3) @ rotation
    turned: Array = data.site_xmat[site].reshape(3, 3).T @ R_world
    return turned
