"""The relations that skills' post-conditions and tasks' success criteria share."""

import math
from dataclasses import replace

import numpy as np
import pytest

from robosandbox.shapes import CONTAINER_WALL
from robosandbox.tasks.judge import checks as judged
from robosandbox.types import DetectedObject, ObjectKind, ObservedScene, Pose
from robosandbox.world import relations
from robosandbox.world.contracts import find
from robosandbox.world.facts import fact
from robosandbox.world.nearness import nearer
from robosandbox.world.predicate import View
from robosandbox.world.scene_json import describe_scene


def thing(
    kind: ObjectKind, size: tuple[float, ...], xyz: tuple[float, float, float], yaw: float = 0.0, tip: float = 0.0
) -> DetectedObject:
    turn = Pose(xyz=(0, 0, 0), quat_xyzw=(0, 0, math.sin(yaw / 2), math.cos(yaw / 2)))
    tilt = Pose(xyz=(0, 0, 0), quat_xyzw=(math.sin(tip / 2), 0, 0, math.cos(tip / 2)))
    pose = Pose(xyz=xyz, quat_xyzw=(turn @ tilt).quat_xyzw)
    return DetectedObject(id=kind, kind=kind, size=size, colour="red", rgba=(1, 0, 0, 1), pose=pose)


CUBE = (0.02, 0.02, 0.02)


@pytest.mark.parametrize(
    ("obj", "low", "high"),
    [
        (thing("box", (0.1, 0.2, 0.3), (1, 2, 3), yaw=math.pi / 2), (0.8, 1.9, 2.7), (1.2, 2.1, 3.3)),
        (thing("sphere", (0.1,), (0, 0, 1)), (-0.1, -0.1, 0.9), (0.1, 0.1, 1.1)),
        (thing("cylinder", (0.1, 0.3), (0, 0, 0), tip=math.pi / 2), (-0.1, -0.3, -0.1), (0.1, 0.3, 0.1)),
        (thing("capsule", (0.1, 0.3), (0, 0, 0)), (-0.1, -0.1, -0.4), (0.1, 0.1, 0.4)),
        (
            thing("bin", (0.1, 0.2, 0.05), (0, 0, 0.04)),
            (-0.1 - CONTAINER_WALL, -0.2 - CONTAINER_WALL, 0.04),
            (0.1 + CONTAINER_WALL, 0.2 + CONTAINER_WALL, 0.09),
        ),
        (thing("drawer", (0.2, 0.1, 0.15, 0.08), (0, 0, 0)), (-0.05, -0.1, 0.0), (0.05, 0.1, 0.15)),
    ],
)
def test_bounds_are_exact(obj: DetectedObject, low: tuple[float, ...], high: tuple[float, ...]) -> None:
    lo, hi = relations.bounds(obj)
    np.testing.assert_allclose(lo, low, atol=1e-12)
    np.testing.assert_allclose(hi, high, atol=1e-12)


def test_cylinder_bounds_match_sampled_surface() -> None:
    obj = thing("cylinder", (0.03, 0.07), (0.1, 0.2, 0.3), yaw=0.4, tip=0.9)
    angle = np.linspace(0, 2 * np.pi, 2000)
    rim = np.column_stack([0.03 * np.cos(angle), 0.03 * np.sin(angle), np.full_like(angle, 0.07)])
    points = np.vstack([rim, -rim]) @ obj.pose.rotation.T + obj.pose.position
    lo, hi = relations.bounds(obj)
    np.testing.assert_allclose(lo, points.min(0), atol=1e-6)
    np.testing.assert_allclose(hi, points.max(0), atol=1e-6)


def test_cube_on_turned_block_is_judged_by_the_turned_footprint() -> None:
    block = thing("box", (0.05, 0.01, 0.02), (0, 0, 0.06), yaw=math.pi / 4)
    along = thing("box", CUBE, (0.03, 0.03, 0.10))
    across = thing("box", CUBE, (0.03, -0.03, 0.10))
    assert relations.on_top(along, block)
    assert not relations.on_top(across, block)


def test_cube_held_over_block_is_not_on_it() -> None:
    block = thing("box", (0.05, 0.05, 0.02), (0, 0, 0.06))
    assert relations.on_top(thing("box", CUBE, (0, 0, 0.101)), block)
    assert not relations.on_top(thing("box", CUBE, (0, 0, 0.110)), block)


def test_inside_needs_centre_within_walls_and_bottom_below_rim() -> None:
    tray = thing("bin", (0.06, 0.06, 0.05), (0.1, 0, 0.04), yaw=0.5)
    assert relations.inside(thing("box", CUBE, (0.1, 0, 0.064)), tray)
    assert not relations.inside(thing("box", CUBE, (0.1, 0, 0.12)), tray)
    assert not relations.inside(thing("box", CUBE, (0.2, 0, 0.06)), tray)


@pytest.mark.parametrize("off", [-0.0055, -0.0045, 0.0045, 0.0055])
def test_skills_believe_a_thing_to_stand_there_within_the_judges_5_mm(off: float) -> None:
    cube, block = thing("box", CUBE, (0, 0, 0.06 + off)), thing("box", (0.05, 0.05, 0.01), (0, 0, 0.03))
    stands = abs(off) < judged.REST_WITHIN
    assert relations.on_top(cube, block).holds is stands
    assert relations.on_table(cube, 0.04).holds is stands
    assert relations.beside(cube, thing("box", CUBE, (0.08, 0, 0.06)), "front").holds is stands


