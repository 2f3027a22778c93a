"""The safe face of every driver: clamps, watchdogs, stops that are seen to the end; each with value, limit and message."""

from __future__ import annotations

import contextlib
import gc
import os
import struct
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Final, cast

import numpy as np
import pytest

from robosandbox.apps.conformance import check_driver
from robosandbox.driver import (
    BareArm,
    BareDriver,
    BareHand,
    Capabilities,
    Guard,
    SafeDriver,
    load_driver,
    made_safe,
    per_tick,
    simulated,
)
from robosandbox.driver.clamps import TOLERANCES
from robosandbox.driver.stop_switch import StopSwitch
from robosandbox.drivers.hardware import Hardware
from robosandbox.errors import FaultError, InputError, LimitError, UnsupportedError
from robosandbox.evidence import LimitEvidence
from robosandbox.motion.planning_scene import PlanningScenes
from robosandbox.motion.time_optimal import optimal_trajectory
from robosandbox.types import (
    ArmState,
    Array,
    GripperState,
    Limits,
    ObservedScene,
    Pose,
    Scene,
    SceneObject,
    Trajectory,
    Workspace,
    frozen_array,
)
from robosandbox.types.robot import GripperSpec, RobotSpec
from robosandbox.workcell.session import open_session


class Arrays(BareDriver):
    """Somebody's driver over arrays: joints that go where they are sent, and slow down as a servo does when they are stopped.

    Args:
        clock: As in `Capabilities`.
        link_timeout: Likewise.
        lag: Seconds in which the speed falls to 1/e after a stop.
    """

    episode: Final = 0
    control_timestep: float = 0.01

    def __init__(
        self,
        *,
        clock: str = "simulated",
        link_timeout: float | None = None,
        lag: float = 0.02,
        limits: Limits | None = None,
    ) -> None:
        super().__init__()
        planning = PlanningScenes(Scene()).of(
            ObservedScene(time=0.0, objects=(), table_height=0.04, base_xy=(0.0, 0.0))
        )
        self.spec = replace(planning.robot.spec, limits=limits)
        self.kinematics = planning.kinematics()
        assert self.spec.gripper is not None
        self.arms, self.hands = {"arm": ArraysArm(self, self.spec)}, {"hand": ArraysHand(self, self.spec.gripper)}
        self._has = Capabilities(clock=clock, link_timeout=link_timeout)  # type: ignore[arg-type]
        self._lag = lag
        self._ticks, self.heard = 0, 0.0
        self.q, self.qd = self.spec.home_q.copy(), np.zeros(self.spec.n)
        self.gripper: list[float] = []
        # What happens in a tick besides; the driver's user knows nothing of it.
        self.linked, self.slow_tick = True, -1

    @property
    def capabilities(self) -> Capabilities:
        return self._has

    @property
    def time(self) -> float:
        return self._ticks * self.control_timestep

    def wait(self, seconds: float, guards: Sequence[Guard] = ()) -> None:
        for _ in range(max(1, round(seconds / self.control_timestep))):
            self.qd = self.qd * np.exp(-self.control_timestep / self._lag)
            self.q = self.q + self.qd * self.control_timestep
            self.tick(guards)

    def close(self) -> None:
        self._loop.close()

    def tick(self, guards: Sequence[Guard]) -> None:
        self._ticks += 1
        if self.linked:
            self.heard = self.time
        if self._ticks == self.slow_tick:
            # The host is busy with something else: this is what is watched, nobody waits for it.
            end = time.monotonic() + 0.3
            while time.monotonic() < end:
                pass
        self._ticked(guards)


class ArraysArm(BareArm):
    def __init__(self, cell: Arrays, spec: RobotSpec) -> None:
        super().__init__(cell, spec)
        self._cell = cell

    def state(self) -> ArmState:
        cell = self._cell
        return ArmState(
            time=cell.heard,
            q=frozen_array(cell.q),
            qd=frozen_array(cell.qd),
            tcp_pose=Pose.from_matrix(*cell.kinematics.forward(cell.q)),
            gripper=cell.hands["hand"].state(),
        )

    def follow(self, trajectory: Trajectory, guards: Sequence[Guard] = ()) -> None:
        cell = self._cell
        for row in per_tick(trajectory, cell.control_timestep):
            cell.qd, cell.q = (row - cell.q) / cell.control_timestep, row
            cell.tick(guards)
        cell.qd = np.zeros(cell.spec.n)

    def trim(self, goal: Array, guards: Sequence[Guard] = ()) -> None:
        self.follow(Trajectory(q=np.array([self._cell.q, goal]), dt=self._cell.control_timestep), guards)

    def stop(self) -> None:
        pass


