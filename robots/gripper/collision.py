"""Fingers that can hold: shapes that collide, hollow ones cut into convex pieces, friction that carries."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Self

import mujoco
import numpy as np
from numpy.typing import NDArray

from robosandbox.robots.gripper.calibrate import moving_groups, palm_of
from robosandbox.robots.importers.imported import ImportedModel, compile_spec
from robosandbox.robots.importers.meshes import add_mesh
from robosandbox.shapes.triangles import TriangleMesh, convex_parts
from robosandbox.types import Array
from robosandbox.values import frozen

_MESH = mujoco.mjtGeom.mjGEOM_MESH.value
# Radius of the ball around a plain shape, metres, up to which it is no pad. Chosen so that a ball that marks a point is none.
_LEAST_PAD = 0.002
# Volume of a mesh's hull over the mesh's own from which it is cut into pieces. Chosen: below it the hull adds less than a
# quarter of what is there, which no gap between fingers is.
_CONCAVE = 1.35
# Radius of the ball around a mesh, metres, below which cutting it gains nothing: smaller parts are screws and caps. Chosen.
_LEAST_RADIUS = 0.01
# Number of triangles up to which a mesh is cut: chosen so that a scan in full detail does not take minutes.
_MOST_FACES = 150_000
# Friction coefficients of MuJoCo: sliding as of rubber on plastic; turning in metres, as of a pad 2 cm wide; rolling in metres.
_FRICTION = (1.0, 0.02, 0.001)
# Time constant of contacts, seconds: MuJoCo's manual asks for at least two physics steps, which are 2 ms here.
_QUICK = 0.004
# MuJoCo's solimp: impedances, the width in metres over which they rise, and the shape of the rise, as in the manual's
# section on solver parameters; between the default (0.9, 0.95) and what it calls hard.
_STIFF = (0.97, 0.995, 0.001, 0.5, 2.0)


@frozen
class _HandBodies:
    """A gripper's bodies.

    Attributes:
        groups: Those of each side.
        bodies: All, what is welded to the palm included.
        fingers: Those that joints of the gripper move, or the palm itself, with what is welded to them.
    """

    groups: list[frozenset[int]]
    bodies: frozenset[int]
    fingers: frozenset[int]

    @classmethod
    def of(cls, model: mujoco.MjModel, joints: list[int]) -> Self:
        """Return the hand that these joints move."""
        groups = moving_groups(model, joints)
        root = palm_of(model, joints)
        weld = int(model.body_weldid[root])
        on_palm = {b for b in range(1, model.nbody) if int(model.body_weldid[b]) == weld}
        sides = frozenset().union(*groups)
        carriers = {int(model.jnt_bodyid[j]) for j in joints} | {root}
        fingers = {b for b in sides if b in carriers or int(model.body_weldid[b]) in carriers}
        return cls(groups, sides | on_palm, frozenset(fingers - (on_palm - {root})))


def refine_fingers(imported: ImportedModel, gripper_joints: Iterable[str]) -> None:
    """Make a gripper's bodies fit to hold things; what is changed is noted.

    A mesh collides as its convex hull, which fills the very gap that a jaw closes; it is replaced by convex pieces.
    """
    spec = imported.spec
    model = compile_spec(spec, imported.path.name)
    hand = _HandBodies.of(model, [model.joint(name).id for name in gripper_joints])
    geoms = {geom.id: geom for geom in spec.geoms}
    padded = {int(model.geom_bodyid[g]) for g, geom in geoms.items() if _is_pad(model, g, geom)}
    for group in hand.groups:
        _ensure_solid(imported, model, geoms, group)
    for g, geom in geoms.items():
        if int(model.geom_bodyid[g]) in hand.bodies and _collides(geom):
            _let_touch(imported, g, geom)
            _let_hold(geom)
    # Pads that the author made of boxes stand proud of what carries them.
    if padded & hand.fingers:
        return
    for group in hand.groups:
        ends = _ends(model, group)
        for g in [g for g in geoms if int(model.geom_bodyid[g]) in ends and _collides(geoms[g])]:
            _cut(imported, model, g, geoms[g])


def _collides(geom: mujoco.MjsGeom) -> bool:
    return bool(geom.contype or geom.conaffinity)


def _touches_objects(geom: mujoco.MjsGeom) -> bool:
    """Tell whether a geom shares a contact bit with what a scene holds, which is bit 1."""
    return bool((geom.contype | geom.conaffinity) & 1)


def _is_pad(model: mujoco.MjModel, g: int, geom: mujoco.MjsGeom) -> bool:
    """Tell whether a geom is a plain shape that touches objects: what an author makes pads of."""
    return bool(model.geom_type[g] != _MESH and _touches_objects(geom) and model.geom_rbound[g] > _LEAST_PAD)


def _let_touch(imported: ImportedModel, g: int, geom: mujoco.MjsGeom) -> None:
    """Let a geom of the gripper touch what a scene holds."""
    if not _touches_objects(geom):
        geom.contype = geom.conaffinity = 1
        imported.notes.append(f"geom {geom.name or g} of the gripper touched nothing but its own kind: now it does")


def _let_hold(geom: mujoco.MjsGeom) -> None:
    """Give a geom that says nothing of its own friction that carries, and stiffness.

    A grip presses a light object with many times its weight: at default softness fingers sink into it.
    """
    if geom.priority > 0:
        return
    geom.condim = max(int(geom.condim), 4)
    geom.friction = np.maximum(geom.friction, _FRICTION)
    soft = float(geom.solimp[1]) < _STIFF[1] or float(geom.solimp[2]) > _STIFF[2]
    if soft or float(geom.solref[0]) > _QUICK:
        geom.solref = [_QUICK, 1.0]
        geom.solimp = _STIFF
        geom.priority = 1


def ensure_solid_tool(imported: ImportedModel, joint: str) -> None:
    """Let the last link of an arm without a gripper touch what it pushes, where only its looks are drawn.

    Args:
        imported: The model; it is changed.
        joint: The arm's last one.
    """
    model = compile_spec(imported.spec, imported.path.name)
    weld = int(model.body_weldid[model.jnt_bodyid[model.joint(joint).id]])
    link = frozenset(b for b in range(1, model.nbody) if int(model.body_weldid[b]) == weld)
    _ensure_solid(imported, model, {geom.id: geom for geom in imported.spec.geoms}, link)


def _ensure_solid(
    imported: ImportedModel, model: mujoco.MjModel, geoms: dict[int, mujoco.MjsGeom], group: frozenset[int]
) -> None:
    mine = [g for g in geoms if int(model.geom_bodyid[g]) in group]
    if any(_collides(geoms[g]) for g in mine):
        return
    for g in mine:
        geoms[g].contype = geoms[g].conaffinity = 1
    if mine:
        name = model.body(min(group)).name
        imported.notes.append(f"link {name!r} has no collision shape: its visual one is taken")


def _ends(model: mujoco.MjModel, group: frozenset[int]) -> set[int]:
    """Return the bodies of a side that carry no further link of it: its fingertips."""
    carrying = {
        int(model.body_weldid[model.body_parentid[b]])
        for b in group
        if model.body_jntnum[b] and int(model.body_weldid[model.body_parentid[b]]) in group
    }
    return {b for b in group if int(model.body_weldid[b]) not in carrying}


def _cut(imported: ImportedModel, model: mujoco.MjModel, g: int, geom: mujoco.MjsGeom) -> None:
    """Replace a hollow mesh's collision by convex pieces."""
    if model.geom_type[g] != _MESH or model.geom_rbound[g] < _LEAST_RADIUS:
        return
    mesh = _mesh_of(model, int(model.geom_dataid[g]))
    if len(mesh.faces) > _MOST_FACES or not is_concave(mesh):
        return
    parts = convex_parts(mesh)
    if len(parts) < 2:
        return
    body = geom.parent
    label = f"{body.name}_{g}"
    for k, part in enumerate(parts):
        name = f"{label}_part{k}"
        add_mesh(imported.spec, name, part.vertices, part.faces)
        body.add_geom(
            name=name,
            type=mujoco.mjtGeom.mjGEOM_MESH,
            meshname=name,
            pos=model.geom_pos[g],
            quat=model.geom_quat[g],
            contype=geom.contype,
            conaffinity=geom.conaffinity,
            condim=geom.condim,
            friction=geom.friction,
            solref=geom.solref,
            solimp=geom.solimp,
            priority=geom.priority,
            mass=0.0,
            group=3,
            rgba=geom.rgba,
        )
    geom.contype = geom.conaffinity = 0
    imported.notes.append(f"link {body.name!r}: a hollow collision mesh is cut into {len(parts)} convex pieces")


