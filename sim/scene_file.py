"""Somebody's scene: an MJCF or URDF file as it is, told as things, fixtures, parts and a table."""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Iterator
from dataclasses import replace
from functools import lru_cache
from pathlib import Path

import mujoco
import numpy as np

from robosandbox.errors import InputError
from robosandbox.robots.importers.imported import one_line
from robosandbox.robots.infer.kinematic_tree import actuator_joints, find_chains
from robosandbox.shapes.body import PartJoint, Piece
from robosandbox.shapes.compound import FileKind, Geometry, kind_of
from robosandbox.shapes.hull import BoxHull, CapsuleHull, CylinderHull, Hull, SphereHull
from robosandbox.shapes.polyhedron import PolyhedronHull
from robosandbox.shapes.room import Room
from robosandbox.sim.keyframes import Keyframe, keyframes_of
from robosandbox.sim.objects.standing import glides, is_free
from robosandbox.sim.room import FLOOR
from robosandbox.sim.scene_model import read_scene_model
from robosandbox.sim.scene_sidecar import ObjectNotes, SceneSidecar, scene_sidecar, sidecar_path
from robosandbox.spatial import quat_xyzw_from_matrix
from robosandbox.suggestions import did_you_mean, did_you_mean_file
from robosandbox.types import Array, Pose, SceneObject, Vec3
from robosandbox.types.objects import Area
from robosandbox.values import frozen

# Hinges in a row that make an arm, and hinges on hinges that make legs; a lamp or a crane of three joints stays in the scene.
_LEAST_HINGES = 4
# Metres over a surface within which a thing stands on it, or will once it has fallen.
_FALLS = 0.10
# Metres above the lowest level face from where on one is no floor.
_ON_A_FLOOR = 0.05
# Half of the longest side of a table, metres: a floor is not reached to its end.
_FARTHEST = 1.5
# Turn of a body out of the vertical up to which its level faces are level, as a cosine.
_UPRIGHT = 0.999
_FREE, _BALL = mujoco.mjtJoint.mjJNT_FREE.value, mujoco.mjtJoint.mjJNT_BALL.value
_HINGE = mujoco.mjtJoint.mjJNT_HINGE.value
_PLANE = mujoco.mjtGeom.mjGEOM_PLANE.value
_MESH = mujoco.mjtGeom.mjGEOM_MESH.value
# Directions from which pictures may be taken, degrees about z, the house's own first, and how steeply from above, as a slope; from
# behind, where most robots stand, none is.
_AROUND = (-39.0, 39.0, -60.0, 60.0, 0.0, -90.0, 90.0, -120.0, 120.0)
_STEEP = 0.7
# Numbers of a texture that its mean colour is taken of.
_PIXELS = 20_000
_NO_ID = re.compile(r"[^A-Za-z0-9_.-]+")


@frozen(kw_only=True)
class Table:
    """The level face that things stand on.

    Attributes:
        body: The name of its body in the file; "world" for what hangs on no body.
        height: In the world, metres.
        area: Least and largest x, then y, metres.
        why: Why this one, in words.
        is_ground: Whether it is a plane: a robot stands anywhere on it, and on a table at its edge.
    """

    body: str
    height: float
    area: Area
    why: str
    is_ground: bool = False


