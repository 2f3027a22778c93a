"""Promises of the driver `ros2`, each tried before a plant: python -m robosandbox_ros2.claims [NAME ...].

In a project of its own as pytest is none of its needs; `tests/test_ros2.py` runs each as a test.
"""

from __future__ import annotations

import json
import socket
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np
import zenoh

from robosandbox_ros2.plant_driver import PlantDriver, PlantProcess  # isort: skip  (sets the domain before rclpy is there)
from robosandbox_msgs.srv import Load, Look, Reset
from sensor_msgs.msg import JointState
from std_srvs.srv import Trigger

from robosandbox.apps.conformance import check_driver
from robosandbox.driver import SafeDriver, load_driver
from robosandbox.errors import FaultError, RoboSandboxError, SkillError
from robosandbox.tasks.loader import find_task
from robosandbox.types import Trajectory
from robosandbox_ros2 import bag, link_claims, pyzeros_visitor, wire
from robosandbox_ros2.plant import TICK
from robosandbox_ros2.visitor import Visitor, look_round, see

CLAIMS: dict[str, Callable[[], str]] = {}
# What counts as standing, rad/s, as `SafeDriver` has it.
STILL = 0.01


def claim(tried: Callable[[], str]) -> Callable[[], str]:
    CLAIMS[tried.__name__] = tried
    return tried


for one in link_claims.CLAIMS:
    claim(one)


@contextmanager
def opened(**options: object) -> Iterator[tuple[SafeDriver, PlantProcess]]:
    """Open a driver before a plant with a Panda and a cube, without cameras."""
    driver = load_driver("ros2_plant", find_task("pick_cube_franka").scene, {"eyes": False, **options})
    behind = driver.behind
    assert isinstance(behind, PlantDriver)
    try:
        yield driver, behind.plant
    finally:
        driver.close()


def sweep(driver: SafeDriver, by: float, seconds: float) -> None:
    """Turn the first joint."""
    q = driver.state().q
    ramp = 0.5 - 0.5 * np.cos(np.linspace(0.0, np.pi, round(seconds / 0.01)))
    driver.arms["arm"].follow(Trajectory(q=q + by * ramp[:, None] * np.eye(len(q))[0], dt=0.01))


def raised(act: Callable[[], object], *words: str) -> str:
    """Return what an act raises, which has these words in it."""
    try:
        act()
    except RoboSandboxError as error:
        assert all(word in str(error) for word in words), f"it says {error}"
        return str(error)
    raise AssertionError(f"nothing was raised; expected {words}")


def stood_after(plant: PlantProcess, since: float) -> float:
    """Return after how many seconds the plant's arm stood for good, by the plant itself."""
    moved = [at for at, speed in plant.referee.speeds(since) if speed > STILL]
    return max(moved, default=since) - since


def while_moving(driver: SafeDriver, act: Callable[[], float]) -> tuple[str, float]:
    """Do something half a second into a motion; return what was said of it, and when it was done."""
    began: list[float] = []
    timer = threading.Timer(0.5, lambda: began.append(act()))
    timer.start()
    said = raised(lambda: sweep(driver, 0.8, 3.0))
    timer.join()
    return said, began[0]


@claim
def the_driver_keeps_its_promises_over_ros() -> str:
    driver = load_driver("ros2_plant", find_task("pick_cube_franka").scene)
    try:
        check_driver(driver)
        assert set(driver.capabilities.cameras) == {"scene", "top", "wrist"}
        assert driver.capabilities.wrist_wrench and not driver.capabilities.gripper_force
    finally:
        driver.close()
    return "check_driver"


@claim
def a_plain_gripper_action_is_found_out() -> str:
    with opened(gripper_action="plain") as (driver, _):
        hand = driver.hands["hand"]
        for closed in (1.0, 0.0):
            hand.set_gripper(closed)
            driver.wait(1.5)
            assert abs(hand.state().closed - closed) < 0.05, hand.state()
    return "GripperCommand"


