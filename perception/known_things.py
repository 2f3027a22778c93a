"""Things whose surfaces are known, laid on what is seen of them."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components
from scipy.spatial import KDTree

from robosandbox.motion.scene_depths import SceneDepths
from robosandbox.perception.colour import colour_name
from robosandbox.perception.frames import SegmentedFrame
from robosandbox.perception.mesh_fit import KnownMesh, MeshFit, fit_level, fit_mesh, fit_near, surface_of
from robosandbox.perception.tolerances import TOLERANCES
from robosandbox.sim.objects.standing import stand as stand_body
from robosandbox.sim.world import World
from robosandbox.types import Array, DetectedObject, Pose, SceneObject, matrix_from_rotation_vector

# Metres from where a thing is believed within which what is seen may be it.
_NEAR = 0.025
# Seen points that tell where a thing is; fewer tell nothing.
_LEAST_POINTS = 25
# Metres between seen points of one thing, and points that a piece of the world has at least to be told of.
_APART, _TOLD = 0.012, 60
# Metres by which a thing is laid on what it stands on.
_STANDS = 0.008
# Radians up to which what stands nearly straight stands straight: four degrees, twice what a look is off by; where it also explains
# what is seen about as well, by a factor and by metres.
_STRAIGHT, _LEANS = float(np.radians(4.0)), float(np.radians(15.0))
_AS_WELL, _AS_WELL_BY = 1.25, 0.0002
# Share of a thing's points that are seen through, of those that could be seen, from which it is gone.
_GONE = 0.5
# Headings, radians, at which a thing is looked for that stands as it stood.
_HEADINGS = np.radians(np.arange(0.0, 360.0, 30.0))
# Factor by which a thing that is hidden where it was must explain what is seen better than one that is nowhere.
_HIDDEN = 1.5
# Share of a piece that no better match has taken.
_STILL_FREE = 0.7
# Distance of shares of red and green that counts as much as a mesh which is just not explained.
_OTHER_COLOUR = 0.12
_FAR_AWAY = 50.0  # Metres below everything: where no ray comes to.


@dataclass(slots=True, eq=False)
class KnownThing:
    """A thing of the file.

    Attributes:
        id: Its name.
        item: What is known of it.
        mesh: Its surface in the frame of its pose.
        pose: Where it is believed to be; None where that is not known.
        hidden: Whether the last look did not show it.
        last: Where it was last seen, or else where the file has it.
    """

    id: str
    item: SceneObject
    mesh: KnownMesh
    pose: Pose | None
    hidden: bool = True
    last: Pose = field(init=False)

    def __post_init__(self) -> None:
        self.last = self.item.pose

    def detected(self) -> DetectedObject:
        """Return it in the planner's words."""
        return DetectedObject(
            id=self.id,
            kind=self.item.kind,
            size=self.item.size,
            colour=colour_name(self.item.rgba),
            rgba=self.item.rgba,
            pose=self.item.pose if self.pose is None else self.pose,
            confidence=TOLERANCES.acted_on if self.hidden else 1.0,
            geometry=self.item.geometry,
        )

    def carry(self, pose: Pose) -> None:
        """Take it to be somewhere else than it was seen."""
        self.pose = pose


