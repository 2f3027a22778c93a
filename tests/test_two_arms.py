"""Two Pandas in one cell: each arm and hand is read and moved by its name, behind limits of its own."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np
import pytest

from robosandbox.agent.context import AgentContext
from robosandbox.apps.conformance import check_driver
from robosandbox.driver import SafeDriver, made_safe
from robosandbox.driver.clamps import braking_seconds
from robosandbox.errors import LimitError
from robosandbox.grasp.analytic import AnalyticTopDown
from robosandbox.motion.ik import DLSMotionPlanner
from robosandbox.perception.ground_truth import GroundTruthPerception
from robosandbox.robots.kinematics import Kinematics
from robosandbox.robots.loader import robot_of
from robosandbox.robots.sidecar import BasePose
from robosandbox.sim.mujoco_backend import MuJoCoBackend
from robosandbox.sim.opening import mujoco_behind
from robosandbox.sim.world import build_world
from robosandbox.types import Array, Limits, Pose, Scene, SceneObject, Trajectory, Workspace
from robosandbox.world.contracts import find
from robosandbox.world.facts import fact
from robosandbox.world.predicate import View
from robosandbox.world.scene_json import describe_scene
from robosandbox.world.symbolic_state import symbolic_state

# The left arm stands at the table's left edge, the right one at its right edge; each has a cube before it.
BASES = {"left": (-0.3, 0.35, 0.0), "right": (-0.3, -0.35, 0.0)}
CUBES = {"left": "red_cube", "right": "blue_cube"}
DOWN = np.diag([1.0, -1.0, -1.0])


def cube(name: str, y: float, rgba: tuple[float, float, float, float]) -> SceneObject:
    return SceneObject(
        id=name, kind="box", size=(0.02, 0.02, 0.02), pose=Pose(xyz=(0.15, y, 0.061)), rgba=rgba, mass=0.05
    )


SCENE = Scene(objects=(cube("red_cube", 0.35, (1.0, 0.0, 0.0, 1.0)), cube("blue_cube", -0.35, (0.0, 0.0, 1.0, 1.0))))


@pytest.fixture
def cell() -> Iterator[SafeDriver]:
    panda = robot_of(SCENE)
    world = MuJoCoBackend()
    sidecars = {name: panda.sidecar.model_copy(update={"base_pose": BasePose(xyz=xyz)}) for name, xyz in BASES.items()}
    world.adopt(build_world(SCENE, {name: replace(panda, sidecar=sidecar) for name, sidecar in sidecars.items()}))
    world.reset()
    with made_safe(world) as driver:
        yield driver


def go(driver: SafeDriver, name: str, point: Array) -> None:
    """Send the TCP of an arm to a point, the hand pointing down, in three seconds."""
    arm, world = driver.arms[name], mujoco_behind(driver)
    assert world is not None
    q = arm.state().q
    found = Kinematics.of(world.model, world.robots[name]).descend(point, DOWN, q)
    assert found.solved
    share = 0.5 - 0.5 * np.cos(np.linspace(0.0, np.pi, 301))[:, None]
    arm.follow(Trajectory(q=q + share * (found.q - q), dt=0.01))
    for _ in range(50):
        arm.trim(found.q)


def pick(driver: SafeDriver, name: str) -> None:
    world = mujoco_behind(driver)
    assert world is not None
    at = world.truth().objects[CUBES[name]].pose.position
    go(driver, name, at + [0.0, 0.0, 0.12])
    go(driver, name, at)
    driver.hands[name].set_gripper(1.0)
    driver.wait(1.0)
    go(driver, name, at + [0.0, 0.0, 0.15])


def context(driver: SafeDriver, arm: str) -> AgentContext:
    return AgentContext(
        sim=driver,
        safety=driver.safety,
        arm_name=arm,
        perception=GroundTruthPerception(),
        grasp=AnalyticTopDown(),
        motion=DLSMotionPlanner(),
    )


def test_a_driver_of_two_arms_passes_the_check(cell: SafeDriver) -> None:
    assert [*cell.arms] == [*cell.hands] == ["left", "right"] and cell.hands["right"].arm == "right"
    check_driver(cell, pictures=False)


def test_an_arm_moves_and_the_other_one_holds(cell: SafeDriver) -> None:
    before = cell.state().arms
    goal = before["left"].q + 0.3 * np.eye(7)[0]
    cell.arms["left"].follow(Trajectory(q=np.linspace(before["left"].q, goal, 200), dt=0.01))
    cell.wait(0.5)
    after = cell.state().arms
    assert np.abs(after["left"].q - goal).max() < 5e-3 and np.abs(after["right"].q - before["right"].q).max() < 1e-3
    assert np.allclose(after["left"].tcp_pose.position[:2] - BASES["left"][:2], _turned(before["left"], 0.3), atol=5e-3)


def _turned(state: object, angle: float) -> Array:
    at = np.array(state.tcp_pose.position[:2]) - BASES["left"][:2]  # type: ignore[attr-defined]
    c, s = np.cos(angle), np.sin(angle)
    return np.array([[c, -s], [s, c]]) @ at


def test_what_is_asked_without_a_name_is_refused_where_there_are_two(cell: SafeDriver) -> None:
    with pytest.raises(ValueError, match=r"there are 2 arms \(left, right\): say which is meant"):
        _ = cell.state().q
    seen = GroundTruthPerception().perceive(cell)
    with pytest.raises(ValueError, match=r"there are 2 hands \(left, right\)"):
        _ = seen.held
    with pytest.raises(ValueError, match=r"there are 2 arms \(left, right\)"):
        AgentContext(sim=cell, perception=GroundTruthPerception(), grasp=AnalyticTopDown(), motion=DLSMotionPlanner())


def test_each_hand_holds_its_own_thing_and_relations_name_the_hand(cell: SafeDriver) -> None:
    pick(cell, "left")
    left, right = context(cell, "left"), context(cell, "right")
    assert left.hand is not None and left.hand.name == "left" and left.arm.name == "left"
    seen = left.look()
    assert seen.hands == {"left": "red_cube", "right": None} and seen.held == "red_cube" and right.look().held is None
    holds = {
        str(f): find(f, View.of(seen)).holds
        for f in (
            fact("holding", "red_cube", "left"),
            fact("holding", "red_cube", "right"),
            fact("hand_empty", "left"),
            fact("hand_empty", "right"),
        )
    }
    assert [*holds.values()] == [True, False, False, True], holds
    assert find(fact("hand_empty"), View.of(right.look())).holds and not find(fact("hand_empty"), View.of(seen)).holds
    pick(cell, "right")
    seen = GroundTruthPerception().perceive(cell)
    assert seen.hands == {"left": "red_cube", "right": "blue_cube"} and seen.in_hands == {"red_cube", "blue_cube"}
    stated = {str(one.fact) for one in symbolic_state(seen)}
    assert {"holding(red_cube, left)", "holding(blue_cube, right)"} <= stated
    assert describe_scene(seen)["held"] == {"left": "red_cube", "right": "blue_cube"}
    unknown = find(fact("holding", "red_cube", "lft"), View.of(seen))
    assert not unknown.holds and "no hand 'lft'" in unknown.cause and "did you mean 'left'?" in unknown.help


def test_a_hand_feels_what_it_holds_and_the_other_one_does_not(cell: SafeDriver) -> None:
    pick(cell, "left")
    assert cell.hands["left"].grip_on("red_cube") > 5.0 and cell.hands["right"].grip_on(None) == 0.0
    weight = 0.05 * 9.81
    assert float(cell.senses.force_on("red_cube", "left")[2]) == pytest.approx(weight, rel=0.1)
    assert not cell.senses.forces("right") and set(cell.senses.forces("left")) == {"red_cube"}
    assert float(cell.senses.force_on("red_cube")[2]) == pytest.approx(weight, rel=0.1), "of both arms together"
    assert all(inner.startswith("left/") for inner, _ in cell.senses.contacts("left"))


def test_each_arm_is_kept_within_its_own_limits(cell: SafeDriver) -> None:
    for name, arm in cell.arms.items():
        q, time = arm.state().q, cell.time
        past = q.copy()
        past[0] = arm.spec.upper[0] + 0.1
        with pytest.raises(LimitError, match="joint1 would be at"):
            arm.follow(Trajectory(q=np.linspace(q, past, 1000), dt=0.01))
        assert cell.time == time and np.abs(arm.state().q - q).max() < 1e-6, f"{name} has not moved"


def test_arms_that_press_on_each_other_are_stopped(cell: SafeDriver) -> None:
    world = mujoco_behind(cell)
    assert world is not None
    go(cell, "right", np.array([0.2, -0.05, 0.3]))
    go(cell, "left", np.array([0.2, 0.25, 0.3]))
    with pytest.raises(LimitError, match=r"the robot presses on right/\w+ with up to .* N") as caught:
        go(cell, "left", np.array([0.2, -0.05, 0.3]))
    assert caught.value.evidence is not None and caught.value.evidence.met()[0].startswith("right/")
    cell.wait(cell.safety.stop_deadline)
    assert cell.mode == "stopped" and cell.safety.stopped_after is not None
    assert cell.safety.stopped_after < 3.0 * braking_seconds(cell.arms["left"].spec)[1]


def test_a_stop_of_one_arm_is_watched_and_a_fault_of_the_cell_holds_all(cell: SafeDriver) -> None:
    cell.safety.limit(Limits(workspace=Workspace(y=(-0.6, 0.4))))
    with pytest.raises(LimitError, match="outside the workspace"):
        go(cell, "left", np.array([0.1, 0.5, 0.3]))
    assert cell.mode == "stopping"
    cell.wait(1.0)
    assert cell.mode == "stopped"
    go(cell, "right", np.array([0.15, -0.3, 0.3]))
    assert cell.mode == "ready"