@claim
def a_cube_is_picked_and_placed_through_the_controller() -> str:
    from robosandbox import open_session

    with open_session("put_in_bin", driver="ros2_plant", perception="rgbd", confirm=False) as session:
        episode = session.run()
        assert episode.success, episode.final_detail
        assert session.judge().success
        return str(episode.plan)


@claim
def what_is_not_there_is_told_with_what_is() -> str:
    scene = find_task("pick_cube_franka").scene
    plant = PlantProcess(scene)
    try:
        load_driver("ros2", scene).close()
        said = [
            raised(lambda given=given: load_driver("ros2", scene, {"discovery": 6.0, **given}), *words)
            for given, words in (
                ({"prefix": "left_"}, ("nobody tells of left_joint1", "joint states come of joint1")),
                (
                    {"controller": "/other"},
                    ("/other/follow_joint_trajectory", "there is /joint_trajectory_controller/follow_joint_trajectory"),
                ),
                ({"gripper": "/hand/gripper_cmd"}, ("/hand/gripper_cmd", "/gripper_controller/gripper_cmd")),
                ({"cameras": "/front"}, ("/front/camera_info",)),
                ({"wrench": "/ft"}, ("no wrench comes on /ft",)),
                ({"wrench": "/wrench", "world": "map"}, ("/tf leads from tool0 to no map",)),
            )
        ]
    finally:
        plant.close()
    return "; ".join(said)


@claim
def a_goal_that_is_rejected_is_a_fault_that_is_recovered_from() -> str:
    with opened() as (driver, plant):
        plant.referee.inject("active", 0.0)
        before = driver.state().q
        said = raised(lambda: sweep(driver, 0.2, 1.0), "the controller did not take the trajectory")
        assert np.abs(driver.state().q - before).max() < 0.002
        assert driver.mode == "fault"
        plant.referee.inject("active", 1.0)
        driver.recover()
        sweep(driver, 0.2, 1.0)
        driver.wait(0.3)
        assert abs(driver.state().q[0] - before[0] - 0.2) < 0.01
    return said


@claim
def a_tolerance_that_is_violated_is_told_with_the_controllers_words() -> str:
    with opened() as (driver, plant):
        said, when = while_moving(driver, lambda: plant.referee.inject("path_tolerance", 1e-5))
        assert "PATH_TOLERANCE_VIOLATED" in said and "off its path" in said, said
        return f"{said}; stood after {stood_after(plant, when):.2f} s"


@claim
def a_controller_whose_speed_is_scaled_down_gets_there() -> str:
    told = []
    for feedback in (1.0, 0.0):
        with opened() as (driver, plant):
            driver.behind.answer = 1.0
            plant.referee.inject("feedback", feedback)
            plant.referee.inject("speed", 0.25)
            before, began = driver.state().q[0], time.monotonic()
            sweep(driver, 0.3, 1.5)
            took = time.monotonic() - began
            assert took > 4.0 and abs(driver.state().q[0] - before - 0.3) < 0.01, took
            timer = threading.Timer(1.0, lambda plant=plant: plant.referee.inject("speed", 0.0))
            timer.start()
            began = time.monotonic()
            said = raised(lambda driver=driver: sweep(driver, 0.3, 1.5), "does not get on")
            gave_up = time.monotonic() - began
            timer.join()
            assert gave_up < 4.5, gave_up
            told.append(
                f"{'with' if feedback else 'without'} feedback {took:.1f} s; at 0 % after {gave_up:.1f} s: {said}"
            )
    return "; ".join(told)


@claim
def a_second_client_that_moves_the_arm_is_noticed() -> str:
    with opened() as (driver, plant):
        other = load_driver("ros2", find_task("pick_cube_franka").scene, {"link_timeout": 0.5})
        try:

            def interfere() -> float:
                behind = other.behind
                q = other.state().q
                behind.link.follow(driver.arms["arm"].spec.joints, q[None], None, np.array([0.5]))
                return time.monotonic()

            said, when = while_moving(driver, interfere)
        finally:
            other.close()
        assert "gave the trajectory up" in said and "another client" in said, said
        return f"{said}; stood after {stood_after(plant, when):.2f} s"


