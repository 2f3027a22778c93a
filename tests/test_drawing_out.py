"""Things that come out of what is fixed to the side alone."""

from __future__ import annotations

from pathlib import Path

import pytest

from robosandbox.workcell.session import open_session

# A bar, one end of which stands under a ledge of a wall; lengths are metres.
_SCENE = """
<mujoco>
  <option cone="elliptic" impratio="20"/>
  <worldbody>
    <light pos="0 0 2"/>
    <geom name="floor" type="plane" size="2 2 0.1"/>
    <body name="table" pos="0 0 0.02"><geom type="box" size="0.5 0.5 0.02"/></body>
    <body name="bar" pos="0.12 0 0.06">
      <freejoint/>
      <geom type="box" size="0.02 0.08 0.02" mass="0.1"/>
    </body>
    <body name="wall" pos="0.12 {side} 0.09">
      <geom type="box" size="0.06 0.01 0.05"/>
      <geom type="box" size="0.06 0.02 0.01" pos="0 {out} 0.005"/>
    </body>
  </worldbody>
</mujoco>
"""


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_a_bar_under_a_ledge_is_drawn_out_before_it_is_lifted(tmp_path: Path, side: float) -> None:
    path = tmp_path / "ledge.xml"
    path.write_text(_SCENE.format(side=0.095 * side, out=-0.03 * side))
    path.with_name("ledge.robosandbox.yaml").write_text("robot_base: [-0.4, 0.0, 0.04, 0.0]\n")
    with open_session(scene=path) as cell:
        cell.do("pick", object="bar")
        y, z = cell.driver.simulation.truth().objects["bar"].pose.xyz[1:]  # type: ignore[union-attr]
        assert z > 0.12
        assert side * y < -0.01
