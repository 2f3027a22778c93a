"""The benchmark of furnished scenes: drawn alike from a seed, judged from raw state, refusals looked at by an oracle of its own."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from importlib import import_module
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest

from robosandbox.types import DetectedObject, ObservedScene, Plan, Pose
from robosandbox.workcell.session import open_session
from robosandbox.world.placement_sampling import table_placements

BENCHMARKS = Path(__file__).resolve().parents[1] / "benchmarks"


@pytest.fixture(scope="module")
def furnished() -> Iterator[ModuleType]:
    sys.path.insert(0, str(BENCHMARKS))
    yield import_module("furnished")
    sys.path.remove(str(BENCHMARKS))


def test_a_furnished_scene_is_the_same_for_a_seed_and_another_for_the_next(furnished: ModuleType) -> None:
    assert furnished.drawn(3) == furnished.drawn(3) != furnished.drawn(4)


def test_a_press_is_judged_by_how_far_in_the_button_went_and_a_refused_place_is_proved_full(
    furnished: ModuleType,
) -> None:
    # The point that is asked for lies in a wall of the shelf.
    in_the_shelf, press = furnished.run(11)
    assert not in_the_shelf.claimed and not in_the_shelf.achieved
    assert in_the_shelf.proved == "no room there"
    assert "occupied by shelf" in in_the_shelf.why
    assert press.relation == "pressed" and press.claimed and press.achieved
    assert press.fixed_n[0] == 0.0 < press.part_n[0] < furnished.LIMIT_N
    figures = furnished.summary([in_the_shelf, press])
    assert figures["achieved"] == figures["refused_proved"] == 1 and figures["false_claims"] == 0


@pytest.mark.parametrize(
    ("seed", "said", "why"),
    [
        # A door that is locked stands where the bowl would: it is fixed as well, and goes nowhere else.
        (1075, "at(blue_bowl", "no room there"),
        # Farther off is the cupboard; nearer and off to a side there is room, whatever hand gets there.
        (1028, "beside(red_box", ""),
    ],
)
def test_a_place_is_proved_full_where_nothing_that_moves_leaves_it_and_not_for_a_few_places_beside_a_thing(
    furnished: ModuleType, tmp_path: Path, seed: int, said: str, why: str
) -> None:
    room = furnished.drawn(seed)
    goal = next(goal for goal in room.goals if goal.said.startswith(said))
    with open_session(scene=room.write(tmp_path), seed=0) as cell:
        assert furnished.Oracle(cell.mujoco.fork(), room).impossible(goal) == why


@pytest.mark.parametrize(("seed", "why"), [(1064, ""), (1075, "locked")])
def test_no_link_sweeps_a_door_along_and_fingers_that_slip_off_it_press_on_nothing(
    furnished: ModuleType, tmp_path: Path, seed: int, why: str
) -> None:
    room = furnished.drawn(seed)
    with open_session(scene=room.write(tmp_path), seed=0) as cell:
        meter = furnished.Meter(cell.mujoco, room)
        cell.driver.subscribe(meter)
        episode = cell.run("open(cupboard.door)")
        assert episode.success is (why == "") and why in episode.final_detail
        assert meter.part[0] < furnished.LIMIT_N and meter.fixed[0] < 40.0


@pytest.mark.parametrize(
    ("seed", "number"),
    [
        # Hands of one lean meet a post, or the cabinet over its drawer, wherever they are turned: others have their turn.
        (1024, 0),
        (1015, 1),
        # The forearm meets the cupboard in the posture that is nearest.
        (1016, 0),
    ],
)
def test_what_is_in_the_way_of_one_lean_or_posture_is_not_in_the_way_of_all(
    furnished: ModuleType, tmp_path: Path, seed: int, number: int
) -> None:
    room = furnished.drawn(seed)
    with open_session(scene=room.write(tmp_path), seed=0) as cell:
        row = furnished.row(cell, room, room.goals[number], False, 0.0)
    assert row.claimed and row.achieved, row.why
    assert row.worst_n < furnished.LIMIT_N


def test_a_place_under_another_board_is_planned_for_a_hand_that_comes_level(
    furnished: ModuleType, tmp_path: Path
) -> None:
    room = furnished.drawn(1037)
    with open_session(scene=room.write(tmp_path), seed=0) as cell:
        plan = cell.plan("on(green_can, shelf_1)")
    assert isinstance(plan, Plan), plan


def test_a_long_thing_has_room_between_walls_turned_along_them() -> None:
    def box(name: str, size: tuple[float, float, float], y: float) -> DetectedObject:
        pose = Pose(xyz=(0.3, y, size[2]))
        return DetectedObject(id=name, kind="box", size=size, colour="grey", rgba=(0.5, 0.5, 0.5, 1.0), pose=pose)

    walls = [box(name, (0.1, 0.01, 0.05), y) for name, y in (("left_wall", 0.06), ("right_wall", -0.06))]
    scene = ObservedScene(time=0.0, objects=tuple(walls), table_height=0.0, base_xy=(-0.3, 0.0))
    across, point = box("bar", (0.02, 0.08, 0.02), 0.4), [np.array([0.3, 0.0])]
    (spot,), blocking = table_placements(scene, across, point)
    assert not blocking and {round(abs(yaw), 3) for yaw in spot.yaws} == {round(np.pi / 2.0, 3)}
    # One that is as long as the room between them is wide has none, however it is turned.
    assert table_placements(scene, box("block", (0.06, 0.06, 0.02), 0.4), point) == ([], ("left_wall", "right_wall"))