@frozen(kw_only=True)
class SceneFile:
    """A scene's file, read.

    Attributes:
        path: The file.
        sidecar: What lies beside it.
        objects: Its things, fixtures and parts.
        table: What most things stand on.
        left_out: Names of bodies that are not in the scene, with why.
        floor: Name of the body of its lowest plane; None without one.
        bodies: Names of the bodies of each object, the first carries its pose, by id.
        keyframes: The file's, by joints.
        eye: Where a camera sees most of it, metres.
        robot_base: Where the file's own robot stood: x, y and z, metres, and the turn about z, radians; None where it has none.
        notes: What was found, in sentences.
    """

    path: Path
    sidecar: SceneSidecar
    objects: tuple[SceneObject, ...]
    table: Table
    left_out: dict[str, str]
    floor: str | None
    bodies: dict[str, tuple[str, ...]]
    keyframes: tuple[Keyframe, ...] = ()
    eye: Vec3 = (1.0, -1.0, 1.0)
    robot_base: tuple[float, float, float, float] | None = None
    notes: tuple[str, ...] = ()

    def bodies_of(self, body: str) -> tuple[str, ...]:
        """Return the names of the bodies of the object whose first body this is."""
        return next(names for names in self.bodies.values() if names[0] == body)

    def spec(self, *, keep: Iterable[str] | None = None) -> mujoco.MjSpec:
        """Return the file as a new spec, without what is left out.

        Args:
            keep: Ids of the objects that stay; all when left out. Fixtures and parts always do.
        """
        spec = read_scene_model(self.path).spec
        kept = None if keep is None else set(keep)
        gone = [
            self.bodies[item.id][0]
            for item in self.objects
            if kept is not None and item.id not in kept and not item.is_fixed
        ]
        for name in (*self.left_out, *gone):
            body = spec.body(name)
            if body is not None:
                spec.delete(body)
        # Their numbers are of all joints: who compiles the spec puts them back.
        for key in list(spec.keys):
            spec.delete(key)
        return spec


def read_scene_file(path: Path) -> SceneFile:
    """Return a scene's file; the same files give the same value.

    Raises:
        InputError: There is no such file, it does not compile, or its sidecar does not fit it.
    """
    full = path.expanduser().resolve()
    if not full.is_file():
        raise InputError(f"scene.world: {str(path)!r} is not a file{did_you_mean_file(path)}")
    beside = sidecar_path(full)
    return _read(full, full.stat().st_mtime_ns, beside.stat().st_mtime_ns if beside.is_file() else 0)


@lru_cache(maxsize=8)
def _read(path: Path, stamp: int, sidecar_stamp: int) -> SceneFile:
    del stamp, sidecar_stamp  # part of the cache's key: an edited file is read again
    said = scene_sidecar(path)
    read = read_scene_model(path)
    spec = read.spec
    if said.table is None and read.is_alone:
        # Whatever level faces the thing has.
        said = said.model_copy(update={"table": FLOOR})
    model = _compiled(spec, path)
    keyframes = keyframes_of(model)
    left_out = {name: "the sidecar leaves it out" for name in said.leave_out}
    _check_names(model, said, path)
    robots = _robots(model)
    base = None if not robots else _stood(model, next(iter(robots)))
    left_out |= robots
    model = _left(spec, model, left_out, path)
    linkages = _linkages(model)
    model = _left(spec, model, linkages, path)
    left_out |= linkages
    found = _Reader(path, said, model, left_out, keyframes).read()
    return replace(found, robot_base=base, notes=(*read.notes, *found.notes))


def _left(spec: mujoco.MjSpec, model: mujoco.MjModel, without: Iterable[str], path: Path) -> mujoco.MjModel:
    """Return what is left of a model without some bodies, and without keyframes, which would not fit."""
    names = list(without)
    for name in names:
        spec.delete(spec.body(name))
    if not names:
        return model
    for key in list(spec.keys):
        spec.delete(key)
    return _compiled(spec, path)


