"""Sessions: what scripts and commands open."""

from pathlib import Path

import numpy as np
import pytest
from support.forked import told_in_forked_child

import robosandbox
from robosandbox.errors import InputError
from robosandbox.tasks.loader import find_task
from robosandbox.types import Pose, Scene, SceneObject
from robosandbox.workcell.session import open_session


def test_open_session_is_a_name_of_the_package() -> None:
    assert robosandbox.open_session is open_session
    assert set(robosandbox.__all__) <= set(dir(robosandbox))


def test_a_bare_scene_takes_prompts() -> None:
    cube = SceneObject(id="cube", kind="box", size=(0.015, 0.015, 0.015), pose=Pose(xyz=(0.1, 0.0, 0.06)))
    with open_session(Scene(objects=(cube,))) as session:
        assert [item.id for item in session.observe().objects] == ["cube"]
        assert session.run("pick up the cube").success
        assert session.observe().held == "cube"


def test_reset_starts_over_where_the_seed_says() -> None:
    with open_session("pick_cube_scrambled") as session:
        first = session.start.objects["red_cube"].pose
        session.run()
        session.reset()
        assert session.start.objects["red_cube"].pose == first and session.observe().held is None
        session.reset(1)
        assert session.start.objects["red_cube"].pose != first


def test_doing_nothing_fails_every_task() -> None:
    from robosandbox.tasks.loader import bundled_tasks

    for name in bundled_tasks():
        with open_session(name) as session:
            session.driver.wait(0.5)
            assert not session.judge().success, name


def test_start_q_starts_the_arm_there() -> None:
    task = find_task("home")
    with open_session(task) as session:
        np.testing.assert_allclose(session.start.arms["arm"].q, task.start_q, atol=0.02)


@pytest.mark.parametrize(
    ("start_q", "says"), [((0.1,), "has 1 values; panda has 7"), ((9.0,) * 7, "outside the limits of 'joint1'")]
)
def test_start_q_that_does_not_fit_the_robot_is_refused(start_q: tuple[float, ...], says: str) -> None:
    with pytest.raises(InputError, match=says):
        open_session(find_task("home").model_copy(update={"start_q": start_q}))


def test_timeout_ends_the_episode_with_the_world_usable() -> None:
    with open_session("pick_cube_franka") as session:
        assert session.run(timeout=0.5).final_reason == "timed_out"
        assert session.run().success


def test_cancel_stops_within_one_control_tick_and_the_arm_holds() -> None:
    with open_session("pick_cube_franka") as session:
        ticks: list[float] = []

        def cancel_once() -> None:
            ticks.append(session.driver.time)
            if len(ticks) == 50:
                session.ctx.cancel()

        session.driver.subscribe(cancel_once)
        episode = session.run()
        assert episode.final_reason == "cancelled" and len(ticks) == 50
        q = session.driver.state().q
        session.driver.wait(1.0)
        np.testing.assert_allclose(session.driver.state().q, q, atol=0.05)


def test_a_missing_yaml_is_an_input_error() -> None:
    with pytest.raises(InputError, match="no such file"):
        open_session(Path("gone.yaml"))


def test_a_layout_is_the_same_to_the_last_digit_whatever_lay_there_before() -> None:
    # Seeds of this task leave some things out, so each of these is another model.
    with open_session("tower_of_three_from_clutter", seed=123) as session:
        first = session.simulation.snapshot()
        session.reset(5)
        session.reset(123)
        assert session.mujoco.compilations > 1
        assert np.array_equal(session.simulation.snapshot(), first)


@pytest.mark.filterwarnings("ignore:.*fork:DeprecationWarning")
def test_a_picture_in_a_forked_process_says_that_it_was_forked() -> None:
    with open_session("pick_cube_franka") as session:
        camera = next(iter(session.driver.capabilities.cameras))
        session.driver.state([camera])
        told = told_in_forked_child(lambda: session.driver.state([camera]))
    assert told.startswith("RenderingError: OpenGL was used in process") and "'spawn'" in told
