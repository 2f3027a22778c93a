"""Layouts of seeds: the same for the same seed, never the same for two, nothing overlapping."""

import numpy as np
import pytest

from robosandbox.errors import InputError
from robosandbox.tasks.judge.checks import AtHome
from robosandbox.tasks.loader import bundled_tasks, find_task
from robosandbox.tasks.randomize import CLEARANCE, draw_layout, groups_of
from robosandbox.tasks.task import Task
from robosandbox.types import DetectedObject, Pose, Randomize, Scene, SceneObject
from robosandbox.world.relations import bounds, gap


def box(name: str, x: float, y: float = 0.0, z: float = 0.06, randomize: Randomize | None = None) -> SceneObject:
    return SceneObject(id=name, kind="box", size=(0.02, 0.02, 0.02), pose=Pose(xyz=(x, y, z)), randomize=randomize)


def task(*objects: SceneObject, randomize: Randomize | None = None) -> Task:
    return Task(
        name="t", prompt="go", scene=Scene(objects=objects), success=AtHome(kind="at_home"), randomize=randomize
    )


def seen(item: SceneObject) -> DetectedObject:
    return DetectedObject(id=item.id, kind=item.kind, size=item.size, colour="", rgba=item.rgba, pose=item.pose)


@pytest.mark.parametrize("name", bundled_tasks())
def test_bundled_layouts_are_reproducible_distinct_and_free_of_overlaps(name: str) -> None:
    bundled = find_task(name)
    layouts = [draw_layout(bundled, seed, joints=7) for seed in range(30)]
    again = draw_layout(bundled, 7, joints=7)
    assert again.scene == layouts[7].scene and np.array_equal(again.q_offset, layouts[7].q_offset)
    assert layouts[0].scene == bundled.scene and not layouts[0].q_offset.any()
    assert len({(layout.scene, tuple(layout.q_offset)) for layout in layouts}) == 30
    groups = [[item.id for item in group] for group in groups_of(bundled.scene.objects)]
    for layout in layouts[1:]:
        objects = [seen(item) for item in layout.scene.objects]
        apart = [(a, b) for i, a in enumerate(objects) for b in objects[:i]]
        apart = [(a, b) for a, b in apart if not any(a.id in group and b.id in group for group in groups)]
        assert all(gap(a, b) >= CLEARANCE for a, b in apart)
        assert all(np.abs(np.array(bounds(item))[:, :2]).max() < 0.5 for item in objects)


def test_draws_stay_within_the_jitter_and_use_all_of_it() -> None:
    jitter = Randomize(xy_jitter=0.1, yaw_jitter=1.0, mass_jitter=0.2, size_jitter=0.3, rgba_jitter=0.1)
    written = box("a", 0.1)
    drawn = [draw_layout(task(written, randomize=jitter), seed, joints=0).scene.objects[0] for seed in range(1, 200)]
    offsets = np.array([np.subtract(item.pose.xyz, written.pose.xyz)[:2] for item in drawn])
    yaws = np.array([item.pose.yaw for item in drawn])
    assert 0.09 < np.abs(offsets).max() <= 0.1 and 0.9 < np.abs(yaws).max() <= 1.0
    assert all(0.8 <= item.mass / written.mass <= 1.2 for item in drawn)
    assert all(0.7 <= item.size[0] / 0.02 <= 1.3 for item in drawn)
    np.testing.assert_allclose([bounds(seen(item))[0][2] for item in drawn], 0.04, atol=1e-12)


def test_a_stack_moves_as_one() -> None:
    tower = task(
        box("a", 0.1), box("b", 0.11, z=0.10), box("c", -0.2), randomize=Randomize(xy_jitter=0.1, yaw_jitter=3.0)
    )
    for seed in range(1, 20):
        a, b, _ = draw_layout(tower, seed, joints=0).scene.objects
        assert (a.pose.inverse() @ b.pose).xyz == pytest.approx((0.01, 0.0, 0.04), abs=1e-9)


def test_an_object_may_have_its_own_jitter() -> None:
    fixed = box("b", 0.3, randomize=Randomize())
    for seed in range(1, 5):
        drawn = draw_layout(task(box("a", 0.0), fixed), seed, joints=0).scene
        assert drawn.objects[1].pose == fixed.pose and drawn.objects[0].pose != box("a", 0.0).pose


def test_a_task_without_randomize_still_differs_by_seed() -> None:
    assert draw_layout(task(box("a", 0.1)), 1, joints=2).scene != draw_layout(task(box("a", 0.1)), 2, joints=2).scene
    empty = task()
    offsets = [draw_layout(empty, seed, joints=2).q_offset for seed in (1, 2)]
    assert not np.array_equal(*offsets) and np.abs(offsets).max() <= 0.1


def test_draws_that_are_not_accepted_are_drawn_again() -> None:
    jittered = task(box("a", 0.1), randomize=Randomize(xy_jitter=0.1))
    for seed in range(1, 20):
        layout = draw_layout(jittered, seed, joints=0, accept=lambda item: item.pose.xyz[0] > 0.15)
        assert layout.scene.objects[0].pose.xyz[0] > 0.15


def test_no_acceptable_layout_is_an_input_error() -> None:
    with pytest.raises(InputError, match="smaller xy_jitter"):
        draw_layout(task(box("a", 0.1)), 1, joints=0, accept=lambda _: False)


def test_negative_seed_is_an_input_error() -> None:
    with pytest.raises(InputError, match="-1"):
        draw_layout(task(box("a", 0.1)), -1, joints=0)


def test_companions_keep_their_places_and_turn_about_the_one_that_leads() -> None:
    pair = task(
        box("a", 0.1),
        box("b", 0.1, 0.06, z=0.05, randomize=Randomize(moves_with="a")),
        box("c", -0.2),
        randomize=Randomize(xy_jitter=0.1, yaw_jitter=3.0),
    )
    for seed in range(1, 20):
        a, b, _ = draw_layout(pair, seed, joints=0).scene.objects
        np.testing.assert_allclose((a.pose.inverse() @ b.pose).xyz, (0.0, 0.06, -0.01), atol=1e-12)
        assert abs(a.pose.xyz[0] - 0.1) <= 0.1


def test_an_area_is_drawn_from_whatever_is_written() -> None:
    scattered = task(box("a", 0.4, 0.4), randomize=Randomize(area=((0.0, 0.1), (-0.2, 0.2))))
    drawn = np.array([draw_layout(scattered, seed, joints=0).scene.objects[0].pose.xyz for seed in range(1, 200)])
    assert drawn[:, 0].min() >= 0.0 and drawn[:, 0].max() <= 0.1 and np.ptp(drawn[:, 1]) > 0.38


def test_what_success_does_not_name_may_be_left_out() -> None:
    scene = Scene(objects=tuple(box(name, 0.1 * k) for k, name in enumerate("abcd")))
    lifted = {"kind": "lifted", "object": "b"}
    some = Task.model_validate(
        {"name": "t", "prompt": "go", "scene": scene, "success": lifted, "randomize": {"xy_jitter": 0.01, "omit": 2}}
    )
    there = [[item.id for item in draw_layout(some, seed, joints=0).scene.objects] for seed in range(40)]
    assert there[0] == ["a", "b", "c", "d"] and all("b" in names for names in there)
    assert {len(names) for names in there} == {2, 3, 4} and {name for names in there for name in names} == set("abcd")
    with pytest.raises(ValueError, match=r"omit: 4 of 3"):
        Task.model_validate(
            {"name": "t", "prompt": "go", "scene": scene, "success": lifted, "randomize": {"xy_jitter": 0.1, "omit": 4}}
        )
