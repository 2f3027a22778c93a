"""A seed's layout: seed 0 is the scene as written, every other one is drawn from the seed and the task's name."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from numbers import Integral
from types import MappingProxyType

import numpy as np

from robosandbox.errors import InputError
from robosandbox.ranges import LAYOUTS
from robosandbox.tasks.task import Task
from robosandbox.types import Array, DetectedObject, Pose, Randomize, Scene, SceneObject
from robosandbox.types.objects import Area
from robosandbox.values import frozen
from robosandbox.world.relations import bottom, bounds, gap

# Least gap between drawn objects, metres; chosen so that a finger's thickness fits in between, as in the seeds' tasks.
CLEARANCE = 0.02
# Least distance of a drawn object from the table's edge, metres; chosen so that nothing drawn stands over it.
EDGE = 0.01
# What two sums of the same floating-point numbers may differ by, metres; chosen a thousand times above rounding at a
# table's size.
_SAME = 1e-9
# Places that are drawn for one object until the whole layout is drawn anew; chosen far above the 37 in all that the 12
# objects of clutter_pick were measured to need at most in 20 layouts.
_ITEM_DRAWS = 200
# Layouts that are begun until a task is refused; chosen because the bundled tasks' were each found with the first in 20
# seeds.
_SCENE_DRAWS = 50

Accept = Callable[[DetectedObject], bool]
Extents = Mapping[str, Sequence[float]]
Group = Sequence[SceneObject]
NO_EXTENTS: Extents = MappingProxyType({})


@frozen
class Layout:
    """Start of an episode.

    Attributes:
        scene: With the task's structure and this seed's numbers.
        q_offset: What to add to the arm's start configuration, shape (n,).
    """

    scene: Scene
    q_offset: Array


def draw_layout(
    task: Task,
    seed: int,
    *,
    joints: int,
    extents: Extents = NO_EXTENTS,
    accept: Accept | None = None,
    attempt: int = 0,
) -> Layout:
    """Return the layout of a seed.

    Objects that stand on one another as written, or say that they move with another, move as one. Drawn objects keep `CLEARANCE` from one another and stay
    on the table, or no further out than the task has them. The layouts of two seeds differ because they are drawn from a continuum.

    Args:
        task: The task.
        seed: 0 or more.
        joints: How many arm joints the robot has.
        extents: Half-extents (3) of each mesh at scale 1 by object id; they stand in its file only.
        accept: Says of a drawn object whether it may be there; out of reach is the usual no.
        attempt: How many draws of this seed the world has refused because the robot would start inside something.

    Raises:
        InputError: The seed is negative, or no layout was accepted.
    """
    if not isinstance(seed, Integral):
        raise InputError(f"seed: {seed!r} is no whole number; give 0 or more")
    if seed < 0:
        raise InputError(f"seed: {seed} is negative; give 0 or more")
    if seed >= LAYOUTS:
        raise InputError(f"seed: {seed} is beyond a task's last layout; give 0 to {LAYOUTS - 1}")
    if seed == 0:
        return Layout(task.scene, np.zeros(joints))
    rng = np.random.default_rng([seed, *task.name.encode(), *([attempt] if attempt else [])])
    q_offset = rng.uniform(-1.0, 1.0, joints) * task.randomization.q_jitter
    loose = [item for item in task.scene.objects if not item.is_fixed]
    fixed = [item for item in task.scene.objects if item.is_fixed]
    groups = _without_omitted(groups_of(loose, extents), task, rng)
    for _ in range(_SCENE_DRAWS):
        drawn = _draw_scene(task, groups, fixed, extents, rng, accept)
        if drawn is not None:
            objects = tuple(drawn[item.id] for item in task.scene.objects if item.id in drawn)
            return Layout(task.scene.model_copy(update={"objects": objects}), q_offset)
    raise InputError(
        f"{task.name}: randomize: seed {seed}: no layout without overlaps and within reach in {_SCENE_DRAWS} draws; "
        "give a smaller xy_jitter, or put the objects further apart or nearer the robot"
    )


def _without_omitted(groups: Sequence[Group], task: Task, rng: np.random.Generator) -> list[Group]:
    """Return the groups less a random few of those that success does not name."""
    most = task.randomization.omit
    if most == 0:
        return list(groups)
    named = task.named
    optional = [index for index, group in enumerate(groups) if not any(item.id in named for item in group)]
    count = int(rng.integers(0, most + 1))
    gone: list[int] = []
    left_out = 0
    for index in rng.permutation(optional):
        if left_out + len(groups[index]) <= count:
            gone.append(int(index))
            left_out += len(groups[index])
    return [group for index, group in enumerate(groups) if index not in gone]


def _draw_scene(
    task: Task,
    groups: Sequence[Group],
    fixed: Sequence[SceneObject],
    extents: Extents,
    rng: np.random.Generator,
    accept: Accept | None,
) -> dict[str, SceneObject] | None:
    placed: dict[str, SceneObject] = {item.id: item for item in fixed}
    written = {item.id: _as_seen(item, extents) for group in groups for item in group}
    for group in groups:
        others = [_as_seen(item, extents) for item in placed.values()]
        for _ in range(_ITEM_DRAWS):
            drawn = _draw_group(group, task.randomization, extents, rng)
            if all(_fits(task, _as_seen(item, extents), written[item.id], others, accept) for item in drawn):
                placed.update({item.id: item for item in drawn})
                break
        else:
            return None
    return placed


def _draw_group(
    group: Sequence[SceneObject], default: Randomize, extents: Extents, rng: np.random.Generator
) -> list[SceneObject]:
    """Return the group moved and turned about the lowest object that leads, each with its own colour and mass."""
    base = next((item for item in group if not (item.randomize and item.randomize.moves_with)), group[0])
    jitter = base.randomize or default
    move = rng.uniform(-1.0, 1.0, 2) * jitter.xy_jitter
    if jitter.area is not None:
        move = np.array([rng.uniform(*span) for span in jitter.area]) - base.pose.position[:2]
    yaw = rng.uniform(-1.0, 1.0) * jitter.yaw_jitter
    turn = Pose(xyz=(0.0, 0.0, 0.0), quat_xyzw=(0.0, 0.0, math.sin(yaw / 2.0), math.cos(yaw / 2.0)))
    pivot = base.pose.position
    drawn = []
    for item in group:
        own = item.randomize or default
        # A stack of other sizes would float or overlap, so only what stands alone changes its size.
        scale = 1.0 + rng.uniform(-1.0, 1.0) * own.size_jitter * (len(group) == 1 and item.body is None)
        arm = turn.rotation @ (item.pose.position - pivot)
        position = pivot + arm + np.array([*move, 0.0])
        pose = Pose.from_matrix(position, turn.rotation @ item.pose.rotation)
        mass = item.mass * (1.0 + rng.uniform(-1.0, 1.0) * own.mass_jitter)
        colour = np.clip(np.array(item.rgba[:3]) + rng.uniform(-1.0, 1.0, 3) * own.rgba_jitter, 0.0, 1.0)
        scaled = item.model_copy(
            update={
                "size": tuple(value * scale for value in item.size),
                "scale": item.scale * scale if item.mesh is not None else item.scale,
                "pose": pose,
                "mass": mass,
                "rgba": (*map(float, colour), item.rgba[3]),
            }
        )
        drawn.append(_standing_as_high_as(item, scaled, extents) if scale != 1.0 else scaled)
    return drawn


def _standing_as_high_as(item: SceneObject, scaled: SceneObject, extents: Extents) -> SceneObject:
    """Return the scaled object with its lowest point where the original's is."""
    x, y, z = scaled.pose.xyz
    z += bottom(_as_seen(item, extents)) - bottom(_as_seen(scaled, extents))
    return scaled.model_copy(update={"pose": Pose(xyz=(x, y, z), quat_xyzw=scaled.pose.quat_xyzw)})