class _Reader:
    """Reads a compiled scene."""

    def __init__(
        self,
        path: Path,
        said: SceneSidecar,
        model: mujoco.MjModel,
        left_out: dict[str, str],
        keyframes: tuple[Keyframe, ...],
    ) -> None:
        self._keyframes = keyframes
        self._path, self._said, self._model, self._left_out = path, said, model, left_out
        self._data = mujoco.MjData(model)
        if said.keyframe is not None:
            start = next(key for key in keyframes if key.name == said.keyframe)
            for joint in range(model.njnt):
                values = start.qpos[str(model.joint(joint).name)]
                address = int(model.jnt_qposadr[joint])
                self._data.qpos[address : address + len(values)] = values
        mujoco.mj_forward(model, self._data)
        self._children: dict[int, list[int]] = {}
        for body in range(1, model.nbody):
            self._children.setdefault(int(model.body_parentid[body]), []).append(body)
        self._ids: set[str] = {"table", "floor", "robot"}
        self._bodies: dict[str, tuple[str, ...]] = {}
        self._notes: list[str] = []

    def read(self) -> SceneFile:
        made = (self._thing(body) for body in self._children.get(0, ()) if self._is_free(body))
        things = [item for item in made if item is not None]
        groups = {top: [*self._units(top)] for top in self._children.get(0, ()) if not self._is_free(top)}
        roots = [body for units in groups.values() for body in units]
        # What is alone in a body without geoms is called by that.
        called = {
            unit: str(self._model.body(top).name)
            for top, units in groups.items()
            for unit in units
            if sum(not self._moves(one) for one in units) == 1 and not self._moves(unit)
        }
        table = self._table(roots, things)
        objects = list(things)
        for units in groups.values():
            # What moves beside the one fixture of a group is a part of it: a knob of a stove.
            fixed = [unit for unit in units if not self._moves(unit)]
            owner = ""
            for body in (*fixed, *(unit for unit in units if self._moves(unit))):
                found = list(self._fixture(body, table, called.get(body), owner if len(fixed) == 1 else ""))
                owner = owner or next((item.id for item in found if item.kind != "part"), "")
                objects += found
        return SceneFile(
            path=self._path,
            sidecar=self._said,
            objects=tuple(objects),
            table=table,
            left_out=self._left_out,
            floor=self._floor(),
            bodies=self._bodies,
            keyframes=self._keyframes,
            eye=self._eye(table, objects),
            notes=tuple(self._notes),
        )

    # What a body is.

    def _is_free(self, body: int) -> bool:
        return is_free(self._model, body)

    def _moves(self, body: int) -> bool:
        return int(self._model.body_jntnum[body]) > 0

    def _units(self, body: int) -> Iterator[int]:
        """Yield the bodies that are fixtures or parts of their own: groups without geoms are looked into."""
        has_geoms = int(self._model.body_geomnum[body]) > 0
        if self._moves(body) or has_geoms or not self._children.get(body):
            yield body
        else:
            for child in self._children[body]:
                yield from self._units(child)

    def _welded(self, body: int) -> list[int]:
        """Return a body and all that is fixed on it."""
        found, ask = [], [body]
        while ask:
            at = ask.pop(0)
            found.append(at)
            ask += [child for child in self._children.get(at, ()) if not self._moves(child)]
        return found

    def _below(self, body: int) -> list[int]:
        """Return a body and all that hangs on it."""
        found, ask = [], [body]
        while ask:
            at = ask.pop(0)
            found.append(at)
            ask += self._children.get(at, ())
        return found

    # Things, fixtures, parts.

    def _thing(self, body: int) -> SceneObject | None:
        bodies = self._below(body)
        pieces = self._pieces(bodies, body)
        name = str(self._model.body(body).name)
        if not pieces:
            self._notes.append(f"{name} moves freely and collides with nothing: it is left as it is and not told of")
            return None
        mass = float(self._model.body_subtreemass[body])
        kind, size = _primitive(pieces)
        if kind is None:
            return self._made(body, bodies, pieces, kind_of(pieces), mass)
        return self._made(body, bodies, None, kind, mass, size)

    def _fixture(self, body: int, table: Table, called: str | None, owner: str) -> Iterator[SceneObject]:
        """Yield a fixture and its parts, or a part of the fixture whose id is `owner`."""
        name = str(self._model.body(body).name)
        if glides(self._model, body):
            if (made := self._thing(body)) is not None:
                yield made
            return
        if self._moves(body):
            yield from self._parts(body, owner)
            return
        bodies = self._welded(body)
        prefix = ""
        if name != table.body:
            pieces = self._pieces(bodies, body)
            if pieces:
                mass = max(float(self._model.body_mass[bodies].sum()), 1.0)
                whole = Geometry(pieces)
                hollows = whole.hollows if whole.cavity is None else ()
                kind = "cupboard" if whole.cavity is not None else "compartment" if len(hollows) == 1 else "fixture"
                made = self._made(body, bodies, pieces, kind, mass, name=called)
                prefix = made.id
                yield made
                for number, room in enumerate(hollows if len(hollows) > 1 else ()):
                    region = self._region_in(room, body, bodies, prefix) or f"compartment_{number + 1}"
                    yield self._made(
                        body, bodies, pieces, "compartment", mass, name=f"{prefix}.{region}", compartment=number
                    )
        for at in bodies:
            for child in self._children.get(at, ()):
                if self._moves(child):
                    yield from self._parts(child, prefix)

    def _parts(self, body: int, prefix: str) -> Iterator[SceneObject]:
        """Yield a body on a hinge or slide, and those on it."""
        model = self._model
        bodies = self._welded(body)
        pieces = self._pieces(bodies, body)
        joint = int(model.body_jntadr[body])
        name = str(model.body(body).name)
        if pieces and int(model.jnt_type[joint]) not in (_BALL, _FREE):
            axis, anchor = self._data.xaxis[joint], self._data.xanchor[joint]
            limited = bool(model.jnt_limited[joint])
            low, high = (float(v) for v in model.jnt_range[joint]) if limited else (-np.inf, np.inf)
            told = PartJoint(
                kind="hinge" if int(model.jnt_type[joint]) == _HINGE else "slide",
                axis=_vec(axis),
                anchor=_vec(anchor),
                low=low,
                high=high,
                stiffness=float(np.asarray(model.jnt_stiffness[joint]).flat[0]),
                start=float(self._data.qpos[model.jnt_qposadr[joint]]),
            )
            own = name
            if prefix:
                own = f"{prefix}.{_without(name, prefix)}"
            made = self._made(
                body, bodies, pieces, "part", max(float(model.body_mass[bodies].sum()), 1e-3), joint=told, name=own
            )
            prefix = made.id
            yield made
        for at in bodies:
            for child in self._children.get(at, ()):
                if self._moves(child):
                    yield from self._parts(child, prefix)

    def _made(
        self,
        body: int,
        bodies: list[int],
        pieces: tuple[Piece, ...] | None,
        kind: str,
        mass: float,
        size: tuple[float, ...] = (),
        *,
        joint: PartJoint | None = None,
        name: str | None = None,
        compartment: int | None = None,
    ) -> SceneObject:
        model, data = self._model, self._data
        stem = str(model.body(body).name)
        notes = ObjectNotes() if compartment is not None else self._said.objects.get(stem, ObjectNotes())
        geometry = None
        if pieces is not None:
            told: FileKind = notes.kind or kind  # type: ignore[assignment]
            geometry = Geometry(pieces, told, joint, compartment)
            kind, size = told, _floats(geometry.box[1])
        made = SceneObject(
            id=self._unique(notes.id or name or stem),
            kind=kind,
            size=tuple(max(one, 1e-4) for one in size),
            pose=Pose.from_matrix(data.xpos[body], data.xmat[body].reshape(3, 3)),
            rgba=notes.rgba or self._colour(bodies),
            mass=float(np.clip(mass, _LIGHTEST, _HEAVIEST)),
            geometry=geometry,
            body=stem,
        )
        # The file's own weight, whatever it is, is what is simulated: the check tells of absurd ones.
        made = made.model_copy(update={"mass": mass})
        self._bodies[made.id] = tuple(str(model.body(one).name) for one in bodies)
        return made

    def _region_in(self, room: Room, body: int, bodies: list[int], prefix: str) -> str | None:
        """Return the name of the site that marks a hollow of some bodies, in the frame of one of them; None without one."""
        model, data = self._model, self._data
        turn, origin = data.xmat[body].reshape(3, 3), data.xpos[body]
        for site in np.flatnonzero(np.isin(model.site_bodyid, bodies)):
            x, y, z = turn.T @ (data.site_xpos[site] - origin)
            if room.margin(np.array([x, y])) > 0.0 and room.floor < z < room.rim:
                return _without(str(model.site(int(site)).name), prefix)
        return None

    def _unique(self, name: str) -> str:
        plain = _NO_ID.sub("_", name).strip("_.-").removesuffix("_main")[:60] or "thing"
        found, number = plain, 2
        while found in self._ids:
            found, number = f"{plain}_{number}", number + 1
        self._ids.add(found)
        return found

    def _pieces(self, bodies: list[int], frame: int) -> tuple[Piece, ...]:
        """Return what of some bodies collides, in the frame of one of them."""
        model, data = self._model, self._data
        rotation, origin = data.xmat[frame].reshape(3, 3), data.xpos[frame]
        found = []
        for body in bodies:
            first = int(model.body_geomadr[body])
            for geom in range(first, first + int(model.body_geomnum[body])):
                if not (model.geom_contype[geom] or model.geom_conaffinity[geom]):
                    continue
                piece = _piece(model, geom)
                if piece is None:
                    continue
                hull, shift = piece
                turn = rotation.T @ data.geom_xmat[geom].reshape(3, 3)
                centre = rotation.T @ (data.geom_xpos[geom] - origin) + turn @ shift
                quat = quat_xyzw_from_matrix(turn)
                found.append(Piece(hull=hull, centre=_vec(centre), quat_xyzw=quat))
        return tuple(found)

    def _colour(self, bodies: list[int]) -> tuple[float, float, float, float]:
        """Return the colour of what is seen most of some bodies, by the surface of the geoms."""
        model = self._model
        best, most = (0.7, 0.7, 0.7, 1.0), 0.0
        areas: dict[tuple[float, float, float, float], float] = {}
        for body in bodies:
            first = int(model.body_geomadr[body])
            for geom in range(first, first + int(model.body_geomnum[body])):
                rgba = _geom_colour(model, geom)
                if rgba is None or rgba[3] < 0.1 or int(model.geom_group[geom]) > 2:
                    continue
                _, y, z = np.sort(model.geom_aabb[geom, 3:])
                areas[rgba] = areas.get(rgba, 0.0) + float(z * y)
        for rgba, area in areas.items():
            if area > most:
                best, most = rgba, area
        return best

    def _eye(self, table: Table, objects: list[SceneObject]) -> Vec3:
        """Return from where most things and parts are seen, the nearest to where the house's own camera would be."""
        (x0, x1), (y0, y1) = table.area
        middle = np.array([(x0 + x1) / 2.0, (y0 + y1) / 2.0, table.height])
        far = max(1.2, 0.75 * math.hypot(x1 - x0, y1 - y0))
        best: tuple[float, Vec3] | None = None
        for azimuth in np.radians(_AROUND):
            eye = middle + far * np.array([math.cos(azimuth), math.sin(azimuth), _STEEP])
            seen = sum(
                self._is_seen(eye, item) * (1.0 if item.is_fixed and item.kind != "part" else 2.0) for item in objects
            )
            # Where the arm stands nothing else is seen.
            score = seen - 0.01 * abs(math.remainder(azimuth - math.radians(_AROUND[0]), math.tau))
            if best is None or score > best[0]:
                best = score, _vec(eye)
        assert best is not None
        return best[1]

    def _is_seen(self, eye: Array, item: SceneObject) -> bool:
        """Tell whether nothing is between a point (3,) and an object's middle."""
        middle = item.pose.position
        if item.geometry is not None:
            middle = middle + item.pose.rotation @ item.geometry.box[0]
        way = middle - eye
        hit = np.full(1, -1, dtype=np.int32)
        near = mujoco.mj_ray(self._model, self._data, eye, way / np.linalg.norm(way), None, 1, -1, hit)
        body = int(self._model.geom_bodyid[hit[0]]) if hit[0] >= 0 else -1
        own = self._bodies[item.id]
        return near < 0.0 or near > np.linalg.norm(way) or (body > 0 and str(self._model.body(body).name) in own)

    # The table.

    def _floor(self) -> str | None:
        planes = [g for g in range(self._model.ngeom) if self._model.geom_type[g] == _PLANE]
        if not planes:
            return None
        lowest = min(planes, key=lambda g: self._data.geom_xpos[g, 2])
        return str(self._model.body(int(self._model.geom_bodyid[lowest])).name)

    def _table(self, roots: list[int], things: list[SceneObject]) -> Table:
        """Return the level face that most things stand on, by themselves or on what stands on it; a floor bears what is on it alone."""
        model = self._model
        stands = [(item.pose.position, _extent(item)[0], frozenset((k,))) for k, item in enumerate(things)]
        faces: list[tuple[int, float, Area, bool]] = []
        feet: dict[int, tuple[Array, float]] = {}
        for body in (0, *roots):
            if self._moves(body):
                continue
            bodies = [0] if body == 0 else self._welded(body)
            planes = [*self._planes(bodies)]
            faces += [(body, *face, True) for face in planes]
            pieces = self._pieces(bodies, body)
            if not pieces:
                continue
            form = Geometry(pieces)
            faces += [(body, *face, False) for face in self._faces(body, form)]
            if body:
                points = form.outer @ self._data.xmat[body].reshape(3, 3).T + self._data.xpos[body]
                feet[body] = points.mean(axis=0), float(points[:, 2].min())
        found: list[tuple[int, float, Table]] = []
        lowest = min((face[1] for face in faces), default=0.0)
        # The highest first: what stands in a cupboard stands on the table that bears the cupboard.
        for body, height, area, ground in sorted(faces, key=lambda face: -face[1]):
            (x0, x1), (y0, y1) = area
            on = frozenset[int]().union(
                *(
                    borne
                    for middle, low, borne in (stands if height > lowest + _ON_A_FLOOR else stands[: len(things)])
                    if x0 <= middle[0] <= x1 and y0 <= middle[1] <= y1 and -0.01 < low - height < _FALLS
                )
            )
            if body in feet:
                stands.append((*feet[body], on))
            why = f"{len(on)} of {len(things)} things stand on it" if things else "the largest level face"
            table = Table(body=str(model.body(body).name), height=height, area=area, why=why, is_ground=ground)
            found.append((len(on), (x1 - x0) * (y1 - y0), table))
        if not found:
            raise InputError(
                f"{self._path.name}: has no level face on which anything could stand; give it a table or a floor"
            )
        if self._said.table is not None:
            named = [one for one in found if one[2].body == self._said.table]
            if not named:
                have = ", ".join(dict.fromkeys(one[2].body for one in found))
                raise InputError(
                    f"{sidecar_path(self._path).name}: table: {self._said.table!r} has no level face; there is {have}"
                )
            found = named
        # A table stands on a floor: of faces with as many things the largest that is higher is meant.
        lowest = min(one[2].height for one in found)
        return max(found, key=lambda one: (one[0], one[2].height > lowest + _ON_A_FLOOR, one[1]))[2]

    def _faces(self, body: int, form: Geometry) -> Iterator[tuple[float, Area]]:
        turn = self._data.xmat[body].reshape(3, 3)
        if turn[2, 2] < _UPRIGHT:
            return
        for face in form.surfaces:
            local = np.column_stack([face.points, np.full(len(face.points), face.height)])
            points = local @ turn.T + self._data.xpos[body]
            low, high = points.min(axis=0) - face.cell / 2.0, points.max(axis=0) + face.cell / 2.0
            yield float(points[0, 2]), ((float(low[0]), float(high[0])), (float(low[1]), float(high[1])))

    def _planes(self, bodies: list[int]) -> Iterator[tuple[float, Area]]:
        model, data = self._model, self._data
        for geom in range(model.ngeom):
            if int(model.geom_bodyid[geom]) not in bodies or model.geom_type[geom] != _PLANE:
                continue
            if data.geom_xmat[geom].reshape(3, 3)[2, 2] < _UPRIGHT:
                continue
            x, y, z = data.geom_xpos[geom]
            hx, hy = (float(s) if 0.0 < s < _FARTHEST else _FARTHEST for s in model.geom_size[geom, :2])
            yield float(z), ((float(x) - hx, float(x) + hx), (float(y) - hy, float(y) + hy))


