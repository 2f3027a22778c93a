"""Tags on objects: a picture on the face that is up, which nothing collides with and which weighs nothing."""

from __future__ import annotations

import mujoco
import numpy as np

from robosandbox.sim.objects.geoms import PREFIX
from robosandbox.tags import BORDERED, TAG_CELLS, TAG_FAMILY
from robosandbox.types import SceneObject

# Pixels across a cell of the texture; chosen as several times what a bundled camera shows of one, so that edges stay
# sharp.
_PIXELS_PER_CELL = 16
# Of the drawn plate, metres; chosen as paper's, which no grasp and no depth camera notices.
_HALF_THICKNESS = 0.0001


def add_tag(spec: mujoco.MjSpec, body: mujoco.MjsBody, item: SceneObject) -> None:
    """Add an object's tag to its body, the tag's upper edge towards local +y; nothing where it has none."""
    face = item.shape.tag_face(item.size)
    if item.tag is None or face is None:
        return
    import cv2

    dictionary = cv2.aruco.getPredefinedDictionary(getattr(cv2.aruco, TAG_FAMILY))
    black = cv2.aruco.generateImageMarker(dictionary, item.tag, TAG_CELLS * _PIXELS_PER_CELL)
    grey = np.pad(black, _PIXELS_PER_CELL, constant_values=255)
    name = f"{PREFIX}{item.id}/tag"
    texture = spec.add_texture(
        name=name, type=mujoco.mjtTexture.mjTEXTURE_2D, width=grey.shape[1], height=grey.shape[0], nchannel=3
    )
    texture.data = np.repeat(grey[..., None], 3, axis=2).tobytes()
    material = spec.add_material(name=name, specular=0.0)
    material.textures[mujoco.mjtTextureRole.mjTEXROLE_RGB] = name
    half = BORDERED * item.tag_edge / 2.0
    body.add_geom(
        name=name,
        type=mujoco.mjtGeom.mjGEOM_BOX,
        size=[half, half, _HALF_THICKNESS],
        pos=[0.0, 0.0, face[1] + _HALF_THICKNESS],
        material=name,
        mass=0.0,
        contype=0,
        conaffinity=0,
    )
