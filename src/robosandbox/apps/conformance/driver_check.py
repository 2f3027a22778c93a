"""Checks that any driver must pass, simulated or real; call them from your own tests.

    from robosandbox.apps.conformance import check_driver

It raises AssertionError with a sentence that says which promise is broken. It moves the first joint by 0.1 rad and closes
the gripper: keep the arm clear.
"""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from robosandbox.apps.conformance.conformance import demand
from robosandbox.driver import CAPABILITIES, CameraSpec, Driver, Guard, Simulated
from robosandbox.errors import InputError, UnsupportedError
from robosandbox.types import PictureWindow, Pose, RgbdFrame, Trajectory

# How far two readings of a joint that is held may differ, rad or m; chosen as half of what skills call arrived.
_STEADY = 0.002
# How far a joint may be off where it is told to hold or arrive, rad or m; chosen as what skills trim away afterwards, a
# few times over.
_HELD = 0.01
# How far a frame's focal length may be from what is declared, as a share; chosen far above a calibration's error and
# below what another lens or size of picture makes.
_LENS = 0.05
# How far a frame's camera may be from where it is declared, metres; chosen far above a calibration's error and below
# what a camera on the wrong link makes.
_MOUNT = 0.05
# How far the arm may move in half a second after a guard has ended a motion, rad or m; chosen as a tick's way at full
# speed and its braking.
_STOPPED = 0.02
# A gentle grip, N or N m; chosen well below what any bundled gripper gives by itself.
_GENTLE = 5.0
# Factor by which the force may pass it; chosen because fingers in motion add their servos' damping.
_OVER = 1.5
# How far the first joint is moved, rad or m; chosen so that no arm at home meets anything.
_STROKE = 0.1
_ROWS, _ROW_SECONDS = 200, 0.005


def check_driver(driver: Driver, *, pictures: bool = True) -> None:
    """Check every member of a driver, every capability that it declares, and what it does about those it has not.

    Args:
        driver: Connected or loaded; the arm has room to move.
        pictures: Whether to ask its cameras for frames, which takes OpenGL of a simulated one.
    """
    _check_values(driver)
    _check_senses(driver)
    _check_simulation(driver)
    if pictures:
        _check_cameras(driver)
    _check_motion(driver)
    _check_guards(driver)
    _check_listeners(driver)
    _check_gripper(driver)


def _check_values(driver: Driver) -> None:
    robot, first, second = driver.spec, driver.state(), driver.state()
    demand(
        len(first.q) == robot.n == len(robot.joints), f"{robot.name} has {robot.n} joints and q is {len(first.q)} long"
    )
    demand(len(first.qd) == robot.n, f"qd has {len(first.qd)} values for {robot.n} joints")
    demand(float(np.abs(first.q - second.q).max()) < _STEADY, "state() changed the state")
    demand(not first.q.flags.writeable, "an observation's arrays can be written to")
    demand((first.gripper is None) == (robot.gripper is None), "the robot and the observation disagree about a gripper")
    demand(driver.control_timestep > 0.0, "control_timestep is not positive")
    demand(isinstance(driver.episode, int), "episode is no integer")
    if driver.capabilities.clock == "simulated":
        demand(
            driver.time == driver.time == second.time, "time passes by itself, and the clock is said to be simulated"
        )


def _check_senses(driver: Driver) -> None:
    """Check that each sense gives finite values where it is declared, and is refused where it is not."""
    has = driver.capabilities
    _check_sense(has.wrist_wrench, "wrist_wrench", lambda: driver.force_on(None))
    _check_sense(has.gripper_force, "gripper_force", lambda: driver.grip_on(None))
    _check_sense(has.joint_torque, "joint_torque", lambda: driver.servo_force(0)[0])
    _check_sense(has.contact is not None, "contact", lambda: driver.strongest_contact()[0])
    _check_sense(has.contact is not None, "contact", lambda: list(driver.forces().values()))
    _check_sense(has.contact == "named", "contact", lambda: [float(len(pair)) for pair in driver.arm_contacts()])
    gripper = driver.state().gripper
    if gripper is not None:
        measured = gripper.force is not None
        demand(
            measured == has.gripper_force,
            f"gripper_force is {has.gripper_force}, and the gripper's force {gripper.force}",
        )
        demand(
            measured or gripper.commanded is not None,
            "the gripper tells neither its force nor where it was sent, so nobody can know that it holds something",
        )


def _check_sense(declared: bool, capability: str, ask: Callable[[], object]) -> None:
    try:
        answer = np.asarray(ask(), dtype=float)
    except UnsupportedError as error:
        demand(not declared, f"{capability} is declared, and asking for it raises: {error.message}")
        demand(capability in error.message, f"the refusal does not name {capability}: {error.message}")
        return
    demand(declared, f"{capability} is not declared, and asking for it answers {answer} instead of an UnsupportedError")
    demand(bool(np.isfinite(answer).all()), f"{capability} is {answer}")


