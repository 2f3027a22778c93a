"""Hollows of what is made of pieces: drawers of a cabinet, compartments of a fixture, things in plates and bowls."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from robosandbox.apps.commands.world import open_here
from robosandbox.grasp.crowding import has_room
from robosandbox.robots.robot import Robot
from robosandbox.shapes.body import Piece
from robosandbox.shapes.compound import Geometry, kind_of
from robosandbox.shapes.hull import BoxHull
from robosandbox.sim.scene_file import read_scene_file
from robosandbox.tasks.loader import load_task
from robosandbox.types import DetectedObject, Grasp, Pose, SceneObject
from robosandbox.workcell.options import WorkcellOptions
from robosandbox.workcell.session import open_workcell
from robosandbox.world.placement_sampling import placements_in
from robosandbox.world.relations import let_down, mouth_of, on_top, rest_height

SCENES = Path(__file__).parents[1] / "examples" / "scenes"
CAN = '<geom type="cylinder" size="0.028 0.045" rgba="0.9 0.2 0.2 1" mass="0.2"/>'
BLOCK = '<geom type="box" size="0.02 0.03 0.015" rgba="0.9 0.2 0.2 1" mass="0.1"/>'
# A caddy of two compartments, the left one named by a site, and a block beside it.
CADDY = """
<mujoco>
  <option timestep="0.002" cone="elliptic" impratio="20"/>
  <worldbody>
    <geom type="plane" size="3 3 0.1"/>
    <body name="table" pos="0.5 0 0"><geom type="box" pos="0 0 0.38" size="0.5 0.6 0.02"/></body>
    <body name="caddy" pos="0.55 0.0 0.40">
      <geom type="box" pos="0 0 0.003" size="0.06 0.12 0.003"/>
      <geom type="box" pos="0.058 0 0.04" size="0.002 0.12 0.04"/>
      <geom type="box" pos="-0.058 0 0.04" size="0.002 0.12 0.04"/>
      <geom type="box" pos="0 0.118 0.04" size="0.06 0.002 0.04"/>
      <geom type="box" pos="0 -0.118 0.04" size="0.06 0.002 0.04"/>
      <geom type="box" pos="0 0.02 0.04" size="0.06 0.002 0.04"/>
      <site name="caddy_left" pos="0 0.07 0.04"/>
    </body>
    <body name="block" pos="0.40 -0.25 0.416"><freejoint/>GEOM</body>
  </worldbody>
