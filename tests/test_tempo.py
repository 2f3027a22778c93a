"""Time-optimal timing, and the tempos that are made of it."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from robosandbox import open_session
from robosandbox.errors import InputError
from robosandbox.motion.time_optimal import optimal_trajectory
from robosandbox.motion.timing import spline, time_path
from robosandbox.skills.primitives.carrying import carry_speed
from robosandbox.skills.primitives.gripping import bearable
from robosandbox.skills.primitives.manipulator import Manipulator
from robosandbox.tasks.loader import find_task
from robosandbox.types import CAREFUL, TEMPOS, Pose, Scene, SceneObject, SkillCall, Timing, find_tempo, share_of

DT = 0.002
VELOCITY, ACCELERATION = np.array([2.0, 1.0, 0.5]), np.array([10.0, 5.0, 3.0])


def random_curves() -> list[np.ndarray]:
    """Return curves through knots far apart, and through knots near each other, as waypoints are."""
    rng = np.random.default_rng(0)
    far = [rng.uniform(-1.0, 1.0, (int(rng.integers(2, 8)), 3)) for _ in range(8)]
    near = [np.cumsum(rng.uniform(-0.1, 0.2, (12, 3)), axis=0) for _ in range(8)]
    return [spline(knots, 401) for knots in far + near]


def test_a_straight_way_takes_the_time_that_is_reckoned_by_hand():
    """Speed up, cruise, slow down: distance / velocity + velocity / acceleration; without a cruise 2 sqrt(distance / acceleration)."""
    for distance, expected in ((2.0, 2.0 / 2.0 + 2.0 / 10.0), (0.1, 2.0 * np.sqrt(0.1 / 10.0))):
        path = np.linspace(0.0, distance, 401)[:, None]
        found = optimal_trajectory(path, np.array([2.0]), np.array([10.0]), DT).duration
        assert found == pytest.approx(expected, rel=0.01, abs=2 * DT)


@pytest.mark.parametrize("smoothing", [0.0, 0.02])
def test_both_limits_are_kept_on_random_curves_and_used(smoothing):
    shares = []
    for path in random_curves():
        trajectory = optimal_trajectory(path, VELOCITY, ACCELERATION, DT, smoothing=smoothing)
        rows = np.concatenate([trajectory.q[:1], trajectory.q, trajectory.q[-1:]])
        speed = np.abs(np.diff(rows, axis=0)) / DT / VELOCITY
        change = np.abs(np.diff(trajectory.q, 2, axis=0)) / DT**2 / ACCELERATION
        assert speed.max() <= 1.002 and change.max() <= 1.002
        assert np.array_equal(trajectory.q[0], path[0]) and np.array_equal(trajectory.q[-1], path[-1])
        # What is optimal has one of the joints at a limit all the time; a little goes for what lies between the samples.
        used = np.maximum(speed[1:-2].max(axis=1), change.max(axis=1))
        assert np.median(used) > 0.65
        shares.append(np.median(used))
        assert trajectory.duration < time_path(path, VELOCITY, ACCELERATION, DT).duration + smoothing + 2 * DT
    assert np.median(shares) > 0.9


def test_it_takes_about_as_long_as_the_library_of_those_who_found_it():
    toppra = pytest.importorskip("toppra")
    from toppra.algorithm import TOPPRA
    from toppra.constraint import JointAccelerationConstraint, JointVelocityConstraint

    toppra.setup_logging("ERROR")
    limits = [
        JointVelocityConstraint(np.stack([-VELOCITY, VELOCITY], axis=1)),
        JointAccelerationConstraint(np.stack([-ACCELERATION, ACCELERATION], axis=1)),
    ]
    grid = np.linspace(0.0, 1.0, 401)
    for path in random_curves():
        way = toppra.SplineInterpolator(grid, path)
        theirs: Any = TOPPRA(limits, way, gridpoints=grid).compute_trajectory(0.0, 0.0)
        ours = optimal_trajectory(path, VELOCITY, ACCELERATION, DT).duration
        assert 0.98 * theirs.duration < ours < 1.1 * theirs.duration + 2 * DT


def test_smoothing_bounds_the_jerk_and_stays_by_the_path():
    smoothing = 0.04
    for path in random_curves():
        rough, smooth = (optimal_trajectory(path, VELOCITY, ACCELERATION, DT, smoothing=s).q for s in (0.0, smoothing))
        jerk = [np.abs(np.diff(np.diff(q, 2, axis=0) / DT**2, axis=0) / DT).max(axis=0) for q in (rough, smooth)]
        assert (jerk[1] <= 2.02 * ACCELERATION / smoothing).all() and (jerk[1] < jerk[0]).all()
        off = max(np.linalg.norm(path - q, axis=1).min() for q in smooth)
        step = np.linalg.norm(np.diff(path, axis=0), axis=1).max()
        assert off <= np.linalg.norm(ACCELERATION) * smoothing**2 / 24.0 + step


def test_a_cap_is_kept_and_costs_no_more_than_it_has_to():
    path = np.linspace(0.0, 1.0, 401)[:, None]
    cap = np.full(401, np.inf)
    cap[360:] = 0.05 * 400
    q = optimal_trajectory(path, np.array([2.0]), np.array([10.0]), DT, cap=cap).q[:, 0]
    speed = np.diff(q) / DT
    assert speed[q[1:] > 0.905].max() <= 0.051 and speed.max() > 1.9
    free = optimal_trajectory(path, np.array([2.0]), np.array([10.0]), DT).duration
    assert (len(q) - 1) * DT < free + 0.1 / 0.05


def test_a_way_that_goes_nowhere_takes_no_time():
    assert optimal_trajectory(np.zeros((5, 3)), VELOCITY, ACCELERATION, DT).duration == 0.0


def test_a_timing_is_scaled_like_a_share():
    assert (0.5 * Timing(share=0.8, arrival=0.1)) == Timing(share=0.4, arrival=0.1) and share_of(0.3) == 0.3


def test_a_pace_that_there_is_not_is_refused():
    with pytest.raises(
        InputError, match=r"--tempo: no tempo 'fsat'; there is careful, brisk, fast; did you mean 'fast'\?"
    ):
        find_tempo("fsat")


def test_each_pace_is_faster_than_the_one_before_it_and_ends_alike():
    taken = []
    for tempo in TEMPOS:
        with open_session("put_in_bin", tempo=tempo) as session:
            start = session.driver.time
            assert session.run().success and session.judge().success
            taken.append(session.driver.time - start)
    assert taken == sorted(taken, reverse=True) and taken[-1] < 0.65 * taken[0]


def test_what_is_tried_on_the_twin_goes_at_the_pace_of_the_world():
    with open_session("pick_cube_franka", tempo="fast") as session:
        assert session.ctx.twin().tempo is session.ctx.tempo is TEMPOS["fast"]


def test_the_last_millimetres_to_a_support_are_slow_and_the_way_there_is_not():
    with open_session("put_in_bin", tempo="fast") as session:
        session.run("pick up the red cube")
        arm = Manipulator(session.ctx)
        arm.use(arm.start, held="red_cube")
        arm.motion.allow("table")
        tcp = session.driver.state().tcp_pose
        rows = arm.motion.plan_line(
            arm.q, type(tcp)(xyz=(*tcp.xyz[:2], tcp.xyz[2] - 0.1), quat_xyzw=tcp.quat_xyzw), speed=arm.tempo.lower
        )
        heights = np.array([arm.motion.forward(q).xyz[2] for q in rows.q])
        speed = np.abs(np.diff(heights)) / rows.dt
        lower = arm.tempo.lower
        assert isinstance(lower, Timing)
        last = heights[1:] - heights[-1] < lower.near - 0.001
        assert speed[last].max() <= 1.1 * lower.arrival < 0.3 * speed.max()
        assert 0.9 * lower.most < speed.max() <= 1.02 * lower.most


def test_what_is_heavy_for_the_grip_is_carried_slower_and_a_light_thing_is_not():
    shares = []
    for mass in (0.05, 0.8, 1.6):
        task = find_task("pick_cube_franka")
        objects = [item.model_copy(update={"mass": mass}) for item in task.scene.objects]
        task = task.model_copy(update={"scene": task.scene.model_copy(update={"objects": objects})})
        with open_session(task, tempo="fast") as session:
            assert session.run().success
            arm = Manipulator(session.ctx)
            shares.append(bearable(arm, arm.held, Timing(share=1.0)).share)
    assert shares[0] > shares[1] > shares[2] >= CAREFUL.carry and shares[0] > 0.9


def test_what_is_nearly_too_heavy_to_carry_is_put_down_within_the_limit_of_force():
    box = SceneObject(id="box", kind="box", size=(0.02, 0.03, 0.03), pose=Pose(xyz=(0.1, -0.1, 0.071)), mass=4.6)
    with open_session(Scene(objects=(box,)), what_if=False) as session:
        pressed: list[float] = []
        session.driver.subscribe(lambda: pressed.append(float(np.linalg.norm(session.driver.senses.force_on("box")))))
        assert session.run("pick up the box").success
        pressed.clear()
        session.agent.perform(SkillCall(skill="place_at", arguments={"x": 0.15, "y": 0.1}))
        assert 0.9 * 4.6 * 9.81 < max(pressed) < 60.0


def test_a_full_cup_is_carried_as_carefully_as_ever():
    with open_session("pour_beads", tempo="fast") as session:
        assert session.run("pick up the cup").success
        arm = Manipulator(session.ctx)
        assert carry_speed(arm, arm.held, arm.start, arm.tempo.carry) == CAREFUL.carry
        assert arm.tempo.carry != CAREFUL.carry