class ArraysHand(BareHand):
    def __init__(self, cell: Arrays, spec: GripperSpec) -> None:
        super().__init__(cell, spec)
        self._cell = cell

    def state(self) -> GripperState:
        closed, geometry = self._cell.gripper[-1] if self._cell.gripper else 0.0, self.spec.geometry
        joint = geometry.open_joint + closed * (geometry.closed_joint - geometry.open_joint)
        return GripperState(joint=joint, width=geometry.aperture(joint), closed=closed, force=None, commanded=closed)

    def set_gripper(self, closed: float, force: float | None = None) -> None:
        if not 0.0 <= closed <= 1.0:
            raise ValueError(f"closed is {closed}")
        if force is not None:
            raise UnsupportedError("grip_limit: it takes none")
        self._cell.gripper.append(closed)


@pytest.fixture(params=["mujoco", "hardware", "outsider"])
def driver(request: pytest.FixtureRequest) -> Iterator[SafeDriver]:
    with made_safe(Arrays()) if request.param == "outsider" else load_driver(request.param, Scene()) as opened:
        yield opened


def moved(spec: RobotSpec, q: Array, joint: int, by: float) -> Array:
    goal: Array = q.copy()
    goal[joint] += by
    return goal


def timed(spec: RobotSpec, q: Array, goal: Array, share: float = 1.0) -> Trajectory:
    """Return the fastest straight way within a share of the limits."""
    limits = share * spec.velocity_limits, share**2 * spec.acceleration_limits
    return optimal_trajectory(np.linspace(q, goal, 200), *limits, 0.01)


def limit_of(error: LimitError | FaultError) -> tuple[float, float, float]:
    assert isinstance(error.evidence, LimitEvidence)
    return error.evidence.value, error.evidence.low, error.evidence.high


def is_still(driver: SafeDriver, q: Array, before: float) -> bool:
    """Tell whether no time has passed and the arm is where it was, to its encoders' noise."""
    return driver.time == before and float(np.abs(driver.state().q - q).max()) < 2e-3


# Clamps.


def test_a_trajectory_within_the_limits_is_followed(driver: SafeDriver) -> None:
    q = driver.state().q
    goal = moved(driver.arms["arm"].spec, q, 0, 0.8)
    driver.arms["arm"].follow(timed(driver.arms["arm"].spec, q, goal))
    driver.wait(0.5)
    assert np.abs(driver.state().q - goal).max() < 0.01 and driver.safety.mode == "ready"


def test_a_trajectory_over_a_speed_limit_is_refused_before_anything_moves(driver: SafeDriver) -> None:
    q, spec, before = driver.state().q, driver.arms["arm"].spec, driver.time
    fast = timed(spec, q, moved(spec, q, 0, 0.8), 1.5)
    with pytest.raises(
        LimitError, match=r"would move at 3\.\d+ rad/s .* its limit is 2\.17.*nothing has moved"
    ) as caught:
        driver.arms["arm"].follow(fast)
    value, _, most = limit_of(caught.value)
    assert most == spec.velocity_limits[0] and value > 1.4 * most and is_still(driver, q, before)
    assert spec.joints[0] in caught.value.message


def test_a_trajectory_that_speeds_up_too_fast_is_refused_before_anything_moves(driver: SafeDriver) -> None:
    q, spec, before = driver.state().q, driver.arms["arm"].spec, driver.time
    goal = moved(spec, q, 0, 0.4)
    jerky = optimal_trajectory(np.linspace(q, goal, 200), spec.velocity_limits, 3.0 * spec.acceleration_limits, 0.01)
    with pytest.raises(LimitError, match=r"would accelerate by .* its limit is 15.*nothing has moved") as caught:
        driver.arms["arm"].follow(jerky)
    value, _, most = limit_of(caught.value)
    assert most == spec.acceleration_limits[0] and value > 2.0 * most and is_still(driver, q, before)


