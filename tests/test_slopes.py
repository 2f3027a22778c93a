"""Sloping faces: a thing leans on one that ends at a ledge, along it or flat on it, as the simulated state says."""

import math
from pathlib import Path

import numpy as np
import pytest

from robosandbox.apps.commands.world import open_here
from robosandbox.shapes.body import Piece
from robosandbox.shapes.compound import Geometry
from robosandbox.shapes.hull import BoxHull
from robosandbox.tasks.loader import load_task
from robosandbox.workcell.options import WorkcellOptions
from robosandbox.workcell.session import open_workcell

SLOPE = math.radians(27.0)
# A board that slopes down to the right, with or without a ledge at its lower edge; a tall thing and a flat one.
STAND = f"""
<mujoco>
  <option timestep="0.002" cone="elliptic" impratio="20"/>
  <worldbody>
    <geom type="plane" size="3 3 0.1"/>
    <body name="table" pos="0.5 0 0"><geom type="box" pos="0 0 0.38" size="0.5 0.7 0.02"/></body>
    <body name="stand" pos="0.50 0.30 0.55">
      <geom type="box" size="0.13 0.08 0.005" euler="{math.degrees(SLOPE)} 0 0"/>
      <geom type="box" pos="0 0.10 -0.09" size="0.12 0.006 0.06"/>
      LEDGE
    </body>
    <body name="flask" pos="0.42 -0.10 0.478"><freejoint/>
      <geom type="cylinder" size="0.022 0.078" rgba="0.1 0.6 0.2 1" mass="0.2"/></body>
    <body name="carton" pos="0.42 -0.25 0.409"><freejoint/>
      <geom type="box" size="0.04 0.021 0.009" rgba="0.9 0.2 0.2 1" mass="0.1"/></body>
  </worldbody>
</mujoco>
"""
LEDGE = f'<geom type="box" pos="0 -0.0755 -0.0302" size="0.13 0.003 0.012" euler="{math.degrees(SLOPE)} 0 0"/>'
TASK = """
name: leaning
scene: {{world: {world}}}
prompt: put the {thing} on the stand
success: {{kind: on, object: {thing}, target: stand}}
"""


def _board(ledge: bool) -> Geometry:
    turn = (math.sin(SLOPE / 2.0), 0.0, 0.0, math.cos(SLOPE / 2.0))
    lip = Piece(hull=BoxHull((0.13, 0.003, 0.012)), centre=(0.0, -0.0755, -0.0302), quat_xyzw=turn)
    return Geometry((Piece(hull=BoxHull((0.13, 0.08, 0.005)), quat_xyzw=turn), *([lip] if ledge else [])), "fixture")


def test_a_sloping_face_with_a_ledge_is_found_and_one_without_is_none() -> None:
    (face,) = _board(ledge=True).slopes
    assert np.degrees(np.arccos(face.axes[2, 2])) == pytest.approx(27.0, abs=0.1)
    # Uphill is away from the ledge, which reaches 7 mm up the board.
    assert face.axes[1, 1] > 0.8
    assert face.stop == pytest.approx(-0.0784, abs=1e-3)
    assert face.half_width == pytest.approx(0.13, abs=1e-3)
    assert _board(ledge=False).slopes == ()


@pytest.mark.parametrize(("thing", "tilt"), [("flask", 90.0 - 27.0), ("carton", 27.0)])
def test_a_thing_leans_on_the_stand_as_it_is_lower(tmp_path: Path, thing: str, tilt: float) -> None:
    world, file = tmp_path / "stand.xml", tmp_path / "leaning.yaml"
    world.write_text(STAND.replace("LEDGE", LEDGE))
    file.write_text(TASK.format(world=world, thing=thing))
    with open_workcell(WorkcellOptions(task=load_task(file))) as cell:
        episode = cell.run(cell.task.prompt)
        assert episode.success, episode.final_detail
        assert cell.judge().success
        upward = cell.simulation.truth().objects[thing].pose.rotation[2, 2]
        assert np.degrees(np.arccos(abs(upward))) == pytest.approx(tilt, abs=3.0)


def test_without_a_ledge_nothing_is_put_on_the_slope(tmp_path: Path) -> None:
    world = tmp_path / "stand.xml"
    world.write_text(STAND.replace("LEDGE", ""))
    with open_here(WorkcellOptions(scene=world)) as cell:
        episode = cell.run("put the flask on the stand")
        assert not episode.success
        assert "no level face" in str(episode.refusal or episode.final_detail)