@claim
def silent_joint_states_stop_the_arm() -> str:
    with opened(link_timeout=0.2) as (driver, plant):
        said, when = while_moving(driver, lambda: plant.referee.inject("silent"))
        assert "the robot was last heard of" in said and driver.mode == "lost", (said, driver.mode)
        time.sleep(0.5)
        stood = stood_after(plant, when)
        assert stood < 1.0, stood
        raised(lambda: driver.arms["arm"].stop() or sweep(driver, 0.1, 1.0), "nothing moves before recover()")
        plant.referee.inject("silent", 0.0)
        time.sleep(0.3)
        driver.recover()
        sweep(driver, 0.1, 1.0)
        return f"{said}; stood after {stood:.2f} s"


@claim
def joint_states_of_nan_are_no_readings() -> str:
    with opened(link_timeout=0.2) as (driver, plant):
        plant.referee.inject("nan_speeds")
        time.sleep(0.2)
        moved: list[float] = []
        leave = driver.subscribe(lambda: moved.append(driver.state().qd[0]))
        before = driver.state().q[0]
        # Speeds are taken from positions then.
        sweep(driver, 0.3, 2.0)
        leave()
        assert abs(driver.state().q[0] - before - 0.3) < 0.01
        fastest = max(moved)
        assert np.isfinite(moved).all() and 0.15 < fastest < 0.35, fastest
        said, when = while_moving(driver, lambda: plant.referee.inject("nan_positions"))
        assert "the robot was last heard of" in said and driver.mode == "lost", (said, driver.mode)
        time.sleep(0.5)
        stood = stood_after(plant, when)
        assert stood < 1.0, stood
        raised(driver.recover, "is told as NaN")
        plant.referee.inject("nan_positions", 0.0)
        time.sleep(0.3)
        driver.recover()
        sweep(driver, 0.1, 1.0)
    return f"without speeds 0.3 rad, {fastest:.2f} rad/s at most; without positions {said}; stood after {stood:.2f} s"


@claim
def a_link_that_hears_nothing_more_is_a_fault_that_is_recovered_from() -> str:
    with opened() as (driver, plant):

        def fails() -> None:
            raise ValueError("no such number")

        def end() -> float:
            driver.behind.link._executor.create_task(fails)
            return time.monotonic()

        said, when = while_moving(driver, end)
        assert "nothing is heard of ROS 2 any more" in said, said
        time.sleep(0.5)
        stood = stood_after(plant, when)
        driver.recover()
        sweep(driver, 0.1, 1.0)
    return f"{said}; stood after {stood:.2f} s"


@claim
def late_joint_states_stop_the_arm() -> str:
    with opened(link_timeout=0.2) as (driver, plant):
        said, when = while_moving(driver, lambda: plant.referee.inject("late", 0.3))
        assert "the robot was last heard of" in said, said
        time.sleep(0.5)
        return f"{said}; stood after {stood_after(plant, when):.2f} s"


@claim
def a_controller_that_is_started_again_is_found_again() -> str:
    with opened() as (driver, plant):

        def restart() -> float:
            plant.kill()
            return time.monotonic()

        said, _ = while_moving(driver, restart)
        raised(driver.recover, "last heard of")
        plant.start()
        end = time.monotonic() + 20.0
        while True:
            try:
                driver.recover()
                break
            except FaultError:
                assert time.monotonic() < end, "it is not found again"
                time.sleep(0.2)
        sweep(driver, 0.1, 1.0)
        return said