class KnownThings:
    """The things of a scene, laid on what stands before the rest of it.

    Args:
        world: The compiled scene.
        depths: The same as it is believed to be; things are put into it where they are found.

    Attributes:
        by_id: The things.
    """

    def __init__(self, world: World, depths: SceneDepths) -> None:
        self._world = world
        self._depths = depths
        self._meshes = {
            item.id: surface_of(depths.triangles(item.id)) for item in world.scene.objects if not item.is_fixed
        }
        self._in_vain: set[tuple[Any, ...]] = set()
        self.by_id: dict[str, KnownThing] = {}
        self.forget()

    def forget(self) -> None:
        """Take everything to be where the file has it."""
        self._in_vain = set()
        self.by_id = {
            item.id: KnownThing(item.id, item, self._meshes[item.id], item.pose)
            for item in self._world.scene.objects
            if item.id in self._meshes
        }

    def look(self, views: Sequence[SegmentedFrame], points: Array, colours: Array, held: Collection[str]) -> Array:
        """Find out where things are, and return the points (n, 3) that nothing explains.

        Args:
            views: The views.
            points: What stands before all that is fixed, and its parts, shape (n, 3).
            colours: Of each, channels 0..1, shape (n, 3).
            held: Ids of what is in hands: they are where the hands are.
        """
        left = self._follow(views, points, held)
        if self._find(views, points, colours, left, held):
            # What was found by a piece of it is laid on all that is seen of it.
            left = self._follow(views, points, held)
        self._lay(held)
        return points[left]

    def drop(self, thing: KnownThing) -> None:
        """Take a thing that a hand has let go to be on what is below it: where on its way up the hand was is not known."""
        assert thing.pose is not None
        gap = self._over(thing, thing.pose, _NEAR)
        if np.isfinite(gap):
            thing.pose = Pose.from_matrix(thing.pose.position - [0.0, 0.0, gap], thing.pose.rotation)

    def stand(self) -> None:
        """Put all things where they are believed to be, those that are nowhere far away."""
        data = self._depths.data
        for thing in self.by_id.values():
            body = self._world.object_bodies[thing.id]
            pose = Pose(xyz=(0.0, 0.0, -_FAR_AWAY)) if thing.pose is None else thing.pose
            stand_body(self._depths.model, data.qpos, body, pose)
        self._depths.place()

    def _follow(self, views: Sequence[SegmentedFrame], points: Array, held: Collection[str]) -> NDArray[np.bool_]:
        """Lay things that are about where they were on what is seen; return which points are none of theirs."""
        left = np.ones(len(points), dtype=bool)
        known = [thing for thing in self.by_id.values() if thing.pose is not None]
        apart = np.array([self._distances(thing, points, _NEAR) for thing in known]).reshape(len(known), len(points))
        nearest = apart.min(axis=0, initial=np.inf)
        for number, thing in enumerate(known):
            # The nearest thing's is each point.
            own = np.isfinite(apart[number]) & (apart[number] == nearest)
            if thing.id in held:
                left &= ~own
                continue
            assert thing.pose is not None
            if np.count_nonzero(own) >= _LEAST_POINTS:
                found = self._plainest(
                    thing, fit_near(thing.mesh, points[own], views, [thing.pose]), points[own], views
                )
                if found.explains:
                    thing.pose, thing.hidden = found.pose, False
                    left &= ~own
                    continue
            if self._is_gone(thing, views):
                thing.pose = None
            else:
                thing.hidden = True
                left &= ~own
        return left

    def _distances(self, thing: KnownThing, points: Array, most: float) -> Array:
        """Return how far points (n, 3) are from a thing's surface, (n,), metres; infinite from `most` on."""
        assert thing.pose is not None
        local = (points - thing.pose.position) @ thing.pose.rotation
        return np.asarray(thing.mesh.tree.query(local, distance_upper_bound=most)[0])

    def _is_gone(self, thing: KnownThing, views: Sequence[SegmentedFrame]) -> bool:
        """Tell whether cameras see through where a thing was."""
        assert thing.pose is not None
        points = thing.mesh.points[::8] @ thing.pose.rotation.T + thing.pose.position
        seen = through = 0
        for view in views:
            beyond = view.beyond(points)
            told = beyond[np.isfinite(beyond)]
            seen += int(np.count_nonzero(told > -_NEAR))
            through += int(np.count_nonzero(told > _NEAR))
        return seen >= _LEAST_POINTS and through > _GONE * seen

    def _find(
        self,
        views: Sequence[SegmentedFrame],
        points: Array,
        colours: Array,
        left: NDArray[np.bool_],
        held: Collection[str],
    ) -> bool:
        """Look for things that are not seen where they were among what nothing explains; tell whether any was found.

        Things stand as they stood before they are looked for in any other way, and are of one colour before they are of several.
        """
        left, any_found = left.copy(), False
        tints = colours[:, :2] / np.maximum(colours.sum(axis=1, keepdims=True), 1e-6)
        for anyhow in (False, True):
            for tinted in (True, False):
                lost = [
                    thing
                    for thing in self.by_id.values()
                    if thing.id not in held and (thing.pose is None or thing.hidden)
                ]
                for thing, piece, found in self._matches(
                    views, points, tints, lost, left, anyhow=anyhow, tinted=tinted
                ):
                    thing.pose, thing.hidden, any_found = found.pose, False, True
                    left[piece] = False
                    left &= ~np.isfinite(self._distances(thing, points, _STANDS))
        return any_found

    def _matches(
        self,
        views: Sequence[SegmentedFrame],
        points: Array,
        tints: Array,
        lost: Sequence[KnownThing],
        left: NDArray[np.bool_],
        *,
        anyhow: bool,
        tinted: bool,
    ) -> Iterator[tuple[KnownThing, NDArray[np.intp], MeshFit]]:
        """Yield which piece of what is left is which thing, the best match of surface and colour first, each thing once.

        Args:
            views: The views.
            points: Seen points, (n, 3).
            tints: Shares of red and green of each, (n, 2).
            lost: The things.
            left: Which of the points nothing explains.
            anyhow: Whether a thing may lie in any way, or stands as it stood.
            tinted: Whether a piece is of the thing's colour throughout, or of any.
        """
        found: list[tuple[float, KnownThing, NDArray[np.intp], MeshFit]] = []
        for thing in lost:
            off = np.linalg.norm(tints - _chroma(np.array(thing.item.rgba[:3])), axis=1)
            for piece in _pieces(points, left & (off < _OTHER_COLOUR) if tinted else left):
                if _width(points[piece]) > 2.0 * float(np.linalg.norm(thing.mesh.half)) + _STANDS:
                    continue
                spread = (*points[piece].mean(axis=0), *points[piece].std(axis=0))
                about = (thing.id, anyhow, *np.round(np.array(spread) / _STANDS).astype(int))
                if about in self._in_vain:
                    continue
                fit = self._laid(thing, points[piece], views, anyhow=anyhow)
                if not fit.explains:
                    self._in_vain.add(about)
                else:
                    another = 1.0 + float(off[piece].mean()) / _OTHER_COLOUR
                    found.append((fit.cost * another * (1.0 if thing.pose is None else _HIDDEN), thing, piece, fit))
        free, done = left.copy(), set()
        for _, thing, piece, fit in sorted(found, key=lambda one: one[0]):
            if thing.id not in done and np.count_nonzero(free[piece]) > _STILL_FREE * len(piece):
                done.add(thing.id)
                free[piece] = False
                yield thing, piece, fit

    def _laid(self, thing: KnownThing, seen: Array, views: Sequence[SegmentedFrame], *, anyhow: bool) -> MeshFit:
        """Return how a thing lies that explains seen points best: standing as it stood, or any way at all."""
        low, high = np.percentile(seen, [2.0, 98.0], axis=0)
        if anyhow:
            middle = np.array([*((low + high) / 2.0)[:2], high[2]])
            under = float(self._depths.below(middle[None], -1)[0])
            table = under if np.isfinite(under) else self._world.scene.table_height
            return self._plainest(thing, fit_mesh(thing.mesh, seen, views, table), seen, views)
        near = []
        for heading in _HEADINGS:
            rotation = matrix_from_rotation_vector(np.array([0.0, 0.0, heading])) @ thing.last.rotation
            corners = thing.mesh.corners @ rotation.T
            middle = (corners.min(axis=0) + corners.max(axis=0)) / 2.0
            place = (low + high) / 2.0 - middle
            place[2] = high[2] - corners[:, 2].max()
            near.append(Pose.from_matrix(place, rotation))
        return self._plainest(thing, fit_near(thing.mesh, seen, views, near), seen, views)

    def _plainest(self, thing: KnownThing, found: MeshFit, seen: Array, views: Sequence[SegmentedFrame]) -> MeshFit:
        """Return the plainest of the ways to lie that explain seen points about as well as the one found.

        What looks the same turned over stands as it stood; what stands nearly straight stands straight.
        """
        middle = (thing.mesh.corners.min(axis=0) + thing.mesh.corners.max(axis=0)) / 2.0
        for axis in np.eye(3)[:2]:
            turn = matrix_from_rotation_vector(np.pi * axis)
            rotation = found.pose.rotation @ turn
            if rotation[2] @ thing.last.rotation[2] <= found.pose.rotation[2] @ thing.last.rotation[2]:
                continue
            place = found.pose.position + found.pose.rotation @ (middle - turn @ middle)
            other = fit_near(thing.mesh, seen, views, [Pose.from_matrix(place, rotation)])
            if other.cost < _AS_WELL * found.cost + _AS_WELL_BY:
                found = other
        straight = _straightened(thing.mesh, found.pose, _LEANS)
        if straight is not found.pose:
            other = fit_level(thing.mesh, seen, views, straight)
            if other.cost < _AS_WELL * found.cost + _AS_WELL_BY:
                found = other
        return found

    def _lay(self, held: Collection[str]) -> None:
        """Lay things that nearly stand straight on something on it, the lowest first."""
        self.stand()
        loose = [
            thing
            for thing in self.by_id.values()
            if thing.pose is not None and thing.id not in held and not thing.hidden
        ]
        for thing in sorted(loose, key=lambda one: one.pose.position[2]):  # type: ignore[union-attr]
            assert thing.pose is not None
            pose = _straightened(thing.mesh, thing.pose, _STRAIGHT)
            gap = self._over(thing, pose, 2.0 * _STANDS)
            if abs(gap) < _STANDS:
                pose = Pose.from_matrix(pose.position - [0.0, 0.0, gap], pose.rotation)
            thing.pose = thing.last = pose
            self.stand()

    def _over(self, thing: KnownThing, pose: Pose, above: float) -> float:
        """Return how far a thing is above what is below it, metres, in it where less than 0, looked for from so far above its feet."""
        corners = thing.mesh.corners @ pose.rotation.T + pose.position
        lowest = float(corners[:, 2].min())
        feet = corners[corners[:, 2] < lowest + 0.003]
        starts = np.vstack([feet, feet.mean(axis=0)[None]])
        starts[:, 2] = lowest + above
        under = self._depths.below(starts, self._world.object_bodies[thing.id])
        return lowest - float(under.max(initial=-np.inf))