def test_a_trajectory_over_a_joints_limit_is_refused_before_anything_moves(driver: SafeDriver) -> None:
    q, spec, before = driver.state().q, driver.arms["arm"].spec, driver.time
    goal = q.copy()
    goal[3] = spec.upper[3] + 0.002
    with pytest.raises(
        LimitError, match=f"{spec.joints[3]} would be at .* its limits are .*nothing has moved"
    ) as caught:
        driver.arms["arm"].follow(timed(spec, q, goal, 0.5))
    value, low, high = limit_of(caught.value)
    assert (value, low, high) == pytest.approx((goal[3], spec.lower[3], spec.upper[3]))
    assert is_still(driver, q, before)


def test_a_command_that_begins_elsewhere_is_refused_before_anything_moves(driver: SafeDriver) -> None:
    q, spec, before = driver.state().q, driver.arms["arm"].spec, driver.time
    elsewhere = moved(spec, q, 0, 0.3)
    with pytest.raises(LimitError, match=r"the trajectory begins at .* begin where the arm stands") as caught:
        driver.arms["arm"].follow(timed(spec, elsewhere, moved(spec, q, 0, 0.5)))
    value, _, most = limit_of(caught.value)
    assert value == pytest.approx(0.3, abs=2e-3) and most == pytest.approx(0.05 * 2.175, rel=0.02)
    with pytest.raises(LimitError, match="the goal is at"):
        driver.arms["arm"].trim(elsewhere)
    assert is_still(driver, q, before)


def test_streamed_commands_within_the_limits_are_followed_and_one_past_a_joints_limit_is_not(
    driver: SafeDriver,
) -> None:
    spec, goal = driver.arms["arm"].spec, driver.state().q.copy()
    for _ in range(20):
        goal = moved(spec, goal, 0, 0.005)
        driver.arms["arm"].trim(goal)
    past = goal.copy()
    past[3] = spec.upper[3] + 0.1
    with pytest.raises(LimitError, match="its limits are"):
        driver.arms["arm"].trim(past)


def cruise(spec: RobotSpec, q: Array, *, goes_on: bool) -> Trajectory:
    """Return a way of the first joint that speeds up within its limits and is at 1 rad/s where it ends."""
    rate, tick = 0.5 * spec.acceleration_limits[0], 0.01
    seconds = np.arange(0.0, 1.0 / rate + 0.5 * tick, tick)
    return Trajectory(q=q + 0.5 * rate * seconds[:, None] ** 2 * np.eye(spec.n)[0], dt=tick, goes_on=goes_on)


def test_a_trajectory_that_ends_at_a_speed_is_refused_unless_it_goes_on(driver: SafeDriver) -> None:
    q, spec, before = driver.state().q, driver.arms["arm"].spec, driver.time
    with pytest.raises(
        LimitError, match=r"would accelerate by .* where it ends, at a speed.*nothing has moved"
    ) as caught:
        driver.arms["arm"].follow(cruise(spec, q, goes_on=False))
    value, _, most = limit_of(caught.value)
    assert most == spec.acceleration_limits[0] and value > most and is_still(driver, q, before)
    driver.arms["arm"].follow(cruise(spec, q, goes_on=True))


def test_a_trajectory_that_begins_at_another_speed_than_the_last_ended_at_is_refused(driver: SafeDriver) -> None:
    spec, arm = driver.arms["arm"].spec, driver.arms["arm"]
    way = cruise(spec, driver.state().q, goes_on=True)
    arm.follow(way)
    ends, before = way.q[-1], driver.time
    back = Trajectory(q=np.linspace(ends, moved(spec, ends, 0, -0.1), 11), dt=0.01, goes_on=True)
    with pytest.raises(LimitError, match=r"would accelerate by .* where it begins, and its limit is 15") as caught:
        arm.follow(back)
    value, _, most = limit_of(caught.value)
    # From 1 rad/s to -1 in a window of 50 ms.
    assert value == pytest.approx(2.0 / TOLERANCES.window, rel=0.2) and most == spec.acceleration_limits[0]
    assert driver.time == before
    arm.follow(Trajectory(q=np.linspace(ends, moved(spec, ends, 0, 0.1), 11), dt=0.01, goes_on=True))


