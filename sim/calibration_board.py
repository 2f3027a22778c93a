"""A board of AprilTags that lies on the table, for calibrating cameras."""

from __future__ import annotations

from typing import Any

import mujoco
import numpy as np
from numpy.typing import NDArray

from robosandbox.types import Array
from robosandbox.values import frozen

_DICTIONARY = "DICT_APRILTAG_36h11"
# Pixels across a gap between two tags; chosen so that a tag has 90 across, more than a bundled camera shows of it.
_PIXELS_PER_CELL = 20
# How far over the table the board lies, metres; chosen so that renderers, whose depth is quantized, tell the two planes
# apart.
_ABOVE = 0.0005


@frozen(kw_only=True)
class CalibrationBoard:
    """Rows of square tags, flat on the table, their upper edges towards +y.

    Attributes:
        centre: Where its middle lies, world x and y, metres.
        columns: Tags along x.
        rows: Tags along y.
        tag: Edge of a tag, metres.
        gap: Between tags, metres.
    """

    centre: tuple[float, float] = (0.3, 0.0)
    columns: int = 4
    rows: int = 3
    tag: float = 0.09
    gap: float = 0.02

    @property
    def grid(self) -> Any:
        """The board as OpenCV knows it."""
        import cv2

        dictionary = cv2.aruco.getPredefinedDictionary(getattr(cv2.aruco, _DICTIONARY))
        return cv2.aruco.GridBoard((self.columns, self.rows), self.tag, self.gap, dictionary)

    @property
    def size(self) -> Array:
        """Its extents along x and y, a margin of `gap` included, metres, (2,)."""
        return np.array([self.columns, self.rows]) * (self.tag + self.gap) + self.gap

    def in_world(self, points: Array, table_height: float) -> Array:
        """Return points (n, 3) of OpenCV's board frame, x right and y down from its first corner, in the world."""
        corner = np.array(self.centre) + [-self.size[0] / 2.0 + self.gap, self.size[1] / 2.0 - self.gap]
        flat = corner + points[:, :2] * [1.0, -1.0]
        return np.column_stack([flat, np.full(len(flat), table_height + _ABOVE)])

    def picture(self) -> NDArray[np.uint8]:
        """Return the board as it is printed, grey, (height, width), with its margin; pixels are square."""
        width, height = np.round(self.size * _PIXELS_PER_CELL / self.gap).astype(int).tolist()
        return np.asarray(self.grid.generateImage((width, height), marginSize=_PIXELS_PER_CELL), dtype=np.uint8)

    def lay(self, spec: mujoco.MjSpec, table_height: float) -> None:
        """Add the board to a world."""
        picture = np.repeat(self.picture()[..., None], 3, axis=2)
        height, width, _ = picture.shape
        texture = spec.add_texture(
            name="board", type=mujoco.mjtTexture.mjTEXTURE_2D, width=width, height=height, nchannel=3
        )
        texture.data = picture.tobytes()
        material = spec.add_material(name="board", specular=0.0)
        material.textures[mujoco.mjtTextureRole.mjTEXROLE_RGB] = "board"
        spec.worldbody.add_geom(
            name="board",
            type=mujoco.mjtGeom.mjGEOM_PLANE,
            size=[*(self.size / 2.0), 0.01],
            pos=[*self.centre, table_height + _ABOVE],
            material="board",
            contype=0,
            conaffinity=0,
        )