def speeds_of(told: np.ndarray, limits: np.ndarray) -> tuple[int, float, float]:
    """Return on how many of a plant's ticks a goal was followed, and the largest shares of the limits of speed asked for and gone at.

    Asked for is from one tick of a goal to its next, and the first is where the arm was: that is what its points ask for, and the
    join before them. Where a goal begins or is cancelled the controller itself steps to where the arm is measured, which no client
    can help. Gone is over a tenth of a second: within single ticks a servo that is stepped back trembles, and gets nowhere by it.
    """
    joints = len(limits)
    goals, commands, been = told[:, 0], told[:, 1 : 1 + joints], told[:, 1 + joints :]
    ours = (goals[1:] == goals[:-1]) & (goals[1:] > 0.0)
    asked = (np.abs(np.diff(commands, axis=0)) / TICK / limits)[ours].max()
    window = round(0.1 / TICK)
    went = (np.abs(been[window:] - been[:-window]) / (window * TICK) / limits).max()
    return int(ours.sum()), float(asked), float(went)


@claim
def a_way_that_begins_beside_the_arm_is_gone_to_within_its_speed() -> str:
    with opened() as (driver, plant):
        spec = driver.arms["arm"].spec
        beside = driver.state().q + 0.04 * spec.velocity_limits
        driver.arms["arm"].follow(Trajectory(q=np.tile(beside, (20, 1)), dt=0.01))
        assert np.abs(driver.state().q - beside).max() < 0.02
        _, asked, went = speeds_of(plant.referee.commands(), spec.velocity_limits)
    # By the cubic from standing to standing, which takes the time that a line at full speed does, it would be 1.5.
    assert 0.5 < asked < 1.01 and went < 1.05, (asked, went)
    return f"fastest {asked:.3f} of the limit asked, {went:.3f} gone"


@claim
def no_command_of_a_fuzzer_reaches_the_plant_outside_the_limits(seconds: float = 20.0, seed: int = 0) -> str:
    random = np.random.default_rng(seed)
    sent = refused = 0
    with opened() as (driver, plant):
        arm = driver.arms["arm"]
        spec = arm.spec
        end = time.monotonic() + seconds
        while time.monotonic() < end:
            q = arm.state().q
            rows = int(random.integers(1, 30))
            scale = 10.0 ** random.uniform(-4, 1)
            path = q + np.cumsum(random.normal(scale=scale, size=(rows, spec.n)), axis=0) * (random.random() < 0.9)
            if random.random() < 0.1:
                path[random.integers(rows), random.integers(spec.n)] = random.choice([np.nan, np.inf, 1e9, -1e9])
            try:
                if random.random() < 0.2:
                    arm.trim(path[0])
                else:
                    arm.follow(
                        Trajectory(q=path, dt=float(10.0 ** random.uniform(-3, -1.3)), goes_on=random.random() < 0.3)
                    )
            except (SkillError, ValueError):
                refused += 1
                if driver.fault:
                    driver.wait(0.3)
                    driver.recover()
            sent += 1
        told = plant.referee.commands()
    commands = told[:, 1 : 1 + spec.n]
    # What the servo's integral action may shift a command by, beyond the limits of positions (`Ros2` says so).
    low, high = spec.lower - 0.301, spec.upper + 0.301
    assert (commands >= low).all() and (commands <= high).all()
    ours, asked, went = speeds_of(told, spec.velocity_limits)
    assert asked < 1.01, f"the plant was asked for {asked:.3f} of a joint's limit of speed"
    assert went < 1.05, f"the plant moved at {went:.3f} of a joint's limit of speed"
    return (
        f"{sent} commands, {refused} refused; {ours} ticks of the plant on the ways of {len({*told[:, 0]}) - 1} goals, "
        f"fastest {asked:.3f} of the limit asked, {went:.3f} gone"
    )


def free_endpoint() -> str:
    """Return an endpoint of this machine that nobody listens on."""
    with socket.socket() as found:
        found.bind(("127.0.0.1", 0))
        return f"tcp/127.0.0.1:{found.getsockname()[1]}"


