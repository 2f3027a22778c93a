"""Trial of somebody's scene: what starts wrong, what does not stay, what weighs too much, what does not move, what is out of reach."""

from __future__ import annotations

import math
from collections.abc import Iterator

import mujoco
import numpy as np

from robosandbox.robots.findings import CheckResult
from robosandbox.sim.objects import place
from robosandbox.sim.populated import populated
from robosandbox.sim.scene_file import SceneFile, read_scene_file
from robosandbox.sim.world import World, build_world_of
from robosandbox.types import Array, Scene, SceneObject

# Metres inside one another from which on things are pushed apart visibly.
_INSIDE = 0.001
# Seconds that things are given to come to rest, and metres by which one that was put down well sinks or shifts.
_SETTLE_SECONDS = 2.0
_STAYS = 0.02
# kg/m^3 between foam and gold, over the convex pieces of a thing; kilograms that no gripper here lifts.
_DENSITIES = (20.0, 20_000.0)
_HEAVY = 5.0
# Newtons with which a part is pushed at the point farthest from its axis, seconds, and the share of its range that it has to make.
_PUSH = 20.0
_PUSH_SECONDS = 1.0
_MOVES = 0.1
# Metres or radians that a part moves at least: half a degree.
_LEAST_TRAVEL = 0.0005
# Friction ratio below which, or with pyramids, what is held creeps out of a grip (google-deepmind/mujoco issue 3328).
_LEAST_IMPRATIO = 5.0


def check_scene(scene: Scene) -> Iterator[CheckResult]:
    """Yield what was found of a scene's file with its robot, one check after the other.

    Args:
        scene: Names the file, and the robot.

    Raises:
        InputError: The file cannot be read at all.
    """
    scene = populated(scene)
    assert scene.world is not None
    file = read_scene_file(scene.world)
    yield CheckResult("read", True, _counts(file))
    for name, why in file.left_out.items():
        yield CheckResult("left out", True, f"{name}: {why}")
    yield CheckResult("table", True, f"{file.table.body!r} at {file.table.height:.3f} m: {file.table.why}")
    world = build_world_of(scene)
    data = mujoco.MjData(world.model)
    _stand(world, data)
    mujoco.mj_forward(world.model, data)
    yield from _starts(world, data)
    yield from _settles(world, data)
    yield from _masses(scene)
    for item in scene.objects:
        if item.geometry is not None and item.geometry.joint is not None:
            yield _part(world, data, item)
    yield from _reach(world, scene)
    yield _grip(world)


def _counts(file: SceneFile) -> str:
    parts = sum(item.kind == "part" for item in file.objects)
    fixtures = sum(item.is_fixed for item in file.objects) - parts
    return f"{len(file.objects) - fixtures - parts} things, {fixtures} fixtures, {parts} parts"


def _stand(world: World, data: mujoco.MjData) -> None:
    """Put everything where it starts, each robot at home."""
    for robot in world.robots.values():
        data.qpos[robot.qpos_indices] = robot.home_q
        data.ctrl[robot.actuator_ids] = robot.control(robot.home_q)
    for item in world.scene.objects:
        place(world.scene, item, data)


def _starts(world: World, data: mujoco.MjData) -> Iterator[CheckResult]:
    worst: dict[tuple[str, str], float] = {}
    bodies = world.model.geom_bodyid
    for contact in data.contact[: data.ncon]:
        names = sorted(world.names[int(bodies[geom])] for geom in contact.geom)
        pair = (names[0], names[1])
        worst[pair] = max(worst.get(pair, 0.0), -float(contact.dist))
    deep = {pair: depth for pair, depth in worst.items() if depth > _INSIDE}
    for (first, second), depth in deep.items():
        yield CheckResult(
            "start", False, f"{first} starts {1e3 * depth:.1f} mm inside {second}; move them apart in the file"
        )
    if not deep:
        yield CheckResult("start", True, "nothing starts inside anything else")


def _settles(world: World, data: mujoco.MjData) -> Iterator[CheckResult]:
    model = world.model
    loose = [item for item in world.scene.objects if not item.is_fixed]
    before = {
        item.id: data.xpos[world.object_bodies[item.id]].copy() for item in loose if item.id in world.object_bodies
    }
    for _ in range(round(_SETTLE_SECONDS / model.opt.timestep)):
        mujoco.mj_step(model, data)
    if not np.isfinite(data.qpos).all() or data.warning[mujoco.mjtWarning.mjWARN_BADQACC].number:
        yield CheckResult(
            "settle", False, "the simulation becomes unstable; look at masses, timestep and contacts in the file"
        )
        return
    moved = 0
    for name, start in before.items():
        way = data.xpos[world.object_bodies[name]] - start
        sideways = math.hypot(way[0], way[1])
        if -way[2] > _STAYS:
            moved += 1
            yield CheckResult("settle", False, f"{name} starts in the air: it falls by {-1e3 * way[2]:.0f} mm")
        elif max(sideways, way[2]) > _STAYS:
            moved += 1
            yield CheckResult(
                "settle", False, f"{name} does not stay: it moves by {1e3 * float(np.linalg.norm(way)):.0f} mm"
            )
    if not moved:
        yield CheckResult(
            "settle", True, f"all {len(before)} things stay within {1e3 * _STAYS:.0f} mm in {_SETTLE_SECONDS:g} s"
        )


