"""Poses of a recorded world's bodies as Foxglove's tree of frames."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import mujoco
import numpy as np
from foxglove_schemas_protobuf.FrameTransform_pb2 import FrameTransform
from foxglove_schemas_protobuf.Pose_pb2 import Pose
from foxglove_schemas_protobuf.Quaternion_pb2 import Quaternion
from foxglove_schemas_protobuf.Vector3_pb2 import Vector3
from google.protobuf.timestamp_pb2 import Timestamp

from robosandbox.sim.world import World
from robosandbox.types import Array

WORLD = "world"
# MuJoCo's cameras look along -z with y up, the optical frames of calibrations along z with y down: half a turn about x.
_TO_OPTICAL = np.array([0.0, 1.0, 0.0, 0.0])


class Frames:
    """The frames of a world: a body's is named after it and hangs on the body that carries it.

    Args:
        world: The model.
        cameras: Those that get an optical frame (x right, y down, z ahead), `camera/<name>`.
    """

    def __init__(self, world: World, cameras: Sequence[str]) -> None:
        self._model = world.model
        self._data = mujoco.MjData(world.model)
        self._names = (WORLD, *world.names[1:])
        self._cameras = {camera_frame(name): world.model.camera(world.cameras[name]).id for name in cameras}

    def at(self, qpos: Array, stamp: Timestamp) -> Iterator[FrameTransform]:
        """Yield the transform of each frame into its parent's at MuJoCo's generalized positions, shape (nq,)."""
        model, data = self._model, self._data
        data.qpos[:] = qpos
        mujoco.mj_kinematics(model, data)
        for body in range(1, model.nbody):
            parent = int(model.body_parentid[body])
            xyz, wxyz = _relative(data.xpos[parent], data.xquat[parent], data.xpos[body], data.xquat[body])
            yield transform(self._names[parent], self._names[body], xyz, wxyz, stamp)
        for name, camera in self._cameras.items():
            wxyz = np.empty(4)
            mujoco.mju_mulQuat(wxyz, model.cam_quat[camera], _TO_OPTICAL)
            parent = int(model.cam_bodyid[camera])
            yield transform(self._names[parent], name, model.cam_pos[camera], wxyz, stamp)


def camera_frame(name: str) -> str:
    """Return the name of a camera's optical frame."""
    return f"camera/{name}"


def transform(parent: str, child: str, xyz: Array, wxyz: Array, stamp: Timestamp) -> FrameTransform:
    """Return a transform from the child's frame into the parent's; metres, quaternion w, x, y, z."""
    return FrameTransform(
        timestamp=stamp,
        parent_frame_id=parent,
        child_frame_id=child,
        translation=vector(xyz),
        rotation=quaternion(wxyz),
    )


def pose(xyz: Array, wxyz: Array) -> Pose:
    """Return a pose; metres, quaternion w, x, y, z."""
    return Pose(position=vector(xyz), orientation=quaternion(wxyz))


def vector(xyz: Array | Sequence[float]) -> Vector3:
    """Return three numbers as Foxglove's vector."""
    x, y, z = (float(value) for value in xyz)
    return Vector3(x=x, y=y, z=z)


def quaternion(wxyz: Array) -> Quaternion:
    """Return a quaternion w, x, y, z as Foxglove's."""
    w, x, y, z = (float(value) for value in wxyz)
    return Quaternion(x=x, y=y, z=z, w=w)


def _relative(parent_xyz: Array, parent_wxyz: Array, xyz: Array, wxyz: Array) -> tuple[Array, Array]:
    """Return a world pose as seen from another."""
    inverse_xyz, inverse_wxyz, found_xyz, found_wxyz = np.empty(3), np.empty(4), np.empty(3), np.empty(4)
    mujoco.mju_negPose(inverse_xyz, inverse_wxyz, parent_xyz, parent_wxyz)
    mujoco.mju_mulPose(found_xyz, found_wxyz, inverse_xyz, inverse_wxyz, xyz, wxyz)
    return found_xyz, found_wxyz