def test_an_arm_that_was_to_go_on_and_does_not_brakes_within_its_limits(driver: SafeDriver) -> None:
    arm, spec = driver.arms["arm"], driver.arms["arm"].spec
    way = cruise(spec, driver.state().q, goes_on=True)
    arm.follow(way)
    driver.wait(1.0)
    came = float(arm.state().q[0] - way.q[-1, 0])
    # v^2 / 2a from 1 rad/s.
    assert came == pytest.approx(1.0 / (2.0 * spec.acceleration_limits[0]), abs=0.01)
    assert float(np.abs(driver.state().qd).max()) < TOLERANCES.still and driver.safety.mode == "ready"


@pytest.mark.parametrize("wrong", [np.nan, np.inf])
def test_what_is_no_number_is_refused(driver: SafeDriver, wrong: float) -> None:
    q, before = driver.state().q, driver.time
    with pytest.raises(ValueError, match="not finite"):
        driver.arms["arm"].follow(Trajectory(q=np.array([q, moved(driver.arms["arm"].spec, q, 0, wrong)]), dt=0.01))
    with pytest.raises(ValueError, match=r"shape \(1, 3\)"):
        driver.arms["arm"].follow(Trajectory(q=np.zeros((1, 3)), dt=0.01))
    assert is_still(driver, q, before)


def test_nothing_moves_where_it_is_not_measured_where_the_arm_is() -> None:
    inner = Arrays()
    driver, q = made_safe(inner), inner.q.copy()
    inner.q[1] = np.nan
    with pytest.raises(FaultError, match="is measured to be at nan"):
        driver.arms["arm"].follow(Trajectory(q=np.tile(moved(inner.spec, q, 0, 1.5), (20, 1)), dt=0.01))
    assert driver.time == 0.0


def test_an_arm_that_stands_outside_its_limits_may_come_in() -> None:
    inner = Arrays()
    inner.q[3] = inner.spec.upper[3] + 0.05
    driver, q = made_safe(inner), inner.q.copy()
    with pytest.raises(LimitError, match="its limits are"):
        driver.arms["arm"].follow(timed(driver.arms["arm"].spec, q, moved(driver.arms["arm"].spec, q, 3, 0.02), 0.5))
    driver.arms["arm"].follow(timed(driver.arms["arm"].spec, q, moved(driver.arms["arm"].spec, q, 3, -0.2), 0.5))
    assert driver.state().q[3] < driver.arms["arm"].spec.upper[3]


# Place, without an agent.


def test_the_arm_stops_at_the_border_of_the_workspace_without_an_agent(driver: SafeDriver) -> None:
    q, at = driver.state().q, driver.state().tcp_pose.position
    driver.safety.limit(Limits(workspace=Workspace(y=(at[1] - 0.15, at[1] + 0.15))))
    with pytest.raises(LimitError, match=r"link6 is at y = .* outside the workspace's .*") as caught:
        driver.arms["arm"].follow(timed(driver.arms["arm"].spec, q, moved(driver.arms["arm"].spec, q, 0, 1.0), 0.5))
    value, _, high = limit_of(caught.value)
    # 10 mm are let pass, and a tick at the speed of the way.
    assert high + 0.009 < value < high + 0.03
    driver.wait(driver.safety.stop_deadline)
    assert driver.safety.mode == "stopped"
    assert driver.safety.stopped_after is not None and driver.safety.stopped_after < driver.safety.stop_deadline
    assert abs(driver.state().tcp_pose.position[1] - at[1]) < 0.12
    here = driver.state().q
    driver.arms["arm"].follow(timed(driver.arms["arm"].spec, here, moved(driver.arms["arm"].spec, here, 0, -0.1), 0.5))


def test_the_robots_own_workspace_holds_from_the_opening_on() -> None:
    at = Arrays().state().tcp_pose.position
    own = Limits(workspace=Workspace(y=(at[1] - 0.05, at[1] + 0.05)))
    driver = made_safe(Arrays(limits=own))
    q = driver.state().q
    with pytest.raises(LimitError, match="outside the workspace's"):
        driver.arms["arm"].follow(timed(driver.arms["arm"].spec, q, moved(driver.arms["arm"].spec, q, 0, -1.0), 0.5))


# Force, without an agent.


# Under the hand at home, and too heavy to be pushed away; its top is at 0.10 m.
ANVIL = SceneObject(id="anvil", kind="box", size=(0.06, 0.06, 0.03), pose=Pose(xyz=(0.255, 0.0, 0.07)), mass=50.0)