def test_what_has_fallen_through_a_floor_is_not_inside() -> None:
    tray = thing("bin", (0.06, 0.06, 0.05), (0, 0, 0.04))
    assert relations.inside(thing("box", CUBE, (0, 0, 0.04 - 0.0045 + 0.02)), tray)
    assert not relations.inside(thing("box", CUBE, (0, 0, 0.04 - 0.0055 + 0.02)), tray)


@pytest.mark.parametrize("opening", [0.0025, 0.0035])
def test_skills_believe_a_drawer_to_be_closed_within_the_judges_3_mm(opening: float) -> None:
    drawer = replace(thing("drawer", (0.2, 0.16, 0.09, 0.12), (0, 0, 0.04)), opening=opening)
    scene = ObservedScene(time=0.0, objects=(drawer,), table_height=0.04, base_xy=(-0.3, 0.0))
    shut = opening < judged.CLOSED_WITHIN
    assert find(fact("closed", "drawer"), View.of(scene)).holds is shut
    assert describe_scene(scene)["objects"][0]["state"] == ("closed" if shut else "open")


@pytest.mark.parametrize(("half", "is_in"), [(0.055, True), (0.085, False)])
def test_what_stands_in_a_drawer_with_its_middle_over_the_rim_is_not_inside(half: float, is_in: bool) -> None:
    drawer = replace(thing("drawer", (0.2, 0.16, 0.09, 0.12), (0, 0, 0.04)), opening=0.1)
    room = relations.room_of(drawer)
    point = drawer.pose.position + drawer.pose.rotation @ np.array([*room.middle, room.floor])
    stands = thing("cylinder", (0.015, half), (point[0], point[1], point[2] + half))
    assert relations.inside(stands, drawer).holds is is_in


def test_inside_of_a_box_is_an_error() -> None:
    with pytest.raises(ValueError, match="is a box"):
        relations.inside(thing("box", CUBE, (0, 0, 0)), thing("box", CUBE, (0, 0, 0)))


@pytest.mark.parametrize(
    ("side", "xy"), [("left", (0, 0.08)), ("right", (0, -0.08)), ("front", (-0.08, 0)), ("back", (0.08, 0))]
)
def test_beside_is_on_that_side_only(side: relations.Side, xy: tuple[float, float]) -> None:
    target = thing("box", CUBE, (0, 0, 0.06))
    obj = thing("box", CUBE, (*xy, 0.06))
    assert [s for s in relations.SIDE_AXES if relations.beside(obj, target, s)] == [side]


def test_beside_is_not_far_away_nor_on_another_level() -> None:
    target = thing("box", CUBE, (0, 0, 0.06))
    assert relations.beside(thing("sphere", (0.02,), (0, 0.13, 0.06)), target, "left")
    assert not relations.beside(thing("sphere", (0.02,), (0, 0.15, 0.06)), target, "left")
    assert not relations.beside(thing("sphere", (0.02,), (0, 0.08, 0.10)), target, "left")


def test_gap_between_turned_cubes_is_corner_to_face() -> None:
    a = thing("box", CUBE, (0, 0, 0), yaw=math.pi / 4)
    b = thing("box", CUBE, (0.1, 0, 0))
    assert relations.gap(a, b) == pytest.approx(0.08 - 0.02 * math.sqrt(2), abs=1e-9)


def test_lifted_measures_the_lowest_point() -> None:
    lying = thing("box", (0.02, 0.06, 0.02), (0, 0, 0.06))
    tipped = thing("box", (0.02, 0.06, 0.02), (0, 0, 0.10), tip=math.pi / 2)
    assert relations.lifted(lying, tipped, 0.03).detail["dz_mm"] == pytest.approx(0.0, abs=1e-9)


def test_displacement_counts_only_along_the_direction() -> None:
    before = thing("box", CUBE, (0, 0, 0.06))
    assert relations.displacement(before, thing("box", CUBE, (0.06, 0.01, 0.06)), "forward", 0.05)
    assert not relations.displacement(before, thing("box", CUBE, (0.06, 0.07, 0.06)), "forward", 0.05)
    assert not relations.displacement(before, thing("box", CUBE, (0.06, 0.0, 0.06)), "back", 0.05)


def test_nearer_is_what_the_exact_gap_says() -> None:
    rng = np.random.default_rng(4)
    sizes: list[tuple[ObjectKind, tuple[float, ...]]] = [
        ("box", (0.02, 0.05, 0.01)),
        ("cylinder", (0.02, 0.05)),
        ("capsule", (0.02, 0.05)),
        ("bin", (0.06, 0.08, 0.05)),
        ("block_l", (0.1, 0.08, 0.03, 0.04)),
        ("drawer", (0.2, 0.16, 0.09, 0.12)),
    ]
    told = []
    for _ in range(600):
        one, other = (
            replace(
                thing(
                    *sizes[rng.integers(len(sizes))],
                    (float(x), float(y), 0.1),
                    yaw=float(rng.uniform(-3.0, 3.0)),
                    tip=float(rng.choice([0.0, 0.4, 1.57])),
                ),
                opening=0.1,
            )
            for x, y in rng.uniform(-0.15, 0.15, (2, 2))
        )
        distance = float(rng.uniform(-0.02, 0.1))
        told.append(nearer(one, other, distance))
        assert told[-1] == (relations.gap(one, other) < distance)
    assert 100 < sum(told) < 500
