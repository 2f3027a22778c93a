"""What the service costs beside bare Zenoh, in one run on one machine.

    python benchmarks/service.py [--goals 300] [--seconds 20] [--json]

A bare Zenoh process answers 200-byte queries; a sim process takes goals, with a state file, so that each is written down before
it is answered. Both are asked in turn, so that load from elsewhere hits both alike. What a write and a flush cost on the disk
of the state file is timed as well. Then the state stream is timed while skills run, and pictures are counted with and without a listener.
"""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import sys
import tempfile
import time
import uuid
from pathlib import Path
from typing import Any

import numpy as np
import zenoh
from support.processes import SimProcess, free_port

from robosandbox.errors import ServiceError, UnsupportedError
from robosandbox.workcell.zenoh.client import RemoteRobot, connect
from robosandbox.workcell.zenoh.messages import SendGoal
from robosandbox.workcell.zenoh.server.loader import TaskLoader
from robosandbox.workcell.zenoh.server.server import SimServer
from robosandbox.workcell.zenoh.transport import open_connector, open_listener

_BARE = """
import json
import sys
import zenoh
config = zenoh.Config()
config.insert_json5("listen/endpoints", json.dumps([sys.argv[1]]))
config.insert_json5("scouting/multicast/enabled", "false")
session = zenoh.open(config)
def answer(query):
    with query:
        query.reply("bare/echo", query.payload)
queryable = session.declare_queryable("bare/echo", answer)
print("ready", flush=True)
sys.stdin.read()
session.close()
"""


def round_trips(goals: int) -> dict[str, Any]:
    """Time bare queries and send_goal in turn."""
    endpoint = f"tcp/127.0.0.1:{free_port()}"
    bare = subprocess.Popen(
        [sys.executable, "-c", _BARE, endpoint], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
    )
    try:
        if not bare.stdout or bare.stdout.readline() != "ready\n":
            raise SystemExit("the bare process did not start")
        with (
            tempfile.TemporaryDirectory() as folder,
            SimProcess("--task", "home", state_file=Path(folder, "world.json")) as sim,
            connect(sim.endpoint) as client,
            open_connector([endpoint], timeout=10.0) as session,
        ):
            robot = client.robot()
            times: dict[str, list[float]] = {"bare": [], "send_goal": []}
            size = 0
            for _ in range(goals):
                message = SendGoal(goal_id=str(uuid.uuid4())).encode()
                size = len(message)
                times["bare"].append(_timed(session, "bare/echo", b"x" * 200))
                times["send_goal"].append(_timed(client.session, "robosandbox/robot/skill/home/send_goal", message))
                goal = robot.send("home", goal_id=json.loads(message)["goal_id"])
                goal.wait(30.0)
    finally:
        bare.communicate("", timeout=10.0)
    p50 = {name: float(np.percentile(values, 50)) for name, values in times.items()}
    p99 = {name: float(np.percentile(values, 99)) for name, values in times.items()}
    return {
        "goals": goals,
        "send_goal_bytes": size,
        "bare_p50_ms": round(p50["bare"], 3),
        "bare_p99_ms": round(p99["bare"], 3),
        "send_goal_p50_ms": round(p50["send_goal"], 3),
        "send_goal_p99_ms": round(p99["send_goal"], 3),
        "ratio_p50": round(p50["send_goal"] / p50["bare"], 2),
    }


def disk(records: int) -> dict[str, Any]:
    """Time what the journal of accepted goals does: a record written, and its flush to the disk."""
    times: dict[str, list[float]] = {"write": [], "flush": []}
    with tempfile.NamedTemporaryFile(buffering=0) as file:
        for _ in range(records):
            begin = time.perf_counter()
            file.write(b"x" * 400)
            middle = time.perf_counter()
            getattr(os, "fdatasync", os.fsync)(file.fileno())
            times["write"].append(1000.0 * (middle - begin))
            times["flush"].append(1000.0 * (time.perf_counter() - middle))
    return {
        f"{name}_p{percent}_ms": round(float(np.percentile(values, percent)), 3)
        for name, values in times.items()
        for percent in (50, 99)
    }