# What a scene's object may weigh, kg, as far as messages and beliefs go.
_LIGHTEST, _HEAVIEST = 0.001, 50.0


def _compiled(spec: mujoco.MjSpec, path: Path) -> mujoco.MjModel:
    try:
        return spec.compile()
    except (ValueError, mujoco.FatalError) as error:
        raise InputError(f"{path.name}: {one_line(error)}") from None


def _check_names(model: mujoco.MjModel, said: SceneSidecar, path: Path) -> None:
    names = [str(model.body(b).name) for b in range(model.nbody)]
    fields = [*(("leave_out", name) for name in said.leave_out), *(("objects", name) for name in said.objects)]
    for field, name in (*fields, *([("table", said.table)] if said.table else ())):
        if name not in names:
            raise InputError(
                f"{sidecar_path(path).name}: {field}: {name!r} is no body of {path.name}{did_you_mean(name, names)}"
            )
    keys = [str(model.key(k).name) for k in range(model.nkey)]
    if said.keyframe is not None and said.keyframe not in keys:
        raise InputError(
            f"{sidecar_path(path).name}: keyframe: {said.keyframe!r} is none of {path.name}, which has "
            f"{', '.join(keys) or 'none'}{did_you_mean(said.keyframe, keys)}"
        )


def _stood(model: mujoco.MjModel, name: str) -> tuple[float, float, float, float]:
    """Return where a body on the world stands: x, y, z, and its turn about z."""
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    pose = Pose.from_matrix(data.body(name).xpos, data.body(name).xmat.reshape(3, 3))
    return (*pose.xyz, pose.yaw)


