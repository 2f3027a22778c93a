"""LeRobot with its own SO101Follower on an emulated bus, and its commands, where that environment is there.

`uv sync --project examples/drivers/lerobot`. Its tests run in it, by its own Python.
"""

from __future__ import annotations

import os
import subprocess
from pathlib import Path

import pytest

TESTS = Path(__file__).parent
PYTHON = TESTS.parent / "examples" / "drivers" / "lerobot" / ".venv" / "bin" / "python"
CLAIMS = (
    "numbers_are_those_that_lerobot_sends_and_reads",
    "the_driver_keeps_its_promises",
    "an_arm_goes_on_holding_when_it_is_disconnected",
    "another_arms_calibration_is_refused",
    "what_lets_go_at_its_end_is_to_be_said",
    "a_cable_that_is_pulled_stops_the_arm_until_a_person_recovers",
    "a_robot_without_servos_is_driven_by_its_units",
    "its_own_cameras_see_once_it_is_said_where_they_stand",
    "no_command_of_a_fuzzer_leaves_the_limits",
    "the_red_cube_is_picked_up",
    "an_episode_is_recorded_with_the_skills_as_its_teleoperator",
    "the_skills_teleoperate",
    "what_was_sent_is_what_an_action_returns",
    "a_policy_is_evaluated",
)


@pytest.mark.alone
@pytest.mark.skipif(not PYTHON.exists(), reason="the environment of examples/drivers/lerobot is not there")
@pytest.mark.parametrize("claim", CLAIMS)
def test_lerobot(claim: str) -> None:
    command = [PYTHON, "-m", "robosandbox_lerobot.claims", claim]
    environment = {**os.environ, "PYTHONPATH": str(TESTS)}
    ran = subprocess.run(command, env=environment, capture_output=True, text=True, timeout=300)
    assert ran.returncode == 0, ran.stdout + ran.stderr
