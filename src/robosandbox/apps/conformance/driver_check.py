"""Checks that any driver must pass, simulated or real; call them from your own tests.

    from robosandbox.apps.conformance import check_driver

It raises AssertionError with a sentence that says which promise is broken. It moves the first joint by 0.1 rad and closes
the gripper: keep the arm clear.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import partial
from typing import TypeVar

import numpy as np

from robosandbox.apps.conformance.conformance import demand
from robosandbox.driver import ARM, CAPABILITIES, Arm, CameraSpec, Driver, Guard, Hand, Simulated
from robosandbox.errors import InputError, UnsupportedError
from robosandbox.types import Array, PictureWindow, RgbdFrame, Trajectory
from robosandbox.types.robot import hand_of

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


T = TypeVar("T")


def check_driver(driver: Driver, *, pictures: bool = True) -> None:
    """Check every member of a driver, every capability that it declares, and what it does about those it has not.

    Args:
        driver: Connected or loaded; the arms have room to move.
        pictures: Whether to ask its cameras for frames, which takes OpenGL of a simulated one.
    """
    _check_values(driver)
    _check_senses(driver)
    _check_simulation(driver)
    if pictures:
        _check_cameras(driver)
    for arm in driver.arms.values():
        _check_motion(driver, arm)
        _check_guards(driver, arm)
    _check_listeners(driver)
    for hand in driver.hands.values():
        _check_hand(driver, hand)


def _check_values(driver: Driver) -> None:
    demand(bool(driver.arms), "there is no arm")
    demand(len(driver.arms) > 1 or ARM in driver.arms, f"{', '.join(driver.arms)}: a cell's only arm is called {ARM!r}")
    first, second = driver.state(), driver.state()
    demand(
        [*first.arms] == [*driver.arms],
        f"state() tells of {', '.join(first.arms)}, and there is {', '.join(driver.arms)}",
    )
    for name, arm in driver.arms.items():
        robot, one = arm.spec, first.arms[name]
        demand(arm.name == name, f"the arm {name!r} is called {arm.name!r}")
        demand(
            len(one.q) == robot.n == len(robot.joints), f"{robot.name} has {robot.n} joints and q is {len(one.q)} long"
        )
        demand(len(one.qd) == robot.n, f"qd has {len(one.qd)} values for {robot.n} joints")
        demand(float(np.abs(one.q - second.arms[name].q).max()) < _STEADY, "state() changed the state")
        demand(
            float(np.abs(one.q - arm.state().q).max()) < _STEADY, f"{name}: the arm and the driver tell another state"
        )
        demand(not one.q.flags.writeable, "an observation's arrays can be written to")
        demand(
            (one.gripper is None) == (robot.gripper is None), "the robot and the observation disagree about a gripper"
        )
        carried = [hand.name for hand in driver.hands.values() if hand.arm == name]
        demand(
            len(carried) == (robot.gripper is not None),
            f"{name} carries {'a' if robot.gripper else 'no'} gripper, and of the hands it has {', '.join(carried) or 'none'}",
        )
    for name, hand in driver.hands.items():
        demand(hand.name == name, f"the hand {name!r} is called {hand.name!r}")
        demand(hand.arm in driver.arms, f"the hand {name!r} is on an arm {hand.arm!r}, which is not there")
        wanted = hand_of(hand.arm)
        demand(name == wanted, f"the hand {name!r} of the arm {hand.arm!r} is called {wanted!r}")
    demand(driver.control_timestep > 0.0, "control_timestep is not positive")
    demand(isinstance(driver.episode, int), "episode is no integer")
    demand(not driver.fault and driver.mode != "fault", f"there is a fault: {driver.fault}")
    if driver.capabilities.clock == "simulated":
        demand(
            driver.time == driver.time == second.time, "time passes by itself, and the clock is said to be simulated"
        )


def _check_senses(driver: Driver) -> None:
    """Check that each sense gives finite values where it is declared, and is refused where it is not."""
    has, senses = driver.capabilities, driver.senses
    for name, arm in driver.arms.items():
        _check_sense(has.wrist_wrench, "wrist_wrench", partial(senses.force_on, None, name))
        _check_sense(has.joint_torque, "joint_torque", partial(arm.servo_force, 0), lambda told: told[0])
        _check_sense(has.contact is not None, "contact", partial(senses.strongest_contact, name), lambda told: told[0])
        _check_sense(has.contact is not None, "contact", partial(senses.forces, name), lambda told: [*told.values()])
    _check_sense(has.contact is not None, "contact", lambda: list(senses.forces().values()))
    _check_sense(has.contact == "named", "contact", lambda: [float(len(pair)) for pair in senses.contacts()])
    for hand in driver.hands.values():
        _check_sense(has.gripper_force, "gripper_force", partial(hand.grip_on, None))
        gripper = hand.state()
        measured = gripper.force is not None
        demand(
            measured == has.gripper_force,
            f"gripper_force is {has.gripper_force}, and the gripper's force {gripper.force}",
        )
        demand(
            measured or gripper.commanded is not None,
            "the gripper tells neither its force nor where it was sent, so nobody can know that it holds something",
        )


def _check_sense(
    declared: bool, capability: str, ask: Callable[[], T], numbers: Callable[[T], object] = lambda told: told
) -> None:
    try:
        answer = np.asarray(numbers(ask()), dtype=float)
    except UnsupportedError as error:
        demand(not declared, f"{capability} is declared, and asking for it raises: {error.message}")
        demand(capability in error.message, f"the refusal does not name {capability}: {error.message}")
        return
    demand(declared, f"{capability} is not declared, and asking for it answers {answer} instead of an UnsupportedError")
    demand(bool(np.isfinite(answer).all()), f"{capability} is {answer}")


def _check_simulation(driver: Driver) -> None:
    has, world = driver.capabilities, driver.simulation
    declared = {name for name in CAPABILITIES if getattr(has, name)} & {"truth", "fork", "reset"}
    if world is None:
        demand(not declared, f"{', '.join(sorted(declared))}: declared by a driver that has no simulation")
        return
    if has.truth:
        demand(math.isclose(world.truth().time, driver.time), "the true state is of another time")
    if has.reset:
        _check_restart(driver, world)
    if has.fork:
        for name, arm in driver.arms.items():
            before, copy = arm.state().q, world.fork()
            goal = before + np.eye(len(before))[0] * _STROKE
            copy.arms[name].follow(Trajectory(q=np.linspace(before, goal, _ROWS), dt=_ROW_SECONDS))
            demand(float(np.abs(arm.state().q - before).max()) < _STEADY, "what moves in a copy moves here, too")


def _check_restart(driver: Driver, world: Simulated) -> None:
    """Check that a reset begins anew, and that a snapshot holds all that the future depends on."""
    episode = driver.episode
    world.reset()
    demand(driver.episode != episode, "a reset is no new episode")
    demand(driver.time == 0.0 and world.physics_steps == 0, "time goes on over a reset")
    begun, scene = world.snapshot(), world.scene
    first = _configurations(driver)
    futures = []
    for _ in range(2):
        driver.wait(0.2)
        futures.append(world.snapshot())
        world.restore(begun)
        demand(bool(np.array_equal(_configurations(driver), first)), "a restored world is another one")
    demand(bool(np.array_equal(futures[0], futures[1])), "the same snapshot has two futures")
    world.resume(scene, futures[0], 7)
    demand(world.physics_steps == 7, "resume() does not take the count of physics steps")


def _configurations(driver: Driver) -> Array:
    """Return the joints of all arms, one behind the other."""
    return np.concatenate([arm.state().q for arm in driver.arms.values()])


def _check_cameras(driver: Driver) -> None:
    for name, declared in driver.capabilities.cameras.items():
        frame = driver.senses.capture(name)
        _check_mount(driver, declared, frame)
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
        stood = {arm: len(posture.q) for arm, posture in frame.arms.items()}
        demand(
            stood == {arm: one.spec.n for arm, one in driver.arms.items()},
            f"{name}: the frame does not tell how the arms stood",
        )
        if declared.windows:
            _check_window(driver, name, frame)
    expected = InputError if driver.capabilities.cameras else UnsupportedError
    try:
        driver.senses.capture("no such camera")
    except expected:
        return
    raise AssertionError(f"a camera that is not there delivers a frame instead of an {expected.__name__}")


def _check_window(driver: Driver, name: str, whole: RgbdFrame) -> None:
    """Check that a part of a picture comes in a frame of the usual size, with nothing around it."""
    height, width = whole.depth.shape
    window = PictureWindow(left=width // 4, top=height // 4, right=width // 2, bottom=height // 2)
    frame = driver.senses.capture(name, window)
    demand(
        frame.rgb.shape == whole.rgb.shape and frame.depth.shape == whole.depth.shape, f"{name}: a window is cut out"
    )
    inside = frame.depth[window.rows, window.columns]
    demand(
        np.count_nonzero(frame.depth) == np.count_nonzero(inside) > 0,
        f"{name}: what is outside of a window has depth, or nothing in it",
    )


def _check_mount(driver: Driver, declared: CameraSpec, frame: RgbdFrame) -> None:
    """Check that a frame comes from where its camera is said to be, through the lens that it is said to have."""
    built, lens = declared.intrinsics, frame.intrinsics
    demand((built.width, built.height) == (lens.width, lens.height), f"{frame.camera}: frames are of another size")
    demand(abs(lens.fx / built.fx - 1.0) < _LENS, f"{frame.camera}: its lens has another focal length")
    arm = declared.arm
    where = declared.pose if arm is None else driver.arms[arm].state().tcp_pose @ declared.pose
    off = float(np.linalg.norm(where.position - frame.pose_camera_in_world.position))
    demand(off < _MOUNT, f"{frame.camera}: a frame comes from {off:.3f} m beside where the camera is said to be")


def _check_motion(driver: Driver, arm: Arm) -> None:
    first = arm.state()
    arm.stop()
    driver.wait(0.5)
    held = arm.state()
    demand(float(np.abs(held.q - first.q).max()) < _HELD, "the arm does not hold")
    tick, simulated = driver.control_timestep, driver.capabilities.clock == "simulated"
    # A wall's clock goes on while the check computes.
    longest = 1.5 * tick if simulated else np.inf
    demand(-1.5 * tick < held.time - first.time - 0.5 < longest, "half a second of waiting is not half a second")
    others = {name: other.state().q for name, other in driver.arms.items() if name != arm.name}
    goal = held.q.copy()
    goal[0] += _STROKE
    arm.follow(Trajectory(q=np.linspace(held.q, goal, _ROWS), dt=_ROW_SECONDS))
    driver.wait(0.5)
    demand(float(np.abs(arm.state().q - goal).max()) < _HELD, "a motion did not arrive")
    for name, q in others.items():
        moved = float(np.abs(driver.arms[name].state().q - q).max())
        demand(moved < _HELD, f"{name} moved by {moved:.3f} while {arm.name} did")
    before = driver.time
    arm.trim(goal)
    demand(0.0 < driver.time - before < longest, "trim() does not take one control tick")


def _check_guards(driver: Driver, arm: Arm) -> None:
    """Check that a guard, of one motion or standing, ends each way of letting time pass, with the arm holding."""
    here = arm.state().q
    back = Trajectory(q=np.linspace(here, here - np.eye(len(here))[0] * _STROKE, _ROWS), dt=_ROW_SECONDS)
    ways: tuple[tuple[str, Callable[[tuple[Guard, ...]], None]], ...] = (
        ("follow()", lambda guards: arm.follow(back, guards)),
        ("wait()", lambda guards: driver.wait(1.0, guards)),
        ("trim()", lambda guards: arm.trim(arm.state().q, guards)),
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
            stopped = arm.state().q
            driver.wait(0.5)
            demand(
                float(np.abs(arm.state().q - stopped).max()) < _STOPPED,
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


def _check_hand(driver: Driver, hand: Hand) -> None:
    for value in (-0.1, 1.1):
        try:
            hand.set_gripper(value)
        except ValueError:
            continue
        raise AssertionError(f"set_gripper({value}) was taken; it goes from 0 (open) to 1 (closed)")
    _check_grip_limit(driver, hand)
    widths = []
    for closed in (0.0, 1.0):
        hand.set_gripper(closed)
        driver.wait(2.0)
        state = hand.state()
        demand(state.commanded in (None, closed), f"the gripper was sent to {closed} and says {state.commanded}")
        widths.append(state.width)
    geometry = hand.spec.geometry
    half = 0.5 * (geometry.max_aperture - geometry.min_aperture)
    # A cup has no gap.
    demand(
        geometry.cup is not None or widths[0] - widths[1] > half,
        f"the gripper is {widths[0]:.3f} m wide open and {widths[1]:.3f} m closed",
    )
    hand.set_gripper(0.0)


def _check_grip_limit(driver: Driver, hand: Hand) -> None:
    """Check that a force to close with is taken where that is declared, and refused where it is not."""
    declared = driver.capabilities.grip_limit
    try:
        hand.set_gripper(1.0, _GENTLE)
    except UnsupportedError as error:
        demand(not declared, f"grip_limit is declared, and a force is refused: {error.message}")
        demand("grip_limit" in error.message, f"the refusal does not name grip_limit: {error.message}")
        return
    demand(declared, "grip_limit is not declared, and set_gripper() takes a force")
    driver.wait(1.0)
    force = hand.state().force
    demand(
        force is None or force < _GENTLE * _OVER,
        f"the gripper was to close with {_GENTLE:g} N and gives {force}",
    )
