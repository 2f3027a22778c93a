"""A robot put to the test in simulation: servos, home, gripper, a pick."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import closing
from pathlib import Path

import numpy as np

from robosandbox.driver import ARM, HAND, Arm, Driver, Hand
from robosandbox.errors import InputError
from robosandbox.progress import doing
from robosandbox.robots.findings import CheckResult
from robosandbox.robots.loader import RobotModel
from robosandbox.sim.opening import open_mujoco
from robosandbox.tasks.judge.checks import Displaced, Lifted
from robosandbox.tasks.task import Task
from robosandbox.types import Array, Pose, Scene, SceneObject, Trajectory
from robosandbox.workcell.session import open_session

CUBE = "red_cube"
# Half an edge of the cube, metres; chosen so that the smallest gripper of docs/arms.md (47 mm) has room for it.
CUBE_HALF = 0.012
# How far each joint is moved, rad or m; chosen large beside a servo's error and small beside any joint's range.
_STEP = 0.1
# Half an edge of the cube for a suction cup, as a share of the cup's diameter; chosen so that the lip is well inside of its
# faces.
_OF_CUP = 0.75
# How far a joint may stay off its command, rad or m; chosen as what a wrong gain exceeds many times over and all 25
# arms of docs/arms.md keep.
_TRACKED = 0.02
_TRACK_SECONDS = 2.0
# How far a joint may sink from home, rad or m; chosen as for a step.
_HELD = 0.02
# Share of its measured opening that a gripper has to reach in motion; chosen because fingers that hang on springs stop
# short of it.
_OPENS = 0.8
# How far above its measured least gap closed fingers may stay, metres; chosen as the error of a gap between curved
# pads.
_CLOSES = 0.004
# Metres; chosen as a stroke that the shortest arm of docs/arms.md has room for.
_PUSH_M = 0.06
_TABLE_HALF = 0.5
# Distance of the cube from the table's edge, metres; chosen so that a push of its length stays on the table.
_TABLE_MARGIN = 0.05


def try_out(
    path: Path, config: Path, robot: RobotModel, static: Sequence[CheckResult], clear_home: tuple[float, ...]
) -> Iterator[CheckResult]:
    """Yield the checks made in simulation, each when it is made.

    Args:
        path: The model.
        config: Its sidecar.
        robot: What was loaded of them.
        static: What was found without simulation; a failure here is the consequence of one there.
        clear_home: A home that is free on a base that stands right, one value per arm joint.
    """
    blame = next((item.field for item in static if item.field and not item.ok), None)
    doubted = blame or next((item.field for item in static if item.field), None)
    scene = Scene(robot_urdf=path, robot_config=config)
    try:
        with doing("opening a world with it"):
            driver = open_mujoco(scene)
    except InputError as error:
        yield CheckResult("start", False, str(error), blame or _start_field(scene, robot, clear_home, str(error)))
        return
    with closing(driver):
        yield _home_is_held(driver, blame)
        yield _servos_track(driver, blame)
        if robot.gripper is not None:
            yield _gripper_moves(driver, doubted)
    if robot.gripper is not None:
        yield _pick(path, config, robot, doubted, what_if=blame is None)
    else:
        yield _push(path, config, robot, blame)
        yield CheckResult(
            "pick",
            False,
            "no gripper: nothing at its end closes, so it cannot hold things; it can push, tap and go home "
            "(--gripper mounts one)",
            "gripper",
            counts=False,
        )


def _start_field(scene: Scene, robot: RobotModel, clear_home: tuple[float, ...], message: str) -> str:
    """Return what to change of a robot that starts inside something: where another home is free, the home."""
    if "'table'" not in message and "'floor'" not in message:
        return "arm.home_qpos"
    if len(clear_home) != len(robot.sidecar.arm.joints):
        return "base_pose.xyz"
    try:
        open_mujoco(scene, start_q=np.array(clear_home)).close()
    except InputError:
        return "base_pose.xyz"
    return "arm.home_qpos"


def _arm(driver: Driver) -> Arm:
    # What is tried is a sidecar, which is of one robot.
    return driver.arms[ARM]


@doing("holding home")
def _home_is_held(driver: Driver, blame: str | None) -> CheckResult:
    home = _arm(driver).spec.home_q
    driver.wait(1.0)
    off = np.abs(_arm(driver).state().q - home)
    touching = [f"{a} on {b}" for a, b in driver.senses.contacts()]
    worst = int(off.argmax())
    if touching:
        return CheckResult("home_held", False, f"at home {touching[0]}", blame or "arm.home_qpos")
    if off[worst] > _HELD:
        return CheckResult(
            "home_held",
            False,
            f"{_arm(driver).spec.joints[worst]} is {off[worst]:.3f} off home after a second: its servo is too weak",
            blame or f"arm.actuators[{worst}]",
        )
    return CheckResult("home_held", True, f"within {off[worst]:.4f} of home after a second, nothing touched")


@doing("trying the servos")
def _servos_track(driver: Driver, blame: str | None) -> CheckResult:
    arm = _arm(driver)
    robot = arm.spec
    worst, who = 0.0, 0
    for joint in range(robot.n):
        target = robot.home_q.copy()
        step = _STEP if target[joint] + _STEP <= robot.upper[joint] else -_STEP
        target[joint] += step * (0.2 if np.isfinite(robot.upper[joint]) and robot.upper[joint] < 0.5 else 1.0)
        target = np.clip(target, robot.lower, robot.upper)
        for goal in (target, robot.home_q):
            arm.follow(Trajectory(q=_ramp(arm.state().q, goal, robot.acceleration_limits), dt=0.01))
            for _ in range(round(_TRACK_SECONDS / driver.control_timestep)):
                if np.abs(arm.state().q - goal).max() < 0.2 * _TRACKED:
                    break
                arm.trim(goal)
            off = float(np.abs(arm.state().q - goal).max())
            if off > worst:
                worst, who = off, int(np.abs(arm.state().q - goal).argmax())
    if worst > _TRACKED:
        return CheckResult(
            "servos", False, f"{robot.joints[who]} stays {worst:.3f} off its command", blame or f"arm.actuators[{who}]"
        )
    return CheckResult("servos", True, f"each joint follows a step of {_STEP} within {worst:.4f}")


def _ramp(start: Array, goal: Array, acceleration: Array) -> Array:
    """Return steps of 10 ms, shape (k, n), no faster than the joints can speed up and slow down."""
    seconds = max(0.6, 2.0 * float(np.sqrt(np.abs(goal - start) / acceleration).max()))
    share = np.linspace(0.0, 1.0, round(seconds / 0.01))[:, None]
    ramp: Array = start + share * (goal - start)
    return ramp


@doing("trying the gripper")
def _gripper_moves(driver: Driver, blame: str | None) -> CheckResult:
    hand = driver.hands[HAND]
    geometry = hand.spec.geometry
    if geometry.cup is not None:
        return _cup_pulls(driver, hand, blame)
    widths = []
    for closed in (1.0, 0.0):
        hand.set_gripper(closed)
        driver.wait(2.0)
        widths.append(hand.state().width)
    shut, opened = widths
    if opened < _OPENS * geometry.max_aperture or opened <= shut:
        return CheckResult("gripper", False, f"opens to {opened * 1000:.0f} mm only", blame or "gripper.open_qpos")
    if shut > geometry.min_aperture + _CLOSES:
        return CheckResult("gripper", False, f"closes to {shut * 1000:.0f} mm only", blame or "gripper.closed_qpos")
    return CheckResult("gripper", True, f"closes to {shut * 1000:.1f} mm, opens to {opened * 1000:.0f} mm")


def _cup_pulls(driver: Driver, hand: Hand, blame: str | None) -> CheckResult:
    pulls = []
    for closed in (1.0, 0.0):
        hand.set_gripper(closed)
        driver.wait(driver.control_timestep)
        pulls.append(hand.state().force or 0.0)
    if not pulls[0] > pulls[1] == 0.0:
        detail = f"the cup pulls with {pulls[0]:.1f} N when it is to suck and {pulls[1]:.1f} N when it is not"
        return CheckResult("gripper", False, detail, blame or "gripper.actuator")
    return CheckResult("gripper", True, f"the cup pulls with {pulls[0]:.0f} N, and lets go")


def _cube_half(robot: RobotModel) -> float:
    """Return half an edge of the cube to be picked, metres: a cup's face has to be larger than the cup."""
    cup = robot.gripper.geometry.cup if robot.gripper else None
    return CUBE_HALF if cup is None else max(CUBE_HALF, _OF_CUP * cup)


