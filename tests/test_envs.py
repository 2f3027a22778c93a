"""Tasks as Gymnasium environments: Gymnasium's own checker on each, and policies that solve them."""

from __future__ import annotations

import importlib.util
import json
import math
import warnings
from pathlib import Path
from typing import Any

import gymnasium
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env

from robosandbox.apps.cli import app
from robosandbox.apps.commands.console import run_app
from robosandbox.apps.envs import ManipulationEnv, env_id
from robosandbox.apps.envs.progress import distance, potential
from robosandbox.errors import InputError
from robosandbox.tasks.loader import bundled_tasks
from robosandbox.workcell.recording.episode import RecordedEpisode
from robosandbox.workcell.recording.replay import open_replay
from robosandbox.workcell.session import open_session

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
@pytest.mark.sample(every=5)
def test_every_task_passes_the_checker(task: str) -> None:
    # Kinds of action take turns over the tasks.
    action = ("ee", "joint")[list(bundled_tasks()).index(task) % 2]
    env = gymnasium.make(env_id(task), action=action).unwrapped
    assert isinstance(env, ManipulationEnv) and env.session.task.name == task
    checked(env)


def test_another_arm_passes_too() -> None:
    toys = Path(__file__).parent / "toys"
    env = ManipulationEnv("pick_cube_franka", robot=toys / "toy_jaw.xml", action="joint")
    robot = env.session.mujoco.robot
    assert robot.name == "toy_jaw" and env.action_space.shape == (robot.n + 1,)
    checked(env)


@pytest.mark.gl
def test_pixels_pass_the_checker_and_are_pictures() -> None:
    env = ManipulationEnv(
        "pick_cube_franka", observation="pixels", render_size=(64, 80), cameras=("wrist",), render_mode="rgb_array"
    )
    seen, _ = env.reset(seed=1)
    assert seen["pixels"].shape == (64, 80, 3) and seen["pixels"].std() > 5.0
    assert "environment_state" not in seen and seen in env.observation_space
    picture = env.render()
    assert picture is not None and picture.shape == (64, 80, 3)
    after, *_ = env.step(np.array([1.0, 0, 0, 0, 0, 0, 0], np.float32))
    assert (after["pixels"] != seen["pixels"]).any()
    env.close()


def test_ids_are_those_of_gymnasium_and_the_tasks_own_names() -> None:
    assert env_id("pick_cube_franka") == "robosandbox/PickCubeFranka-v0"
    for name in ("robosandbox/PickCubeFranka-v0", "robosandbox/pick_cube_franka-v0"):
        assert gymnasium.spec(name).kwargs == {"task": "pick_cube_franka"}


def test_a_seed_is_the_layout_of_the_bench() -> None:
    env = ManipulationEnv("pick_cube_scrambled")
    first, info = env.reset(seed=3)
    assert info == {"is_success": False, "layout": 3, "task_description": "pick up the red cube"}
    cube = env.session.start.objects["red_cube"].pose
    env.close()
    with ManipulationEnv("pick_cube_scrambled") as other:
        other.session.reset(3)
        assert other.session.start.objects["red_cube"].pose == cube
        drawn = [other.reset()[1]["layout"] for _ in range(2)]
        assert drawn[0] != drawn[1]
    assert np.allclose(first["environment_state"][:3], cube.xyz, atol=1e-6)


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
    robot = env.session.mujoco.robot
    goal = robot.home_q + np.array([0.3, -0.2, 0.1, 0.2, -0.1, 0.2, 0.3])
    for _ in range(40):
        seen, *_ = env.step(env.controller.joint_action(goal, closed=1.0))
    assert np.abs(seen["agent_pos"][:-1] - goal).max() < 0.02 and seen["agent_pos"][-1] > 0.95
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


@pytest.mark.parametrize("task", bundled_tasks())
def test_observations_are_flat_and_named_as_lerobot_names_them(task: str) -> None:
    # Stable-Baselines3 takes a Dict of Boxes of one dimension and of pictures; LeRobot reads these names.
    with ManipulationEnv(task) as env:
        found = env.observation_space
        assert isinstance(found, gymnasium.spaces.Dict)
        count, objects = env.session.mujoco.robot.n, len(env.session.task.scene.objects)
        shapes = {"agent_pos": (count + 1,), "agent_vel": (count,), "tcp_pose": (7,)}
        wanted = shapes | ({"environment_state": (7 * objects,)} if objects else {})
        assert {name: space.shape for name, space in found.items()} == wanted
        assert all(isinstance(space, gymnasium.spaces.Box) for space in found.values())
        assert env.task_description == env.session.task.prompt


