"""Things that are pressed where they stand, and a hand that leans to a side."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import pytest

from robosandbox.errors import UnsupportedError
from robosandbox.types import Array
from robosandbox.workcell.embedded import EmbeddedWorkcell
from robosandbox.workcell.session import open_session


@pytest.fixture
def cell() -> Iterator[EmbeddedWorkcell]:
    with open_session("pick_from_three") as made:
        yield made


def place(cell: EmbeddedWorkcell, name: str) -> Array:
    item = cell.observe().find(name)
    assert item is not None
    return item.pose.position


def test_a_thing_is_squeezed_where_it_stands(cell: EmbeddedWorkcell) -> None:
    before = place(cell, "red_cube")
    most = [0.0]
    cell.driver.subscribe(lambda: most.append(cell.mujoco.grip_on("hand", "red_cube")))
    done = cell.do("squeeze", object="red_cube", force=8.0, seconds=1.0)
    assert float(done.detail["force_n"]) == pytest.approx(8.0, rel=0.1)
    assert max(most) < 1.1 * 8.0, "pressed harder before: a pick holds with 22 N"
    assert cell.observe().held is None
    assert np.abs(place(cell, "red_cube") - before).max() < 0.003


def test_a_thing_is_squeezed_lightly_where_no_force_is_told(cell: EmbeddedWorkcell) -> None:
    done = cell.do("squeeze", object="green_cube")
    assert 0.0 < float(done.detail["force_n"]) < 5.0


def test_a_force_that_the_gripper_does_not_tell_is_refused_before_anything_moves() -> None:
    with open_session("pick_from_three", driver="hardware", perception="rgbd", what_if=False) as cell:
        begun, gap = cell.driver.time, cell.state().gripper.width
        with pytest.raises(UnsupportedError, match="does not tell the force of its gripper"):
            cell.do("squeeze", object="red_cube", force=5.0)
        assert cell.driver.time - begun < 0.1 and cell.state().gripper.width == pytest.approx(gap, abs=1e-4)


def test_what_is_kept_is_held_and_not_lifted(cell: EmbeddedWorkcell) -> None:
    before = place(cell, "blue_cube")
    cell.do("squeeze", object="blue_cube", force=10.0, keep=True)
    assert cell.observe().held == "blue_cube"
    assert np.abs(place(cell, "blue_cube") - before).max() < 0.003


def test_the_tips_go_to_the_left(cell: EmbeddedWorkcell) -> None:
    before = cell.driver.state().tcp_pose
    cell.do("turn_hand", sideways=0.3)
    after = cell.driver.state().tcp_pose
    assert np.abs(after.position - before.position).max() < 0.002
    assert after.rotation[:, 2] @ np.array([0.0, 1.0, 0.0]) == pytest.approx(np.sin(0.3), abs=0.01)


def test_fingers_that_close_on_nothing_are_shut(cell: EmbeddedWorkcell) -> None:
    began = cell.driver.time
    done = cell.do("close_gripper", force=5.0)
    assert cell.driver.time - began < 8.0, "a Panda's creep with 5 N at 4 mm/s"
    assert float(done.detail["width_mm"]) < 1.0
    assert done.detail["held"] == ""
    assert done.found == "the fingers are shut, with nothing between them"