def work_point(robot: RobotModel, share: float = 0.5) -> tuple[float, float]:
    """Return a point of the table that a robot reaches: straight ahead, `share` of the way from near to far."""
    space, base = robot.workspace, robot.base_pose
    direction = base.rotation @ (space.point(1.0, 0.0) - space.point(0.0, 0.0))
    axis = base.position + base.rotation @ space.point(0.0, 0.0)
    # A long arm reaches farther than its table does.
    edge = min(
        ((np.sign(d) * _TABLE_HALF - a) / d for a, d in zip(axis[:2], direction[:2], strict=True) if abs(d) > 1e-6),
        default=space.far,
    )
    far = max(space.near, min(space.far, float(edge) - _TABLE_MARGIN))
    x, y = (axis + (space.near + share * (far - space.near)) * direction)[:2]
    return round(float(x), 3), round(float(y), 3)


def cube_task(
    path: Path, config: Path | None, at: tuple[float, float], *, table_height: float = 0.04, half: float = CUBE_HALF
) -> Task:
    """Return the task of picking a cube, 24 mm where `half` an edge, metres, says nothing else, at a point of the table."""
    cube = SceneObject(
        id=CUBE,
        kind="box",
        size=(half,) * 3,
        pose=Pose(xyz=(*at, table_height + half + 0.001)),
        rgba=(0.85, 0.2, 0.2, 1.0),
        mass=0.05,
    )
    return Task(
        name="pick_cube",
        prompt="pick up the red cube",
        scene=Scene(robot_urdf=path, robot_config=config, objects=(cube,), table_height=table_height),
        success=Lifted(kind="lifted", object=CUBE, min_mm=50.0),
    )


