"""Sleep: what lies still costs nothing, is seen as before, and wakes with what touches it."""

from __future__ import annotations

import copy
import math
from collections.abc import Iterator

import mujoco
import numpy as np
import pytest
from support.asleep import SCENE, box, height, live, sleeping
from support.behind import backend

from robosandbox import open_session
from robosandbox.sim.intervention import Intervention
from robosandbox.sim.mujoco_backend import MuJoCoBackend
from robosandbox.sim.saved_state import integrated_size, put_state
from robosandbox.sim.sleep_timer import CALM_SECONDS, MOST_STEPS, moving_count
from robosandbox.types import ObjectTruth, Pose, Scene, SceneObject

HALF = 0.02


@pytest.fixture(scope="module")
def world() -> Iterator[MuJoCoBackend]:
    with MuJoCoBackend() as sim:
        sim.load(SCENE)
        yield sim


@pytest.fixture
def sim(world: MuJoCoBackend) -> MuJoCoBackend:
    """The scene, asleep."""
    world.reset(SCENE)
    world.wait(2.0 * CALM_SECONDS)
    assert sleeping(world) == {item.id for item in SCENE.objects}
    return world


# Who sleeps.


def test_what_lies_still_sleeps_and_the_robot_does_not(sim: MuJoCoBackend) -> None:
    trees = np.unique(sim.model.body_treeid[sorted(sim.robot.bodies)])
    assert (live(sim).tree_asleep[trees[trees >= 0]] < 0).all()
    sim.wait(3.0)
    assert (live(sim).tree_asleep[trees[trees >= 0]] < 0).all()


