"""The world's bodies in the browser: meshes are sent once, then poses of what has moved."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence

import mujoco
import numpy as np
import trimesh
import viser
from mjviser.conversions import group_geoms_by_visual_compat, merge_geoms

from robosandbox.types import Array, Pose

_LAST_VISUAL_GROUP = 2
_RED = (225, 30, 30)  # Channels of 255 levels. Chosen as of warnings.
_COLLISION = (40, 130, 220)  # Channels of 255 levels. Chosen.
_MOVED = 1e-5  # Metres below which a body has not moved. Chosen.
_TURNED = 1e-5  # Radians below which it has not turned, about. Chosen.


class BodyScene:
    """Draws one compiled model.

    Args:
        server: Where.
        model: What.
        names: What people call each body.

    Attributes:
        model: What is drawn.
        root: Name of the node that everything drawn here lies under.
    """

    root = "/world"

    def __init__(self, server: viser.ViserServer, model: mujoco.MjModel, names: Sequence[str]) -> None:
        self.model = model
        self._server = server
        self._names = names
        self._frames: dict[int, viser.FrameHandle] = {}
        self._meshes: dict[int, list[viser.GlbHandle]] = {}
        self._collision: list[viser.MeshHandle] = []
        self._marks: list[viser.MeshHandle] = []
        self._base = server.scene.add_frame(self.root, show_axes=False)
        for body in range(1, model.nbody):
            self._add(body)

    def show(self, data: mujoco.MjData) -> int:
        """Send the poses of the bodies that have moved since they were last sent; return how many."""
        sent = 0
        for body, frame in self._frames.items():
            position, wxyz = data.xpos[body], data.xquat[body]
            if np.abs(frame.position - position).max() > _MOVED:
                frame.position = position
                sent += 1
            if 1.0 - abs(float(np.dot(frame.wxyz, wxyz))) > _TURNED**2:
                frame.wxyz = wxyz
                sent += 1
        return sent

    def node(self, body: int) -> str:
        """Return the name of the node that moves with a body."""
        return f"{self.root}/{body}_{_plain(self._names[body])}"

    def meshes(self, body: int) -> Sequence[viser.GlbHandle]:
        """Return what a body looks like."""
        return self._meshes.get(body, ())

    def pose(self, body: int) -> Pose:
        """Return where a body was drawn last."""
        frame = self._frames[body]
        w, x, y, z = (float(c) for c in frame.wxyz)
        px, py, pz = (float(c) for c in frame.position)
        return Pose(xyz=(px, py, pz), quat_xyzw=(x, y, z, w))

    def show_collision(self, visible: bool) -> None:
        """Draw what contacts are computed with; the shapes are sent when they are first wanted."""
        if visible and not self._collision:
            for body in self._frames:
                shape = self.shape(body, collision=True)
                if shape is not None:
                    node = f"{self.node(body)}/collision"
                    self._collision.append(add_surface(self._server, node, shape, _COLLISION, 0.35, faceted=True))
        for handle in self._collision:
            handle.visible = visible

    def mark(self, bodies: Iterable[int]) -> None:
        """Draw these bodies in red, and no others."""
        for handle in self._marks:
            handle.remove()
        self._marks = []
        for body in bodies:
            shape = self.shape(body) or self.shape(body, collision=True)
            if shape is not None:
                node = f"{self.node(body)}/mark"
                self._marks.append(add_surface(self._server, node, _inflated(shape), _RED, faceted=True))

    def shape(self, body: int, *, collision: bool = False) -> trimesh.Trimesh | None:
        """Return a body's surface in its own frame: as it looks, or as it collides; None if it has none."""
        geoms = _geoms(self.model, body, collision=collision)
        geoms = [geom for geom in geoms if self.model.geom_type[geom] != mujoco.mjtGeom.mjGEOM_PLANE]
        return merge_geoms(self.model, geoms) if geoms else None

    def remove(self) -> None:
        """Take everything away."""
        self._base.remove()

    def _add(self, body: int) -> None:
        visuals = _geoms(self.model, body, collision=False)
        planes = [geom for geom in visuals if self.model.geom_type[geom] == mujoco.mjtGeom.mjGEOM_PLANE]
        solid = [geom for geom in visuals if geom not in planes]
        if planes:
            self._add_floor(planes[0])
        if not solid and not _geoms(self.model, body, collision=True):
            return
        self._frames[body] = self._server.scene.add_frame(self.node(body), show_axes=False)
        self._meshes[body] = [
            self._server.scene.add_mesh_trimesh(
                f"{self.node(body)}/look{index}", _faceted(merge_geoms(self.model, group))
            )
            for index, group in enumerate(group_geoms_by_visual_compat(self.model, solid) if solid else [])
        ]

    def _add_floor(self, geom: int) -> None:
        """Draw a plane as a grid that fades out."""
        half = self.model.geom_size[geom, :2]
        width, height = (2.0 * float(h) if h > 0.0 else 20.0 for h in half)
        self._server.scene.add_grid(
            f"{self.root}/floor",
            width=width,
            height=height,
            cell_size=0.1,
            section_size=0.5,
            cell_color=(205, 208, 212),
            section_color=(176, 181, 188),
            fade_distance=6.0,
            plane_color=(226, 228, 231),
            plane_opacity=1.0,
            shadow_opacity=0.35,
            position=self.model.geom_pos[geom] + self.model.body_pos[self.model.geom_bodyid[geom]] - [0.0, 0.0, 0.001],
        )


