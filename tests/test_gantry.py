"""A gantry: a hand on three slides, which goes anywhere and never turns, from an unedited file."""

import math
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from robosandbox.errors import SkillError
from robosandbox.skills.primitives.manipulator import Manipulator
from robosandbox.skills.primitives.part_ways import plan_push
from robosandbox.spatial import matrix_about_axis
from robosandbox.types import Pose, Scene, SceneObject
from robosandbox.workcell.embedded import EmbeddedWorkcell
from robosandbox.workcell.session import open_session

_INERTIA = '<inertial pos="0 0 0" mass="1" diaginertia="0.01 0.01 0.01"/>'
_FINGER = '<geom type="box" pos="0 {y} 0" size="0.01 0.005 0.03" mass="0.03" friction="1 0.01 0.001"/>'
GANTRY = f"""
<mujoco model="gantry">
  <compiler autolimits="true"/>
  <default><joint type="slide" damping="20" armature="0.1"/><position kp="2000" kv="100"/></default>
  <worldbody>
    <body name="rail" pos="0 0 0.45">{_INERTIA}<joint name="x" axis="1 0 0" range="-0.1 0.45"/>
      <body name="bridge">{_INERTIA}<joint name="y" axis="0 1 0" range="-0.35 0.35"/>
        <body name="hand"><geom type="box" size="0.03 0.05 0.02" mass="0.3"/><joint name="z" axis="0 0 1" range="-0.36 0.05"/>
          <body name="left" pos="0 0.01 -0.05"><joint name="left" axis="0 1 0" range="0 0.04"/>{_FINGER.format(y=0.005)}</body>
          <body name="right" pos="0 -0.01 -0.05"><joint name="right" axis="0 -1 0" range="0 0.04"/>{_FINGER.format(y=-0.005)}</body>
        </body>
      </body>
    </body>
  </worldbody>
  <actuator>
    <position name="x" joint="x"/><position name="y" joint="y"/><position name="z" joint="z"/>
    <position name="left" joint="left" kp="500" forcerange="-30 30"/>
    <position name="right" joint="right" kp="500" forcerange="-30 30"/>
  </actuator>
</mujoco>
"""


@pytest.fixture
def gantry(tmp_path: Path) -> Path:
    path = tmp_path / "gantry.xml"
    path.write_text(GANTRY)
    return path


def _cell(gantry: Path, yaw: float) -> EmbeddedWorkcell:
    turn = matrix_about_axis(np.array([0.0, 0.0, 1.0]), yaw)
    long = SceneObject(
        id="block", kind="box", size=(0.045, 0.02, 0.02), pose=Pose.from_matrix(np.array([0.15, 0.0, 0.06]), turn)
    )
    return open_session(Scene(objects=(long,)), robot=gantry, what_if=False)


@pytest.fixture
def planning(gantry: Path) -> Iterator[Manipulator]:
    with _cell(gantry, 0.0) as cell:
        yield Manipulator(cell.ctx)


def test_its_hand_faces_one_way_alone(planning: Manipulator) -> None:
    hand = planning.state.tcp_pose.rotation
    assert planning.planning.can_face(hand)
    for axis in np.eye(3):
        assert not planning.planning.can_face(matrix_about_axis(axis, math.radians(5.0)) @ hand)


def test_an_arm_of_seven_hinges_faces_any_way() -> None:
    with open_session("pick_cube_franka") as cell:
        arm = Manipulator(cell.ctx)
        turns = (matrix_about_axis(axis, 1.0) for axis in np.eye(3))
        assert all(arm.planning.can_face(turn @ arm.state.tcp_pose.rotation) for turn in turns)


@pytest.mark.parametrize("yaw", [0.0, 0.2, -0.3])
def test_what_lies_nearly_right_is_taken_and_put_down(gantry: Path, yaw: float) -> None:
    with _cell(gantry, yaw) as cell:
        cell.do("pick", object="block")
        cell.do("place_at", x=0.2, y=0.1)
        where = cell.simulation.truth().objects["block"].pose.position
        assert np.linalg.norm(where[:2] - (0.2, 0.1)) < 0.015


def test_what_lies_askew_is_refused_before_anything_moves(gantry: Path) -> None:
    """Fingers that close at 45 degrees to its faces do not hold it, and the hand cannot turn."""
    with _cell(gantry, math.radians(45.0)) as cell:
        before = cell.simulation.truth().objects["block"].pose
        with pytest.raises(SkillError):
            cell.do("pick", object="block")
        assert cell.simulation.truth().objects["block"].pose.xyz == pytest.approx(before.xyz, abs=1e-3)