@contextmanager
def node_process(*arguments: str) -> Iterator[subprocess.Popen[bytes]]:
    """Serve a workcell as a node in a process of its own."""
    process = subprocess.Popen([str(Path(sys.executable).with_name("robo-sandbox")), "ros2", *arguments])
    try:
        yield process
    finally:
        process.terminate()
        ended = process.wait(20.0)
    assert ended == 0, f"the node ended with {ended}"


@contextmanager
def served(*arguments: str) -> Iterator[Visitor]:
    """Serve a workcell as a node in a process of its own, and visit it."""
    with node_process(*arguments):
        visitor = Visitor()
        try:
            visitor.wait()
            yield visitor
        finally:
            visitor.close()


@claim
def a_silent_robot_is_lost_though_the_node_tells_of_it() -> str:
    plant = PlantProcess(find_task("pick_cube_franka").scene)
    driver = "ros2:gripper=/gripper_controller/gripper_cmd,cameras=/scene,link_timeout=0.2,answer=5"
    try:
        with served("--task", "pick_cube_franka", "--perception", "rgbd", "--driver", driver) as visitor:
            told = {each.node_name for each in visitor.node.get_publishers_info_by_topic("/joint_states")}
            assert told == {"plant"}, told
            assert set(visitor.next(JointState, "/robosandbox/joint_states").name) >= {"joint1"}
            cut: list[float] = []
            began = time.monotonic()

            def fall_silent() -> None:
                while sum(speed > 0.1 for _, speed in plant.referee.speeds(began)) < 30:
                    time.sleep(0.02)
                cut.append(plant.referee.inject("silent"))

            threading.Thread(target=fall_silent, daemon=True).start()
            ended = visitor.perform("pick", object="red_cube")
            assert not ended.success and "last heard of" in ended.message, ended.message
            time.sleep(0.5)
            moved = stood_after(plant, cut[0])
            assert moved < 0.5, moved
            stamped = visitor.next(JointState, "/robosandbox/joint_states").header.stamp
            age = time.time() - stamped.sec - 1e-9 * stamped.nanosec
            assert age > 0.4, age
    finally:
        plant.close()
    return f"{ended.message}; stood after {moved:.2f} s, joint states are {age:.1f} s old"


@claim
def an_outside_node_sees_and_is_answered() -> str:
    with served("--task", "pick_from_three", "--pace", "fast") as visitor:
        seen = look_round(visitor)
        pictures = see(visitor)
        asked = visitor.say("pick up the cube")
        assert not asked.success and "Which one do you mean" in asked.message, asked.message
        answered = visitor.say("the left one")
        assert answered.success, answered.message
        assert any("grasp" in line for line in visitor.heard), visitor.heard
        assert visitor.call(Look, "look").things.held == ["blue_cube"]
        undone = visitor.perform("undo")
        assert undone.success and visitor.call(Look, "look").things.held == []
        picked = visitor.perform("pick", object="green_cube")
        assert picked.success and json.loads(picked.data)["skill"] == "pick"
        assert visitor.call(Trigger, "judge").success
        assert visitor.call(Reset, "reset", seed=3).success and not visitor.call(Trigger, "judge").success
        assert visitor.call(Load, "load", task="put_in_bin").message.startswith("put_in_bin")
        assert "grey_bin" in look_round(visitor)
        planned = visitor.perform("plan", prompt="put the red cube in the bin")
        assert planned.success and "place_in" in planned.data
        for name, arguments, code in (
            ("pick", {"object": "banana"}, "object_not_found"),
            ("pick", {"thing": "red_cube"}, "invalid_argument"),
            ("run", {"prompt": "go home"}, "invalid_argument"),
            ("no_such_skill", {}, "invalid_argument"),
        ):
            wrong = visitor.perform(name, **arguments)
            assert not wrong.success and wrong.code == code, (name, wrong.code, wrong.message)
        return f"{seen}; pictures {pictures}"


