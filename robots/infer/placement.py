"""Placement of an arm whose workspace covers the table, and a home from which it starts well."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping

import mujoco
import numpy as np

from robosandbox.robots.kinematics import Kinematics
from robosandbox.robots.singularity import centring, conditioning, is_singular, singularity
from robosandbox.robots.surfaces import world_points
from robosandbox.types import Array
from robosandbox.values import frozen

_DOWN = np.array([0.0, 0.0, -1.0])
# Angles from straight down at which the tool is tried, radians, the first as good as straight. Chosen: arms with five joints,
# as the SO-101, reach down only aslant.
_TILTS = (0.03, 0.3, 0.6, 1.0)
_RADII = 26  # Number of distances that are tried from the base outwards. Chosen.
# Number of sampled starts at each of them; chosen so that they are of several postures: six of the library's 4096 are often
# of one, and an arm that touches itself in that one seems to reach no nearer (Trossen WXAI 0.15 m in place of 0.09).
_STARTS = 16
# Heights over the table, metres, at which the tool must point down: at a small object, and above it. Chosen.
_HEIGHTS = (0.02, 0.10)
# Width of a workspace, metres, from which no tool that is more aslant is tried. Chosen: room for two cubes of 24 mm.
_LEAST_BAND = 0.06
# Where on the table the middle of a workspace comes, metres along x: where the bundled tasks have their objects, as seen from
# the bundled arm. Chosen.
_WORK_X = 0.13
_TABLE_HALF = 0.5
# How far from the table's edge a base stays, metres. Chosen: half of a foot.
_BASE_MARGIN = 0.05
# Length of the mean of unit vectors, a fraction, below which an arm reaches all around and looks nowhere. Chosen.
_FORWARD = 0.15
# How far wheels stay over the table, metres. Chosen so that they do not rub on it.
_WHEEL_CLEARANCE = 0.005
# Number of starts from which a home is descended to at each point; chosen as densely: of nine arms, seven get a home of a higher
# score than with 14, none of a lower one.
_HOME_STARTS = 38
# Heights at which a home is looked for, as shares of the workspace's middle distance, the best first, and the least one in
# metres; and the score from which a home is good enough. Chosen: half an arm's reach up, its view over the table is free.
_HOME_HEIGHTS, _LEAST_HOME_HEIGHT, _GOOD_HOME = (0.55, 0.4, 0.7, 0.3), 0.08, 0.35


@frozen
class TableWorkspace:
    """Workspace of an arm over a table on which it stands; lengths in metres, in the robot's frame.

    Attributes:
        floor: Height of the table top that its base stands on.
        axis: The first joint's axis on the ground, shape (2,).
        forward: Direction of the middle of its workspace, radians about z.
        near: Least horizontal distance from the axis at which the tool points down at the table.
        far: The largest.
        tilt: How far from straight down it has to point there, radians.
    """

    floor: float
    axis: Array
    forward: float
    near: float
    far: float
    tilt: float

    @property
    def is_known(self) -> bool:
        """It was found; else the tool points down nowhere, and these are guesses."""
        return self.tilt < np.pi

    @property
    def middle(self) -> float:
        """The distance at which to work."""
        return (self.near + self.far) / 2.0

    def point(self, distance: float, height: float) -> Array:
        """Return a point straight ahead, shape (3,)."""
        ahead = np.array([np.cos(self.forward), np.sin(self.forward)])
        return np.array([*(self.axis + distance * ahead), self.floor + height])


def base_bottom(model: mujoco.MjModel, joints: tuple[int, ...]) -> float:
    """Return the lowest point of what the arm stands on, its wheels included, metres in the robot's frame.

    Args:
        model: The robot.
        joints: Ids of the arm's joints; what they move does not count.
    """
    data = mujoco.MjData(model)
    mujoco.mj_fwdPosition(model, data)
    carried = {int(model.jnt_bodyid[joint]) for joint in joints}
    for body in range(1, model.nbody):
        if int(model.body_parentid[body]) in carried:
            carried.add(body)
    chosen = [g for g in range(model.ngeom) if int(model.geom_bodyid[g]) not in carried]
    if not chosen:
        first = int(model.jnt_bodyid[joints[0]])
        chosen = [g for g in range(model.ngeom) if int(model.geom_bodyid[g]) == first]
    # Collision shapes are often simplified beyond the base's foot; what is seen is what stands. Wheels stand too.
    fixed = [g for g in chosen if int(model.body_weldid[model.geom_bodyid[g]]) == 0]
    seen = [g for g in fixed if not (model.geom_contype[g] or model.geom_conaffinity[g])]
    foot = world_points(model, data, seen or fixed, 0.005)[:, 2].min(initial=np.inf)
    # Wheels, which are held but not welded, would rub on the table.
    wheels = world_points(model, data, [g for g in chosen if g not in fixed], 0.005)[:, 2].min(initial=np.inf)
    lowest = float(min(foot, wheels - _WHEEL_CLEARANCE))
    return lowest if np.isfinite(lowest) else 0.0


def find_workspace(
    kinematics: Kinematics, floor: float, collides: Callable[[Array], str | None] = lambda q: None
) -> TableWorkspace:
    """Return where the tool can point down at a table at height `floor`."""
    model, data = kinematics.model, kinematics.data
    _, positions, rotations = kinematics.samples()
    joint = int(kinematics.joints[0])
    axis = data.xanchor[joint][:2].copy()
    shoulder = float(data.xanchor[joint][2])
    reach = float(np.linalg.norm(positions - data.xanchor[joint], axis=1).max())
    forward = _forward(positions - [*axis, 0.0], rotations[:, :, 2])
    first = [g for g in range(model.ngeom) if int(model.geom_bodyid[g]) == int(model.jnt_bodyid[joint])]
    lowest = world_points(model, data, first, 0.01)[:, 2].min(initial=shoulder)
    # An arm on a pedestal as high as it is long reaches nothing at the level of its foot: the table comes up to the arm.
    for level in (floor, min(shoulder - 0.35 * reach, float(lowest))):
        best: tuple[float, TableWorkspace] | None = None
        for tilt in _TILTS:
            found = _band(kinematics, TableWorkspace(level, axis, forward, 0.0, reach, tilt), reach, collides)
            if found is not None and (best is None or found.far - found.near > best[0]):
                best = (found.far - found.near, found)
            if best is not None and best[0] >= _LEAST_BAND:
                break
        if best is not None:
            return best[1]
        if shoulder - floor < 0.5 * reach:
            break
    return TableWorkspace(floor, axis, forward, 0.3 * reach, 0.7 * reach, np.pi)


def _forward(offsets: Array, approaches: Array) -> float:
    """Return the middle of the arc in which the tool points down, snapped to a right angle; 0 for a full turn."""
    down = approaches[:, 2] < -0.5
    chosen = offsets[down] if down.sum() > 30 else offsets
    flat = chosen[:, :2]
    length = np.linalg.norm(flat, axis=1)
    units = flat[length > 1e-6] / length[length > 1e-6, None]
    # A tool that only turns about the first joint's axis has none either.
    mean = units.mean(axis=0) if len(units) else np.zeros(2)
    if float(np.linalg.norm(mean)) < _FORWARD:
        return 0.0
    angle = float(np.arctan2(mean[1], mean[0]))
    quarter = round(angle / (np.pi / 2.0)) * np.pi / 2.0
    return quarter if abs(angle - quarter) < np.radians(20.0) else angle


def _band(
    kinematics: Kinematics, space: TableWorkspace, reach: float, collides: Callable[[Array], str | None]
) -> TableWorkspace | None:
    """Return the longest run of distances at which the tool points down, both at the table and above it."""
    radii = np.linspace(0.04 * reach, reach, _RADII)
    fine = []
    seed: Array | None = None
    for radius in radii:
        good = True
        for height in _HEIGHTS:
            point = space.point(float(radius), height)
            q = kinematics.find(point, _DOWN, tilt=space.tilt, restarts=_STARTS, seed=seed, collides=collides)
            seed = q if q is not None else seed
            good = q is not None
            if not good:
                break
        fine.append(good)
    runs: list[tuple[int, int]] = []
    for k, good in enumerate(fine):
        if good and runs and runs[-1][1] == k - 1:
            runs[-1] = (runs[-1][0], k)
        elif good:
            runs.append((k, k))
    if not runs:
        return None
    first, last = max(runs, key=lambda run: run[1] - run[0])
    return TableWorkspace(space.floor, space.axis, space.forward, float(radii[first]), float(radii[last]), space.tilt)


def base_pose(space: TableWorkspace, table_height: float) -> tuple[tuple[float, float, float], float]:
    """Return the base's position in the world and its yaw, so that the workspace's middle lies on the table."""
    yaw = -space.forward
    turn = np.array([[np.cos(yaw), -np.sin(yaw)], [np.sin(yaw), np.cos(yaw)]])
    axis = turn @ space.axis
    axis_x = max(_WORK_X - space.middle, -_TABLE_HALF + _BASE_MARGIN)
    x, y, z = axis_x - axis[0], -axis[1], table_height - space.floor
    return (round(float(x), 3), round(float(y), 3), round(float(z), 4)), yaw


@frozen
class HomePosture:
    """A start configuration and where it comes from."""

    q: Array
    evidence: str
    confidence: float


def find_home(
    kinematics: Kinematics,
    space: TableWorkspace,
    names: tuple[str, ...],
    keyframes: Mapping[str, Mapping[str, float]],
    collides: Callable[[Array], str | None],
) -> HomePosture:
    """Return a keyframe that holds the tool down clear of everything, or an optimized posture.

    Args:
        kinematics: The arm.
        space: What it reaches.
        names: Its joints.
        keyframes: Named joint values from the model or its SRDF.
        collides: What touches at a configuration (n,), or None.
    """
    rejected = []
    for title in sorted(keyframes, key=lambda name: "home" not in name.lower()):
        values = keyframes[title]
        if not all(name in values for name in names):
            continue
        q = np.array([values[name] for name in names])
        fault = _fault(kinematics, space, q, collides)
        if fault is None:
            return HomePosture(q, f"keyframe {title!r} of the model: tool down, clear of itself and the table", 0.95)
        rejected.append(f"{title!r} {fault}")
    note = f"; not its keyframes: {', '.join(rejected[:2])}" if rejected else ""
    best = _optimized(kinematics, space, collides)
    if best is not None:
        how = f"optimized: tool down over the table, far from limits and singularities{note}"
        return HomePosture(_rounded(kinematics, best), how, 0.85)
    q, positions, rotations = kinematics.samples()
    order = np.argsort(rotations[:, 2, 2] - 0.3 * (positions[:, 2] > space.floor + 0.1), kind="stable")
    usable = (k for k in order if singularity(kinematics, q[k], space.far) is None)
    free = next((k for k in usable if collides(q[k]) is None), order[0])
    how = f"the sampled posture that points down best; check it on the picture{note}"
    return HomePosture(_rounded(kinematics, q[free]), how, 0.3)


def _optimized(kinematics: Kinematics, space: TableWorkspace, collides: Callable[[Array], str | None]) -> Array | None:
    """Return the best posture, shape (n,), with the tool down over the middle of the workspace, at the first height that has a good one."""
    best: tuple[float, Array] | None = None
    for height in _HOME_HEIGHTS:
        for distance in (space.middle, 0.75 * space.middle + 0.25 * space.near):
            point = space.point(distance, max(_LEAST_HOME_HEIGHT, height * space.middle))
            for q in _postures(kinematics, space, point):
                score = _score(kinematics, space, q)
                better = best is None or score > best[0]
                if better and not is_singular(kinematics, q, space.far) and collides(q) is None:
                    best = (score, q)
        if best is not None and best[0] > _GOOD_HOME:
            break
    return None if best is None else best[1]


def _postures(kinematics: Kinematics, space: TableWorkspace, point: Array) -> Iterator[Array]:
    """Yield configurations (n,) that hold the tool down at a point (3,)."""
    for start in kinematics.starts(point, _DOWN, _HOME_STARTS):
        solution = kinematics.descend(point, _DOWN, start, tilt=max(_TILTS[0], space.tilt))
        if solution.solved:
            yield _unwound(kinematics, solution.q)


def _rounded(kinematics: Kinematics, q: Array) -> Array:
    """Return the configuration to four digits, within the limits all the same."""
    inside: Array = np.clip(
        np.round(q, 4), np.ceil(kinematics.lower * 1e4) / 1e4, np.floor(kinematics.upper * 1e4) / 1e4
    )
    return inside


def _fault(
    kinematics: Kinematics, space: TableWorkspace, q: Array, collides: Callable[[Array], str | None]
) -> str | None:
    if (q < kinematics.lower - 1e-6).any() or (q > kinematics.upper + 1e-6).any():
        return "is outside the joint limits"
    position, rotation = kinematics.forward(q)
    if rotation[2, 2] > -np.cos(max(0.45, space.tilt)):
        return "does not point the tool down"
    if position[2] < space.floor + 0.05:
        return "has the tool at or below the table"
    reach = np.linalg.norm(position[:2] - space.axis)
    if not 0.7 * space.near <= reach <= 1.05 * space.far:
        return "has the tool outside the workspace over the table"
    ahead = np.array([np.cos(space.forward), np.sin(space.forward)])
    if (position[:2] - space.axis) @ ahead < 0.5 * reach:
        return "looks away from the workspace"
    if is_singular(kinematics, q, space.far):
        return "is close to a singularity"
    touching = collides(q)
    return f"has {touching}" if touching else None


def _score(kinematics: Kinematics, space: TableWorkspace, q: Array) -> float:
    """Return how well a posture suits as a home; near 1 is best."""
    moving = min(1.0, conditioning(kinematics, q) / (0.3 * space.far))
    central = min(1.0, centring(kinematics, q) / 0.4)
    # Elbow up: the links' mean height over the table.
    kinematics.forward(q)
    joints = kinematics.joints
    heights = kinematics.data.xanchor[joints, 2] - space.floor
    up = float(np.clip(heights.mean() / (0.5 * space.far), 0.0, 1.0))
    side = np.array([-np.sin(space.forward), np.cos(space.forward)])
    aside = float(np.abs((kinematics.data.xanchor[joints, :2] - space.axis) @ side).mean()) / space.far
    full = kinematics.upper - kinematics.lower > 2.0 * np.pi - 0.1
    turned = float(np.abs(q[full]).mean() / np.pi) if full.any() else 0.0
    return 0.3 * moving + 0.25 * central + 0.45 * up - 3.0 * aside - 0.2 * turned


def _unwound(kinematics: Kinematics, q: Array) -> Array:
    """Return the same posture with every hinge within half a turn of zero, where its limits allow."""
    wound = q.copy()
    for i, joint in enumerate(kinematics.joints):
        if kinematics.model.jnt_type[joint] != mujoco.mjtJoint.mjJNT_HINGE.value:
            continue
        near = (q[i] + np.pi) % (2.0 * np.pi) - np.pi
        if kinematics.lower[i] <= near <= kinematics.upper[i]:
            wound[i] = near
    return wound
