"""MuJoCo worlds as drivers: opened on a scene or on a world that is compiled already, and found behind a driver."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping

from robosandbox.driver import Driver, SafeDriver, robot_name
from robosandbox.errors import UnsupportedError
from robosandbox.sim.calibration_board import CalibrationBoard
from robosandbox.sim.mujoco_backend import MuJoCoBackend
from robosandbox.sim.sensors import find_sensor
from robosandbox.sim.world import World
from robosandbox.types import Array, Scene


def open_mujoco(
    scene: Scene,
    *,
    control_timestep: float = 0.01,
    sensor: str = "ideal",
    render_size: tuple[int, int] = (240, 320),
    felt: Iterable[str] = (),
    wait_hook: Callable[[], None] | None = None,
    start_q: Array | Mapping[str, Array] | None = None,
) -> MuJoCoBackend:
    """Return a scene as a world in MuJoCo: the entry point `mujoco` of `robosandbox.drivers`.

    Args:
        scene: Robot, table and objects.
        control_timestep: Seconds between commands to the servos.
        sensor: What its cameras are like: ideal, realsense, rough or webcam.
        render_size: (height, width) of camera pictures, pixels.
        felt: Objects of which the truth is to tell how hard they were pressed.
        wait_hook: Called again and again while the world settles; what it raises ends that.
        start_q: Where the arm begins, shape (n,), or each by name; at home when left out.

    Raises:
        InputError: A file, name or number of the robot or scene is wrong.
    """
    sim = MuJoCoBackend(render_size, control_timestep, sensor=find_sensor(sensor))
    if wait_hook is not None:
        sim.wait_hooks.append(wait_hook)
    sim.feel(felt)
    try:
        sim.load(scene, start_q)
    except BaseException:
        sim.close()
        raise
    return sim


def open_with_board(scene: Scene, board: CalibrationBoard, sensor: str) -> MuJoCoBackend:
    """Return a scene with a board of tags on its table, to calibrate cameras with.

    Args:
        scene: Robot and table.
        board: What lies on the table.
        sensor: What the cameras are like: ideal, realsense, rough or webcam.

    Raises:
        InputError: A file or name is wrong.
    """
    sim = MuJoCoBackend(sensor=find_sensor(sensor), board=board)
    sim.load(scene)
    return sim


def simulate(world: World, state: Array) -> MuJoCoBackend:
    """Return a simulation of a world that is compiled already, in a state as `snapshot` returns it."""
    sim = MuJoCoBackend()
    sim.adopt(world)
    sim.restore(state)
    return sim


def mujoco_behind(driver: Driver) -> MuJoCoBackend | None:
    """Return the MuJoCo world behind a driver, to be drawn, recorded and exported; None where it is another's.

    It is commanded through the driver. Behind one that hides the truth nothing is found.
    """
    if isinstance(driver, SafeDriver):
        driver = driver.behind
    return driver if isinstance(driver, MuJoCoBackend) else None


def require_mujoco(driver: Driver, purpose: str) -> MuJoCoBackend:
    """Return the MuJoCo world behind a driver.

    Args:
        driver: Whose model.
        purpose: What it is needed for, as "the viewer draws it".

    Raises:
        UnsupportedError: There is none.
    """
    world = mujoco_behind(driver)
    if world is None:
        raise UnsupportedError(
            f"model: the driver of {robot_name(driver)} has no simulated model, and {purpose}; use --driver mujoco"
        )
    return world