def _robots(model: mujoco.MjModel) -> dict[str, str]:
    """Return the bodies of arms, by name, with why: hinges in a row that motors drive, or that are led by the hand."""
    found = _led_arms(model)
    driven = {joint for actuator in range(model.nu) for joint in actuator_joints(model, actuator)}
    for chain in find_chains(model):
        hinges = [j for j in chain.joints if model.jnt_type[j] == _HINGE and j in driven]
        if len(hinges) < _LEAST_HINGES:
            continue
        body = int(model.jnt_bodyid[chain.joints[0]])
        while int(model.body_parentid[body]):
            body = int(model.body_parentid[body])
        found[str(model.body(body).name)] = (
            f"an arm of {len(hinges)} driven hinges: the scene's own robot takes its place"
        )
    return found


def _linkages(model: mujoco.MjModel) -> dict[str, str]:
    """Return the lowest jointed bodies of arms and legs without an arm's motors, by name, with why: more hinges on hinges than fixtures have."""
    hinges, lowest, loose = [0] * model.nbody, [0] * model.nbody, [False] * model.nbody
    on_hinges = [0] * model.nbody
    for body in range(1, model.nbody):
        parent, start = int(model.body_parentid[body]), int(model.body_jntadr[body])
        kinds = [int(kind) for kind in model.jnt_type[start : start + int(model.body_jntnum[body])]]
        loose[body] = loose[parent] or _FREE in kinds
        hinges[body] = hinges[parent] + kinds.count(_HINGE)
        lowest[body] = lowest[parent] or (body if hinges[body] else 0)
        on_hinges[int(model.body_rootid[body])] += hinges[body] > hinges[parent] > 0
    found = {
        lowest[body]
        for body in range(1, model.nbody)
        if hinges[body] and not loose[body] and max(hinges[body], on_hinges[model.body_rootid[body]]) >= _LEAST_HINGES
    }
    return {str(model.body(body).name): "an arm or legs: hinges on hinges, which no part has" for body in sorted(found)}