def add_surface(
    server: viser.ViserServer,
    node: str,
    shape: trimesh.Trimesh,
    colour: tuple[int, int, int],
    opacity: float | None = None,
    *,
    faceted: bool = False,
) -> viser.MeshHandle:
    """Draw a surface in one colour, that casts no shadow and has none; return its handle."""
    return server.scene.add_mesh_simple(
        node,
        np.asarray(shape.vertices),
        np.asarray(shape.faces),
        color=colour,
        opacity=opacity,
        flat_shading=faceted,
        cast_shadow=False,
        receive_shadow=False,
    )


def _geoms(model: mujoco.MjModel, body: int, *, collision: bool) -> list[int]:
    first = int(model.body_geomadr[body])
    found = range(first, first + int(model.body_geomnum[body])) if first >= 0 else range(0)
    if collision:
        return [geom for geom in found if model.geom_contype[geom] or model.geom_conaffinity[geom]]
    return [geom for geom in found if model.geom_group[geom] <= _LAST_VISUAL_GROUP and _opacity(model, geom) > 0.0]


def _opacity(model: mujoco.MjModel, geom: int) -> float:
    material = int(model.geom_matid[geom])
    return float(model.mat_rgba[material, 3] if material >= 0 else model.geom_rgba[geom, 3])


def _faceted(mesh: trimesh.Trimesh) -> trimesh.Trimesh:
    """Return the mesh with sharp edges kept sharp: vertices are shared only across gentle angles."""
    if isinstance(mesh.visual, trimesh.visual.TextureVisuals):
        return mesh
    shaded = trimesh.graph.smooth_shade(mesh, angle=np.radians(30.0))
    # Normals are exported only if they were asked for before; without them every facet is seen.
    _ = shaded.vertex_normals
    return shaded


def _inflated(mesh: trimesh.Trimesh, by: float = 0.0008) -> trimesh.Trimesh:
    """Return the mesh a little larger, to cover what it is drawn over."""
    normals: Array = np.asarray(mesh.vertex_normals)
    return trimesh.Trimesh(np.asarray(mesh.vertices) + by * normals, mesh.faces, process=False)


def _plain(name: str) -> str:
    return "".join(c if c.isalnum() or c in "_-." else "_" for c in name)


def body_ids(names: Sequence[str]) -> Mapping[str, int]:
    """Return the ids of bodies by what people call them."""
    return {name: body for body, name in enumerate(names)}
