"""Putting things into holes that they just fit, by feel."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from support.pegs import insert, scene

from robosandbox.skills.primitives.hand_move import Mover
from robosandbox.skills.primitives.yielding import YieldingHand
from robosandbox.types import Plan, SkillCall
from robosandbox.workcell.session import open_session


@pytest.fixture
def pegs(tmp_path: Path, request: pytest.FixtureRequest) -> Path:
    shape, clearance = request.param
    (tmp_path / "pegs.xml").write_text(scene(shape, clearance))
    return tmp_path / "pegs.xml"


@pytest.mark.parametrize(
    ("pegs", "seed"),
    [(("square", 0.001), 1), (("round", 0.0005), 2), (("triangle", 0.001), 3)],
    indirect=["pegs"],
    ids=str,
)
def test_a_peg_goes_into_a_hole_that_is_elsewhere(pegs: Path, seed: int) -> None:
    row = insert(pegs, "mujoco", seed)
    assert row["claimed"] and row["in"], row
    assert row["force_n"] < 44.0


@pytest.mark.parametrize("pegs", [("square", -0.001)], indirect=True)
def test_a_hole_that_is_too_narrow_is_told_and_the_peg_stays_in_the_hand(pegs: Path) -> None:
    row = insert(pegs, "mujoco", 0)
    assert not row["claimed"] and not row["in"]
    assert (
        "did not sink into block within 4 mm of where its hole is seen: it is elsewhere, or too narrow" in row["said"]
    )
    assert row["held"] == "peg"


@pytest.mark.parametrize("pegs", [("hexagon", 0.0005)], indirect=True)
def test_a_sentence_that_puts_something_where_it_has_no_room_to_spare_is_mended_by_feel(pegs: Path) -> None:
    with open_session(scene=pegs) as cell:
        episode = cell.run("put the peg in the block")
        assert episode.success
        assert "insert(container=block)" in episode.final_detail
        truth = cell.driver.simulation.truth()  # type: ignore[union-attr]
        assert truth.objects["peg"].pose.xyz[2] - 0.035 == pytest.approx(0.01, abs=0.002)


@pytest.mark.parametrize("pegs", [("square", 0.002)], indirect=True)
def test_what_is_held_is_plugged_into_a_hole_by_words(pegs: Path) -> None:
    with open_session(scene=pegs) as cell:
        cell.do("pick", object="peg", to="block")
        plan = cell.plan("plug it into the block")
        assert isinstance(plan, Plan)
        assert [*plan.steps] == [SkillCall(skill="insert", arguments={"container": "block"})]


@pytest.mark.parametrize(("joint", "along"), [(0, (0.0, -0.01, 0.0)), (2, (0.0, -0.01, 0.0)), (2, (0.01, 0.0, 0.0))])
def test_a_hand_that_yields_goes_straight_though_a_joint_is_at_its_limit(
    joint: int, along: tuple[float, float, float]
) -> None:
    # Where that joint was left out of its way and no other took its part, it went 3 mm the other way, and could not give way at all.
    with open_session("pick_from_three", what_if=False) as cell:
        q = np.array([0.3, 0.4, 0.0, -2.2, 0.0, 2.6, 0.5])
        q[joint] = cell.ctx.arm.spec.upper[joint] - 1e-4
        cell.do("move_joints", q=tuple(float(value) for value in q))
        hand = YieldingHand(Mover(cell.ctx))
        begun = hand.place.copy()
        for _ in range(200):
            hand.go(np.array(along))
        assert np.abs(hand.place - begun - 200 * hand.tick * np.array(along)).max() < 2e-4
        assert (hand.q <= cell.ctx.arm.spec.upper + 1e-9).all()