def _led_arms(model: mujoco.MjModel) -> dict[str, str]:
    """Return the bodies of arms whose hand is welded to a mocap body, by name, and such bodies, with why."""
    found: dict[str, str] = {}
    for weld in np.flatnonzero(model.eq_type == mujoco.mjtEq.mjEQ_WELD.value):
        ends = int(model.eq_obj1id[weld]), int(model.eq_obj2id[weld])
        if model.eq_objtype[weld] != mujoco.mjtObj.mjOBJ_BODY.value or model.body_mocapid[[*ends]].max() < 0:
            continue
        target, hand = ends if model.body_mocapid[ends[0]] >= 0 else ends[::-1]
        chain = [hand]
        while model.body_parentid[chain[-1]]:
            chain.append(int(model.body_parentid[chain[-1]]))
        hinges = sum(int(model.jnt_type[j]) == _HINGE for j in np.flatnonzero(np.isin(model.jnt_bodyid, chain)))
        if hinges >= _LEAST_HINGES:
            found[str(model.body(chain[-1]).name)] = (
                f"an arm of {hinges} hinges whose hand is led: the scene's own robot takes its place"
            )
            found[str(model.body(target).name)] = f"it leads the hand of {model.body(chain[-1]).name}"
    return found


def _piece(model: mujoco.MjModel, geom: int) -> tuple[Hull, Array] | None:
    """Return a geom's hull, and where in the geom's frame the middle of its box is (3,)."""
    kinds, size, none = mujoco.mjtGeom, model.geom_size[geom], np.zeros(3)
    match kinds(int(model.geom_type[geom])):
        case kinds.mjGEOM_BOX:
            return BoxHull(_vec(size)), none
        case kinds.mjGEOM_SPHERE:
            return SphereHull((float(size[0]),)), none
        case kinds.mjGEOM_CYLINDER:
            return CylinderHull((float(size[0]), float(size[1]))), none
        case kinds.mjGEOM_CAPSULE:
            return CapsuleHull((float(size[0]), float(size[1]))), none
        case kinds.mjGEOM_ELLIPSOID:
            points = size * _sphere()
        case kinds.mjGEOM_MESH:
            mesh = int(model.geom_dataid[geom])
            start, count = int(model.mesh_vertadr[mesh]), int(model.mesh_vertnum[mesh])
            points = np.asarray(model.mesh_vert[start : start + count], dtype=np.float64)
            points = _corners(points)
        case _:
            return None
    middle = (points.min(axis=0) + points.max(axis=0)) / 2.0
    return PolyhedronHull(tuple(_vec(point) for point in points - middle)), middle