def way_down(driver: SafeDriver, end: float, speed: float) -> Trajectory:
    """Return a straight way of the TCP down to a height, metres, at so many metres a second."""
    planning = PlanningScenes(Scene()).of(ObservedScene(time=0.0, objects=(), table_height=0.04, base_xy=(0.0, 0.0)))
    kinematics, start, rows = planning.kinematics(), driver.state().tcp_pose, [driver.state().q]
    for height in np.linspace(start.xyz[2], end, 60)[1:]:
        rows.append(kinematics.descend(np.array([*start.xyz[:2], height]), start.rotation, rows[-1]).q)
    return Trajectory(q=np.array(rows), dt=(start.xyz[2] - end) / speed / 60)


@pytest.mark.parametrize(
    ("name", "options", "most"), [("mujoco", {}, 40.0), ("hardware", {"wrist_wrench": True}, 60.0)]
)
def test_a_press_is_stopped_without_an_agent(name: str, options: Mapping[str, bool], most: float) -> None:
    with load_driver(name, Scene(objects=(ANVIL,)), options) as driver:
        gripper, peak = driver.arms["arm"].spec.gripper, [0.0]
        assert gripper is not None and abs(driver.state().tcp_pose.position[0] - 0.255) < 0.05
        surface = 0.10 + gripper.geometry.tip_depth
        driver.hands["hand"].set_gripper(1.0)
        driver.arms["arm"].follow(way_down(driver, surface + 0.003, 0.05))
        driver.wait(0.5)
        driver.subscribe(lambda: peak.append(max(map(np.linalg.norm, _forces(driver)), default=0.0)))
        with pytest.raises(LimitError, match=f"the robot presses on .* allows {most:g}") as caught:
            driver.arms["arm"].follow(way_down(driver, surface - 0.01, 0.005))
        # What commands take effect late runs on, and is told of again.
        with contextlib.suppress(LimitError):
            driver.wait(0.3)
        assert limit_of(caught.value)[2] == most and 0.5 * most < max(peak) < 1.2 * most


def test_no_link_leaves_the_workspace_while_the_tool_stays_in_it(driver: SafeDriver) -> None:
    arm = driver.arms["arm"]
    # Sideways with the shoulder, and back with the joint behind it: the elbow goes out, the hand stays.
    q, spec = arm.state().q, arm.spec
    bent = q + np.array([0.0, 0.38, 0.0, -0.98, 0.0, -0.4, 0.6])
    arm.follow(timed(spec, q, bent, 0.5))
    driver.safety.limit(Limits(workspace=Workspace(y=(-0.2, 0.2))))
    here = arm.state().q
    out = here + np.array([1.65, 0.26, -1.76, -0.35, 0.0, 0.0, 0.0])
    with pytest.raises(LimitError, match=r"link\d is at y = -?0\.\d+ m, outside the workspace's -0.2..0.2") as caught:
        arm.follow(timed(spec, here, out, 0.5))
    assert 0.21 < abs(limit_of(caught.value)[0]) < 0.23, "stopped at the line, and not where it was going"
    assert abs(arm.state().tcp_pose.position[1]) < 0.2
    driver.wait(1.0)
    assert driver.mode == "stopped"
    # Back in is allowed.
    now = arm.state().q
    arm.follow(timed(spec, now, here, 0.5))


def _forces(driver: SafeDriver) -> list[Array]:
    return list(driver.senses.forces().values()) if driver.capabilities.contact else [driver.senses.force_on(None)]


def test_what_is_not_protected_is_said() -> None:
    with load_driver("hardware", Scene()) as numb, load_driver("mujoco", Scene()) as feels:
        assert [text.partition(":")[0] for text in numb.safety.unprotected] == ["force", "sliding", "workspace"]
        assert [text.partition(":")[0] for text in feels.safety.unprotected] == ["workspace"]
    on_wall = made_safe(Arrays(clock="wall")).safety.unprotected
    assert on_wall[-1].startswith("link: the driver of panda does not tell the age of its state")


def test_a_limit_of_force_that_a_numb_driver_cannot_keep_is_refused_at_its_opening() -> None:
    with pytest.raises(UnsupportedError, match=r"limits\.max_force_n, 20 N"):
        made_safe(Arrays(limits=Limits(max_force_n=20.0)))


# Stops.