@doing("trying a pick")
def _pick(path: Path, config: Path, robot: RobotModel, blame: str | None, *, what_if: bool) -> CheckResult:
    at, half = work_point(robot), _cube_half(robot)
    if max(map(abs, at)) > _TABLE_HALF:
        return CheckResult(
            "pick",
            False,
            f"what it reaches straight ahead, ({at[0]:.2f}, {at[1]:.2f}), lies beside the table; move or turn the base",
            blame or "base_pose.xyz",
        )
    try:
        with open_session(cube_task(path, config, at, half=half), what_if=what_if) as session:
            session.ctx.advise = False
            episode = session.run()
            verdict = session.judge()
    except InputError as error:
        return CheckResult("pick", False, str(error), blame)
    where = f"a {2000 * half:.0f} mm cube at ({at[0]:.2f}, {at[1]:.2f})"
    if verdict.success:
        return CheckResult("pick", True, f"held {where} and lifted it by {verdict.detail['dz_mm']:.0f} mm")
    return CheckResult(
        "pick", False, f"{where}: {episode.final_detail}", blame or _pick_field(robot, episode.final_detail)
    )


def _pick_field(robot: RobotModel, message: str) -> str | None:
    geometry = robot.gripper.geometry if robot.gripper else None
    if geometry is not None and geometry.cup is None:
        widest, narrowest = float(geometry.aperture_samples.max()), float(geometry.aperture_samples.min())
        if "the gripper opens" in message and geometry.max_aperture < _OPENS * widest:
            return "gripper.open_qpos"
        if "less than the gripper can hold" in message and geometry.min_aperture > narrowest + _CLOSES:
            return "gripper.closed_qpos"
    if "out of reach" in message:
        return "base_pose.xyz"
    return "ee_site.inject.xyz" if "closed on nothing" in message else None


@doing("trying a push")
def _push(path: Path, config: Path, robot: RobotModel, blame: str | None) -> CheckResult:
    task = cube_task(path, config, work_point(robot, 0.4))
    wanted = Displaced(kind="displaced", object=CUBE, direction="forward", min_mm=0.6 * _PUSH_M * 1000)
    task = task.model_copy(update={"prompt": f"push the red cube {_PUSH_M * 100:.0f} cm forward", "success": wanted})
    try:
        with open_session(task, what_if=blame is None) as session:
            session.ctx.advise = False
            episode = session.run()
            verdict = session.judge()
    except InputError as error:
        return CheckResult("push", False, str(error), blame)
    detail = f"pushed a cube {_PUSH_M * 1000:.0f} mm forward" if verdict.success else episode.final_detail
    return CheckResult("push", verdict.success, detail, None if verdict.success else blame)
