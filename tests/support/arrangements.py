"""Perturbations by what stands where: a lid on the target, a full tray, a bowl's rim over it, a can before a drawer."""

from __future__ import annotations

import math

import numpy as np
from support import faults
from support.perturbations import park, parked
from support.sampling import DRAWS, EpisodeSampler, Perturbation, standing_at

from robosandbox.shapes import CONTAINER_WALL
from robosandbox.shapes.tray import Tray
from robosandbox.types import Pose, SceneObject, matrix_about_axis
from robosandbox.world.relations import centre

_ON_THE_WAY = ("perceive", "plan", "approach")
_TRAY = Tray.kind  # The tray is called what it is.
_CUBE = 0.02  # Half edge of the cubes in the tray, metres; chosen as those of the bundled tasks.
# Space around each cube in a full tray, metres; chosen as what place_in asks for, walls included.
_TRAY_ROOM = 0.006
_TRAY_HEIGHT = 0.02  # Metres; chosen as half a cube, so that fingers get at what lies in it.
_BOWL_HEIGHT, _BOWL_RADII = 0.05, (0.045, 0.065)  # Metres; chosen as bowls of tables here.
_CAN = (0.025, 0.045)  # Radius and half height of the can before the drawer, metres; chosen to stand and to be gripped.
_IN_THE_TRAY = {"blue_cube": (0.2, 0.35, 0.85, 1.0), "green_cube": (0.2, 0.65, 0.3, 1.0)}


def lidded(sampler: EpisodeSampler) -> Perturbation:
    """A flat box as wide as the object or wider is put on it after the plan was made."""
    long, wide, thick = sampler.uniform(0.03, 0.05), sampler.uniform(0.022, 0.036), sampler.uniform(0.006, 0.012)
    park(sampler, "lid", thick)
    sampler.replace("lid", size=(long, wide, thick))
    item = sampler.item(sampler.subject)
    offset = (sampler.uniform(-0.005, 0.005), sampler.uniform(-0.005, 0.005))
    at = sampler.moment(_ON_THE_WAY, away_from=item.pose.position)
    about = f"{2e3 * long:.0f} x {2e3 * wide:.0f} x {2e3 * thick:.0f} mm lid"
    return Perturbation(scene=sampler.scene, fault=faults.put_on("lid", sampler.subject, offset), at=at, about=about)


def full_tray(sampler: EpisodeSampler) -> Perturbation:
    """Two cubes fill a tray: a third one is to be swapped with one of them, or finds the tray full when it comes."""
    inner = (_CUBE + _TRAY_ROOM, 2.0 * _CUBE + 1.5 * _TRAY_ROOM)
    x, y, _ = sampler.item("grey_bin").pose.xyz
    yaw, table = sampler.uniform(-math.pi, math.pi), sampler.scene.table_height
    turn = (0.0, 0.0, math.sin(yaw / 2.0), math.cos(yaw / 2.0))
    size = (*inner, _TRAY_HEIGHT)
    tray = SceneObject(id=_TRAY, kind=Tray.kind, size=size, pose=Pose(xyz=(x, y, table), quat_xyzw=turn), mass=0.4)
    along = np.array([-math.sin(yaw), math.cos(yaw)]) * (_CUBE + 0.5 * _TRAY_ROOM)
    cubes = []
    for sign, (name, rgba) in zip((-1.0, 1.0), _IN_THE_TRAY.items(), strict=True):
        height = table + CONTAINER_WALL + _CUBE + 0.001
        pose = Pose(xyz=(x + sign * along[0], y + sign * along[1], height), quat_xyzw=turn)
        cubes.append(SceneObject(id=name, kind="box", size=(_CUBE,) * 3, pose=pose, rgba=rgba, mass=0.05))
    kept = [item for item in sampler.scene.objects if item.id != "grey_bin"]
    sampler.change(sampler.scene.model_copy(update={"objects": (tray, *cubes, *kept)}))
    swapped = [
        ("red_cube", "inside", _TRAY),
        ("blue_cube", "in_place_of", "red_cube"),
        ("green_cube", "inside", _TRAY),
    ]
    checks = [{"kind": kind, "object": one, "target": other} for one, kind, other in swapped]
    goal = "inside(red_cube, tray), inside(green_cube, tray), on(blue_cube, table)"
    match int(sampler.rng.integers(3)):
        case 0:
            sampler.ask("swap the red cube and the blue cube", {"kind": "all", "checks": checks})
            return Perturbation(scene=sampler.scene, about="swapped in a sentence")
        case 1:
            sampler.ask(goal, {"kind": "goal", "relations": goal})
            return Perturbation(scene=sampler.scene, about="swapped for a goal")
    into = cubes[0].pose
    sampler.replace("blue_cube", pose=parked(sampler, _CUBE))
    sampler.ask("put the red cube in the tray", {"kind": "goal", "relations": "inside(red_cube, tray)"})
    at = sampler.moment(_ON_THE_WAY, away_from=into.position)
    return Perturbation(scene=sampler.scene, fault=faults.put("blue_cube", into), at=at, about="filled meanwhile")