@pytest.mark.parametrize("count", [1, 60])
def test_physics_is_spent_on_the_robot_alone_however_many_things_lie_there(count: int) -> None:
    objects = tuple(box(f"box_{k}", 0.4 - 0.08 * (k // 10), 0.36 - 0.08 * (k % 10)) for k in range(count))
    with MuJoCoBackend() as sim:
        sim.load(Scene(objects=objects))
        gripper = sim.robot.gripper
        assert gripper is not None
        assert live(sim).nv_awake == len(sim.robot.dof_indices) + len(gripper.joint_indices)
        assert live(sim).ncon == 0


def test_a_twin_sleeps_too() -> None:
    with open_session(Scene(objects=(box("cube", 0.15, 0.0), box("other", 0.15, 0.2)))) as session:
        twin = backend(session.ctx.twin().driver)
        twin.wait(CALM_SECONDS)
        assert sleeping(twin) == {"cube", "other"}


def leaning_can(beyond: float) -> Pose:
    """A can on a pillar's edge, tilted by so many radians more than balances it there."""
    radius, half, over = 0.02, 0.05, 0.018
    tilt = math.atan2(radius - over, half) + beyond
    c, s = math.cos(tilt), math.sin(tilt)
    x, z = 0.17 + c * (over - radius) + s * half, 0.16 + s * (radius - over) + c * half
    return Pose(xyz=(x, 0.0, z), quat_xyzw=(0.0, math.sin(tilt / 2.0), 0.0, math.cos(tilt / 2.0)))


def test_what_falls_slowly_from_its_balance_does_not_fall_asleep_on_the_way() -> None:
    """Near its balance a can is slower than what sleeps for longer than MuJoCo's ten steps, and falls all the same."""
    pillar = SceneObject(id="pillar", kind="box", size=(0.02, 0.02, 0.06), pose=Pose(xyz=(0.15, 0.0, 0.1)), mass=2.0)
    can = SceneObject(id="can", kind="cylinder", size=(0.02, 0.05), pose=Pose(xyz=(0.15, 0.0, 0.21)), mass=0.1)
    with MuJoCoBackend() as sim:
        sim.load(Scene(objects=(pillar, can)))
        hand, body, steps = Intervention(sim), sim.object_bodies["can"], round(2.5 / sim.model.opt.timestep)

        def falls(beyond: float) -> tuple[bool, bool, bool]:
            """Tell whether it does where nothing may sleep, in this world, and with MuJoCo's own count."""
            sim.reset()
            hand.set_pose("can", leaning_can(beyond))
            bare = mujoco.MjData(sim.model)
            put_state(sim.model, bare, sim.snapshot())
            awake = copy.copy(bare)
            mujoco.mj_step(sim.model, bare, steps)
            for _ in range(steps // MOST_STEPS + 1):
                awake.tree_asleep[:] = moving_count(sim.model)
                mujoco.mj_step(sim.model, awake, MOST_STEPS)
            sim.wait(2.5)
            heights = (awake.xpos[body, 2], sim.truth().objects["can"].pose.xyz[2], bare.xpos[body, 2])
            return heights[0] < 0.14, heights[1] < 0.14, heights[2] < 0.14

        told = {beyond: falls(beyond) for beyond in np.linspace(-0.026, -0.001, 11).tolist()}
    assert {truly for truly, _, _ in told.values()} == {True, False}
    assert all(ours == truly for truly, ours, _ in told.values()), told
    assert any(truly and not bare for truly, _, bare in told.values()), "MuJoCo's own count leaves none hanging"


def test_ticks_longer_than_mujocos_own_count_let_nothing_sleep_sooner() -> None:
    with MuJoCoBackend(control_timestep=0.05) as sim:
        sim.load(Scene(objects=(box("cube", 0.15, 0.0),)))
        assert 0.05 / sim.model.opt.timestep > MOST_STEPS
        Intervention(sim).set_velocity("cube", np.array([0.0, 0.0, 0.3]))
        awake = 0.0
        while "cube" not in sleeping(sim):
            sim.wait(0.05)
            awake += 0.05
        assert CALM_SECONDS < awake < 3.0 * CALM_SECONDS


# What is seen of it.


def assert_balanced(item: ObjectTruth) -> None:
    assert item.touches is not None and item.weight is not None
    total = np.sum([one.force for one in item.touches], axis=0)
    assert np.abs(total - [0.0, 0.0, item.weight]).max() < 0.01 * item.weight, item.id


def test_what_sleeps_is_seen_to_touch_and_to_be_carried(sim: MuJoCoBackend) -> None:
    assert live(sim).ncon == 0
    objects = sim.truth().objects
    assert objects["middle"].contacts == ("high", "low") and objects["low"].contacts == ("middle", "table")
    assert objects["can"].contacts == ("bin",) and set(objects["bin"].contacts) == {"can", "table"}
    for item in objects.values():
        assert_balanced(item)
        assert not item.linear_velocity.any() and not item.angular_velocity.any()


def test_a_sleeping_world_looks_as_the_same_world_awake(sim: MuJoCoBackend) -> None:
    asleep = sim.truth().objects
    with sim.fork() as other:
        other.restore(sim.snapshot()[: integrated_size(sim.model)])
        assert not sleeping(other)
        awake = other.truth().objects
    for name, item in asleep.items():
        assert awake[name].pose == item.pose and awake[name].contacts == item.contacts
        mine, theirs = (np.array([one.force for one in of.touches or ()]) for of in (item, awake[name]))
        assert np.allclose(mine, theirs, atol=1e-3 * (item.weight or 0.0))


def test_a_look_tells_anew_what_has_woken_and_only_that(sim: MuJoCoBackend) -> None:
    before = sim.truth().objects
    assert all(sim.truth().objects[name] is item for name, item in before.items())
    Intervention(sim).set_velocity("far", np.array([0.8, 0.0, 0.0]))
    sim.truth()
    sim.wait(0.01)
    first = sim.truth().objects
    sim.wait(2.0)
    assert "far" in sleeping(sim)
    after = sim.truth().objects
    assert after["far"].pose.position[0] > before["far"].pose.position[0] + 0.005
    assert after["far"].contacts == ("table",) and not after["far"].linear_velocity.any()
    assert_balanced(after["far"])
    assert all(after[name] is item for name, item in first.items() if name != "far")


def test_a_recording_has_the_contacts_of_what_sleeps(sim: MuJoCoBackend) -> None:
    log = sim.log(4)
    log.add()
    Intervention(sim).set_velocity("far", np.array([0.0, 0.0, 0.2]))
    sim.wait(0.02)
    log.add()
    columns = log.take()
    bodies, forces = columns.ragged["contact_bodies"], columns.ragged["contact_force"]
    weight = sum(item.weight or 0.0 for item in sim.truth().objects.values())
    for row in range(2):
        begin, end = forces.offsets[row : row + 2]
        pairs = bodies.values[2 * begin : 2 * end].reshape(-1, 2)
        on_table = [sim.world.names[a] == "table" or sim.world.names[b] == "table" for a, b in pairs]
        flying = sim.world.object_bodies["far"] not in pairs
        assert flying == (row == 1)
        carried = weight - 9.81 * 0.05 * flying
        assert forces.values[begin:end][on_table].sum() == pytest.approx(carried, rel=0.01)


# What wakes it.


def test_what_is_pushed_wakes_and_with_it_what_it_runs_into_but_nothing_else(sim: MuJoCoBackend) -> None:
    Intervention(sim).set_velocity("beside", np.array([0.0, -0.8, 0.0]))
    sim.wait(0.02)
    assert "low" in sleeping(sim)
    sim.wait(0.1)
    assert not {"low", "middle", "high"} & sleeping(sim)
    assert {"far", "ball", "bin", "can", "drawer"} <= sleeping(sim)


def test_what_loses_its_support_falls(sim: MuJoCoBackend) -> None:
    before = height(sim, "high")
    Intervention(sim).set_pose("low", Pose(xyz=(0.15, -0.15, 0.061)))
    assert not {"low", "middle", "high"} & sleeping(sim)
    sim.wait(0.5)
    assert height(sim, "high") == pytest.approx(before - 2.0 * HALF, abs=0.002)


def test_what_a_force_acts_on_wakes_and_moves(sim: MuJoCoBackend) -> None:
    hand = Intervention(sim)
    with hand.state() as data:
        data.xfrc_applied[sim.object_bodies["far"], 2] = 0.6
    sim.wait(0.2)
    assert sim.truth().objects["far"].linear_velocity[2] > 0.2
    assert {"low", "ball", "drawer"} <= sleeping(sim)


def test_a_push_that_is_replayed_wakes_what_it_acts_on(sim: MuJoCoBackend) -> None:
    push = np.zeros((sim.model.nbody, 6))
    push[sim.object_bodies["far"], 2] = 0.6
    for _ in range(20):
        sim.replay(sim.controls, push)
    assert sim.truth().objects["far"].linear_velocity[2] > 0.2


def test_a_drawer_that_is_moved_wakes_with_its_box(sim: MuJoCoBackend) -> None:
    with Intervention(sim).state() as data:
        body = sim.world.parts["drawer"][1]
        data.qpos[sim.model.jnt_qposadr[sim.model.body_jntadr[body]]] += 0.02
    assert "drawer" not in sleeping(sim)


def test_what_the_model_says_anew_of_a_thing_is_felt_after_waking_it() -> None:
    """On a slope of 6 degrees a cube stands by its friction, and slides when there is hardly any."""
    with MuJoCoBackend() as sim:
        sim.load(Scene(objects=(box("cube", 0.15, 0.0),)))
        sim.model.opt.gravity[:] = [1.0, 0.0, -9.8]
        hand = Intervention(sim)
        hand.wake()
        sim.wait(2.0)
        assert sleeping(sim) == {"cube"}
        before = sim.truth().objects["cube"].pose
        sim.model.geom_friction[:, 0] = 0.02
        sim.wait(0.5)
        assert sim.truth().objects["cube"].pose == before
        hand.wake()
        sim.wait(0.5)
        assert sim.truth().objects["cube"].pose.xyz[0] > before.xyz[0] + 0.05


def test_the_arm_wakes_what_it_touches() -> None:
    with open_session("put_in_bin") as session:
        sim = backend(session.driver)
        assert sleeping(sim) == set(sim.object_bodies)
        awake: list[set[str]] = []
        sim.subscribe(lambda: awake.append(set(sim.object_bodies) - sleeping(sim)))
        assert session.run().success
        assert (
            not awake[0] and any("red_cube" in names for names in awake) and any("grey_bin" in names for names in awake)
        )
        sim.wait(4.0 * CALM_SECONDS)
        assert sleeping(sim) == set(sim.object_bodies)
        assert session.judge().success


def test_a_reset_to_other_numbers_is_as_a_new_world(world: MuJoCoBackend) -> None:
    other = Scene(objects=tuple(item.model_copy(update={"mass": item.mass * 1.5}) for item in SCENE.objects))
    world.reset(SCENE)
    world.wait(1.0)
    world.truth()
    world.reset(other)
    world.wait(1.0)
    with MuJoCoBackend() as fresh:
        fresh.load(SCENE)
        fresh.reset(other)
        fresh.wait(1.0)
        assert np.array_equal(fresh.snapshot(), world.snapshot())
        for name, item in fresh.truth().objects.items():
            assert_balanced(world.truth().objects[name])
            assert world.truth().objects[name].touches == item.touches