class _Enough(Exception):
    pass


def broken_off(driver: SafeDriver) -> None:
    """Have the arm stop at its full speed."""
    q, ticks = driver.state().q, [0]
    way = timed(driver.arms["arm"].spec, q, moved(driver.arms["arm"].spec, q, 0, 1.2))

    def guard() -> Exception | None:
        ticks[0] += 1
        return _Enough() if ticks[0] * driver.control_timestep > 0.5 * way.duration else None

    with pytest.raises(_Enough):
        driver.arms["arm"].follow(way, (guard,))


def test_an_arm_that_is_stopped_at_full_speed_is_seen_to_stand_in_time(driver: SafeDriver) -> None:
    broken_off(driver)
    assert driver.safety.mode == "stopping" and np.abs(driver.state().qd).max() > 1.5
    driver.wait(driver.safety.stop_deadline)
    assert driver.safety.mode == "stopped" and np.abs(driver.state().qd).max() < TOLERANCES.still
    assert driver.safety.stopped_after is not None and driver.safety.stopped_after < 0.5
    assert driver.safety.stop_deadline == pytest.approx(3.0 * 2.175 / 7.5)


def test_an_arm_that_does_not_stand_after_a_stop_is_a_fault_and_moves_no_more_before_it_is_recovered() -> None:
    driver = made_safe(Arrays(lag=1.0))
    broken_off(driver)
    with pytest.raises(FaultError, match=r"told to stop 0\.8[78] s ago and moves at .* within 0\.87 s") as caught:
        driver.wait(2.0)
    value, _, most = limit_of(caught.value)
    assert value > most == TOLERANCES.still and driver.safety.mode == "fault"
    q = driver.state().q
    for command in (
        lambda: driver.arms["arm"].follow(Trajectory(q=q[None], dt=0.01)),
        lambda: driver.arms["arm"].trim(q),
        lambda: driver.hands["hand"].set_gripper(1.0),
    ):
        with pytest.raises(FaultError, match=r"nothing moves before recover\(\)"):
            command()
    with pytest.raises(FaultError, match=r"the arm moves at .* it is not over"):
        driver.recover()
    cast(Arrays, driver._inner).qd[:] = 0.0
    driver.recover()
    assert driver.safety.mode == "ready" and not driver.safety.fault
    driver.hands["hand"].set_gripper(1.0)
    driver.arms["arm"].trim(driver.state().q)


def test_a_new_motion_ends_the_watch_over_a_stop() -> None:
    driver = made_safe(Arrays(lag=1.0))
    broken_off(driver)
    here = driver.state().q
    driver.arms["arm"].follow(timed(driver.arms["arm"].spec, here, moved(driver.arms["arm"].spec, here, 0, 0.1)))
    driver.wait(2.0)
    assert driver.safety.mode == "ready"


def test_a_reset_ends_a_fault_with_the_world_that_it_was_in() -> None:
    with load_driver("mujoco", Scene()) as driver:
        driver.safety._failed("fault", "somebody says so", "nothing", 1.0, 0.0)
        with pytest.raises(FaultError, match="somebody says so"):
            driver.hands["hand"].set_gripper(1.0)
        simulated(driver, "it starts over").reset()
        driver.hands["hand"].set_gripper(1.0)


def test_on_a_walls_clock_a_stop_returns_when_the_arm_stands() -> None:
    driver = made_safe(Arrays(clock="wall"))
    broken_off(driver)
    assert driver.safety.mode == "stopped" and driver.safety.stopped_after is not None
    assert np.abs(driver.state().qd).max() < TOLERANCES.still
    runaway = made_safe(Arrays(clock="wall", lag=10.0))
    cast(Arrays, runaway._inner).qd[:] = 1.0
    with pytest.raises(FaultError, match="was told to stop"):
        runaway.stop()


def test_a_cancel_that_comes_while_the_arm_brakes_is_left_for_the_next_motion() -> None:
    driver, asked = made_safe(Arrays(clock="wall")), list[float]()
    driver.guards.append(lambda: asked.append(driver.time))  # type: ignore[func-returns-value, arg-type]
    broken_off(driver)
    told, now = len(asked), driver.time
    assert max(asked) < now, "none of the ticks in which it brakes"
    driver.wait(0.02)
    assert len(asked) == told + 2


# Watchdogs.