def under_rim(sampler: EpisodeSampler) -> Perturbation:
    """A bowl falls with its rim onto the object, or with its foot, after the plan was made; the other side is on the table."""
    radius = sampler.uniform(*_BOWL_RADII)
    park(sampler, "bowl", radius)
    x, y, _ = sampler.item("bowl").pose.xyz
    pose = Pose(xyz=(x, y, sampler.scene.table_height))
    sampler.replace("bowl", kind="bowl", size=(radius, _BOWL_HEIGHT), pose=pose, mass=0.2)
    item = sampler.item(sampler.subject)
    table, half, outer = sampler.scene.table_height, item.size[0], radius + CONTAINER_WALL
    upside_down = bool(sampler.rng.integers(2))
    overlap = sampler.uniform(0.012, 0.022)
    # The bowl's underside slopes from the table to the near edge of the object's top.
    slope = math.asin(min(0.9, 2.0 * half / (2.0 * outer - overlap)))
    for _ in range(DRAWS):
        away = sampler.direction()
        axis = np.array([-away[1], away[0], 0.0])
        base = np.array(
            [*(centre(item)[:2] + away * (half - overlap + outer)), table + outer * math.sin(slope) + 0.002]
        )
        rotation = matrix_about_axis(axis, slope)
        if upside_down:
            base = base + rotation @ np.array([0.0, 0.0, _BOWL_HEIGHT])
            rotation = rotation @ np.diag([1.0, -1.0, -1.0])
        there = Pose.from_matrix(base, rotation)
        others = [
            one for one in (sampler.item(two.id) for two in sampler.scene.objects) if one.id not in ("bowl", item.id)
        ]
        clear = all(np.linalg.norm(centre(one)[:2] - base[:2]) > outer + max(one.size[:2]) * 1.5 for one in others)
        if sampler.easy(base[:2]) and clear:
            break
    else:
        raise ValueError("no room for the bowl")
    at = sampler.moment(_ON_THE_WAY, away_from=item.pose.position)
    about = f"{'rim' if upside_down else 'foot'} of a {2e3 * outer:.0f} mm bowl, {1e3 * overlap:.0f} mm over it"
    return Perturbation(scene=sampler.scene, fault=faults.put("bowl", there), at=at, about=about)


def before_drawer(sampler: EpisodeSampler) -> Perturbation:
    """A can stands where the drawer opens; it is to stand upright in the end."""
    drawer = sampler.item("drawer")
    width, depth, _, travel = drawer.size
    for _ in range(DRAWS):
        ahead = sampler.uniform(0.04, max(travel, 0.05)) + _CAN[0]
        aside = sampler.uniform(-0.5, 0.5) * width
        point = drawer.pose.position + drawer.pose.rotation @ np.array([-depth / 2.0 - ahead, aside, 0.0])
        pose = Pose(xyz=(float(point[0]), float(point[1]), sampler.scene.table_height + _CAN[1] + 0.001))
        sampler.replace("can", size=_CAN, pose=pose)
        can = standing_at(sampler.item("can"), pose)
        if sampler.free(can, least=0.004) and sampler.easy(point[:2]):
            break
    else:
        raise ValueError("no room before the drawer")
    checks = [{"kind": "opened", "object": "drawer", "min_mm": 80}, {"kind": "on", "object": "can", "target": "table"}]
    tipped = {"kind": "upright", "object": "can"}
    sampler.ask(sampler.task.prompt, {"kind": "all", "checks": [*checks, tipped]})
    return Perturbation(scene=sampler.scene, about=f"{1e3 * ahead:.0f} mm ahead, {1e3 * aside:.0f} mm aside")
