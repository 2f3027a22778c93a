"""What a model is told of the scene, on bundled tasks and after things have moved."""

import json
from dataclasses import replace
from typing import Any

import pytest

from robosandbox.tasks.loader import bundled_tasks
from robosandbox.types import DetectedObject, ObservedScene, Pose
from robosandbox.workcell.session import open_session
from robosandbox.world.scene_json import describe_scene


def described(scene: ObservedScene) -> dict[str, dict[str, Any]]:
    return {item["id"]: item for item in describe_scene(scene)["objects"]}


def test_a_closed_and_an_opened_drawer_and_what_is_put_into_it() -> None:
    with open_session("put_in_drawer") as session:
        before = described(session.observe())
        drawer = next(name for name, item in before.items() if item["kind"] == "drawer")
        assert before[drawer]["state"] == "closed" and before[drawer]["contents"] == []
        assert before["red_cube"]["on"] == "table" and "in" not in before["red_cube"]
        assert session.run(f"open {drawer}, put the red cube in {drawer}").success
        after = described(session.observe())
    assert after[drawer]["state"] == "open" and after[drawer]["open_by"] > 0.05
    assert after[drawer]["contents"] == ["red_cube"] and after["red_cube"]["in"] == drawer


def test_beads_in_a_cup_are_counted_where_they_are() -> None:
    with open_session("pour_beads") as session:
        things = described(session.observe())
    beads = next(item for item in things.values() if item["kind"] == "beads")
    assert beads["count"] > 1 and things[beads["in"]]["contents"] == {beads["id"]: beads["count"]}


def test_what_is_held_is_in_the_gripper_and_what_stands_on_what_is_said() -> None:
    with open_session("stack_two") as session:
        assert session.run("pick up the red cube").success
        held = session.observe()
        assert session.run(
            "put it on the blue cube" if held.held is None else "put the red cube on the blue cube"
        ).success
        things = described(session.observe())
    assert describe_scene(held)["held"] == "red_cube" and described(held)["red_cube"]["in"] == "gripper"
    assert things["red_cube"]["on"] == "blue_cube" and things["blue_cube"]["on"] == "table"


def box(name: str, x: float, **more: Any) -> DetectedObject:
    seen = DetectedObject(
        id=name,
        kind="box",
        size=(0.02,) * 3,
        colour="red",
        rgba=(1.0, 0.0, 0.0, 1.0),
        pose=Pose(xyz=(x, -0.00001, 0.06)),
    )
    return replace(seen, **more)


def scene_of(*objects: DetectedObject) -> ObservedScene:
    return ObservedScene(time=0.0, objects=objects, table_height=0.04, base_xy=(-0.3, 0.0), reach=(0.2, 0.7))


def test_tags_reach_doubt_and_notes_are_said_where_there_is_something_to_say() -> None:
    seen = replace(scene_of(box("near", 0.123456), box("far", 0.45, tag=7, confidence=0.42)), notes=("dark",))
    data, things = describe_scene(seen), described(seen)
    assert things["near"].keys().isdisjoint({"tag", "reachable", "confidence", "tipped_over"})
    assert (things["far"]["tag"], things["far"]["reachable"], things["far"]["confidence"]) == (7, False, 0.4)
    assert things["near"]["position"] == [0.123, 0.0, 0.06] and "-0.0" not in json.dumps(data)
    assert data["notes"] == ["dark"]


def test_a_cup_on_its_side_is_told() -> None:
    cup = DetectedObject(
        id="cup",
        kind="cup",
        size=(0.03, 0.08),
        colour="blue",
        rgba=(0.0, 0.0, 1.0, 1.0),
        pose=Pose(xyz=(0.1, 0.0, 0.08), quat_xyzw=(0.7071068, 0.0, 0.0, 0.7071068)),
    )
    assert described(scene_of(cup))["cup"]["tipped_over"] is True
    upright = replace(cup, pose=Pose(xyz=(0.1, 0.0, 0.04)))
    assert "tipped_over" not in described(scene_of(upright))["cup"]


@pytest.mark.parametrize("name", sorted(bundled_tasks()))
def test_every_bundled_task_is_described_in_short_lines(name: str) -> None:
    """Everything at rest says what it stands on or lies in, and an object takes about a hundred tokens at most."""
    with open_session(name, what_if=False) as session:
        scene = session.observe()
    data = describe_scene(scene)
    assert [item["id"] for item in data["objects"]] == [item.id for item in scene.objects]
    for item in data["objects"]:
        assert "on" in item or "in" in item, item
        assert len(json.dumps(item, separators=(",", ":"))) < 300, item


def test_a_cup_that_stands_on_its_rim_has_tipped_over() -> None:
    # Rounding takes the matrix of half a turn beyond -1.
    turned = Pose(xyz=(0.1, 0.0, 0.1), quat_xyzw=(-0.11530264154270288, -0.9933304087026004, 0.0, 0.0))
    cup = DetectedObject(id="cup", kind="cup", size=(0.03, 0.08), colour="red", rgba=(1.0, 0.0, 0.0, 1.0), pose=turned)
    scene = ObservedScene(time=0.0, objects=(cup,), table_height=0.04, base_xy=(0.0, 0.0))
    assert described(scene)["cup"]["tipped_over"]
