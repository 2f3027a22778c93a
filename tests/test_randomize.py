"""Layouts of seeds: the same for the same seed, never the same for two, nothing overlapping."""

import numpy as np
import pytest

from robosandbox.errors import InputError
from robosandbox.perception.relations import bounds, gap
from robosandbox.tasks.loader import bundled_tasks, find_task
from robosandbox.tasks.randomize import CLEARANCE, draw_layout
from robosandbox.tasks.success import AtHome
from robosandbox.tasks.task import Task
from robosandbox.types import DetectedObject, Pose, Randomize, Scene, SceneObject


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
    for layout in layouts[1:]:
        objects = [seen(item) for item in layout.scene.objects]
        assert all(gap(a, b) >= CLEARANCE for i, a in enumerate(objects) for b in objects[:i])
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
