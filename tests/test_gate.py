"""The twin as gate: on a wall's clock plans are tried on the twin, shown, confirmed; an arm that goes otherwise is stopped."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from robosandbox.agent.episode import FinalReason
from robosandbox.agent.gate import Gate
from robosandbox.apps.repl.shell import Shell
from robosandbox.errors import CollisionError, SkillError, TwinError
from robosandbox.types import Trajectory
from robosandbox.workcell.embedded import EmbeddedWorkcell
from robosandbox.workcell.host import WorkcellHost
from robosandbox.workcell.orders import bind_order
from robosandbox.workcell.session import open_session

WALL: dict[str, Any] = {"driver": "hardware:clock=wall", "perception": "rgbd"}
# Moves by the wall's clock: beside other tests this computer is a host that stalls, and the driver stops.
pytestmark = [pytest.mark.alone, pytest.mark.gl]


@pytest.fixture
def cell() -> Iterator[EmbeddedWorkcell]:
    with open_session("put_in_bin", **WALL) as cell:
        yield cell


def run(cell: EmbeddedWorkcell, sentence: str) -> dict[str, Any]:
    """Say a sentence as every mouth does."""
    data: dict[str, Any] = WorkcellHost(cell).perform_order(bind_order("run", {"prompt": sentence})).data  # type: ignore[union-attr]
    return data


def test_it_is_on_where_the_clock_is_the_walls_and_one_option_turns_it_off() -> None:
    for options, gated in (
        ({}, False),
        ({"confirm": True}, True),
        (WALL, True),
        ({**WALL, "confirm": False}, False),
        ({"driver": "hardware", "perception": "rgbd"}, False),
    ):
        with open_session("put_in_bin", **options) as cell:
            assert isinstance(cell.agent.approve, Gate) is gated


def test_a_sentence_is_answered_by_what_would_come_of_it_and_yes_carries_it_out(cell: EmbeddedWorkcell) -> None:
    stood = cell.state().q
    asked = run(cell, "pick up the red cube")
    assert asked["reason"] == "refused" and asked["refusal"]["candidates"] == ["yes", "no"]
    assert asked["detail"].startswith("on the twin: pick(object=red_cube): would work; 2.")
    assert "touches red_cube, " in asked["detail"] and " mm from table at the nearest" in asked["detail"]
    assert np.abs(cell.state().q - stood).max() < 0.01
    done = run(cell, "yes")
    assert done["success"], done
    assert cell.observe().held == "red_cube"


def test_no_moves_nothing_and_another_sentence_is_another_order(cell: EmbeddedWorkcell) -> None:
    run(cell, "pick up the red cube")
    assert run(cell, "no")["answer"] == "it is not carried out"
    assert run(cell, "pick up the red cube")["refusal"] is not None
    assert run(cell, "what is on the table?")["answer"]
    assert not run(cell, "yes")["success"], "a yes answers the sentence before it alone"


def test_in_the_repl_the_next_line_confirms(cell: EmbeddedWorkcell) -> None:
    shell = Shell(WorkcellHost(cell))
    assert "carry it out? say yes or no" in shell.execute("pick up the red cube").text
    assert shell.execute("yes").text == "done: pick(object=red_cube)"


def test_a_person_at_the_terminal_is_shown_a_line_for_each_call(cell: EmbeddedWorkcell) -> None:
    shown: list[str] = []
    assert isinstance(cell.agent.approve, Gate)
    cell.agent.approve.ask = lambda lines: bool(shown.extend(lines))
    assert cell.run().final_reason is FinalReason.DECLINED
    assert shown[0].startswith("pick(object=red_cube): would work; ")
    assert shown[1].startswith("place_in(container=grey_bin): would work; ")


def test_where_nobody_can_be_asked_what_works_on_the_twin_is_carried_out(cell: EmbeddedWorkcell) -> None:
    assert cell.run().success


def test_where_nobody_can_be_asked_what_fails_on_the_twin_moves_nothing(cell: EmbeddedWorkcell) -> None:
    stood = cell.state().q
    with pytest.raises(SkillError, match=r"not carried out: on the twin place_in\(container=grey_bin\) would fail: "):
        cell.do("place_in", container="grey_bin")
    assert np.abs(cell.state().q - stood).max() < 0.01


def test_where_nobody_can_be_asked_what_touches_something_on_the_twin_moves_nothing(
    cell: EmbeddedWorkcell, monkeypatch: pytest.MonkeyPatch
) -> None:
    told = {"ok": True, "moves": True, "would_touch": ["mug"]}
    monkeypatch.setattr(type(cell.ctx), "rehearse", lambda ctx, calls: told)
    episode = cell.run()
    assert (
        episode.final_reason is FinalReason.DECLINED and "would touch mug, which no call names" in episode.final_detail
    )
    with pytest.raises(CollisionError, match="clear the way"):
        cell.do("home")


def stopped_by(cell: EmbeddedWorkcell) -> TwinError:
    """Return what a pick is stopped by, nothing being tried again."""
    episode = cell.run("pick up the red cube")
    assert episode.final_reason is FinalReason.GAVE_UP and episode.replans == 0 and episode.error is not None
    error = episode.error.exception()
    assert isinstance(error, TwinError)
    return error


def test_an_arm_that_is_off_its_twins_way_is_stopped(cell: EmbeddedWorkcell, monkeypatch: pytest.MonkeyPatch) -> None:
    arm = cell.driver.behind.arms["arm"]
    measured = arm._measured_q  # type: ignore[attr-defined]

    def pushed() -> np.ndarray:
        q: np.ndarray = measured()
        return q + 0.4 * np.eye(len(q))[0] * (cell.ctx.phase == "lift")

    monkeypatch.setattr(arm, "_measured_q", pushed)
    assert "differ in position: joint1 is 0." in stopped_by(cell).message


def test_an_arm_that_takes_much_longer_than_its_twin_is_stopped(
    cell: EmbeddedWorkcell, monkeypatch: pytest.MonkeyPatch
) -> None:
    arm = cell.driver.behind.arms["arm"]
    follow = arm.follow

    def slowly(trajectory: Trajectory, guards: Any = ()) -> None:
        follow(replace(trajectory, dt=10.0 * trajectory.dt), guards)

    monkeypatch.setattr(arm, "follow", slowly)
    assert "differ in time: the arm has moved for " in stopped_by(cell).message


def test_an_arm_that_presses_harder_than_its_twin_is_stopped(monkeypatch: pytest.MonkeyPatch) -> None:
    with open_session("put_in_bin", driver="hardware:clock=wall,wrist_wrench=true", perception="rgbd") as cell:
        senses = cell.driver.behind.senses
        felt = senses.force_on

        def pressed(object_id: str | None, arm: str | None = None) -> np.ndarray:
            return np.array([0.0, 0.0, 50.0]) if cell.ctx.phase == "approach" else felt(object_id, arm)

        monkeypatch.setattr(senses, "force_on", pressed)
        assert "differ in force: the arm presses with 50.0 N" in stopped_by(cell).message