def _corners(points: Array) -> Array:
    from scipy.spatial import ConvexHull

    corners: Array = points[ConvexHull(points).vertices]
    return corners


def _sphere() -> Array:
    k = np.arange(64) + 0.5
    z = 1.0 - k / 32.0
    angle, level = np.pi * (1.0 + np.sqrt(5.0)) * k, np.sqrt(1.0 - (1.0 - k / 32.0) ** 2)
    return np.column_stack([level * np.cos(angle), level * np.sin(angle), z]).astype(np.float64)


def _primitive(pieces: tuple[Piece, ...]) -> tuple[str | None, tuple[float, ...]]:
    """Return the kind and size of a thing that is one box, cylinder, ball or capsule about its own frame."""
    (first, *others) = pieces
    plain = not others and np.abs(first.centre).max() < 1e-6 and abs(first.quat_xyzw[3]) > 1.0 - 1e-9
    match first.hull:
        case BoxHull(size=size) if plain:
            return "box", size
        case CylinderHull(size=size) if plain:
            return "cylinder", size
        case SphereHull(size=size) if plain:
            return "sphere", size
        case CapsuleHull(size=size) if plain:
            return "capsule", size
        case _:
            return None, ()


def _extent(item: SceneObject) -> tuple[float, float]:
    """Return an object's lowest and highest point, metres."""
    geometry = item.geometry
    if geometry is not None:
        heights = geometry.outer @ item.pose.rotation[2] + item.pose.xyz[2]
        return float(heights.min()), float(heights.max())
    reach = item.shape.hull(item.size).support(np.array([[0.0, 0.0, 1.0]]) @ item.pose.rotation)[0]
    return item.pose.xyz[2] - float(reach), item.pose.xyz[2] + float(reach)


