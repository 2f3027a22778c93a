"""The node of ROS 2 over time: its latencies beside plain Zenoh's, and its growth in half an hour.

    uv run --project examples/drivers/ros2 python -m robosandbox_ros2.lasting latency [--goals 200]
    uv run --project examples/drivers/ros2 python -m robosandbox_ros2.lasting growth [--minutes 30]

`latency` asks a node and a sim process in turn, each with a robot at home, so that what else the machine does slows both: how long
until a goal is accepted, until its result is there, and until what is seen is answered. `growth` has an outside node say sentences,
look, take pictures and reset for so many minutes, and reads memory, threads and open files of the node's process.
"""

from __future__ import annotations

import argparse
import json
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from threading import Event, Thread
from typing import Any

import numpy as np
from rclpy.action import ActionClient
from rclpy.executors import SingleThreadedExecutor
from rclpy.task import Future
from robosandbox_msgs.action import Perform
from robosandbox_msgs.srv import Look, Reset
from std_srvs.srv import Trigger

from robosandbox.workcell.zenoh.client import connect
from robosandbox_ros2.claims import free_endpoint, node_process
from robosandbox_ros2.visitor import Visitor, look_round, see


@contextmanager
def sim_process(task: str) -> Iterator[str]:
    """Serve a task over Zenoh in a process of its own; yield its endpoint."""
    endpoint = free_endpoint()
    command = [str(Path(sys.executable).with_name("robo-sandbox")), "sim", "--task", task]
    command += ["--listen", endpoint]
    process = subprocess.Popen(command, stdout=subprocess.PIPE, text=True)
    assert process.stdout is not None
    try:
        assert endpoint in process.stdout.readline()
        yield endpoint
    finally:
        process.terminate()
        process.wait(20.0)


def timed(act: Callable[[], object]) -> float:
    """Return the milliseconds that an act takes."""
    began = time.perf_counter()
    act()
    return 1000.0 * (time.perf_counter() - began)


def latency(goals: int) -> None:
    """Print medians and 99th percentiles, ms, of what both are asked for in turn."""
    times: dict[str, list[float]] = {}
    with (
        node_process("--task", "home", "--pace", "realtime"),
        sim_process("home") as endpoint,
        connect(endpoint) as client,
    ):
        visitor, robot = Visitor(), client.robot()
        visitor.wait()
        performing = ActionClient(visitor.node, Perform, "/robosandbox/perform")
        looking = visitor.node.create_client(Look, "/robosandbox/look")
        assert performing.wait_for_server(20.0) and looking.wait_for_service(20.0)
        # Spun anew for each answer, rclpy has a client take longer for each.
        executor = SingleThreadedExecutor()
        executor.add_node(visitor.node)
        Thread(target=executor.spin, daemon=True).start()
        goal = Perform.Goal(name="home", arguments="{}")
        for _ in range(goals):
            handles: list[Any] = []
            sent: list[Any] = []

            def ask(handles: list[Any] = handles) -> None:
                handles.append(_done(performing.send_goal_async(goal)))

            def result(handles: list[Any] = handles) -> None:
                assert _done(handles[0].get_result_async()).result.success

            for name, act in (
                ("goal accepted, ROS 2", ask),
                ("then its result, ROS 2", result),
                ("look, ROS 2", lambda: _done(looking.call_async(Look.Request()))),
                ("goal accepted, Zenoh", lambda sent=sent: sent.append(robot.send("home"))),
                ("then its result, Zenoh", lambda sent=sent: sent[0].wait(30.0)),
                ("look, Zenoh", robot.look),
            ):
                times.setdefault(name, []).append(timed(act))
        executor.shutdown()
        visitor.close()
    for name, values in sorted(times.items()):
        print(f"{name}: median {np.median(values):.2f} ms, p99 {np.percentile(values, 99):.2f} ms")


def _done(asked: Future) -> Any:
    """Return what a future comes to, which another thread spins."""
    came = Event()
    asked.add_done_callback(lambda _: came.set())
    assert came.wait(30.0), "no answer"
    return asked.result()


def growth(minutes: float) -> None:
    """Print what a node's process takes, each minute, while an outside node uses it."""
    with node_process("--task", "pick_from_three", "--pace", "fast") as process:
        visitor = Visitor()
        visitor.wait()
        began, told, rounds = time.monotonic(), -1, 0
        while (gone := time.monotonic() - began) < 60.0 * minutes:
            assert visitor.call(Reset, "reset", seed=rounds % 50).success
            asked = visitor.say("pick up the cube")
            assert not asked.success and visitor.say("the left one").success
            look_round(visitor)
            see(visitor)
            visitor.perform("move_by", dz=0.02, cancel_after=0.02)
            visitor.call(Trigger, "judge")
            assert visitor.perform("undo").code in ("", "refused")
            rounds += 1
            if int(gone / 60.0) > told:
                told = int(gone / 60.0)
                print(json.dumps({"minute": told, "rounds": rounds, **taken(process.pid)}), flush=True)
        print(json.dumps({"minutes": minutes, "rounds": rounds, **taken(process.pid)}))
        visitor.close()


def taken(pid: int) -> dict[str, int]:
    """Return resident memory, MB, threads and open files of a process."""
    place = Path("/proc") / str(pid)
    resident = next(line for line in (place / "status").read_text().splitlines() if line.startswith("VmRSS"))
    return {
        "mb": int(resident.split()[1]) // 1024,
        "threads": len([*(place / "task").iterdir()]),
        "files": len([*(place / "fd").iterdir()]),
    }


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("what", choices=("latency", "growth"))
    parser.add_argument("--goals", type=int, default=200)
    parser.add_argument("--minutes", type=float, default=30.0)
    given = parser.parse_args()
    if given.what == "latency":
        latency(given.goals)
    else:
        growth(given.minutes)


if __name__ == "__main__":
    main()