def _beyond(seen: DetectedObject, area: Area) -> float:
    """Return how far an object reaches over the table's edge, metres; negative within."""
    low, high = bounds(seen)
    (x0, x1), (y0, y1) = area
    return float(max(x0 - low[0], y0 - low[1], high[0] - x1, high[1] - y1))


def _fits(
    task: Task, seen: DetectedObject, written: DetectedObject, others: Iterable[DetectedObject], accept: Accept | None
) -> bool:
    # What the task puts over the edge or off the table is drawn no further out than it is written.
    area = task.scene.table_area
    on_table = _beyond(seen, area) < max(-EDGE, _beyond(written, area) + _SAME)
    # What stands on or in a fixture stays there.
    apart = all(
        gap(seen, other) >= CLEARANCE or (other.is_fixed and gap(written, other) < CLEARANCE) for other in others
    )
    # Beads are where their container is, and that is asked about itself.
    return on_table and apart and (accept is None or seen.shape.is_granular or accept(seen))


def groups_of(objects: Sequence[SceneObject], extents: Extents = NO_EXTENTS) -> list[list[SceneObject]]:
    """Return the objects in groups that stand on or in one another or move together, the lowest of each first."""
    groups: list[list[SceneObject]] = []
    for item in sorted(objects, key=lambda each: (each.shape.is_granular, bottom(_as_seen(each, extents)))):
        seen = _as_seen(item, extents)
        below = [group for group in groups if any(_together(other, item, seen, extents) for other in group)]
        merged = [other for group in below for other in group]
        groups = [group for group in groups if group not in below]
        groups.append([*merged, item])
    return groups


def _together(other: SceneObject, item: SceneObject, seen: DetectedObject, extents: Extents) -> bool:
    companions = [each.randomize.moves_with for each in (item, other) if each.randomize]
    return item.id in companions or other.id in companions or gap(_as_seen(other, extents), seen) < 0.0


def _as_seen(item: SceneObject, extents: Extents) -> DetectedObject:
    size = tuple(half * item.scale for half in extents[item.id]) if item.mesh is not None else item.size
    # A drawer takes the room that it opens into.
    opening = item.shape.max_open(item.size) if item.shape.opens else None
    return DetectedObject(
        id=item.id,
        kind=item.kind,
        size=size,
        colour="",
        rgba=item.rgba,
        pose=item.pose,
        opening=opening,
        geometry=item.geometry,
    )