def test_a_gap_between_two_control_ticks_on_a_walls_clock_is_a_fault() -> None:
    inner = Arrays(clock="wall")
    inner.slow_tick = 20
    driver, q = made_safe(inner), inner.q.copy()
    # Joint 7 brakes from 2.61 rad/s in 0.13 s: in whole ticks of 10 ms.
    assert driver.safety.host_deadline == pytest.approx(0.13)
    with pytest.raises(
        FaultError, match=r"let 0\.3\d* s pass between two control ticks, and 0\.130 s are allowed"
    ) as caught:
        driver.arms["arm"].follow(timed(driver.arms["arm"].spec, q, moved(driver.arms["arm"].spec, q, 0, 1.0)))
    value, _, most = limit_of(caught.value)
    assert value >= 0.3 and most == pytest.approx(0.13) and inner._ticks >= 20
    assert driver.safety.mode == "fault" and driver.safety.stopped_after is not None, (
        "it was seen to stand all the same"
    )
    driver.recover()


def test_where_time_waits_for_the_host_a_gap_is_none() -> None:
    inner = Arrays()
    inner.slow_tick = 20
    driver, q = made_safe(inner), inner.q.copy()
    assert driver.safety.host_deadline is None
    driver.arms["arm"].follow(timed(driver.arms["arm"].spec, q, moved(driver.arms["arm"].spec, q, 0, 1.0)))


@pytest.mark.parametrize("clock", ["wall", "simulated"])
@pytest.mark.parametrize("falls_ill", [False, True])
def test_cycles_are_collected_while_no_machine_moves(clock: str, falls_ill: bool) -> None:
    inner = Arrays(clock=clock)
    driver, q = made_safe(inner), inner.q.copy()
    seen: list[bool] = []

    def listen() -> None:
        seen.append(gc.isenabled())
        if falls_ill and len(seen) > 3:
            raise FaultError("ill")

    driver.subscribe(listen)
    with pytest.raises(FaultError, match="ill") if falls_ill else contextlib.nullcontext():
        driver.arms["arm"].follow(timed(driver.arms["arm"].spec, q, moved(driver.arms["arm"].spec, q, 0, 0.2)))
    assert gc.isenabled() and set(seen) == {clock == "simulated"}


def test_a_robot_that_is_heard_of_no_more_is_lost_and_found_again() -> None:
    inner = Arrays(link_timeout=0.05)
    driver, q = made_safe(inner), inner.q.copy()
    driver.subscribe(lambda: setattr(inner, "linked", driver.time < 0.1))
    with pytest.raises(FaultError, match=r"last heard of 0\.060 s ago, and 0\.050 s are allowed") as caught:
        driver.arms["arm"].follow(timed(driver.arms["arm"].spec, q, moved(driver.arms["arm"].spec, q, 0, 1.0)))
    assert limit_of(caught.value)[2] == 0.05 and driver.safety.mode == "lost"
    with pytest.raises(FaultError, match=r"nothing moves before recover\(\)"):
        driver.arms["arm"].trim(driver.state().q)
    with pytest.raises(FaultError, match="it is not over"):
        driver.recover()
    inner.heard, inner.qd = inner.time, np.zeros(7)
    driver.recover()
    driver.arms["arm"].trim(driver.state().q)


def in_time(driver: SafeDriver, act: Callable[[], object], after: float) -> Callable[[], None]:
    """Return a listener that does something once, so many seconds from now."""
    due = [driver.time + after]

    def listen() -> None:
        if due and driver.time >= due[0]:
            due.clear()
            act()

    return listen


def test_a_file_that_somebody_makes_stops_the_arm_in_mid_motion_and_between_commands(
    driver: SafeDriver, tmp_path: Path
) -> None:
    file, spec = tmp_path / "stop", driver.arms["arm"].spec
    driver.safety.switches.append(StopSwitch(file))
    q = driver.state().q
    goal = moved(spec, q, 0, 1.0)
    driver.subscribe(in_time(driver, file.touch, 0.3))
    began = driver.time
    with pytest.raises(
        FaultError, match=r"stop is there, which asks for a stop; remove it; nothing moves before recover"
    ):
        driver.arms["arm"].follow(timed(spec, q, goal, 0.5))
    assert driver.time - began < 0.34 and driver.mode == "fault"
    driver.wait(1.0)
    assert driver.state().q[0] < q[0] + 0.7
    for command in (lambda: driver.arms["arm"].trim(driver.state().q), lambda: driver.hands["hand"].set_gripper(1.0)):
        with pytest.raises(FaultError, match="which asks for a stop"):
            command()
    with pytest.raises(FaultError, match="it is not over"):
        driver.recover()
    file.unlink()
    driver.recover()
    here = driver.state().q
    driver.arms["arm"].follow(timed(spec, here, moved(spec, here, 0, 0.1)))
    # Nothing moves now, and nothing is to.
    file.touch()
    with pytest.raises(FaultError, match="which asks for a stop"):
        driver.arms["arm"].follow(timed(spec, here, moved(spec, here, 0, 0.2)))