def _geom_colour(model: mujoco.MjModel, geom: int) -> tuple[float, float, float, float] | None:
    """Return what colour a geom is drawn in: its own, its material's, or the mean of the texture."""
    rgba, material = model.geom_rgba[geom], int(model.geom_matid[geom])
    if material >= 0:
        rgba = model.mat_rgba[material]
        textures = [int(t) for t in np.atleast_1d(model.mat_texid[material]).ravel() if t >= 0]
        if textures:
            start = int(model.tex_adr[textures[0]])
            channels = int(model.tex_nchannel[textures[0]])
            count = int(model.tex_width[textures[0]]) * int(model.tex_height[textures[0]]) * channels
            pixels = model.tex_data[start : start + count].reshape(-1, channels)[:: max(1, count // _PIXELS), :3]
            rgba = np.array([*(pixels.mean(axis=0) / 255.0 * rgba[:3]), rgba[3]])
    red, green, blue, alpha = (float(np.clip(c, 0.0, 1.0)) for c in rgba)
    return round(red, 3), round(green, 3), round(blue, 3), round(alpha, 3)


def _without(name: str, prefix: str) -> str:
    """Return the name of a part without that of what it is on."""
    rest = name.removeprefix(prefix).strip("_.-/ ")
    return rest or name


def _vec(values: Array) -> tuple[float, float, float]:
    x, y, z = (float(v) for v in values)
    return x, y, z


def _floats(values: Array) -> tuple[float, ...]:
    return tuple(float(v) for v in values)
