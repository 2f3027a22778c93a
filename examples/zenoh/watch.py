"""What an observer sees: every robot's goals as they go, and once a second where it stands.

    python watch.py observer.json5 tcp/sim-machine:7447

The endpoint is left out where the configuration names a router.
"""

from __future__ import annotations

import json
import sys
from contextlib import suppress
from pathlib import Path

import zenoh

from robosandbox.workcell.zenoh.client import RemoteRobot, connect


def main() -> int:
    if len(sys.argv) < 2:
        print(__doc__, file=sys.stderr)
        return 2
    config, *endpoints = sys.argv[1:]
    with connect(*endpoints, zenoh_config=Path(config)) as client:
        robots = [client.robot(robot_id) for robot_id in client.robots]
        watches = [watch for robot in robots for watch in follow(robot)]
        print(f"watching {', '.join(robot.id for robot in robots)}; Ctrl-C ends it", flush=True)
        with suppress(KeyboardInterrupt):
            sys.stdin.read()
        for watch in watches:
            watch.undeclare()
    return 0


def follow(robot: RemoteRobot) -> list[zenoh.Subscriber[None]]:
    def news(sample: zenoh.Sample) -> None:
        said = json.loads(sample.payload.to_bytes())
        print(f"{robot.id}: {said['skill']}: {said.get('phase') or said['status']}", flush=True)

    def state(sample: zenoh.Sample) -> None:
        said = json.loads(sample.payload.to_bytes())
        if said["seq"] % 50 == 0:
            x, y, z = said["robot"]["arms"]["arm"]["tcp_pose"]["xyz"]
            held = said["hands"]["hand"] or "nothing"
            print(f"{robot.id}: at {x:.3f} {y:.3f} {z:.3f} m, holds {held}", flush=True)

    return [robot.watch("goal/*/*", news), robot.watch("obs/state", state)]


if __name__ == "__main__":
    raise SystemExit(main())
