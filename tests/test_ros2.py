"""ROS 2 with the real rclpy and Fast DDS, where that environment is there: `uv run --project examples/drivers/ros2 build_interfaces.py`.

Its tests run in it, by its own Python: a plant behind controllers of rclpy's is one process, what is tested another.
"""

from __future__ import annotations

import os
import subprocess
import sys
from importlib.util import find_spec
from pathlib import Path

import numpy as np
import pytest

from robosandbox.drivers.ros2.splines import largest_speeds, seconds_to, stretch

PROJECT = Path(__file__).parents[1] / "examples" / "drivers" / "ros2"
RUN = "from robosandbox.apps.cli import main; main()"
PYTHON = PROJECT / ".venv" / "bin" / "python"
CLAIMS = (
    "the_driver_keeps_its_promises_over_ros",
    "a_plain_gripper_action_is_found_out",
    "a_cube_is_picked_and_placed_through_the_controller",
    "what_is_not_there_is_told_with_what_is",
    "a_goal_that_is_rejected_is_a_fault_that_is_recovered_from",
    "a_tolerance_that_is_violated_is_told_with_the_controllers_words",
    "a_controller_whose_speed_is_scaled_down_gets_there",
    "a_second_client_that_moves_the_arm_is_noticed",
    "silent_joint_states_stop_the_arm",
    "joint_states_of_nan_are_no_readings",
    "a_joint_that_is_told_of_as_nan_has_no_position_and_no_speed",
    "a_broken_picture_is_none_and_the_link_goes_on",
    "a_link_whose_thread_has_ended_says_so_and_is_revived",
    "a_frame_that_is_fixed_at_two_places_is_refused",
    "a_transform_that_moves_grows_old",
    "a_wrench_is_as_old_as_its_stamp",
    "a_lens_that_is_not_known_is_told_in_place_of_a_wrong_one",
    "a_link_that_hears_nothing_more_is_a_fault_that_is_recovered_from",
    "late_joint_states_stop_the_arm",
    "a_controller_that_is_started_again_is_found_again",
    "a_silent_robot_is_lost_though_the_node_tells_of_it",
    "an_outside_node_sees_and_is_answered",
    "an_outside_node_cancels_and_stops",
    "a_way_that_begins_beside_the_arm_is_gone_to_within_its_speed",
    "no_command_of_a_fuzzer_reaches_the_plant_outside_the_limits",
    "bytes_and_hashes_without_ros_are_those_of_the_wheels",
    "a_bag_of_the_topics_is_read_back_by_another_reader",
    "a_node_of_pyzeros_sees_and_is_answered_over_rmw_zenoh",
)


def test_without_ros_it_is_told_what_the_driver_and_the_node_need() -> None:
    if find_spec("rclpy") is not None:
        pytest.skip("ROS is there")
    for command, says in (
        (("run", "go home", "--driver", "ros2"), "--driver ros2: Python cannot import"),
        (("ros2",), "ros2: Python cannot import 'rclpy': source your ROS 2 in this shell, and build robosandbox_msgs"),
    ):
        ran = subprocess.run([sys.executable, "-c", RUN, *command], capture_output=True, text=True, timeout=120)
        assert ran.returncode == 2 and says in ran.stderr and len(ran.stderr.splitlines()) == 1


def test_the_interfaces_are_where_colcon_is_told() -> None:
    command = [sys.executable, "-c", RUN, "ros2", "--interfaces"]
    folder = Path(subprocess.run(command, capture_output=True, text=True, check=True, timeout=120).stdout.strip())
    written = (folder / "CMakeLists.txt").read_text()
    files = [
        path.relative_to(folder).as_posix() for kind in ("msg", "srv", "action") for path in folder.rglob(f"*.{kind}")
    ]
    assert files and all(f'"{file}"' in written for file in files)


def fastest(step: float, before: float, after: float, seconds: float) -> float:
    """Return the largest speed of a cubic, by looking at very many places of it."""
    share, first, last = np.linspace(0.0, 1.0, 20_001), before * seconds, after * seconds
    second, third = 3.0 * step - 2.0 * first - last, first + last - 2.0 * step
    return float(np.abs(first + share * (2.0 * second + 3.0 * third * share)).max() / seconds)


def test_the_largest_speed_of_a_cubic_is_that_of_all_its_places() -> None:
    random = np.random.default_rng(0)
    for step, before, after, seconds in random.uniform((-1, -2, -2, 0.01), (1, 2, 2, 1.0), (300, 4)):
        found = largest_speeds(np.array([step]), np.array([before]), np.array([after]), seconds)
        assert found[0] == pytest.approx(fastest(step, before, after, seconds), rel=1e-6)
    # From standing to standing the middle is half as fast again as a line.
    assert largest_speeds(np.ones(1), np.zeros(1), np.zeros(1), 1.0)[0] == 1.5


def test_a_goal_is_joined_to_within_the_limits_by_a_line_and_by_a_cubic() -> None:
    random, limits = np.random.default_rng(1), np.array([2.0, 0.5])
    for _ in range(100):
        steps = random.normal(scale=0.2, size=(2, 2))
        before, after = random.uniform(-limits, limits, (2, 2))
        seconds = seconds_to(steps, before, after, limits, 0.01)
        by_line = seconds_to(steps, before, None, limits, 0.01)
        assert (np.abs(steps) / by_line <= limits * (1 + 1e-6)).all() and by_line <= seconds
        for step in steps:
            for joint, limit in enumerate(limits):
                assert fastest(step[joint], before[joint], after[joint], seconds) <= limit * (1 + 1e-6)
    assert seconds_to(np.zeros((1, 2)), np.zeros(2), np.zeros(2), limits, 0.01) == 0.01
    with pytest.raises(ValueError, match="not finite"):
        seconds_to(np.full((1, 2), np.nan), np.zeros(2), np.zeros(2), limits, 0.01)


def test_rows_that_keep_to_a_speed_are_stretched_where_their_cubics_do_not() -> None:
    rows, limits = np.array([[0.0], [0.1], [0.2], [0.2]]), np.array([1.0])
    speeds = np.gradient(rows, 0.1, axis=0)
    longer = stretch(rows, speeds, 0.1, limits)
    assert longer == pytest.approx(fastest(0.1, 1.0, 0.5, 0.1)) and longer > 1.05
    assert (
        largest_speeds(np.diff(rows, axis=0), speeds[:-1] / longer, speeds[1:] / longer, 0.1 * longer).max()
        <= 1.0 + 1e-9
    )
    assert stretch(rows, speeds, 0.1, 2.0 * limits) == 1.0


def ros_domain(worker: str) -> str:
    """Return a domain of this worker's own, which nothing else on this machine hears."""
    return str(60 + int(worker.removeprefix("gw") or 0) % 40) if worker.startswith("gw") else "60"


@pytest.mark.alone
@pytest.mark.skipif(not PYTHON.exists(), reason="the environment of examples/drivers/ros2 is not there")
@pytest.mark.parametrize("claim", CLAIMS)
def test_ros2(claim: str) -> None:
    environment = {
        **os.environ,
        "ROS_AUTOMATIC_DISCOVERY_RANGE": "LOCALHOST",
        "ROS_DOMAIN_ID": ros_domain(os.environ.get("PYTEST_XDIST_WORKER", "")),
    }
    command = [PYTHON, "-m", "robosandbox_ros2.claims", claim]
    ran = subprocess.run(command, env=environment, capture_output=True, text=True, timeout=300)
    assert ran.returncode == 0, ran.stdout + ran.stderr
