"""Reach of a robot over its table, free of self-collision."""

from __future__ import annotations

from collections.abc import Callable

import mujoco

from robosandbox.robots.chains import Tool
from robosandbox.robots.gripper.geometry import DerivedGripper
from robosandbox.robots.importers.imported import compile_spec
from robosandbox.robots.infer.placement import TableWorkspace, find_workspace
from robosandbox.robots.kinematics import Kinematics
from robosandbox.robots.sidecar import Sidecar
from robosandbox.types import Array


def measured_workspace(
    model: mujoco.MjModel,
    sidecar: Sidecar,
    site: int,
    R_site_tcp: Array,
    gripper: DerivedGripper | None,
    table_height: float,
) -> TableWorkspace:
    """Return what a robot reaches with its gripper open.

    Args:
        model: The robot alone.
        sidecar: Its roles; where it puts the base decides how high the table is for the arm.
        site: Id of its TCP site.
        R_site_tcp: Rotation from the site's frame to the TCP frame, shape (3, 3).
        gripper: What was measured of its gripper.
        table_height: In the world, metres.
    """
    start = model.qpos0.copy()
    for name, value in zip(sidecar.arm.joints, sidecar.arm.home_qpos, strict=True):
        start[model.joint(name).qposadr[0]] = value
    if gripper is not None and sidecar.fingers is not None:
        widest = int(gripper.geometry.aperture_samples.argmax())
        for name, value in zip(sidecar.fingers.joints, gripper.coupled_samples[widest], strict=True):
            start[model.joint(name).qposadr[0]] = value
    joints = [model.joint(name).id for name in sidecar.arm.joints]
    kinematics = Kinematics(model, joints, Tool.at_site(model, site, R_site_tcp), qpos=start)
    floor = table_height - sidecar.base_pose.xyz[2]
    space = find_workspace(kinematics, floor, collision_test(model, kinematics))
    # Shapes that overlap wherever the arm is say nothing of its reach.
    return space if space.is_known else find_workspace(kinematics, floor)


def collision_test(
    model: mujoco.MjModel, kinematics: Kinematics, *, deepest: float = 5e-4
) -> Callable[[Array], str | None]:
    """Return a function that says what touches at a configuration of the arm, or None.

    Links that none of its joints moves against each other, as a hand's own, say nothing of a configuration.

    Args:
        model: The robot, with a table or without.
        kinematics: Its arm.
        deepest: How far shapes may overlap before that counts, metres.
    """
    data = mujoco.MjData(model)
    start = kinematics.data.qpos.copy()
    rigid = _beyond(model, kinematics)

    def touching(q: Array) -> str | None:
        data.qpos[:] = start
        data.qpos[kinematics.addresses] = q
        mujoco.mj_fwdPosition(model, data)
        for contact in data.contact[: data.ncon]:
            first, second = (int(model.geom_bodyid[g]) for g in contact.geom)
            if contact.dist < -deepest and rigid[first] != rigid[second]:
                pair = [str(model.body(body).name) for body in (first, second)]
                pair.sort(key=lambda name: name == "world")
                return f"{pair[0]!r} touching {'the table' if pair[1] == 'world' else repr(pair[1])}"
        return None

    return touching


def _beyond(model: mujoco.MjModel, kinematics: Kinematics) -> list[int]:
    """Return for each body how many bodies with a joint of the arm are on the way to it: where two agree, they move together."""
    moved = {int(model.jnt_bodyid[joint]) for joint in kinematics.joints}
    found = [0]
    for body in range(1, model.nbody):
        found.append(found[int(model.body_parentid[body])] + (body in moved))
    return found


def with_table(spec: mujoco.MjSpec, source: str, floor: float) -> mujoco.MjModel:
    """Return a robot compiled with a table at a height in its frame, metres."""
    spec = spec.copy()
    spec.worldbody.add_geom(
        name="robosandbox_table",
        type=mujoco.mjtGeom.mjGEOM_PLANE,
        pos=[0.0, 0.0, floor - 0.001],
        size=[2.0, 2.0, 0.1],
    )
    return compile_spec(spec, source)