def _check_simulation(driver: Driver) -> None:
    has = driver.capabilities
    declared = {name for name in CAPABILITIES if getattr(has, name)} & {"truth", "fork", "reset"}
    if not isinstance(driver, Simulated):
        demand(not declared, f"{', '.join(sorted(declared))}: declared by a driver that is not Simulated")
        return
    if has.truth:
        demand(math.isclose(driver.truth().time, driver.time), "the true state is of another time")
    if has.reset:
        _check_restart(driver)
    if has.fork:
        before, copy = driver.state().q, driver.fork()
        goal = before + np.eye(len(before))[0] * _STROKE
        copy.follow(Trajectory(q=np.linspace(before, goal, _ROWS), dt=_ROW_SECONDS))
        demand(float(np.abs(driver.state().q - before).max()) < _STEADY, "what moves in a copy moves here, too")


def _check_restart(driver: Simulated) -> None:
    """Check that a reset begins anew, and that a snapshot holds all that the future depends on."""
    episode = driver.episode
    driver.reset()
    demand(driver.episode != episode, "a reset is no new episode")
    demand(driver.time == 0.0 and driver.physics_steps == 0, "time goes on over a reset")
    begun, scene = driver.snapshot(), driver.scene
    first = driver.state().q
    futures = []
    for _ in range(2):
        driver.wait(0.2)
        futures.append(driver.snapshot())
        driver.restore(begun)
        demand(bool(np.array_equal(driver.state().q, first)), "a restored world is another one")
    demand(bool(np.array_equal(futures[0], futures[1])), "the same snapshot has two futures")
    driver.resume(scene, futures[0], 7)
    demand(driver.physics_steps == 7, "resume() does not take the count of physics steps")


def _check_cameras(driver: Driver) -> None:
    for name, declared in driver.capabilities.cameras.items():
        frame = driver.capture(name)
        _check_mount(declared, frame, driver.state().tcp_pose)
        lens = frame.intrinsics
        demand(frame.camera == name, f"the frame of {name} says it is of {frame.camera}")
        demand(
            frame.rgb.shape == (lens.height, lens.width, 3),
            f"{name}: colour is {frame.rgb.shape}, not as its lens says",
        )
        demand(
            frame.depth.shape == (lens.height, lens.width),
            f"{name}: depth is {frame.depth.shape}, not as its lens says",
        )
        demand(len(frame.q) == driver.spec.n, f"{name}: the frame does not tell how the arm stood")
        if declared.windows:
            _check_window(driver, name, frame)
    expected = InputError if driver.capabilities.cameras else UnsupportedError
    try:
        driver.capture("no such camera")
    except expected:
        return
    raise AssertionError(f"a camera that is not there delivers a frame instead of an {expected.__name__}")


