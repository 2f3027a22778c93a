"""RGB-D cameras drawn by Bullet's software renderer, in the conventions of `RgbdFrame`."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pybullet
from numpy.typing import NDArray

from robosandbox.types import Array, Intrinsics, Pose
from robosandbox_pybullet.world import BulletWorld

WIDTH, HEIGHT = 640, 480
# Distances that are drawn, metres: from a finger before the wrist's camera to the floor behind the table.
_NEAR, _FAR = 0.02, 8.0
# Where the light comes from, and shares of light: a white thing that faces the camera stays just below what a pixel holds.
_LIGHT = (0.6, -1.2, 2.2)
_AMBIENT, _DIFFUSE, _SPECULAR = 0.55, 0.4, 0.0
# OpenGL's cameras look along -z with y up, optical frames along z with y down.
_OPTICAL = np.diag([1.0, -1.0, -1.0])


@dataclass(frozen=True, slots=True, kw_only=True)
class Camera:
    """A camera.

    Attributes:
        pose: Of its optical frame (z forward, y down), in the world or in the TCP's frame.
        fovy: Vertical field of view, radians.
        on_hand: Whether the pose is in the TCP's frame.
    """

    pose: Pose
    fovy: float
    on_hand: bool = False

    @property
    def intrinsics(self) -> Intrinsics:
        """Its pinhole; pixel centres are at whole numbers, so the middle lies between two of them."""
        focal = HEIGHT / 2.0 / float(np.tan(self.fovy / 2.0))
        return Intrinsics(width=WIDTH, height=HEIGHT, fx=focal, fy=focal, cx=(WIDTH - 1) / 2.0, cy=(HEIGHT - 1) / 2.0)


def cameras(table_height: float) -> dict[str, Camera]:
    """Return the cameras: one beside the table, one above it, one at the wrist."""
    return {
        "scene": Camera(
            pose=_looking((1.05, -0.85, table_height + 0.75), (0.0, 0.0, table_height + 0.14)), fovy=np.radians(42.0)
        ),
        "top": Camera(
            pose=_looking((0.1, 0.0, table_height + 1.36), (0.1, 0.0, table_height), up=(1.0, 0.0, 0.0)),
            fovy=np.radians(45.0),
        ),
        "wrist": Camera(
            pose=_looking((0.07, 0.0, -0.12), (0.0, 0.0, 0.0), up=(-1.0, 0.0, 0.0)), fovy=np.radians(70.0), on_hand=True
        ),
    }


def draw(world: BulletWorld, camera: Camera, pose: Pose) -> tuple[NDArray[np.uint8], NDArray[np.float32]]:
    """Return colour (height, width, 3) and distance along the optical axis, metres, (height, width).

    Args:
        world: What is drawn.
        camera: Its lens.
        pose: Of its optical frame in the world.
    """
    rotation = pose.rotation @ _OPTICAL
    view = np.eye(4)
    view[:3, :3], view[:3, 3] = rotation.T, -rotation.T @ pose.position
    _, _, rgba, depth, _ = world.call(
        "getCameraImage",
        WIDTH,
        HEIGHT,
        view.T.ravel().tolist(),
        pybullet.computeProjectionMatrixFOV(np.degrees(camera.fovy), WIDTH / HEIGHT, _NEAR, _FAR),
        lightDirection=_LIGHT,
        lightAmbientCoeff=_AMBIENT,
        lightDiffuseCoeff=_DIFFUSE,
        lightSpecularCoeff=_SPECULAR,
        shadow=0,
        renderer=pybullet.ER_TINY_RENDERER,
    )
    rgb = np.ascontiguousarray(np.reshape(rgba, (HEIGHT, WIDTH, 4))[..., :3], dtype=np.uint8)
    buffer = np.reshape(depth, (HEIGHT, WIDTH)).astype(np.float64)
    metres = _FAR * _NEAR / (_FAR - (_FAR - _NEAR) * buffer)
    # Where nothing was drawn the buffer is at the far plane: no depth.
    return rgb, np.where(buffer < 1.0, metres, 0.0).astype(np.float32)


def _looking(eye: tuple[float, ...], target: tuple[float, ...], up: tuple[float, ...] = (0.0, 0.0, 1.0)) -> Pose:
    """Return an optical frame at `eye` that looks at `target`, with `up` upwards in its pictures."""
    forward = np.array(target) - np.array(eye)
    forward /= np.linalg.norm(forward)
    right = np.cross(forward, up)
    right /= np.linalg.norm(right)
    rotation: Array = np.column_stack([right, np.cross(forward, right), forward])
    return Pose.from_matrix(np.array(eye), rotation)
