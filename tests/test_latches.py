"""Doors that a handle with a spring keeps shut."""

from __future__ import annotations

from pathlib import Path

import pytest

from robosandbox.workcell.session import open_session

# A door before the robot, hinged at its right, with a lever whose bolt stands behind a frame; lengths are metres.
_SCENE = """
<mujoco>
  <compiler angle="radian"/>
  <option cone="elliptic" impratio="20"/>
  <worldbody>
    <light pos="0 0 2"/>
    <geom name="floor" type="plane" size="2 2 0.1"/>
    <body name="table" pos="0 0 0.02"><geom type="box" size="0.5 0.5 0.02"/></body>
    <body name="gate" pos="0.35 0 0.26">
      <geom type="box" size="0.02 0.02 0.2" pos="0 0.19 0" name="jamb"/>
      <geom type="box" size="0.02 0.02 0.2" pos="0 -0.19 0"/>
      <body name="leaf">
        <joint name="hinge" pos="0 -0.165 0" axis="0 0 1" range="0 0.5" limited="true" damping="1" frictionloss="0.5"/>
        <geom type="box" size="0.012 0.15 0.19" mass="2"/>
        <body name="lever" pos="0 0.12 0">
          <joint name="lever" axis="1 0 0" range="-1.4 1.4" limited="true" stiffness="0.5" damping="0.01" frictionloss="0.05"/>
          <geom type="cylinder" fromto="0.02 0 0 -0.07 0 0" size="0.012" mass="0.05"/>
          <geom type="box" size="0.01 0.06 0.012" pos="-0.07 -0.06 0" mass="0.05"/>
          <geom type="box" size="0.01 0.03 0.012" pos="0.03 0.04 0" mass="0.02"/>
        </body>
      </body>
    </body>
  </worldbody>
</mujoco>
"""


def test_a_latched_door_is_opened_by_its_handle(tmp_path: Path) -> None:
    (tmp_path / "gate.xml").write_text(_SCENE)
    (tmp_path / "gate.robosandbox.yaml").write_text("robot_base: [-0.3, 0.0, 0.04, 0.0]\ntable: table\n")
    with open_session(scene=tmp_path / "gate.xml") as cell:
        result = cell.do("open", part="gate.leaf")
        assert not result.side_effects
        door, lever = (cell.observe().find(name) for name in ("gate.leaf", "gate.leaf.lever"))
        assert door is not None and lever is not None
        assert door.opening == pytest.approx(0.45, abs=0.06)
        # The handle was led back before the hand let it go.
        assert lever.opening == pytest.approx(0.0, abs=0.1)