# A cupboard before the gantry: as its door opens, its bar leaves the hand's reach, and nothing else of it is free before that. Metres.
_CUPBOARD = """
    <body name="gate" pos="0 0.02 0.17">
      <geom type="box" size="0.02 0.02 0.13" pos="-0.03 0 0"/>
      <geom type="box" size="0.19 0.04 0.13" pos="0.185 0.06 0"/>
      <body name="leaf">
        <joint name="hinge" axis="0 0 1" range="-1.9 0" damping="1" frictionloss="0.1"/>
        <geom type="box" size="0.18 0.01 0.12" pos="0.185 0 0" mass="1"/>
        <geom type="box" size="0.01 0.05 0.01" pos="0.325 -0.06 0" mass="0.1"/>
        <geom type="box" size="0.05 0.015 0.015" pos="0.34 -0.12 0" mass="0.1"/>
      </body>
    </body>
"""
# A lever that turns down beside a post; `{x}` is where it stands.
_LEVER = """
    <body name="gate" pos="{x} 0 0.17">
      <geom type="box" size="0.02 0.02 0.13" pos="0 0.03 0"/>
      <body name="leaf">
        <joint name="hinge" axis="0 1 0" range="0 1.57" damping="0.1" frictionloss="0.01"/>
        <geom type="box" size="0.05 0.019 0.01" pos="0.042 -0.024 0" mass="0.1"/>
      </body>
    </body>
"""

# A dial whose head is too long for a grip on all of it; it is damped.
_DIAL = """
    <body name="gate" pos="{x} 0 0.04">
      <geom type="cylinder" size="0.06 0.005" pos="0 0 0.005"/>
      <body name="leaf" pos="0 0 0.01">
        <joint name="hinge" axis="0 0 1" range="-3.1 3.1" damping="0.3"/>
        <geom type="cylinder" size="0.05 0.018" pos="0 0 0.018" mass="0.1"/>
        <geom type="box" size="0.015 0.046 0.015" pos="0 0 0.051" mass="0.1"/>
      </body>
    </body>
"""


def _cell_before(folder: Path, gantry: Path, body: str) -> EmbeddedWorkcell:
    around = (
        '<mujoco><compiler angle="radian" autolimits="true"/><worldbody>'
        '<geom name="floor" type="plane" size="2 2 0.1"/>'
        '<body name="table" pos="0 0 0.02"><geom type="box" size="0.5 0.5 0.02"/></body>'
    )
    (folder / "gate.xml").write_text(f"{around}{body}</worldbody></mujoco>")
    (folder / "gate.robosandbox.yaml").write_text("robot_base: [0.0, 0.0, 0.04, 0.0]\ntable: table\n")
    return open_session(scene=folder / "gate.xml", robot=gantry, what_if=False)


def test_a_door_whose_bar_leaves_the_reach_is_pushed_on_from_where_it_does(tmp_path: Path, gantry: Path) -> None:
    with _cell_before(tmp_path, gantry, _CUPBOARD) as cell:
        cell.do("open", part="gate.leaf")
        door = cell.observe().find("gate.leaf")
        assert door is not None and door.opening is not None
        assert abs(door.opening) > 0.6 * 1.9


def test_a_lever_is_pushed_at_the_same_place_wherever_it_stands(tmp_path: Path, gantry: Path) -> None:
    places = []
    for x in (0.15, 0.16, 0.17, 0.18):
        with _cell_before(tmp_path, gantry, _LEVER.format(x=x)) as cell:
            arm = Manipulator(cell.ctx)
            arm.use(arm.look())
            places.append(plan_push(arm, arm.find("gate.leaf"), [1.0]).poses[0].position - (x, 0.0, 0.0))
    assert np.ptp(places, axis=0).max() < 1e-3


@pytest.mark.parametrize("x", [0.15, 0.18, 0.21])
def test_a_dial_is_pushed_round_by_a_hand_that_does_not_turn(tmp_path: Path, gantry: Path, x: float) -> None:
    """One finger goes round its axis, not the TCP between two; and none lies on its head on both sides of that."""
    with _cell_before(tmp_path, gantry, _DIAL.format(x=x)) as cell:
        cell.do("turn_on", part="gate.leaf", share=0.75)
        dial = cell.observe().find("gate.leaf")
        assert dial is not None and dial.opening is not None
        assert dial.opening > 1.2