</mujoco>
"""


def _made(kind: str, size: tuple[float, ...], name: str, pose: Pose) -> DetectedObject:
    """Return an object of one of our kinds as a file would have it: by its pieces alone."""
    pieces = (
        SceneObject(id="it", kind=kind, size=size, pose=pose)
        .shape.bodies(SceneObject(id="it", kind=kind, size=size, pose=pose))[0]
        .pieces
    )
    geometry = Geometry(pieces, kind_of(pieces))
    return DetectedObject(
        id=name,
        kind=geometry.kind,
        size=tuple(float(v) for v in geometry.box[1]),
        colour="",
        rgba=(0.5, 0.5, 0.5, 1.0),
        pose=pose,
        geometry=geometry,
    )


def test_a_bowl_stands_with_its_foot_in_a_plate_that_its_rim_reaches_over() -> None:
    plate = _made("plate", (0.06, 0.018), "plate", Pose(xyz=(0.0, 0.0, 0.1)))
    wide = _made("bowl", (0.07, 0.05), "wide", Pose(xyz=(0.0, 0.0, 0.3)))
    narrow = _made("bowl", (0.04, 0.05), "narrow", Pose(xyz=(0.0, 0.0, 0.3)))
    assert rest_height(wide, plate) == pytest.approx(0.118, abs=1e-3)
    assert rest_height(narrow, plate) == pytest.approx(0.104, abs=1e-3)
    standing = replace(narrow, pose=Pose(xyz=(0.0, 0.0, 0.104)))
    assert on_top(standing, plate).holds


def test_a_bowl_rests_in_one_of_its_kind_below_the_rim() -> None:
    lower = _made("bowl", (0.06, 0.05), "lower", Pose(xyz=(0.0, 0.0, 0.1)))
    upper = _made("plate", (0.062, 0.03), "upper", Pose(xyz=(0.0, 0.0, 0.3)))
    assert [*placements_in(lower, upper, ())] == []
    # A cone of boards narrows downwards: what is wider than its floor stays between them.
    half = (0.05, 0.003, 0.04)
    tilted = np.radians(30.0)
    boards = tuple(
        Piece(
            hull=BoxHull(half),
            centre=(-0.065 * np.sin(turn), 0.065 * np.cos(turn), 0.04),
            quat_xyzw=_turned(turn, -tilted),
        )
        for turn in np.arange(4) * np.pi / 2.0
    )
    floor = Piece(hull=BoxHull((0.05, 0.05, 0.003)), centre=(0.0, 0.0, 0.003))
    cone = replace(lower, geometry=Geometry((floor, *boards), "vessel"), size=(0.09, 0.09, 0.04))
    block = replace(lower, id="block", kind="box", size=(0.048, 0.048, 0.005), geometry=None)
    height = let_down(block, cone, (0.0, 0.0))
    assert height is not None and 0.105 < height < 0.16


def _turned(yaw: float, lean: float) -> tuple[float, float, float, float]:
    """Return the quaternion of a lean about x, then a turn about z."""
    a, b, c, d = np.sin(lean / 2.0), np.cos(lean / 2.0), np.sin(yaw / 2.0), np.cos(yaw / 2.0)
    return float(a * d), float(a * c), float(b * c), float(b * d)


def test_boards_with_gaps_between_them_make_one_floor() -> None:
    boards = [Piece(hull=BoxHull((0.10, 0.02, 0.003)), centre=(0.0, y, 0.003)) for y in (-0.052, 0.0, 0.052)]
    walls = [
        Piece(hull=BoxHull((0.002, 0.074, 0.03)), centre=(0.10, 0.0, 0.03)),
        Piece(hull=BoxHull((0.002, 0.074, 0.03)), centre=(-0.10, 0.0, 0.03)),
        Piece(hull=BoxHull((0.10, 0.002, 0.03)), centre=(0.0, 0.072, 0.03)),
        Piece(hull=BoxHull((0.10, 0.002, 0.03)), centre=(0.0, -0.072, 0.03)),
    ]
    hollow = Geometry((*boards, *walls)).hollow
    assert hollow is not None
    assert hollow.half == pytest.approx([0.098, 0.07], abs=0.004)
    assert hollow.floor == pytest.approx(0.006, abs=1e-3)


def test_fingers_have_room_in_a_drawer_beside_what_lies_there() -> None:
    cabinet = {item.id: item for item in read_scene_file(SCENES / "cabinet.xml").objects}
    drawer = cabinet["cabinet.top"]
    robot = _panda()
    assert robot.gripper is not None
    around = DetectedObject(
        id=drawer.id,
        kind=drawer.kind,
        size=drawer.size,
        colour="",
        rgba=drawer.rgba,
        pose=drawer.pose,
        geometry=drawer.geometry,
    )
    down = np.diag([1.0, -1.0, -1.0])
    middle, at_the_side = (
        Grasp(
            object="it",
            tcp_pose=Pose.from_matrix(drawer.pose.position + [0.0, y, 0.0], down),
            width=0.03,
            quality=1.0,
            how="top-down",
        )
        for y in (0.0, 0.09)
    )
    assert has_room(middle, [around], robot.gripper.geometry)
    assert not has_room(at_the_side, [around], robot.gripper.geometry)


def _panda() -> Robot:
    from robosandbox.sim.world import build_world_of
    from robosandbox.types import Scene

    return build_world_of(Scene()).robot


def test_only_what_has_come_out_of_a_drawer_is_reached_from_above() -> None:
    drawer = next(item for item in read_scene_file(SCENES / "cabinet.xml").objects if item.id == "cabinet.top")
    seen = DetectedObject(
        id=drawer.id,
        kind=drawer.kind,
        size=drawer.size,
        colour="",
        rgba=drawer.rgba,
        pose=drawer.pose,
        geometry=drawer.geometry,
    )
    assert mouth_of(replace(seen, opening=0.0)).half[0] == pytest.approx(0.0)
    half_open = mouth_of(replace(seen, opening=0.08))
    assert 2.0 * half_open.half[0] == pytest.approx(0.08)
    assert half_open.middle[0] < -0.05
    assert half_open.half[1] == pytest.approx(0.108, abs=0.003)


def test_a_block_goes_into_a_drawer_of_a_file_and_is_shut_in(tmp_path: Path) -> None:
    scene = tmp_path / "cabinet.xml"
    scene.write_text((SCENES / "cabinet.xml").read_text().replace(CAN, BLOCK).replace("0.446", "0.416"))
    task = tmp_path / "away.yaml"
    task.write_text(f'name: away\ngoal: "inside(can, cabinet.top), closed(cabinet.top)"\nscene: {{world: {scene}}}\n')
    with open_workcell(WorkcellOptions(task=load_task(task))) as cell:
        episode = cell.run()
        assert episode.success, episode.final_detail
        assert cell.judge().success
        truth = cell.simulation.truth().objects
        assert abs(truth["cabinet.top"].opening or 0.0) < 0.008
        x, y, z = truth["can"].pose.xyz
        assert 0.70 < x < 0.90 and abs(y) < 0.11 and 0.56 < z < 0.63


def test_compartments_of_a_caddy_are_places_of_their_own(tmp_path: Path) -> None:
    scene = tmp_path / "caddy.xml"
    scene.write_text(CADDY.replace("GEOM", BLOCK))
    names = {item.id: item.kind for item in read_scene_file(scene).objects}
    assert names == {
        "block": "box",
        "caddy": "fixture",
        "caddy.compartment_1": "compartment",
        "caddy.left": "compartment",
    }
    with open_here(WorkcellOptions(scene=scene)) as cell:
        episode = cell.achieve("inside(block, caddy.left)")
        assert episode.success, episode.final_detail
        x, y, z = cell.simulation.truth().objects["block"].pose.xyz
        assert abs(x - 0.55) < 0.056 and 0.022 < y < 0.116 and z < 0.45


def test_what_moves_beside_the_one_fixture_of_a_group_is_its_part(tmp_path: Path) -> None:
    stove = """
    <body name="stove" pos="0.55 0.0 0.40"><body name="base">
      <body name="burner"><geom type="box" pos="0 0 0.02" size="0.1 0.1 0.02"/></body>
      <body name="knob" pos="-0.15 0 0.02"><joint type="hinge" axis="0 0 1" range="0 2.1"/><geom type="box" size="0.02 0.005 0.02"/></body>
    </body></body>
    <body name="block" """
    scene = tmp_path / "stove.xml"
    scene.write_text(CADDY.replace('<body name="block" ', stove.lstrip()).replace("GEOM", BLOCK))
    assert {"stove", "stove.knob"} < {item.id for item in read_scene_file(scene).objects}
