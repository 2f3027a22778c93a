"""Sleep in copies: a saved state tells who sleeps, and every copy of a world goes on as the world does."""

from __future__ import annotations

import math
from collections.abc import Iterator

import mujoco
import numpy as np
import pytest
from support.asleep import SCENE, live, sleeping
from support.behind import backend

from robosandbox import open_session
from robosandbox.errors import InputError
from robosandbox.sim.intervention import Intervention
from robosandbox.sim.mujoco_backend import MuJoCoBackend
from robosandbox.sim.saved_state import integrated_size, put_state
from robosandbox.sim.sleep_timer import CALM_SECONDS, moving_count
from robosandbox.sim.state_check import check_state
from robosandbox.types import Array

# What MuJoCo derives of who sleeps.
DERIVED = ("tree_awake", "body_awake")
LISTS = (("body_awake_ind", "nbody_awake"), ("parent_awake_ind", "nparent_awake"), ("dof_awake_ind", "nv_awake"))


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


def assert_same_sleepers(one: mujoco.MjData, other: mujoco.MjData) -> None:
    for name in DERIVED:
        assert np.array_equal(getattr(one, name), getattr(other, name)), name
    for name, count in LISTS:
        size = getattr(one, count)
        assert size == getattr(other, count), count
        assert np.array_equal(getattr(one, name)[:size], getattr(other, name)[:size]), name


def test_a_copy_has_the_sleepers_of_its_world_as_mujoco_lists_them(sim: MuJoCoBackend) -> None:
    hand = Intervention(sim)
    for name in ("far", "high", "can"):
        with sim.fork() as other:
            assert_same_sleepers(live(sim), live(other))
            assert np.array_equal(sim.snapshot(), other.snapshot())
        hand.set_velocity(name, np.array([0.0, 0.1, 0.1]))
        sim.wait(0.01)


@pytest.mark.parametrize(
    ("task", "seed"),
    [("stack_three", 0), ("put_in_drawer", 1), pytest.param("pour_beads", 0, marks=pytest.mark.slow), ("push_left", 2)],
)
def test_a_copy_made_in_mid_episode_goes_on_to_the_last_bit(task: str, seed: int) -> None:
    rng = np.random.default_rng(seed)
    with open_session(task, seed=seed) as session:
        sim = backend(session.driver)
        controls: list[Array] = []
        states: list[Array] = []
        counts: list[int] = []

        def listen() -> None:
            controls.append(sim.controls.copy())
            states.append(sim.snapshot())
            counts.append(int((live(sim).tree_asleep >= 0).sum()))

        end = sim.subscribe(listen)
        assert session.run().success
        end()
        ticks = len(states)
        # Where somebody sleeps who is awake later, and the other way round.
        changes = np.flatnonzero(np.diff(counts))
        assert max(counts) > 0 and len(changes) >= 2
        begins = {*rng.integers(0, ticks - 1, 4).tolist(), *(max(0, k - 20) for k in rng.choice(changes, 4).tolist())}
        with sim.fork() as copy:
            for begin in begins:
                copy.restore(states[begin])
                assert np.array_equal(copy.snapshot(), states[begin])
                last = min(ticks - 1, begin + 300)
                for tick in range(begin + 1, last + 1):
                    copy.replay(controls[tick])
                    assert np.array_equal(copy.snapshot(), states[tick]), (begin, tick)


def test_a_state_from_before_bodies_slept_is_one_in_which_all_are_awake(sim: MuJoCoBackend) -> None:
    state = sim.snapshot()[: integrated_size(sim.model)]
    check_state(sim.model, state, robot="robot")
    with sim.fork() as other:
        other.resume(SCENE, state, 0)
        assert not sleeping(other)
        assert np.array_equal(other.snapshot()[: len(state)], state)


def test_what_is_only_shown_has_all_contacts(sim: MuJoCoBackend) -> None:
    data = mujoco.MjData(sim.model)
    put_state(sim.model, data, sim.snapshot())
    mujoco.mj_forward(sim.model, data)
    assert data.ncon >= 4 * 5


@pytest.mark.parametrize("damage", ["half", "no number", "no ring", "out of range", "the robot", "too early"])
def test_a_saved_state_whose_sleepers_do_not_fit_together_is_refused(sim: MuJoCoBackend, damage: str) -> None:
    state = sim.snapshot()
    asleep = state[integrated_size(sim.model) :]
    far = int(sim.model.body_treeid[sim.object_bodies["far"]])
    low = int(sim.model.body_treeid[sim.object_bodies["low"]])
    robot = int(sim.model.body_treeid[max(sim.robot.bodies)])
    where, value = {
        "half": (far, far + 0.5),
        "no number": (far, math.nan),
        "no ring": (far, low),
        "out of range": (far, 10**6),
        "the robot": (robot, robot),
        "too early": (far, moving_count(sim.model) - 1),
    }[damage]
    check_state(sim.model, state, robot="robot")
    asleep[where] = value
    with pytest.raises(InputError, match="which bodies sleep"):
        check_state(sim.model, state, robot="robot")
