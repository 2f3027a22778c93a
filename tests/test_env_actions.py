"""What an environment makes of actions that no space of it holds."""

from __future__ import annotations

import contextlib
from itertools import product

import mujoco
import numpy as np
import pytest
from gymnasium.error import ResetNeeded

from robosandbox.apps.envs import ManipulationEnv
from robosandbox.errors import InputError
from robosandbox.robots.kinematics import Kinematics
from robosandbox.types import MAX_UNINTENDED_FORCE_N, matrix_from_rotation_vector


def test_an_action_of_another_shape_or_not_finite_is_told_and_moves_nothing() -> None:
    with contextlib.closing(ManipulationEnv("home")) as env:
        env.reset(seed=0)
        before = env.session.state().q.copy()
        with pytest.raises(InputError, match=r"action: has shape \(3,\); ee actions have shape \(7,\)"):
            env.step(np.zeros(3))
        with pytest.raises(InputError, match=r"action: .*nan.* not finite"):
            env.step(np.full(7, np.nan))
        assert np.array_equal(env.session.state().q, before)


def test_a_step_before_the_first_reset_is_told() -> None:
    with contextlib.closing(ManipulationEnv("home")) as env:
        with pytest.raises(ResetNeeded, match=r"call reset\(\) first"):
            env.step(np.zeros(7))
        env.reset(seed=0)
        env.step(np.zeros(7))


@pytest.mark.parametrize("rate", [20.0, 30.0])
@pytest.mark.parametrize("kind", ["ee", "joint"])
def test_random_actions_press_on_nothing_harder_than_allowed_and_are_all_carried_out(kind: str, rate: float) -> None:
    """Without a look ahead three of four such episodes press on the table with 170 to 7,000 N."""
    with contextlib.closing(ManipulationEnv("pick_cube_franka", action=kind, control_hz=rate)) as env:
        most, went = 0.0, 0.0

        def feel() -> None:
            nonlocal most
            most = max(most, env.session.driver.senses.strongest_contact("arm")[0])

        env.session.driver.subscribe(feel)
        for seed in range(4):
            env.reset(seed=seed)
            draws = np.random.default_rng(seed)
            q = env.session.state().q
            for step in range(round(8.0 * rate)):
                if step % round(0.5 * rate) == 0:
                    action = draws.uniform(-1.0, 1.0, env.action_space.shape)
                *_, ended, _, info = env.step(action.astype(np.float32))
                assert "stopped" not in info, info
                q, before = env.session.state().q, q
                went += float(np.abs(q - before).sum())
                if ended:
                    break
        assert most <= 1.1 * MAX_UNINTENDED_FORCE_N
        assert went / (4 * 8.0) > 4.0, "rad/s of all joints: it is slowed down where something is near alone"


def test_a_hand_that_is_sent_down_on_a_cube_does_not_press_it_on_the_table() -> None:
    with contextlib.closing(ManipulationEnv("pick_cube_franka", action="ee")) as env:
        env.reset(seed=0)
        (cube,) = env.session.simulation.truth().objects.values()
        most = 0.0

        def feel() -> None:
            nonlocal most
            most = max(most, env.session.driver.senses.strongest_contact("arm")[0])

        env.session.driver.subscribe(feel)
        for height in (0.15, -0.05):
            for _ in range(80):
                off = (cube.pose.position + [0.0, 0.0, height] - env.session.state().tcp_pose.position) / 0.02
                *_, info = env.step(np.array([*np.clip(off, -1.0, 1.0), 0.0, 0.0, 0.0, 1.0], np.float32))
                assert "stopped" not in info, info
        # Closed fingers came down on it, at 0.4 m/s but for the last.
        assert 1.0 < most <= 1.1 * MAX_UNINTENDED_FORCE_N


def test_the_distance_of_a_finger_to_an_edge_is_told_before_it_is_there() -> None:
    """Contacts of two boxes, which fingers and table are, come late at an edge."""
    with contextlib.closing(ManipulationEnv("home")) as env:
        env.reset(seed=0)
        world, arm = env.session.simulation, env.session.driver.arms["arm"]
        model, data = world.model, mujoco.MjData(world.model)
        box = np.asarray(model.geom_type) == mujoco.mjtGeom.mjGEOM_BOX
        ours = np.asarray([model.body(body).name.startswith("robot/") for body in model.geom_bodyid])
        stands = [int(geom) for geom in np.flatnonzero(box & ~ours) if model.geom_contype[geom]]
        fingers = [int(geom) for geom in np.flatnonzero(box & ours) if model.geom_contype[geom]]
        solver, ahead, draws = (
            Kinematics.of(model, world.robots["arm"]),
            world.lookahead("arm"),
            np.random.default_rng(0),
        )
        near = 0
        for _ in range(300):
            # Tilted, about the front edge.
            turn = matrix_from_rotation_vector(draws.uniform(-1.0, 1.0, 3)) @ arm.state().tcp_pose.rotation
            found = solver.descend(
                np.array([*draws.uniform([0.45, -0.3], [0.53, 0.3]), draws.uniform(0.0, 0.07)]), turn, arm.spec.home_q
            )
            data.qpos[:] = model.qpos0
            data.qpos[world.robots["arm"].qpos_indices] = found.q
            mujoco.mj_kinematics(model, data)
            least = min(mujoco.mj_geomDistance(model, data, *pair, 0.05, None) for pair in product(fingers, stands))
            if 0.0 < least < 0.05:
                near += 1
                assert ahead.distances(found.q).others < least + 1e-6
        assert near > 30


def test_fingers_of_a_leaning_hand_that_close_onto_the_table_do_not_press_it() -> None:
    """Commands of seed 24 closed them onto it with 59 N, from 7 mm over it."""
    with contextlib.closing(ManipulationEnv("pick_cube_franka", action="ee")) as env:
        env.reset(seed=24)
        draws, most = np.random.default_rng(24), 0.0
        action = draws.uniform(-1.0, 1.0, env.action_space.shape)

        def feel() -> None:
            nonlocal most
            most = max(most, env.session.driver.senses.strongest_contact("arm")[0])

        env.session.driver.subscribe(feel)
        for step in range(300):
            if step % 10 == 0:
                action = draws.uniform(-1.0, 1.0, env.action_space.shape)
            *_, info = env.step(action.astype(np.float32))
            assert "stopped" not in info, info
        assert 0.0 < most < 20.0
