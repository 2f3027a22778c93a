"""What a client asks of the world is bounded and can be given up: by another message, by its loss, by SIGTERM."""

import json
import threading
import time
import uuid
from collections.abc import Callable, Iterator
from typing import Any

import pytest
from support.processes import SimProcess

from robosandbox.errors import CancelledError, InputError
from robosandbox.workcell.zenoh.client import connect
from robosandbox.workcell.zenoh.client.robot import RemoteRobot
from robosandbox.workcell.zenoh.server.loader import MOST_BODIES

# Wall time within which a process ends at SIGTERM on an idle machine is below a second; others may run beside.
SECONDS_TO_END = 10.0


def beads(bins: int, per_bin: int = 100) -> dict[str, Any]:
    """Return a task with bins full of beads, as small as JSON has it."""
    objects: list[dict[str, Any]] = []
    for number in range(bins):
        place = [0.1 * (number % 4), -0.3 + 0.12 * (number // 4), 0.06]
        objects.append({"id": f"c{number}", "kind": "bin", "size": [0.03, 0.03, 0.05], "pose": {"xyz": place}})
        objects.append({"id": f"b{number}", "kind": "beads", "size": [0.004], "inside": f"c{number}", "count": per_bin})
    return {"name": "many", "prompt": "go home", "scene": {"objects": objects}, "success": {"kind": "at_home"}}


@pytest.fixture(scope="module")
def sim() -> Iterator[SimProcess]:
    with SimProcess("--task", "pick_cube_franka") as process:
        yield process


@pytest.fixture
def robot(sim: SimProcess) -> Iterator[RemoteRobot]:
    with connect(sim.endpoint) as client:
        robot = client.robot()
        robot.load("pick_cube_franka")
        yield robot


def begun(robot: RemoteRobot, ask: Callable[[], object], name: str) -> tuple[threading.Thread, list[Exception]]:
    """Ask in a thread; return when the sim is at it."""
    raised: list[Exception] = []

    def run() -> None:
        try:
            ask()
        except Exception as error:
            raised.append(error)

    thread = threading.Thread(target=run)
    thread.start()
    while robot.info().doing != name:
        assert thread.is_alive(), raised
    return thread, raised


def test_step_of_the_clock_is_given_up_and_the_world_goes_on(robot: RemoteRobot) -> None:
    before = robot.state().robot.time
    thread, raised = begun(robot, lambda: robot.step(60.0), "clock")
    robot.give_up()
    thread.join(10.0)
    assert isinstance(raised[0], CancelledError)
    assert robot.state().robot.time - before < 30.0
    assert robot.send("home").wait(60.0).skill == "home"


def test_reset_that_is_given_up_leaves_the_world_as_it_was(robot: RemoteRobot) -> None:
    robot.set_pace("fast")
    robot.load(document=beads(2))
    before = robot.truth()
    thread, raised = begun(robot, lambda: robot.reset(0), "reset")
    robot.give_up()
    thread.join(30.0)
    assert isinstance(raised[0], CancelledError)
    assert robot.truth().time >= before.time
    moved = [
        abs(a - b)
        for old, new in zip(before.objects.values(), robot.truth().objects.values(), strict=True)
        for a, b in zip(old.pose.xyz, new.pose.xyz, strict=True)
    ]
    assert max(moved) < 1e-3


def test_load_that_is_given_up_leaves_the_task_as_it_was(robot: RemoteRobot) -> None:
    thread, raised = begun(robot, lambda: robot.load(document=beads(2)), "load")
    robot.give_up()
    thread.join(30.0)
    assert isinstance(raised[0], CancelledError)
    assert robot.info().task["name"] == "pick_cube_franka"
    assert robot.send("pick", {"object": "red_cube"}).wait(120.0).skill == "pick"


def test_change_of_a_lost_client_is_given_up(sim: SimProcess) -> None:
    with connect(sim.endpoint) as client:
        message = json.dumps({"step": 60.0, "client_id": str(uuid.uuid4())}).encode()
        # That client has no token, as one that died while it asked.
        replies = list(client.session.get("robosandbox/robot/clock", payload=message, timeout=60.0))
        assert replies[0].err is not None
        assert json.loads(replies[0].err.payload.to_bytes())["code"] == "cancelled"


@pytest.mark.parametrize("name", ["clock", "load", "reset"])
def test_sigterm_ends_the_process_during_a_change(name: str) -> None:
    with SimProcess("--task", "pick_cube_franka") as sim, connect(sim.endpoint) as client:
        robot = client.robot()
        if name == "reset":
            robot.load(document=beads(2))
        asks: dict[str, Callable[[], object]] = {
            "clock": lambda: robot.step(60.0),
            "load": lambda: robot.load(document=beads(2)),
            "reset": lambda: robot.reset(0),
        }
        thread, _ = begun(robot, asks[name], name)
        begin = time.monotonic()
        assert sim.stop() == 0
        assert time.monotonic() - begin < SECONDS_TO_END
    thread.join(60.0)


def test_task_of_more_bodies_than_a_client_may_load_is_refused_before_it_is_made(sim: SimProcess) -> None:
    document = beads(18)
    assert len(json.dumps(document)) < 6000
    with connect(sim.endpoint) as client:
        robot = client.robot()
        with pytest.raises(InputError, match=rf"scene\.objects: .*1818 bodies; .*1 to {MOST_BODIES}"):
            robot.load(document=document)
        # Small in bodies, large in shapes.
        cups = [
            {
                "id": f"c{n}",
                "kind": "cup",
                "size": [0.01, 0.03],
                "pose": {"xyz": [0.03 * (n % 9), 0.03 * (n // 9), 0.05]},
            }
            for n in range(120)
        ]
        with pytest.raises(InputError, match="shapes"):
            robot.load(document={**beads(1), "scene": {"objects": cups}})


def test_objects_that_all_start_in_one_place_are_refused(sim: SimProcess) -> None:
    cups = [{"id": f"c{n}", "kind": "cup", "size": [0.02, 0.05], "pose": {"xyz": [0.2, 0.0, 0.06]}} for n in range(30)]
    with connect(sim.endpoint) as client, pytest.raises(InputError, match=r"move (it|them) apart"):
        client.robot().load(document={**beads(1), "scene": {"objects": cups}})
