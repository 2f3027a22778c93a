"""`ros2`: the workcell as a node of a ROS 2 graph."""

from __future__ import annotations

import os
import re
import signal
import sys
import threading
from pathlib import Path
from typing import Annotated

import typer

from robosandbox.apps.commands.console import EXIT_DONE, ending_with_threads
from robosandbox.apps.commands.recording import Video, VideoFps, record_settings
from robosandbox.apps.commands.world import open_here, takes_world
from robosandbox.errors import InputError
from robosandbox.workcell.options import WorkcellOptions
from robosandbox.workcell.ros2.graph import Graph

# Between looks for a signal, seconds, so that Ctrl-C acts at once.
_WAKE_SECONDS = 0.2


@takes_world(without=("camera", "calibration"))
def ros2(
    world: WorkcellOptions,
    name: Annotated[str, typer.Option("--name", help="Of the node, before its topics and actions.")] = "robosandbox",
    world_frame: Annotated[
        str,
        typer.Option(
            "--world-frame",
            help="Frame of tf that is the world of what is told, where a driver of a real arm has another than `world`.",
        ),
    ] = "world",
    pace: Annotated[str, typer.Option("--pace", help="realtime, or fast.")] = "realtime",
    rmw_zenoh: Annotated[
        str | None,
        typer.Option(
            "--rmw-zenoh",
            help="Without rclpy, as a node that ROS 2 on rmw_zenoh sees: Zenoh endpoint of its router, as "
            "tcp/localhost:7447. Experimental.",
        ),
    ] = None,
    interfaces: Annotated[
        bool, typer.Option("--interfaces", help="Print where the package robosandbox_msgs is, for colcon, and end.")
    ] = False,
    record: Annotated[
        Path | None, typer.Option("--record", help="Keep each goal in a folder of its own in this folder.")
    ] = None,
    video: Video = None,
    video_fps: VideoFps = 20.0,
) -> int:
    """Serve a world as a ROS 2 node until SIGINT or SIGTERM: state, pictures, things, actions and services."""
    if interfaces:
        import robosandbox.workcell.ros2 as face

        print(Path(face.__file__).parent / "robosandbox_msgs")
        return EXIT_DONE
    if not re.fullmatch(r"[A-Za-z_][A-Za-z0-9_]*", name):
        raise InputError(f"--name: {name[:60]!r} is no name of a node; use letters, digits and '_'")
    if pace not in ("realtime", "fast"):
        raise InputError(f"--pace: {pace!r} is not one of realtime, fast")
    settings = record_settings(record, video, video_fps)
    graph = _rclpy_graph(name) if rmw_zenoh is None else _rmw_zenoh_graph(name, rmw_zenoh)
    from robosandbox.workcell.host import WorkcellHost
    from robosandbox.workcell.ros2.node import WorkcellNode

    stopped = threading.Event()
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, lambda *_: stopped.set())
    with open_here(world) as cell:
        host = WorkcellHost(cell, pace="fast" if pace == "fast" else "realtime", record=settings)
        host.start()
        node = WorkcellNode(host, graph, world=world_frame)
        with ending_with_threads("robo-sandbox"):
            node.start()
            print(f"node /{name}: {cell.task.name} with {cell.robot_name}", flush=True)
            while not stopped.wait(_WAKE_SECONDS):
                pass
            print("stopping", file=sys.stderr, flush=True)
            node.close()
        host.stop_all()
        host.wait_idle(_WAKE_SECONDS)
        host.end()
    return EXIT_DONE


def _rclpy_graph(name: str) -> Graph:
    # Read when the node is made: nobody beyond this machine, unless the person has said so.
    os.environ.setdefault("ROS_AUTOMATIC_DISCOVERY_RANGE", "LOCALHOST")
    try:
        from robosandbox.workcell.ros2.rclpy_graph import RclpyGraph

        graph = RclpyGraph(name)
        # What is built by hand, so that its lack is told before the world is opened.
        graph.kind("robosandbox_msgs/msg/Things")
    except ImportError as error:
        if error.name is None or error.name.startswith("robosandbox."):
            raise
        raise InputError(
            f"ros2: Python cannot import {error.name!r}: source your ROS 2 in this shell, and build robosandbox_msgs with "
            "`colcon build --paths $(robo-sandbox ros2 --interfaces)`; docs/ros2.md"
        ) from None
    return graph


def _rmw_zenoh_graph(name: str, router: str) -> Graph:
    from robosandbox.workcell.ros2.rmw_zenoh import RmwZenohGraph

    domain = os.environ.get("ROS_DOMAIN_ID", "0")
    if not domain.isdecimal():
        raise InputError(f"ROS_DOMAIN_ID: {domain[:60]!r} is no number")
    return RmwZenohGraph(name, router=router, domain=int(domain))