@pytest.mark.parametrize(
    ("name", "still", "press"),
    [
        # What a joystick tells of its buttons as it is opened, a stick, a button that is let go; then one that is pressed.
        ("js0", [(9, 1, 0x81, 2), (9, 32767, 0x02, 1), (9, 0, 0x01, 2)], (12, 1, 0x01, 3)),
        ("event5", [(1, 2, 3, 0, 128), (1, 2, 0, 0, 0), (1, 2, 1, 304, 0)], (1, 3, 1, 304, 1)),
    ],
)
def test_a_button_stops_the_arm_and_nothing_else_that_a_gamepad_sends_does(
    tmp_path: Path, name: str, still: list[tuple[int, ...]], press: tuple[int, ...]
) -> None:
    device, form = tmp_path / name, struct.Struct("=IhBB" if name == "js0" else "@llHHi")
    os.mkfifo(device)
    driver = made_safe(Arrays())
    spec, q = driver.arms["arm"].spec, driver.state().q
    driver.safety.switches.append(StopSwitch(device))
    with device.open("wb", buffering=0) as pad:
        pad.write(b"".join(form.pack(*event) for event in still))
        driver.arms["arm"].follow(timed(spec, q, moved(spec, q, 0, 0.2)))
        # In two writes, as a pipe may bring it.
        whole = form.pack(*press)
        pad.write(whole[:5])
        here = driver.state().q
        driver.subscribe(in_time(driver, lambda: pad.write(whole[5:]), 0.2))
        began = driver.time
        with pytest.raises(FaultError, match=rf"button (3|304) of .*{name} was pressed"):
            driver.arms["arm"].follow(timed(spec, here, moved(spec, here, 0, 1.0), 0.5))
        assert driver.time - began < 0.24
        with pytest.raises(FaultError, match="was pressed"):
            driver.arms["arm"].trim(driver.state().q)
        driver.wait(1.0)
        driver.recover()
        driver.arms["arm"].trim(driver.state().q)
    device.unlink()
    with pytest.raises(FaultError, match="No such file"):
        driver.safety.switches[0].reset()
        driver.arms["arm"].trim(driver.state().q)
    driver.close()


def test_a_stop_switch_that_is_not_there_is_refused_at_the_opening() -> None:
    with pytest.raises(InputError, match=r"stop switch /dev/input/js99: No such file or directory; plug it in"):
        open_session("home", stop_switch="/dev/input/js99")


# The face.


def test_a_safe_driver_is_what_the_driver_is() -> None:
    with load_driver("mujoco", Scene()) as world, load_driver("hardware", Scene()) as plant:
        assert world.simulation is not None and world.referee is None
        assert plant.simulation is None and plant.referee is not None
        assert made_safe(world) is world
        nobodys = made_safe(Arrays())
        assert nobodys.simulation is None and nobodys.referee is None


def test_the_guards_of_a_program_cannot_take_the_place_of_the_limits() -> None:
    driver = made_safe(Arrays())
    driver.safety.limit(Limits(workspace=Workspace(y=(-0.01, 0.01))))
    driver.guards.clear()
    q = driver.state().q
    with pytest.raises(LimitError, match="outside the workspace's"):
        driver.arms["arm"].follow(timed(driver.arms["arm"].spec, q, moved(driver.arms["arm"].spec, q, 0, 1.0), 0.5))


@pytest.mark.parametrize("make", [Arrays, lambda: Hardware(Scene())])
def test_a_safe_driver_passes_the_check_of_drivers(make: type[Arrays]) -> None:
    with made_safe(make()) as driver:
        check_driver(driver, pictures=False)
