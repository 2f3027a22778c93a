"""TCP of an arm without a gripper: the end of its last link, and the direction in which that points."""

from __future__ import annotations

import re

import mujoco
import numpy as np

from robosandbox.robots.findings import FieldEvidence
from robosandbox.robots.surfaces import world_points
from robosandbox.types import Array

_TOOL = re.compile(
    r"tcp|tool|pinch|grasp|gripper_?frame|end_?effector|\bee\b|ee_|_ee|eef|flange|attachment|grip_?(site|point)", re.I
)
_NO_TOOL = re.compile(r"cam|light|imu|focus|cali", re.I)
_BENT = 1.5  # Ratio of a link's reach aside to that along its joint from which it is bent. Chosen.
_NAMED = 0.002  # Metres below which a named frame says nothing of the direction. Chosen.


def flange_tool(model: mujoco.MjModel, joints: tuple[int, ...], palm: str) -> tuple[str, Array, Array, FieldEvidence]:
    """Return body, position and rotation of the tool of an arm without a gripper: the end of its last link."""
    data = mujoco.MjData(model)
    mujoco.mj_fwdPosition(model, data)
    last = joints[-1]
    link = int(model.jnt_bodyid[last])
    bodies = _welded(model, link)
    points = _points_of(model, data, bodies)
    frames = [data.xpos[b] for b in bodies if is_tool(model.body(b).name)]
    frames += [
        data.site_xpos[s]
        for s in range(model.nsite)
        if int(model.site_bodyid[s]) in bodies and is_tool(model.site(s).name)
    ]
    anchor = data.xanchor[last].copy()
    before = _points_of(model, data, _welded(model, int(model.body_parentid[model.body_weldid[link]])))
    axis, why = _outward(model, data, last, points - anchor, before - anchor, np.array(frames or [anchor]) - anchor)
    # If the last link has no shape, the tool is the end of the link before it.
    solid = points if any(int(b) in bodies for b in model.geom_bodyid) else before
    tip = anchor + axis * float(((solid - anchor) @ axis).max())
    body = next((b for b in sorted(bodies, reverse=True) if is_tool(model.body(b).name)), link)
    R_body = data.xmat[body].reshape(3, 3)
    side = R_body[:, int(np.abs(R_body.T @ axis).argmin())]
    closing = side - axis * (axis @ side)
    closing /= np.linalg.norm(closing)
    rotation = R_body.T @ np.column_stack([np.cross(closing, axis), closing, axis])
    position = R_body.T @ (tip - data.xpos[body])
    return str(model.body(body).name), position, rotation, FieldEvidence(0.8, f"the end of the last link, {why}")


def _outward(
    model: mujoco.MjModel, data: mujoco.MjData, joint: int, points: Array, before: Array, frames: Array
) -> tuple[Array, str]:
    """Return the direction, shape (3,), in which the last link points, and which one that is.

    Args:
        model: The robot.
        data: Where it is.
        joint: The last joint.
        points: On the last link, from the joint's anchor, shape (k, 3).
        before: On the link that carries it, shape (k, 3).
        frames: The model's own tool frames there, shape (k, 3).
    """
    axis = data.xaxis[joint].copy()
    along, behind = points @ axis, before @ axis
    flat = points - np.outer(along, axis)
    aside = flat.mean(axis=0)
    reach = float(np.linalg.norm(flat, axis=1).max())
    # A wrist that ends in a bend, not in a roll, points the way its link reaches from the joint.
    if np.linalg.norm(aside) > max(_BENT * abs(float(along.mean())), 0.5 * reach, 0.01):
        direction = aside / np.linalg.norm(aside)
        return _nearest_axis(data.xmat[model.jnt_bodyid[joint]].reshape(3, 3), direction), "across its joint's axis"
    # A flange may be so thin that it lies on neither side of its origin: it is on the far side of what carries it.
    tip, root = float(along[np.abs(along).argmax()]), float(behind.mean())
    named = float((frames @ axis).mean())
    outward = named if abs(named) > _NAMED else tip if abs(tip) > abs(root) else float(along.mean()) - root
    return (axis if outward >= 0.0 else -axis), "along its joint's axis"


def _nearest_axis(R: Array, direction: Array) -> Array:
    """Return the frame's own axis within 15 degrees of a direction, else the direction; shape (3,)."""
    cosines = R.T @ direction
    best = int(np.abs(cosines).argmax())
    axis: Array = R[:, best] * np.sign(cosines[best])
    return axis if abs(cosines[best]) > np.cos(np.radians(15.0)) else direction


def _welded(model: mujoco.MjModel, body: int) -> frozenset[int]:
    weld = int(model.body_weldid[body])
    return frozenset(b for b in range(1, model.nbody) if int(model.body_weldid[b]) == weld)


def _points_of(model: mujoco.MjModel, data: mujoco.MjData, bodies: frozenset[int]) -> Array:
    """Return points on bodies, their origins where they have no shape; shape (k, 3)."""
    geoms = [g for g in range(model.ngeom) if int(model.geom_bodyid[g]) in bodies]
    points = world_points(model, data, geoms, 0.005) if geoms else data.xpos[sorted(bodies)]
    return points if len(points) else np.zeros((1, 3))


def is_tool(name: str) -> bool:
    """Tell whether a site or frame is called like a tool."""
    return bool(_TOOL.search(name)) and not _NO_TOOL.search(name)