def _timed(session: zenoh.Session, key: str, payload: bytes) -> float:
    begin = time.perf_counter()
    answered = [reply.ok is not None for reply in session.get(key, payload=payload, timeout=10.0)]
    took = 1000.0 * (time.perf_counter() - begin)
    if answered != [True]:
        raise SystemExit(f"{key} was not answered")
    return took


def state_stream(seconds: float, pace: str) -> dict[str, Any]:
    """Time the arrivals of states while skills run."""
    with SimProcess("--task", "pick_from_three", "--pace", pace) as sim, connect(sim.endpoint) as client:
        robot = client.robot()
        arrivals: list[float] = []
        stream = robot.watch("obs/state", lambda _: arrivals.append(time.perf_counter()))
        begin, number = time.monotonic(), 0
        while time.monotonic() - begin < seconds:
            robot.reset(number)
            robot.send("pick", {"object": "red_cube"}).wait(60.0)
            number += 1
        stream.undeclare()
    gaps = 1000.0 * np.diff(arrivals)
    return {
        "pace": pace,
        "picks": number,
        "messages": len(arrivals),
        "hz": round(1000.0 / float(gaps.mean()), 1),
        "gap_p50_ms": round(float(np.percentile(gaps, 50)), 2),
        "gap_p99_ms": round(float(np.percentile(gaps, 99)), 2),
        "gap_max_ms": round(float(gaps.max()), 2),
    }


def pictures(seconds: float) -> dict[str, Any]:
    """Count what is drawn without and with a listener; the server is in this process, where its counter can be read."""
    loader = TaskLoader()
    endpoint = f"tcp/127.0.0.1:{free_port()}"
    session, _ = open_listener(endpoint)
    with session, SimServer(loader.open("pick_from_three"), session, robot_id="robot", load=loader.load) as server:
        with connect(endpoint) as client:
            robot = client.robot()
            robot.send("pick", {"object": "red_cube"}).wait(60.0)
            unseen = server.host.studio.frames
            try:
                payload, about = robot.picture("scene")
            except (ServiceError, UnsupportedError) as error:
                return {"frames_without_listener": unseen, "no_pictures": error.message}
            rate = _frame_rate(robot, seconds)
        time.sleep(0.3)
        after = server.host.studio.frames
        time.sleep(1.0)
        return {
            "frames_without_listener": unseen,
            "frames_after_the_listener_left": server.host.studio.frames - after,
            "size": f"{about.intrinsics.width}x{about.intrinsics.height}",
            "jpeg_bytes": len(payload),
            "frames_per_s": rate,
        }


def _frame_rate(robot: RemoteRobot, seconds: float) -> float:
    arrivals: list[float] = []
    stream = robot.watch("obs/camera/scene/rgb", lambda _: arrivals.append(time.monotonic()))
    time.sleep(seconds)
    stream.undeclare()
    return round((len(arrivals) - 1) / (arrivals[-1] - arrivals[0]), 1)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--goals", type=int, default=300)
    parser.add_argument("--seconds", type=float, default=20.0)
    parser.add_argument("--json", action="store_true")
    arguments = parser.parse_args()
    table = {
        "round_trip": round_trips(arguments.goals),
        "disk": disk(arguments.goals),
        "state_realtime": state_stream(arguments.seconds, "realtime"),
        "state_fast": state_stream(arguments.seconds, "fast"),
        "pictures": pictures(min(5.0, arguments.seconds)),
    }
    if arguments.json:
        print(json.dumps(table, indent=2))
        return
    for name, row in table.items():
        print(f"{name:16} {', '.join(f'{key}={value}' for key, value in row.items())}")


if __name__ == "__main__":
    main()
