"""URDF to a MuJoCo spec: every link, fixed ones too, every mesh, mimic joints, repaired inertias."""

from __future__ import annotations

import io
import logging
from collections.abc import Iterable
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import mujoco
import numpy as np

from robosandbox.errors import InputError
from robosandbox.robots.importers import inertia
from robosandbox.robots.importers.files import MissingFileError, ModelFiles, read_xml
from robosandbox.robots.importers.imported import ImportedModel, put_scalar
from robosandbox.robots.importers.meshes import add_mesh, read_mesh
from robosandbox.robots.importers.srdf import read_srdf
from robosandbox.robots.importers.urdf_lint import check_urdf, numbers
from robosandbox.shapes.triangles import TriangleMesh
from robosandbox.types import Array

# Channels, 0 to 1 (a fraction each), of links without a colour. Chosen.
_GREY = (0.7, 0.7, 0.72, 1.0)
# Red, green, blue and alpha, as in the URDF specification.
_COLOUR_NUMBERS = 4
# Shares of a mimic's travel inside the joint's own limits: all of it, and hardly any. Chosen.
_FITS, _FITS_NOT = 0.9, 0.25
_VISUAL_GROUP, _COLLISION_GROUP = 2, 3
# Newtons or newton metres from which an effort is a placeholder and no motor's. Chosen.
_PLACEHOLDER_EFFORT = 1e5
_MOVING = {"revolute": "HINGE", "continuous": "HINGE", "prismatic": "SLIDE"}


def import_urdf(path: Path, package_paths: Iterable[Path] = ()) -> ImportedModel:
    """Read a URDF as it is.

    Args:
        path: The file.
        package_paths: Where package:// and relative names are looked up, before ROS_PACKAGE_PATH.

    Raises:
        InputError: The file is wrong or names a file that is not there; the message names the element.
    """
    content = read_xml(path)
    root = ElementTree.fromstring(content)
    painted = _drop_odd_colours(root)
    empty = _drop_empty_shapes(root)
    check_urdf(root, path.name)
    capsules = _square(root)
    robot = _parse(ElementTree.tostring(root) if capsules or painted or empty else content, path)
    files = ModelFiles.of(path, package_paths)
    model = ImportedModel(name=str(robot.name or path.stem), path=path, spec=mujoco.MjSpec())
    if painted:
        model.notes.append(f"{painted} colours that are not four numbers are left out")
    if empty:
        model.notes.append(f"{empty} shapes of no size are left out")
    if capsules:
        model.notes.append(f"{capsules} capsules, which a URDF does not have, are taken as cylinders")
    _SpecBuilder(model, robot, files).build()
    read_srdf(model)
    return model


def _drop_odd_colours(root: ElementTree.Element) -> int:
    """Take away colours that nothing can be painted with, no reason to refuse a robot; return how many there were."""
    dropped = 0
    for material in root.iter("material"):
        for colour in material.findall("color"):
            if len(numbers(colour.get("rgba", "")) or ()) != _COLOUR_NUMBERS:
                material.remove(colour)
                dropped += 1
    return dropped


def _drop_empty_shapes(root: ElementTree.Element) -> int:
    """Take away shapes whose sizes are all 0, drawn where a link has none; return how many there were."""
    dropped = 0
    for link in root.iter("link"):
        for item in [*link.findall("visual"), *link.findall("collision")]:
            sizes = [
                value
                for shape in item.iterfind("geometry/*")
                for attribute in ("size", "radius", "length")
                for value in numbers(shape.get(attribute, "")) or ()
            ]
            if sizes and not any(sizes):
                link.remove(item)
                dropped += 1
    return dropped


def _square(root: ElementTree.Element) -> int:
    """Make each capsule, known to some simulators alone, the cylinder of its length; return how many there were."""
    capsules = list(root.iter("capsule"))
    for element in capsules:
        element.tag = "cylinder"
        element.set("length", str(float(element.attrib["length"]) + 2.0 * float(element.attrib["radius"])))
    return len(capsules)