def pieces(points: Array) -> Iterator[Array]:
    """Yield those of some points (n, 3) that hang together, each (k, 3), where they are enough to be told of."""
    for own in _pieces(points, np.ones(len(points), dtype=bool)):
        yield points[own]


def _pieces(points: Array, left: NDArray[np.bool_]) -> Iterator[NDArray[np.intp]]:
    """Yield the indices of points that hang together, of those that are left."""
    chosen = np.flatnonzero(left)
    if len(chosen) < _TOLD:
        return
    pairs = KDTree(points[chosen]).query_pairs(_APART, output_type="ndarray")
    near = coo_matrix((np.ones(len(pairs)), (pairs[:, 0], pairs[:, 1])), shape=(len(chosen), len(chosen)))
    count, labels = connected_components(near, directed=False)
    for number in range(count):
        own = chosen[labels == number]
        if len(own) >= _TOLD:
            yield own


def _straightened(mesh: KnownMesh, pose: Pose, within: float) -> Pose:
    """Return a mesh's pose, upright on the face of its hull on which it stands within some radians; else as it is."""
    rotation = pose.rotation
    down = -rotation[2]
    for rest in mesh.rests:
        face = -rest[2]
        if float(face @ down) > np.cos(within):
            axis = np.cross(rotation @ face, [0.0, 0.0, -1.0])
            turn = matrix_from_rotation_vector(axis)
            middle = rotation @ mesh.corners.mean(axis=0)
            return Pose.from_matrix(pose.position + middle - turn @ middle, turn @ rotation)
    return pose


def _width(points: Array) -> float:
    """Return about the largest distance between two of some points (n, 3), metres."""
    far = points[np.linalg.norm(points - points.mean(axis=0), axis=1).argmax()]
    return float(np.linalg.norm(points - far, axis=1).max())


def _chroma(rgb: Array) -> Array:
    return np.asarray(rgb[:2] / max(float(rgb.sum()), 1e-6))
