"""Kinds of objects: each keeps its promises, and new ones are used everywhere without an edit elsewhere."""

from __future__ import annotations

import ast
from pathlib import Path

import numpy as np
import pytest

from robosandbox import open_session
from robosandbox.apps.conformance import check_shape
from robosandbox.shapes import shape_of, shapes
from robosandbox.types import Pose, Scene, SceneObject
from robosandbox.world.relations import bottom, inside, on_top

SIZES = {
    "box": (0.02, 0.03, 0.04),
    "sphere": (0.03,),
    "cylinder": (0.03, 0.05),
    "capsule": (0.02, 0.03),
    "bin": (0.06, 0.05, 0.05),
    "bowl": (0.06, 0.05),
    "cup": (0.03, 0.09),
    "drawer": (0.2, 0.18, 0.1, 0.12),
    "plate": (0.08, 0.018),
    "tray": (0.10, 0.08, 0.025),
    "block_l": (0.04, 0.03, 0.015, 0.022),
}
# They need a file, or a container to start in.
ELSEWHERE = {"mesh", "beads"}
ROOT = Path(__file__).resolve().parents[1]


def test_every_installed_kind_is_checked() -> None:
    assert shapes().keys() == SIZES.keys() | ELSEWHERE


@pytest.mark.parametrize("kind", sorted(SIZES))
def test_a_kind_keeps_its_promises(kind: str) -> None:
    check_shape(shape_of(kind), SIZES[kind])


@pytest.mark.parametrize("kind", ["block_l", "drawer"])
def test_a_size_that_leaves_nothing_of_the_form_is_refused(kind: str) -> None:
    size = {"block_l": (0.04, 0.03, 0.015, 0.06), "drawer": (0.2, 0.01, 0.1, 0.1)}[kind]
    with pytest.raises(ValueError, match="size: "):
        SceneObject(id="it", kind=kind, size=size, pose=Pose(xyz=(0.0, 0.0, 0.1)))


def _item(name: str, kind: str, xy: tuple[float, float], rgba: tuple[float, float, float, float]) -> SceneObject:
    z = 0.041 if shape_of(kind).holds_things else 0.041 + SIZES[kind][2]
    return SceneObject(id=name, kind=kind, size=SIZES[kind], pose=Pose(xyz=(*xy, z)), rgba=rgba, mass=0.1)


WHITE, BLUE, GREEN, BROWN = (0.9, 0.9, 0.9, 1.0), (0.1, 0.2, 0.9, 1.0), (0.1, 0.7, 0.2, 1.0), (0.4, 0.3, 0.2, 1.0)


def test_a_plate_is_stacked_on_a_plate_by_its_name() -> None:
    plates = (_item("a", "plate", (0.2, 0.15), WHITE), _item("b", "plate", (0.2, -0.18), BLUE))
    with open_session(Scene(objects=plates)) as session:
        assert session.run("put the blue plate on the white plate").success
        seen = {item.id: item for item in session.observe().objects}
        assert on_top(seen["b"], seen["a"]).holds
        assert bottom(seen["b"]) - bottom(seen["a"]) == pytest.approx(SIZES["plate"][1], abs=0.003)


def test_a_block_on_a_plate_stands_on_its_floor() -> None:
    block = SceneObject(id="cube", kind="box", size=(0.02,) * 3, pose=Pose(xyz=(0.05, -0.1, 0.061)), rgba=GREEN)
    with open_session(Scene(objects=(_item("a", "plate", (0.2, 0.1), WHITE), block))) as session:
        assert session.run("put the green cube on the plate").success
        seen = {item.id: item for item in session.observe().objects}
        assert on_top(seen["cube"], seen["a"]).holds and inside(seen["cube"], seen["a"]).holds


def test_an_l_is_held_by_an_arm_and_put_into_a_tray_that_is_lifted_by_its_rim() -> None:
    objects = (_item("x", "block_l", (0.2, -0.1), GREEN), _item("y", "tray", (0.2, 0.17), BROWN))
    with open_session(Scene(objects=objects)) as session:
        first, second = session.run("put the green l-block in the tray"), session.run("pick up the tray")
        assert first.success and second.success
        assert session.observe().held == "y"


@pytest.mark.gl
@pytest.mark.parametrize(("kind", "size"), [("plate", (0.09, 0.03)), ("tray", (0.1, 0.08, 0.03))])
def test_a_new_open_kind_is_seen_in_pixels_as_what_the_task_says_it_is(kind: str, size: tuple[float, ...]) -> None:
    item = SceneObject(id="dish", kind=kind, size=size, pose=Pose(xyz=(0.2, 0.1, 0.041)), rgba=BLUE, mass=0.2)
    with open_session(Scene(objects=(item,)), perception="rgbd") as session:
        seen = session.observe().find("dish")
        assert seen is not None and seen.kind == kind
        assert np.linalg.norm(np.subtract(seen.pose.xyz, item.pose.xyz)) < 0.01


@pytest.mark.parametrize("kind", ["plate", "tray", "block_l"])
def test_a_new_kind_is_named_in_its_own_file_alone(kind: str) -> None:
    found = []
    for folder in ("src", "agent", "sim", "skills", "perception", "robots", "tasks"):
        for file in (ROOT / folder).rglob("*.py"):
            if any(part.is_symlink() for part in file.parents) or "language" in file.parts or file.stem == kind:
                continue
            strings = {node.value for node in ast.walk(ast.parse(file.read_text())) if isinstance(node, ast.Constant)}
            if kind in strings:
                found.append(file.name)
    assert not found