def _mesh_of(model: mujoco.MjModel, mesh: int) -> TriangleMesh:
    start, count = int(model.mesh_vertadr[mesh]), int(model.mesh_vertnum[mesh])
    first, number = int(model.mesh_faceadr[mesh]), int(model.mesh_facenum[mesh])
    vertices = model.mesh_vert[start : start + count].astype(float)
    return TriangleMesh(vertices, model.mesh_face[first : first + number].copy())


def is_concave(mesh: TriangleMesh) -> bool:
    """Tell whether a mesh's hull is a good deal larger than the mesh, or may be: an open one encloses nothing."""
    from scipy.spatial import ConvexHull, QhullError

    try:
        hull = float(ConvexHull(mesh.vertices).volume)
    except QhullError:
        return False
    return not _is_closed(mesh) or hull > _CONCAVE * _volume(mesh.vertices, mesh.faces)


def _is_closed(mesh: TriangleMesh) -> bool:
    """Tell whether every edge has a face on either side, so that the mesh encloses a volume."""
    _, welded = np.unique(mesh.vertices.round(6), axis=0, return_inverse=True)
    corners = welded.reshape(-1)[mesh.faces]
    edges = np.sort(np.concatenate([corners[:, [0, 1]], corners[:, [1, 2]], corners[:, [2, 0]]]), axis=1)
    _, counts = np.unique(edges, axis=0, return_counts=True)
    return bool((counts == 2).mean() > 0.98)


def _volume(vertices: Array, faces: NDArray[np.int32]) -> float:
    """Return the volume that triangles enclose, by the divergence theorem."""
    a, b, c = (vertices[faces[:, k]] for k in range(3))
    return abs(float(np.einsum("ij,ij->i", a, np.cross(b, c)).sum()) / 6.0)
