"""A suction cup found in a model: the body that sticks to things, its lip, and which way it faces."""

from __future__ import annotations

import mujoco
import numpy as np

from robosandbox.robots.findings import FieldEvidence
from robosandbox.robots.gripper.cup import lip, suctions
from robosandbox.robots.infer.tcp import flange_tool
from robosandbox.robots.sidecar import SuctionRoles
from robosandbox.robots.tolerances import ROBOT_TOLERANCES
from robosandbox.types import Array
from robosandbox.values import frozen


@frozen
class InferredCup:
    """Suction cup found by names: TCP position (3,) and rotation (3, 3) are in its body's frame."""

    roles: SuctionRoles
    body: str
    tool: Array
    rotation: Array
    findings: dict[str, FieldEvidence]


def infer_cup(model: mujoco.MjModel, joints: tuple[int, ...]) -> InferredCup | None:
    """Return the cup at the end of an arm, or None where nothing beyond its last joint sucks.

    Args:
        model: The robot.
        joints: Ids of the arm's joints, base to wrist.
    """
    end = int(model.body_weldid[model.jnt_bodyid[joints[-1]]])
    for name in suctions(model):
        body = int(model.actuator_trnid[model.actuator(name).id, 0])
        if int(model.body_weldid[body]) != end or not model.body_geomnum[body]:
            continue
        data = mujoco.MjData(model)
        mujoco.mj_fwdPosition(model, data)
        facing = _facing(model, data, joints, body)
        R_body = data.xmat[body].reshape(3, 3)
        points = lip(model, data, body, facing)
        side = R_body[:, int(np.abs(R_body.T @ facing).argmin())]
        closing = side - facing * (facing @ side)
        closing /= np.linalg.norm(closing)
        rotation = np.column_stack([np.cross(closing, facing), closing, facing])
        local = points @ rotation
        middle = rotation @ np.array([*(local.max(axis=0) + local.min(axis=0))[:2] / 2.0, local[:, 2].max()])
        across = float(np.ptp(local[:, :2], axis=0).min())
        actuator = model.actuator(name).id
        force = float(np.abs(model.actuator_ctrlrange[actuator]).max() * abs(model.actuator_gainprm[actuator, 0]))
        said = f"a cup of {across * 1000:.0f} mm that pulls with up to {force:.0f} N"
        return InferredCup(
            roles=SuctionRoles(kind="suction", actuator=name),
            body=str(model.body(body).name),
            tool=R_body.T @ (middle - data.xpos[body]),
            rotation=R_body.T @ rotation,
            findings={
                "gripper": FieldEvidence(0.95, said),
                "gripper.actuator": FieldEvidence(0.95, f"adhesion on {model.body(body).name!r}"),
                "ee_site.inject.xyz": FieldEvidence(0.95, "the middle of the cup's lip"),
                "ee_site.inject.quat_xyzw": FieldEvidence(0.9, "z out of the cup"),
            },
        )
    return None


def _facing(model: mujoco.MjModel, data: mujoco.MjData, joints: tuple[int, ...], body: int) -> Array:
    """Return the direction in the world, shape (3,), in which a cup faces: away from what carries it, along an axis of its own."""
    link, _, turn, _ = flange_tool(model, joints, str(model.body(body).name))
    outward = data.xmat[model.body(link).id].reshape(3, 3) @ turn[:, 2]
    first, count = int(model.body_geomadr[body]), int(model.body_geomnum[body])
    away = data.geom_xpos[first : first + count].mean(axis=0) - data.xanchor[joints[-1]]
    length = float(np.linalg.norm(away))
    if length < 1e-6 or outward @ away > ROBOT_TOLERANCES.along * length:
        return np.asarray(outward)
    axes = data.xmat[body].reshape(3, 3).T
    cosines = axes @ (away / length)
    best = int(np.abs(cosines).argmax())
    return np.asarray(
        axes[best] * np.sign(cosines[best]) if abs(cosines[best]) > ROBOT_TOLERANCES.along else away / length
    )
