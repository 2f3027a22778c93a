"""The robots of a cell as ROS 2 describes them: a URDF with their meshes as files, joint values, and where each link is."""

from __future__ import annotations

import struct
from collections.abc import Iterator, Mapping
from pathlib import Path
from xml.etree import ElementTree

import mujoco
import numpy as np

from robosandbox.errors import InputError
from robosandbox.motion.twin import standing
from robosandbox.sim.world import World
from robosandbox.types import ArmState, Array
from robosandbox.values import frozen

WORLD = "world"
# MuJoCo's viewers show the geometry of groups 0 to 2; what is for collision alone is in the others.
_SHOWN_GROUPS = 3
_GEOM, _JOINT = mujoco.mjtGeom, mujoco.mjtJoint


@frozen
class _Link:
    """A body as a link, whose frame lies where its joint turns: in URDF a joint's axis goes through its link's origin.

    Attributes:
        name: As people call the body.
        parent: Name of the link that carries it.
        body: Id in the model.
        carrier: Id of the body that carries it.
        shift: Of the link's origin in the body's frame, metres, shape (3,).
        joint: Id of its joint; None where it is fixed.
    """

    name: str
    parent: str
    body: int
    carrier: int
    shift: Array
    joint: int | None


class RobotDescription:
    """Every robot of a compiled world, on a link `world`.

    Args:
        world: The model; of its objects nothing is read.
        folder: Gets the meshes.

    Raises:
        InputError: A body of a robot has several joints, which no link has.

    Attributes:
        urdf: The description.
        tools: Name of the frame of each arm's TCP, by the arm's name.
    """

    def __init__(self, world: World, folder: Path) -> None:
        self._world, self._model = world, world.model
        self._data = mujoco.MjData(self._model)
        self._links = [*self._chain()]
        alone = len(world.robots) == 1
        self.tools: Mapping[str, str] = {name: "tcp" if alone else f"{name}/tcp" for name in world.robots}
        self.urdf: str = self._written(folder)

    def joints(self, arms: Mapping[str, ArmState]) -> tuple[list[str], list[float], list[float]]:
        """Return names, values and speeds of all joints; a gripper's speeds, which nobody tells, are 0."""
        qpos = standing(self._world, (), arms)
        speeds = np.zeros(self._model.nq)
        for name, robot in self._world.robots.items():
            speeds[robot.qpos_indices] = arms[name].qd
        moving = [link.joint for link in self._links if link.joint is not None]
        at = [int(self._model.jnt_qposadr[joint]) for joint in moving]
        return [self._joint_name(joint) for joint in moving], qpos[at].tolist(), speeds[at].tolist()

    def frames(self, arms: Mapping[str, ArmState]) -> Iterator[tuple[str, str, Array, Array]]:
        """Yield parent, child, position (3,) and quaternion w, x, y, z (4,) of every link and of each TCP."""
        data = self._data
        data.qpos[:] = standing(self._world, (), arms)
        mujoco.mj_kinematics(self._model, data)
        shifts = {0: np.zeros(3), **{link.body: link.shift for link in self._links}}
        for link in self._links:
            yield link.parent, link.name, *self._between(link.carrier, shifts[link.carrier], link.body, link.shift)
        for name, robot in self._world.robots.items():
            body = int(self._model.site_bodyid[robot.tcp_site])
            carrier = next(link for link in self._links if link.body == body)
            position, rotation = robot.tcp(data)
            wxyz = np.empty(4)
            mujoco.mju_mat2Quat(wxyz, rotation.ravel())
            origin = self._origin(body, carrier.shift)
            yield carrier.name, self.tools[name], *_seen_from(origin, data.xquat[body], position, wxyz)

    # The tree.

    def _chain(self) -> Iterator[_Link]:
        model, names = self._model, self._world.names
        for body in sorted(self._world.robot_bodies):
            if (count := int(model.body_jntnum[body])) > 1:
                raise InputError(f"{names[body]} has {count} joints, and a link of a robot description has one")
            joint = int(model.body_jntadr[body]) if count else None
            carrier = int(model.body_parentid[body])
            shift = np.zeros(3) if joint is None else model.jnt_pos[joint].copy()
            yield _Link(names[body], names[carrier] if carrier else WORLD, body, carrier, shift, joint)

    def _joint_name(self, joint: int) -> str:
        return str(self._model.joint(joint).name).removeprefix("robot/").replace("/robot/", "/")

    def _origin(self, body: int, shift: Array) -> Array:
        origin: Array = self._data.xpos[body] + self._data.xmat[body].reshape(3, 3) @ shift
        return origin

    def _between(self, carrier: int, its: Array, body: int, own: Array) -> tuple[Array, Array]:
        data = self._data
        return _seen_from(self._origin(carrier, its), data.xquat[carrier], self._origin(body, own), data.xquat[body])

    # The text.

    def _written(self, folder: Path) -> str:
        model, data = self._model, self._data
        root = ElementTree.Element("robot", name=" and ".join(robot.name for robot in self._world.robots.values()))
        ElementTree.SubElement(root, "link", name=WORLD)
        # With every joint at 0, as URDF counts.
        data.qpos[:] = 0.0
        mujoco.mj_kinematics(model, data)
        shifts = {0: np.zeros(3), **{link.body: link.shift for link in self._links}}
        for link in self._links:
            self._put_link(root, link, folder)
            kind = "fixed" if link.joint is None else self._kind(link.joint)
            name = f"{link.name}_fixed" if link.joint is None else self._joint_name(link.joint)
            joint = ElementTree.SubElement(root, "joint", name=name, type=kind)
            ElementTree.SubElement(joint, "parent", link=link.parent)
            ElementTree.SubElement(joint, "child", link=link.name)
            _put_origin(joint, *self._between(link.carrier, shifts[link.carrier], link.body, link.shift))
            if link.joint is not None:
                ElementTree.SubElement(joint, "axis", xyz=_text(model.jnt_axis[link.joint]))
                low, high = model.jnt_range[link.joint]
                ends = {} if kind == "continuous" else {"lower": f"{low:.9g}", "upper": f"{high:.9g}"}
                ElementTree.SubElement(joint, "limit", {"effort": "0", "velocity": self._fastest(link.joint), **ends})
        return ElementTree.tostring(root, encoding="unicode")

    def _fastest(self, joint: int) -> str:
        address = int(self._model.jnt_qposadr[joint])
        for robot in self._world.robots.values():
            for index, speed in zip(robot.qpos_indices, robot.velocity_limits, strict=True):
                if int(index) == address:
                    return f"{speed:.9g}"
        return "0"

    def _kind(self, joint: int) -> str:
        if self._model.jnt_type[joint] == _JOINT.mjJNT_SLIDE:
            return "prismatic"
        return "revolute" if self._model.jnt_limited[joint] else "continuous"

    def _put_link(self, root: ElementTree.Element, link: _Link, folder: Path) -> None:
        element, model = ElementTree.SubElement(root, "link", name=link.name), self._model
        first = int(model.body_geomadr[link.body])
        for geom in range(first, first + int(model.body_geomnum[link.body])):
            if model.geom_group[geom] >= _SHOWN_GROUPS or model.geom_rgba[geom, 3] == 0.0:
                continue
            size, xyz, wxyz = model.geom_size[geom], model.geom_pos[geom] - link.shift, model.geom_quat[geom]
            match int(model.geom_type[geom]):
                case _GEOM.mjGEOM_BOX:
                    shape = {"box": {"size": _text(2.0 * size)}}
                case _GEOM.mjGEOM_SPHERE:
                    shape = {"sphere": {"radius": f"{size[0]:.9g}"}}
                case _GEOM.mjGEOM_CYLINDER | _GEOM.mjGEOM_CAPSULE as kind:
                    # A capsule with flat ends of the same length: URDF has no round ones.
                    length = 2.0 * size[1] + (2.0 * size[0] if kind == _GEOM.mjGEOM_CAPSULE else 0.0)
                    shape = {"cylinder": {"radius": f"{size[0]:.9g}", "length": f"{length:.9g}"}}
                case _GEOM.mjGEOM_MESH:
                    shape = {"mesh": {"filename": self._mesh(int(model.geom_dataid[geom]), folder)}}
                case _:
                    continue
            visual = ElementTree.SubElement(element, "visual")
            _put_origin(visual, xyz, wxyz)
            geometry = ElementTree.SubElement(visual, "geometry")
            for tag, attributes in shape.items():
                ElementTree.SubElement(geometry, tag, attributes)
            material = int(model.geom_matid[geom])
            rgba = model.geom_rgba[geom] if material < 0 else model.mat_rgba[material]
            paint = ElementTree.SubElement(visual, "material", name=f"{link.name}_{geom}")
            ElementTree.SubElement(paint, "color", rgba=_text(rgba))

    def _mesh(self, mesh: int, folder: Path) -> str:
        """Write a mesh as a binary STL, as the model has it; return its address."""
        model, file = self._model, folder / f"{mesh}.stl"
        if not file.exists():
            start, faces = int(model.mesh_vertadr[mesh]), int(model.mesh_faceadr[mesh])
            vertices = model.mesh_vert[start : start + int(model.mesh_vertnum[mesh])]
            corners = vertices[model.mesh_face[faces : faces + int(model.mesh_facenum[mesh])]]
            rows = np.zeros(len(corners), dtype=[("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("rest", "<u2")])
            rows["corners"] = corners
            rows["normal"] = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
            file.write_bytes(bytes(80) + struct.pack("<I", len(rows)) + rows.tobytes())
        return file.as_uri()


def _seen_from(parent_xyz: Array, parent_wxyz: Array, xyz: Array, wxyz: Array) -> tuple[Array, Array]:
    """Return a world pose as seen from another; positions (3,), quaternions w, x, y, z (4,)."""
    inverse_xyz, inverse_wxyz, found_xyz, found_wxyz = np.empty(3), np.empty(4), np.empty(3), np.empty(4)
    mujoco.mju_negPose(inverse_xyz, inverse_wxyz, parent_xyz, parent_wxyz)
    mujoco.mju_mulPose(found_xyz, found_wxyz, inverse_xyz, inverse_wxyz, xyz, wxyz)
    return found_xyz, found_wxyz


def _put_origin(element: ElementTree.Element, xyz: Array, wxyz: Array) -> None:
    matrix = np.empty(9)
    mujoco.mju_quat2Mat(matrix, wxyz)
    m = matrix.reshape(3, 3)
    # URDF's roll, pitch, yaw about fixed axes.
    pitch = np.arctan2(-m[2, 0], np.hypot(m[0, 0], m[1, 0]))
    if np.hypot(m[0, 0], m[1, 0]) > 1e-9:
        roll, yaw = np.arctan2(m[2, 1], m[2, 2]), np.arctan2(m[1, 0], m[0, 0])
    else:
        roll, yaw = 0.0, np.arctan2(-m[0, 1], m[1, 1])
    ElementTree.SubElement(element, "origin", xyz=_text(xyz), rpy=_text((roll, pitch, yaw)))


def _text(values: object) -> str:
    return " ".join(f"{float(value):.9g}" for value in np.asarray(values).ravel())
