"""Tasks as Gymnasium environments: Gymnasium's own checker on each, and policies that solve them."""

from __future__ import annotations

import json
import warnings
from pathlib import Path
from typing import Any

import gymnasium
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env

from robosandbox.cli import app
from robosandbox.commands.console import run_app
from robosandbox.envs import ManipulationEnv, env_id
from robosandbox.errors import InputError
from robosandbox.recording.episode import RecordedEpisode
from robosandbox.tasks.loader import bundled_tasks
from robosandbox.tasks.replay import open_replay

EXAMPLES = Path(__file__).resolve().parents[1] / "examples"


def checked(env: ManipulationEnv) -> None:
    """Run Gymnasium's checker; what it would only warn of is an error, infinite bounds apart."""
    with warnings.catch_warnings(record=True) as said:
        warnings.simplefilter("always")
        check_env(env, skip_render_check=True)
    found = [str(item.message) for item in said if "infinity" not in str(item.message)]
    assert [text for text in found if "gym" in text.lower() or "WARN" in text] == []
    env.close()


@pytest.mark.parametrize("task", bundled_tasks())
def test_every_task_passes_the_checker(task: str) -> None:
    # Kinds of action take turns over the tasks.
    action = ("ee", "joint")[list(bundled_tasks()).index(task) % 2]
    env = gymnasium.make(env_id(task), action=action).unwrapped
    assert isinstance(env, ManipulationEnv) and env.session.task.name == task
    checked(env)


def test_another_arm_passes_too() -> None:
    toys = Path(__file__).parent / "toys"
    env = ManipulationEnv("pick_cube_franka", robot=toys / "toy_jaw.xml", action="joint")
    robot = env.session.sim.robot
    assert robot.name == "toy_jaw" and env.action_space.shape == (robot.n + 1,)
    checked(env)


@pytest.mark.gl
def test_pixels_pass_the_checker_and_are_pictures() -> None:
    env = ManipulationEnv(
        "pick_cube_franka", observation="pixels", render_size=(64, 80), cameras=("wrist",), render_mode="rgb_array"
    )
    seen, _ = env.reset(seed=1)
    assert seen["pixels"]["wrist"].shape == (64, 80, 3) and seen["pixels"]["wrist"].std() > 5.0
    assert "objects" not in seen and seen in env.observation_space
    picture = env.render()
    assert picture is not None and picture.shape == (64, 80, 3)
    after, *_ = env.step(np.array([1.0, 0, 0, 0, 0, 0, 0], np.float32))
    assert (after["pixels"]["wrist"] != seen["pixels"]["wrist"]).any()
    env.close()


def test_ids_are_those_of_gymnasium_and_the_tasks_own_names() -> None:
    assert env_id("pick_cube_franka") == "robosandbox/PickCubeFranka-v0"
    for name in ("robosandbox/PickCubeFranka-v0", "robosandbox/pick_cube_franka-v0"):
        assert gymnasium.spec(name).kwargs == {"task": "pick_cube_franka"}


def test_a_seed_is_the_layout_of_the_bench() -> None:
    env = ManipulationEnv("pick_cube_scrambled")
    first, info = env.reset(seed=3)
    assert info == {"is_success": False, "layout": 3}
    cube = env.session.start.objects["red_cube"].pose
    env.close()
    with ManipulationEnv("pick_cube_scrambled") as other:
        other.session.reset(3)
        assert other.session.start.objects["red_cube"].pose == cube
        drawn = [other.reset()[1]["layout"] for _ in range(2)]
        assert drawn[0] != drawn[1]
    assert np.allclose(first["objects"][0, :3], cube.xyz, atol=1e-6)


def test_ee_actions_move_the_tcp_by_what_they_say() -> None:
    env = ManipulationEnv("pick_cube_franka")
    before, _ = env.reset(options={"layout": 0})
    for _ in range(10):
        after, *_ = env.step(np.array([0.0, 0.5, 0.0, 0.0, 0.0, 0.0, -1.0], np.float32))
    for _ in range(5):
        after, *_ = env.step(np.array([0.0, 0.0, 0.0, 0.0, 0.0, 0.0, -1.0], np.float32))
    # Half of 0.4 m/s for half a second, to the left.
    assert np.allclose(after["tcp_pose"][:3] - before["tcp_pose"][:3], [0.0, 0.10, 0.0], atol=2e-3)
    assert abs(float(after["tcp_pose"][3:] @ before["tcp_pose"][3:])) > 0.9999
    env.close()


def test_joint_actions_lead_to_the_joints_that_they_name() -> None:
    env = ManipulationEnv("home", action="joint")
    env.reset(options={"layout": 0})
    robot = env.session.sim.robot
    goal = robot.home_q + np.array([0.3, -0.2, 0.1, 0.2, -0.1, 0.2, 0.3])
    for _ in range(40):
        seen, *_ = env.step(env.controller.joint_action(goal, closed=1.0))
    assert np.abs(seen["q"] - goal).max() < 0.02 and seen["gripper"][0] > 0.95
    env.close()


def test_success_is_the_tasks_own_and_has_to_hold() -> None:
    env = ManipulationEnv("home")
    env.reset(seed=2)
    seen, reward, ended, cut, info = env.step(np.zeros(7, np.float32))
    assert (reward, ended, cut, info["is_success"]) == (0.0, False, False, False)
    assert seen in env.observation_space
    env.close()


def test_scripted_policy_of_twenty_lines_solves_pick_cube_franka(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(EXAMPLES)
    given = ["run", "--task", "pick_cube_franka", "--seed", "4", "--policy", "07_gym_policy:grasp"]
    assert run_app(app, "robo-sandbox", [*given, "--record", str(tmp_path), "--json"]) == 0
    document = json.loads(capsys.readouterr().out)
    assert document["judged"]["success"] and document["steps"] < 200
    # What a policy commands is recorded and runs again like what skills command.
    run = open_replay(RecordedEpisode.load(document["recorded"]))
    replayed = run.run()
    run.session.close()
    assert replayed.same and replayed.object_error_mm["red_cube"] < 1e-3


@pytest.mark.parametrize(
    ("arguments", "complaint"),
    [
        (["--task", "home", "--policy", "nowhere"], "'nowhere' is not MODULE:FACTORY"),
        (["--task", "home", "--policy", "nowhere:make"], "there is no module 'nowhere'"),
        (["--task", "home", "--policy", "json:nothing"], "json has no factory 'nothing'"),
        (["--task", "home", "--policy", "builtins:id"], "made a int; it must map observations to actions"),
        (["--task", "home", "--policy", "json:loads", "--action", "feet"], "--action is one of ee, joint"),
        (["go home", "--policy", "json:loads"], "leave the prompt out"),
    ],
)
def test_wrong_policies_are_told(arguments: list[str], complaint: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert run_app(app, "robo-sandbox", ["run", *arguments]) == 2
    assert complaint in capsys.readouterr().err


def test_wrong_kinds_are_told() -> None:
    wrong: Any = {"observation": "smell"}
    with pytest.raises(InputError, match="observation: 'smell' is not one of state, pixels"):
        ManipulationEnv("home", **wrong)
    with pytest.raises(InputError, match="control_hz: 30 does not divide"):
        ManipulationEnv("home", control_hz=30)