def test_pictures_are_flat_for_one_camera_and_by_name_for_several() -> None:
    with ManipulationEnv("home", observation="pixels", render_size=(32, 48)) as env:
        assert isinstance(env.observation_space, gymnasium.spaces.Dict)
        assert env.observation_space["pixels"] == gymnasium.spaces.Box(0, 255, (32, 48, 3), np.uint8)
    with ManipulationEnv("home", observation="pixels", cameras=("scene", "wrist")) as env:
        assert isinstance(env.observation_space, gymnasium.spaces.Dict)
        inner = env.observation_space["pixels"]
        assert isinstance(inner, gymnasium.spaces.Dict) and set(inner) == {"scene", "wrist"}


@pytest.mark.parametrize(("arguments", "cost"), [({}, 1.0), ({"penalty": 0.25, "reward": "dense"}, 0.25)])
def test_pressing_on_the_table_ends_the_episode_and_costs_the_penalty(arguments: dict[str, Any], cost: float) -> None:
    env = ManipulationEnv("pick_cube_franka", **arguments)
    env.reset(seed=0)
    ended, info, reward = False, {}, 0.0
    while not ended:
        _, reward, ended, _, info = env.step(np.array([0.0, 0.0, -1.0, 0.0, 0.0, 0.0, -1.0]))
    assert "presses on table" in info["stopped"] and not info["is_success"]
    assert reward == pytest.approx(-cost, abs=0.01)
    env.close()


def test_a_penalty_below_zero_is_refused() -> None:
    with pytest.raises(InputError, match="penalty: -1; give 0 or more"):
        ManipulationEnv("pick_cube_franka", penalty=-1.0)


def test_dense_rewards_add_up_to_what_was_gained_and_lead_to_the_task() -> None:
    env = ManipulationEnv("pick_cube_franka", reward="dense")
    spec = importlib.util.spec_from_file_location("policy", EXAMPLES / "07_gym_policy.py")
    assert spec is not None and spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    policy = module.grasp(env)
    seen, _ = env.reset(options={"layout": 2})
    tcp = seen["tcp_pose"][:3].astype(float)
    begun = potential(env.session.task.success, env.session.start, env.session.simulation.truth(), tcp)
    rewards = []
    for _ in range(200):
        seen, reward, ended, *_ = env.step(policy(seen))
        rewards.append(reward)
        if ended:
            break
    # At success the potential is 0: what is gained in all is 1 and the distance that there was.
    assert ended and begun < -0.05 and sum(rewards) == pytest.approx(1.0 - begun, abs=1e-5)
    assert np.mean(np.array(rewards[:10]) > 0.0) > 0.8 and rewards[-1] > 0.9
    env.close()


@pytest.mark.parametrize("task", ["pick_ball", "place_beside", "stack_two", "put_in_bin", "push_left", "open_drawer"])
def test_tasks_have_a_distance_that_is_measured_and_goes_to_nothing(task: str) -> None:
    with open_session(task) as session:
        start, criterion = session.start, session.task.success
        if not criterion.evaluate(start, session.simulation.truth()).holds:
            assert distance(criterion, start, session.simulation.truth()) > 0.0
        session.run()
        assert session.judge().success
        tcp = session.driver.state().tcp_pose.position
        assert distance(criterion, start, session.simulation.truth()) == 0.0
        assert potential(criterion, start, session.simulation.truth(), tcp) == 0.0


def test_wrong_kinds_are_told() -> None:
    wrong: Any = {"observation": "smell"}
    with pytest.raises(InputError, match="observation: 'smell' is not one of state, pixels"):
        ManipulationEnv("home", **wrong)
    for rate in (0.0, -1.0, 101.0, math.nan):
        with pytest.raises(InputError, match=r"control_hz: .* give more than 0, to 100"):
            ManipulationEnv("home", control_hz=rate)


@pytest.mark.parametrize("rate", [100.0, 60.0, 30.0, 16.0, 7.0, 2.0])
def test_actions_of_any_rate_begin_at_the_tick_nearest_to_their_time(rate: float) -> None:
    """As of a data set of 30 pictures a second, between which lies no whole number of control ticks; slow ones are as long in coming."""
    env = ManipulationEnv("home", control_hz=rate, action="joint", observation="state")
    try:
        env.reset(seed=1)
        driver, spec = env.session.driver, env.session.ctx.arm.spec
        begun, tick = driver.time, driver.control_timestep
        rng, fastest = np.random.default_rng(3), 0.0
        for count in range(1, round(2.0 * rate) + 1):
            before = env.controller.commanded[0]
            began = driver.time
            action = rng.uniform(-1.0, 1.0, env.action_space.shape)
            *_, info = env.step(action)
            assert "stopped" not in info, info
            assert env.controller.commanded[1] == pytest.approx(0.5 * (action[-1] + 1.0))
            assert abs(driver.time - begun - count / rate) <= 0.5 * tick + 1e-9
            speed = np.abs(env.controller.commanded[0] - before) / (driver.time - began)
            fastest = max(fastest, float((speed / spec.velocity_limits).max()))
        assert 0.05 < fastest <= 1.0 + 1e-9
    finally:
        env.close()
