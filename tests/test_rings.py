"""Things with a hole that go over a post."""

from __future__ import annotations

from pathlib import Path

import pytest

from robosandbox.errors import SkillError
from robosandbox.sim.scene_file import read_scene_file
from robosandbox.types import Plan, SkillCall
from robosandbox.workcell.session import open_session

# A nut of four walls with a handle, and two posts; lengths are metres.
_SCENE = """
<mujoco>
  <option cone="elliptic" impratio="20"/>
  <worldbody>
    <light pos="0 0 2"/>
    <geom name="floor" type="plane" size="2 2 0.1"/>
    <body name="table" pos="0 0 0.02"><geom type="box" size="0.5 0.5 0.02"/></body>
    <body name="nut" pos="0.12 -0.1 0.052" euler="0 0 {turn}">
      <freejoint/>
      <geom type="box" size="0.01 0.044 0.01" pos="-0.033 0 0" mass="0.01"/>
      <geom type="box" size="0.031 0.01 0.01" pos="0 0.033 0" mass="0.01"/>
      <geom type="box" size="0.031 0.01 0.01" pos="0 -0.033 0" mass="0.01"/>
      <geom type="box" size="0.01 0.044 0.01" pos="0.033 0 0" mass="0.01"/>
      <geom type="box" size="0.025 0.015 0.01" pos="0.06 0 0" mass="0.01"/>
    </body>
    <body name="post" pos="0.2 0.12 0.1"><geom type="box" size="0.016 0.016 0.06"/></body>
    <body name="pillar" pos="0.05 0.2 0.1"><geom type="box" size="0.03 0.03 0.06"/></body>
  </worldbody>
</mujoco>
"""


@pytest.fixture
def nut(tmp_path: Path, request: pytest.FixtureRequest) -> Path:
    path = tmp_path / "nut.xml"
    path.write_text(_SCENE.format(turn=getattr(request, "param", 30)))
    path.with_name("nut.robosandbox.yaml").write_text("robot_base: [-0.4, 0.0, 0.04, 0.0]\n")
    return path


def test_a_hole_through_a_thing_is_measured(nut: Path) -> None:
    (item,) = (one for one in read_scene_file(nut).objects if one.id == "nut")
    assert item.geometry is not None
    bore = item.geometry.bore
    assert bore is not None
    assert bore.half == pytest.approx([0.023, 0.023], abs=0.0015)
    assert bore.middle == pytest.approx([0.0, 0.0], abs=0.0015)
    assert not item.shape.holds_things


@pytest.mark.parametrize("nut", [30, -70, 160], indirect=True)
def test_a_nut_is_taken_by_its_handle_and_put_over_a_post(nut: Path) -> None:
    with open_session(scene=nut) as cell:
        episode = cell.achieve("around(nut, post)")
        assert episode.success, episode.final_detail
        truth = cell.driver.simulation.truth()  # type: ignore[union-attr]
        x, y, z = truth.objects["nut"].pose.xyz
        assert (x, y) == pytest.approx((0.2, 0.12), abs=0.007)
        assert z == pytest.approx(0.05, abs=0.002)


def test_a_post_that_is_too_wide_is_told_before_anything_moves(nut: Path) -> None:
    with open_session(scene=nut) as cell:
        cell.do("pick", object="nut", to="post")
        with pytest.raises(SkillError, match="pillar does not go through the hole in nut"):
            cell.do("put_over", post="pillar")


def test_a_nut_is_slipped_over_a_post_by_words(nut: Path) -> None:
    with open_session(scene=nut) as cell:
        cell.do("pick", object="nut", to="post")
        plan = cell.plan("thread it onto the post")
        assert isinstance(plan, Plan)
        assert [*plan.steps] == [SkillCall(skill="put_over", arguments={"post": "post"})]