def _check_window(driver: Driver, name: str, whole: RgbdFrame) -> None:
    """Check that a part of a picture comes in a frame of the usual size, with nothing around it."""
    height, width = whole.depth.shape
    window = PictureWindow(left=width // 4, top=height // 4, right=width // 2, bottom=height // 2)
    frame = driver.capture(name, window)
    demand(
        frame.rgb.shape == whole.rgb.shape and frame.depth.shape == whole.depth.shape, f"{name}: a window is cut out"
    )
    inside = frame.depth[window.rows, window.columns]
    demand(
        np.count_nonzero(frame.depth) == np.count_nonzero(inside) > 0,
        f"{name}: what is outside of a window has depth, or nothing in it",
    )


def _check_mount(declared: CameraSpec, frame: RgbdFrame, tcp: Pose) -> None:
    """Check that a frame comes from where its camera is said to be, through the lens that it is said to have."""
    built, lens = declared.intrinsics, frame.intrinsics
    demand((built.width, built.height) == (lens.width, lens.height), f"{frame.camera}: frames are of another size")
    demand(abs(lens.fx / built.fx - 1.0) < _LENS, f"{frame.camera}: its lens has another focal length")
    where = tcp @ declared.pose if declared.on_hand else declared.pose
    off = float(np.linalg.norm(where.position - frame.pose_camera_in_world.position))
    demand(off < _MOUNT, f"{frame.camera}: a frame comes from {off:.3f} m beside where the camera is said to be")


def _check_motion(driver: Driver) -> None:
    first = driver.state()
    driver.stop()
    driver.wait(0.5)
    held = driver.state()
    demand(float(np.abs(held.q - first.q).max()) < _HELD, "the arm does not hold")
    tick, simulated = driver.control_timestep, driver.capabilities.clock == "simulated"
    # A wall's clock goes on while the check computes.
    longest = 1.5 * tick if simulated else np.inf
    demand(-1.5 * tick < held.time - first.time - 0.5 < longest, "half a second of waiting is not half a second")
    goal = held.q.copy()
    goal[0] += _STROKE
    driver.follow(Trajectory(q=np.linspace(held.q, goal, _ROWS), dt=_ROW_SECONDS))
    driver.wait(0.5)
    demand(float(np.abs(driver.state().q - goal).max()) < _HELD, "a motion did not arrive")
    before = driver.time
    driver.trim(goal)
    demand(0.0 < driver.time - before < longest, "trim() does not take one control tick")


def _check_guards(driver: Driver) -> None:
    """Check that a guard, of one motion or standing, ends each way of letting time pass, with the arm holding."""
    here = driver.state().q
    back = Trajectory(q=np.linspace(here, here - np.eye(len(here))[0] * _STROKE, _ROWS), dt=_ROW_SECONDS)
    ways: tuple[tuple[str, Callable[[tuple[Guard, ...]], None]], ...] = (
        ("follow()", lambda guards: driver.follow(back, guards)),
        ("wait()", lambda guards: driver.wait(1.0, guards)),
        ("trim()", lambda guards: driver.trim(driver.state().q, guards)),
    )
    for name, go in ways:
        for standing in (False, True):
            guard = _EndsAt(1 if name == "trim()" else 5)
            if standing:
                driver.guards.append(guard)
            try:
                go(() if standing else (guard,))
            except _Ended:
                pass
            else:
                raise AssertionError(f"a {'standing ' * standing}guard did not end {name}")
            finally:
                if standing:
                    driver.guards.remove(guard)
            demand(guard.asked == guard.at, f"{name} went on after a guard had ended it")
            stopped = driver.state().q
            driver.wait(0.5)
            demand(
                float(np.abs(driver.state().q - stopped).max()) < _STOPPED,
                f"the arm went on after a guard had ended {name}",
            )


class _Ended(Exception):
    pass


class _EndsAt:
    """A guard that ends a motion when it is asked so often."""

    def __init__(self, at: int) -> None:
        self.at = at
        self.asked = 0

    def __call__(self) -> Exception | None:
        self.asked += 1
        return _Ended() if self.asked >= self.at else None


def _check_listeners(driver: Driver) -> None:
    times: list[float] = []
    end = driver.subscribe(lambda: times.append(driver.time))
    driver.wait(10.0 * driver.control_timestep)
    demand(len(times) == 10, f"a listener was told of {len(times)} ticks in ten")
    demand(times == sorted(set(times)), "two ticks are of the same time")
    end()
    driver.wait(driver.control_timestep)
    demand(len(times) == 10, "a listener that has left is still told of ticks")


def _check_gripper(driver: Driver) -> None:
    gripper = driver.spec.gripper
    for value in (-0.1, 1.1):
        try:
            driver.set_gripper(value)
        except ValueError:
            continue
        raise AssertionError(f"set_gripper({value}) was taken; it goes from 0 (open) to 1 (closed)")
    if gripper is None:
        return
    _check_grip_limit(driver)
    widths = []
    for closed in (0.0, 1.0):
        driver.set_gripper(closed)
        driver.wait(2.0)
        state = driver.state().gripper
        assert state is not None
        demand(state.commanded in (None, closed), f"the gripper was sent to {closed} and says {state.commanded}")
        widths.append(state.width)
    half = 0.5 * (gripper.geometry.max_aperture - gripper.geometry.min_aperture)
    # A cup has no gap.
    demand(
        gripper.geometry.cup is not None or widths[0] - widths[1] > half,
        f"the gripper is {widths[0]:.3f} m wide open and {widths[1]:.3f} m closed",
    )
    driver.set_gripper(0.0)


def _check_grip_limit(driver: Driver) -> None:
    """Check that a force to close with is taken where that is declared, and refused where it is not."""
    declared = driver.capabilities.grip_limit
    try:
        driver.set_gripper(1.0, _GENTLE)
    except UnsupportedError as error:
        demand(not declared, f"grip_limit is declared, and a force is refused: {error.message}")
        demand("grip_limit" in error.message, f"the refusal does not name grip_limit: {error.message}")
        return
    demand(declared, "grip_limit is not declared, and set_gripper() takes a force")
    driver.wait(1.0)
    state = driver.state().gripper
    demand(
        state is None or state.force is None or state.force < _GENTLE * _OVER,
        f"the gripper was to close with {_GENTLE:g} N and gives {state and state.force}",
    )