def _parse(content: bytes, path: Path) -> Any:
    import yourdfpy

    logging.getLogger("yourdfpy").setLevel(logging.ERROR)
    try:
        return yourdfpy.URDF.load(io.BytesIO(content), build_scene_graph=False, load_meshes=False).robot
    except Exception as error:  # what passes the check above and still fails is the parser's to say
        said = " ".join(str(error).split())[:160]
        raise InputError(f"{path.name}: cannot be read as a URDF: {said or type(error).__name__}") from None


def _number(value: Any) -> float:
    """Return an optional attribute's number, 0 where it is left out."""
    return float(value or 0.0)


class _SpecBuilder:
    def __init__(self, model: ImportedModel, robot: Any, files: ModelFiles) -> None:
        self.model, self.spec, self.robot, self.files = model, model.spec, robot, files
        self.spec.modelname = model.name
        self.spec.compiler.degree = False
        self.spec.compiler.autolimits = True
        self.colours = {
            item.name: tuple(float(c) for c in item.color.rgba)
            for item in robot.materials
            if item.color is not None and item.color.rgba is not None
        }
        self.meshes: dict[tuple[str, tuple[float, ...]], str] = {}
        self.pieces: dict[str, list[tuple[Array, Array]]] = {}

    def build(self) -> None:
        links = {link.name: link for link in self.robot.links}
        below: dict[str, list[Any]] = {}
        for joint in self.robot.joints:
            below.setdefault(joint.parent, []).append(joint)
        children = {joint.child for joint in self.robot.joints}
        root = next(name for name in links if name not in children)
        bare = not (links[root].visuals or links[root].collisions)
        if root == "world" and bare:
            # MuJoCo's world is the root's frame already.
            bodies = {root: self.spec.worldbody}
        else:
            name = "base_world" if root == "world" else root
            bodies = {root: self.spec.worldbody.add_body(name=name)}
            self._fill(bodies[root], links[root], moving=False)
        pending = [root]
        while pending:
            for joint in below.get(pending.pop(), ()):
                body = bodies[joint.parent].add_body(name=joint.child)
                bodies[joint.child] = body
                if joint.origin is not None:
                    body.pos, body.quat = _pos_quat(np.asarray(joint.origin, dtype=float))
                moving = self._add_joint(body, joint)
                self._fill(body, links[joint.child], moving=moving)
                pending.append(joint.child)
        for joint in self.robot.joints:
            self._add_mimic(joint)

    def _add_joint(self, body: mujoco.MjsBody, joint: Any) -> bool:
        turns_freely, limit = joint.type == "continuous", joint.limit
        if joint.type not in _MOVING:
            if joint.type != "fixed":
                self.model.notes.append(f"joint {joint.name!r} is {joint.type}: held fixed, as an arm's base is")
            return False
        if not turns_freely and limit.lower == limit.upper:
            self.model.notes.append(f"joint {joint.name!r} has limits that are equal: held fixed")
            return False
        axis = np.array([1.0, 0.0, 0.0]) if joint.axis is None else np.asarray(joint.axis, dtype=float)
        kind = getattr(mujoco.mjtJoint, f"mjJNT_{_MOVING[joint.type]}")
        added = body.add_joint(name=joint.name, type=kind, axis=axis)
        added.limited = mujoco.mjtLimited.mjLIMITED_FALSE if turns_freely else mujoco.mjtLimited.mjLIMITED_TRUE
        if not turns_freely:
            added.range = [_number(limit.lower), _number(limit.upper)]
        if joint.dynamics is not None:
            put_scalar(added, "damping", max(0.0, _number(joint.dynamics.damping)))
            added.frictionloss = max(0.0, _number(joint.dynamics.friction))
        if limit is not None:
            effort, speed = abs(_number(limit.effort)), abs(_number(limit.velocity))
            if 0.0 < effort < _PLACEHOLDER_EFFORT:
                added.actfrclimited = mujoco.mjtLimited.mjLIMITED_TRUE
                added.actfrcrange = [-effort, effort]
            if speed > 0.0:
                self.model.velocity[joint.name] = speed
        return True

    def _add_mimic(self, joint: Any) -> None:
        if joint.mimic is None or joint.type not in _MOVING:
            return
        names = {item.name for item in self.spec.joints}
        if joint.name not in names or joint.mimic.joint not in names:
            return
        offset = float(joint.mimic.offset or 0.0)
        multiplier = 1.0 if joint.mimic.multiplier is None else float(joint.mimic.multiplier)
        if self._fits(joint, -multiplier, offset) > _FITS and self._fits(joint, multiplier, offset) < _FITS_NOT:
            self.model.notes.append(
                f"joint {joint.name!r}: its mimic multiplier {multiplier:g} leads outside its own limits: its sign is turned"
            )
            multiplier = -multiplier
        equality = self.spec.add_equality(
            name=f"{joint.name}_mimic",
            type=mujoco.mjtEq.mjEQ_JOINT,
            objtype=mujoco.mjtObj.mjOBJ_JOINT,
            name1=joint.name,
            name2=joint.mimic.joint,
            solref=[0.005, 1.0],
            solimp=[0.95, 0.99, 0.001, 0.5, 2.0],
        )
        data = np.zeros(len(equality.data))
        data[:2] = offset, multiplier
        equality.data = data

    def _fits(self, joint: Any, multiplier: float, offset: float) -> float:
        """Return which share of what a mimic asks of a joint lies within the joint's own limits."""
        own, leader = self.spec.joint(joint.name), self.spec.joint(joint.mimic.joint)
        limited = mujoco.mjtLimited.mjLIMITED_TRUE
        if own.limited != limited or leader.limited != limited:
            return 0.5
        asked = np.sort(np.asarray(leader.range) * multiplier + offset)
        inside = min(asked[1], own.range[1]) - max(asked[0], own.range[0])
        return float(max(0.0, inside) / max(asked[1] - asked[0], 1e-9))

    def _fill(self, body: mujoco.MjsBody, link: Any, *, moving: bool) -> None:
        low, high = np.full(3, np.inf), np.full(3, -np.inf)
        for solid, items in ((True, link.collisions), (False, link.visuals)):
            for item in items:
                if item.geometry is None:
                    continue
                corners = self._add_geom(body, link.name, item, solid)
                if corners is not None:
                    low, high = np.minimum(low, corners.min(axis=0)), np.maximum(high, corners.max(axis=0))
        if not np.isfinite(low).all():
            low, high = np.full(3, -0.01), np.full(3, 0.01)
        inertia.write(body, self._inertial(link, moving, low, high))

    def _inertial(self, link: Any, moving: bool, low: Array, high: Array) -> inertia.Inertial | None:
        given = link.inertial
        if given is None or given.mass is None:
            if not moving:
                return None
            made = inertia.of_box(low, high)
            self.model.notes.append(f"link {link.name!r} moves and has no inertia: {made.mass:.3g} kg from its shape")
            return made
        mass = float(given.mass)
        origin = np.eye(4) if given.origin is None else np.asarray(given.origin, dtype=float)
        matrix = np.zeros((3, 3)) if given.inertia is None else np.asarray(given.inertia, dtype=float)
        matrix = origin[:3, :3] @ matrix @ origin[:3, :3].T
        wrong = inertia.fault(mass, matrix)
        if wrong is None:
            return inertia.Inertial(mass, origin[:3, 3], matrix)
        if not moving and (mass <= 1e-6 or not np.any(matrix)):
            # A tool frame of no extent: a point that rides along.
            return None if mass <= 0.0 else inertia.of_box(origin[:3, 3], origin[:3, 3], mass)
        made = inertia.of_box(low, high, mass if mass > 0.0 and np.isfinite(mass) else None)
        self.model.notes.append(f"link {link.name!r}: inertia {wrong}; replaced by that of its shape")
        return made

    def _add_geom(self, body: mujoco.MjsBody, link: str, item: Any, solid: bool) -> Array | None:
        """Add a visual or collision shape; return its bounding corners in the link, shape (8, 3)."""
        shape = item.geometry
        options: dict[str, Any] = {"group": _COLLISION_GROUP if solid else _VISUAL_GROUP, "mass": 0.0}
        options |= {"contype": int(solid), "conaffinity": int(solid)}
        origin = np.eye(4) if item.origin is None else np.asarray(item.origin, dtype=float)
        options["pos"], options["quat"] = _pos_quat(origin)
        rgba = _GREY if solid else self._colour(item)
        half = np.zeros(3)
        if shape.box is not None:
            half = np.abs(np.asarray(shape.box.size, dtype=float)) / 2.0
            options |= {"type": mujoco.mjtGeom.mjGEOM_BOX, "size": half}
        elif shape.cylinder is not None:
            radius, length = float(shape.cylinder.radius), float(shape.cylinder.length)
            half = np.array([radius, radius, length / 2.0])
            options |= {"type": mujoco.mjtGeom.mjGEOM_CYLINDER, "size": [radius, length / 2.0, 0.0]}
        elif shape.sphere is not None:
            radius = float(shape.sphere.radius)
            half = np.full(3, radius)
            options |= {"type": mujoco.mjtGeom.mjGEOM_SPHERE, "size": [radius, 0.0, 0.0]}
        elif shape.mesh is not None:
            return self._add_mesh_geom(body, link, shape.mesh, solid, options, rgba, origin)
        else:
            self.model.notes.append(f"link {link!r}: a {'collision' if solid else 'visual'} without a known shape")
            return None
        body.add_geom(rgba=rgba or _GREY, **options)
        corners = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)]) * half
        placed: Array = corners @ origin[:3, :3].T + origin[:3, 3]
        return placed

    def _add_mesh_geom(
        self,
        body: mujoco.MjsBody,
        link: str,
        shape: Any,
        solid: bool,
        options: dict[str, Any],
        rgba: tuple[float, ...] | None,
        origin: Array,
    ) -> Array | None:
        scale = np.ones(3) if shape.scale is None else np.broadcast_to(np.asarray(shape.scale, dtype=float), 3)
        element = f"{self.model.path.name}: link {link!r}"
        try:
            path = self.files.find(str(shape.filename), f"link {link!r} <mesh>")
        except MissingFileError:
            if solid:
                raise
            self.model.notes.append(f"link {link!r}: its visual mesh {str(shape.filename)!r} is not there: not drawn")
            return None
        mesh = read_mesh(path, element)
        vertices = mesh.vertices * scale
        low, high = vertices.min(axis=0), vertices.max(axis=0)
        if float((high - low).max()) > 20.0:
            raise InputError(
                f"{element}: mesh {path.name} is {(high - low).max():.0f} m large; give it scale='0.001 0.001 0.001'"
            )
        if float((high - low).max()) < 1e-5 or np.prod(scale) == 0.0:
            self.model.notes.append(f"link {link!r}: mesh {path.name} has no extent; left out")
            return None
        name = self._mesh(str(path), tuple(float(s) for s in scale), mesh)
        options |= {"type": mujoco.mjtGeom.mjGEOM_MESH, "meshname": name}
        body.add_geom(rgba=rgba or mesh.rgba or _GREY, **options)
        corners = np.array([[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)]) * (high - low) + low
        placed: Array = corners @ origin[:3, :3].T + origin[:3, 3]
        return placed

    def _mesh(self, path: str, scale: tuple[float, ...], mesh: TriangleMesh) -> str:
        key = (path, scale)
        if key not in self.meshes:
            name = f"{Path(path).stem}_{len(self.meshes)}"
            add_mesh(self.spec, name, mesh.vertices * np.array(scale), mesh.faces, mirrored=bool(np.prod(scale) < 0.0))
            self.meshes[key] = name
        return self.meshes[key]

    def _colour(self, item: Any) -> tuple[float, ...] | None:
        material = item.material
        if material is None:
            return None
        if material.color is not None and material.color.rgba is not None:
            return tuple(float(c) for c in material.color.rgba)
        return self.colours.get(material.name)


def _pos_quat(origin: Array) -> tuple[Array, Array]:
    quat = np.zeros(4)
    mujoco.mju_mat2Quat(quat, origin[:3, :3].flatten())
    return origin[:3, 3].copy(), quat