def _masses(scene: Scene) -> Iterator[CheckResult]:
    wrong = 0
    for item in scene.objects:
        if item.is_fixed or item.body is None:
            continue
        volume = _volume(item)
        density = item.mass / volume
        if not _DENSITIES[0] <= density <= _DENSITIES[1]:
            wrong += 1
            yield CheckResult(
                "mass", False, f"{item.id} weighs {item.mass:.4g} kg in {1e6 * volume:.0f} cm^3, {density:.0f} kg/m^3"
            )
        elif item.mass > _HEAVY:
            wrong += 1
            yield CheckResult("mass", False, f"{item.id} weighs {item.mass:.3g} kg: too heavy to be carried")
    if not wrong:
        yield CheckResult("mass", True, "all things weigh what things weigh")


def _volume(item: SceneObject) -> float:
    pieces = () if item.geometry is None else item.geometry.pieces
    return sum(piece.hull.volume for piece in pieces) or item.shape.hull(item.size).volume


def _part(world: World, data: mujoco.MjData, item: SceneObject) -> CheckResult:
    """Return whether a part follows a push, both ways, from where it stands."""
    assert item.geometry is not None and item.geometry.joint is not None
    joint, model = item.geometry.joint, world.model
    number = int(model.body_jntadr[world.object_bodies[item.id]])
    dof, address = int(model.jnt_dofadr[number]), int(model.jnt_qposadr[number])
    lever = 1.0 if joint.kind == "slide" else _lever(item, joint.axis, joint.anchor)
    here = float(data.qpos[address])
    found = [here]
    for way in (1.0, -1.0):
        trial = mujoco.MjData(model)
        trial.qpos[:], trial.ctrl[:] = data.qpos, data.ctrl
        trial.qfrc_applied[dof] = way * _PUSH * lever
        for _ in range(round(_PUSH_SECONDS / model.opt.timestep)):
            mujoco.mj_step(model, trial)
        # A stop gives way a little.
        found.append(float(np.clip(trial.qpos[address], joint.low, joint.high)))
    low, high = min(found), max(found)
    travel = high - low
    span = joint.high - joint.low
    turns = joint.kind == "hinge"
    said = f"{_value(low, turns)} to {_value(high, turns)}"
    kind = f"{joint.kind}{', springs back' if joint.stiffness else ''}"
    if travel < max(_MOVES * min(span, math.pi if turns else 1.0), _LEAST_TRAVEL):
        return CheckResult(
            "part",
            False,
            f"{item.id} ({kind}) does not move: pushed with {_PUSH:g} N it goes from {said}; locked or blocked",
        )
    return CheckResult("part", True, f"{item.id} ({kind}) moves: {said}")


def _value(value: float, turns: bool) -> str:
    return f"{math.degrees(value):.0f} deg" if turns else f"{1e3 * value:.0f} mm"


def _lever(item: SceneObject, axis: tuple[float, float, float], anchor: tuple[float, float, float]) -> float:
    """Return how far the point of a part that is farthest from its axis is from it, metres."""
    assert item.geometry is not None
    points = item.pose.position + item.geometry.outer @ item.pose.rotation.T - np.array(anchor)
    across: Array = np.linalg.norm(np.cross(points, np.array(axis)), axis=1)
    return float(across.max())


def _reach(world: World, scene: Scene) -> Iterator[CheckResult]:
    near, far = world.robot.reach
    base = world.robot.base_position
    wanted = [item for item in scene.objects if not item.is_fixed or item.kind == "part"]
    out = []
    for item in wanted:
        middle = item.pose.position
        if item.geometry is not None:
            middle = middle + item.pose.rotation @ item.geometry.box[0]
        away = float(np.hypot(*(middle - base)[:2]))
        if not near <= away <= far:
            out.append(f"{item.id} ({away:.2f} m)")
    span = f"{near:.2f} to {far:.2f} m around ({base[0]:.2f}, {base[1]:.2f}, {base[2]:.2f})"
    if wanted and len(out) == len(wanted):
        yield CheckResult("reach", False, f"nothing is within {span}; say --robot-base x,y,z,yaw")
    elif out:
        yield CheckResult("reach", False, f"out of reach, {span}: {', '.join(out)}", counts=False)
    else:
        yield CheckResult("reach", True, f"all {len(wanted)} things and parts are within {span}")


def _grip(world: World) -> CheckResult:
    """Return whether the file's contacts keep what is held."""
    option = world.model.opt
    elliptic = int(option.cone) == mujoco.mjtCone.mjCONE_ELLIPTIC.value
    if elliptic and (option.impratio >= _LEAST_IMPRATIO or option.noslip_iterations > 0):
        return CheckResult("grip", True, "the file's contacts keep what is held")
    cone = "elliptic" if elliptic else "pyramidal"
    return CheckResult(
        "grip",
        False,
        f"the file's contacts ({cone} cones, impratio {option.impratio:g}) let what is held creep; they stay as they are: "
        '<option cone="elliptic" impratio="10"/> in the file holds it',
        counts=False,
    )