@claim
def an_outside_node_cancels_and_stops() -> str:
    with served("--task", "pick_from_three", "--pace", "realtime") as visitor:
        began = time.monotonic()
        cancelled = visitor.perform("pick", object="red_cube", cancel_after=1.0)
        took = time.monotonic() - began - 1.0
        assert not cancelled.success and cancelled.code == "cancelled", cancelled.message
        assert visitor.perform("open_gripper").success, "it goes on"
        busy = visitor.node.create_client(Trigger, "/robosandbox/stop")
        assert busy.wait_for_service(10.0)
        timer = visitor.node.create_timer(1.5, lambda: (timer.cancel(), busy.call_async(Trigger.Request())))
        stopped = visitor.say("pick up the red cube")
        assert not stopped.success, stopped.message
        return f"cancelled within {took:.2f} s; {stopped.message}"


@claim
def bytes_and_hashes_without_ros_are_those_of_the_wheels() -> str:
    return wire.compare(200)


@claim
def a_bag_of_the_topics_is_read_back_by_another_reader() -> str:
    with served("--task", "pick_from_three") as visitor, tempfile.TemporaryDirectory() as place:
        folder, topics = Path(place) / "bag", bag.topics()

        def pick() -> None:
            assert visitor.perform("pick", object="red_cube").success
            visitor.spin(1.0)

        count = bag.record(visitor, topics, folder, pick)
        size = sum(file.stat().st_size for file in folder.iterdir())
        found = bag.read(folder)
    assert {topic: len(messages) for topic, messages in found.items()} == count and count.keys() == topics.keys(), count
    joints, pictures = found["/joint_states"], found["/robosandbox/scene/image_raw"]
    stamps = [one.header.stamp.sec + 1e-9 * one.header.stamp.nanosec for one in joints]
    assert stamps == sorted(stamps) and max(np.ptp([one.position for one in joints], axis=0)) > 0.3, "nothing moved"
    assert all(len(one.data) == one.step * one.height for one in pictures) and len(np.unique(pictures[-1].data)) > 20
    assert found["/robosandbox/things"][-1].held == ["red_cube"]
    assert {one.child_frame_id for one in found["/tf"][0].transforms} >= {"tcp", "scene_optical"}
    return (
        f"{sum(count.values())} messages of {len(count)} topics in {stamps[-1] - stamps[0]:.1f} s, {size / 1e6:.1f} MB"
    )


@claim
def a_node_of_pyzeros_sees_and_is_answered_over_rmw_zenoh() -> str:
    router = free_endpoint()
    config = zenoh.Config()
    for key, value in {"mode": "router", "listen/endpoints": [router], "scouting/multicast/enabled": False}.items():
        config.insert_json5(key, json.dumps(value))
    command = [str(Path(sys.executable).with_name("robo-sandbox")), "ros2", "--task", "pick_from_three"]
    with zenoh.open(config):
        process = subprocess.Popen([*command, "--rmw-zenoh", router])
        try:
            seen = pyzeros_visitor.visited(router, ["pick up the cube", "the left one", "what do you hold?"])
        finally:
            process.terminate()
            ended = process.wait(20.0)
    assert ended == 0, f"the node ended with {ended}"
    (asked, picked, held) = seen.results
    assert asked[:2] == (6, False) and "Which one do you mean" in asked[2], asked
    assert picked[:2] == (4, True) and "blue_cube" in held[2], (picked, held)
    assert any("grasp" in line for line in seen.feedback), seen.feedback
    return f"{seen.joints} joints {1000 * seen.joint_age:.0f} ms old, {seen.picture}, {seen.tokens} tokens; {held[2]}"


def main() -> None:
    """Try the claims that are named, or all."""
    for name in sys.argv[1:] or CLAIMS:
        began = time.monotonic()
        said = CLAIMS[name]()
        print(f"{name}: {said} ({time.monotonic() - began:.1f} s)", flush=True)


if __name__ == "__main__":
    main()
