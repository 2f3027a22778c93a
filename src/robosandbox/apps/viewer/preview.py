"""Transparent copies: of the whole robot in another configuration, and of its gripper at another pose."""

from __future__ import annotations

import mujoco
import numpy as np
import trimesh
import viser

from robosandbox.apps.viewer.scene import BodyScene, add_surface
from robosandbox.apps.viewer.source import Blueprint
from robosandbox.types import Array, Pose

_COLOUR = (70, 130, 210)  # Channels of 255 levels. Chosen.
_OPACITY = 0.3  # A fraction. Chosen so that the robot shows through its preview.


class PreviewRobot:
    """The robot once more, transparent, wherever it is put.

    Args:
        server: Where it is drawn.
        blueprint: Whose robot.
        body_scene: Has its shapes.
        node: Name of the scene node for it.
    """

    def __init__(self, server: viser.ViserServer, blueprint: Blueprint, body_scene: BodyScene, node: str) -> None:
        self._blueprint = blueprint
        self._data = mujoco.MjData(blueprint.model)
        self._root = server.scene.add_frame(node, show_axes=False)
        self._parts: dict[int, viser.MeshHandle] = {}
        for body in sorted(blueprint.robot.bodies):
            shape = body_scene.shape(body)
            if shape is not None:
                self._parts[body] = add_surface(server, f"{node}/{body}", shape, _COLOUR, _OPACITY)

    def pose(self, q: Array, base_change: Pose | None = None) -> Pose:
        """Put the arm at a configuration.

        Args:
            q: Shape (n,).
            base_change: A transform of the world that takes the robot from where the model has it to where it is to stand.

        Returns:
            The TCP in the world.
        """
        model, robot, data = self._blueprint.model, self._blueprint.robot, self._data
        data.qpos[robot.qpos_indices] = q
        if robot.gripper is not None:
            data.qpos[robot.gripper.joint_indices] = robot.gripper.joints_at(robot.gripper.geometry.open_joint)
        mujoco.mj_kinematics(model, data)
        change = base_change or Pose(xyz=(0.0, 0.0, 0.0))
        for body, part in self._parts.items():
            moved = change @ Pose.from_matrix(data.xpos[body], data.xmat[body].reshape(3, 3))
            part.position, part.wxyz = moved.position, _wxyz(moved)
        return change @ Pose.from_matrix(*robot.tcp(data))

    def tool_body(self) -> Pose:
        """Return the body that the TCP rides on, in the world as `pose` last put it, before the base's change."""
        body = int(self._blueprint.model.site_bodyid[self._blueprint.robot.tcp_site])
        return Pose.from_matrix(self._data.xpos[body], self._data.xmat[body].reshape(3, 3))

    def remove(self) -> None:
        """Take it away."""
        self._root.remove()


def gripper_shape(blueprint: Blueprint, body_scene: BodyScene) -> trimesh.Trimesh | None:
    """Return the open gripper's surface in the TCP's frame; None for an arm without one."""
    model, robot = blueprint.model, blueprint.robot
    if robot.gripper is None:
        return None
    data = mujoco.MjData(model)
    data.qpos[robot.qpos_indices] = robot.home_q
    data.qpos[robot.gripper.joint_indices] = robot.gripper.joints_at(robot.gripper.geometry.open_joint)
    mujoco.mj_kinematics(model, data)
    T_tcp_world = Pose.from_matrix(*robot.tcp(data)).inverse()
    parts = []
    for body in sorted(robot.gripper.bodies | {int(model.site_bodyid[robot.tcp_site])}):
        shape = body_scene.shape(body) or body_scene.shape(body, collision=True)
        if shape is not None:
            T_tcp_body = T_tcp_world @ Pose.from_matrix(data.xpos[body], data.xmat[body].reshape(3, 3))
            points = np.asarray(shape.vertices) @ T_tcp_body.rotation.T + T_tcp_body.position
            parts.append(trimesh.Trimesh(points, shape.faces, process=False))
    joined = trimesh.util.concatenate(parts) if parts else None
    return joined if isinstance(joined, trimesh.Trimesh) else None


def add_gripper(
    server: viser.ViserServer, node: str, shape: trimesh.Trimesh, pose: Pose, colour: tuple[int, int, int]
) -> viser.MeshHandle:
    """Draw a gripper's shape with its TCP at a pose; return its handle."""
    handle = add_surface(server, node, shape, colour, 0.5)
    handle.position, handle.wxyz = pose.position, _wxyz(pose)
    return handle


def _wxyz(pose: Pose) -> Array:
    x, y, z, w = pose.quat_xyzw
    return np.array([w, x, y, z])
