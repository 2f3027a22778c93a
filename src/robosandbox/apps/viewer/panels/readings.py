"""Joint and gripper readings with their limits, the TCP, and what is held."""

from __future__ import annotations

import time

import numpy as np
import viser

from robosandbox.apps.viewer import html
from robosandbox.apps.viewer.source import Blueprint, Frame
from robosandbox.types import Pose
from robosandbox.types.robot import hand_of

_SECONDS = 0.2  # Seconds between readings. Chosen: faster nobody reads.


class ReadingsPanel:
    """Shows how the robot stands, five times a second while it moves.

    Args:
        server: Where.
    """

    def __init__(self, server: viser.ViserServer) -> None:
        self._board = server.gui.add_html("")
        self._sent = 0.0

    def draw(self, frame: Frame, blueprint: Blueprint) -> None:
        """Show a frame."""
        if time.monotonic() - self._sent < _SECONDS:
            return
        self._sent = time.monotonic()
        lines = [line for name in blueprint.robots for line in _arm(name, frame, blueprint)]
        lines.append(html.rows([("simulated time", f"{frame.seen.time:.2f} s")]))
        self._board.content = html.block(*lines)


def _arm(name: str, frame: Frame, blueprint: Blueprint) -> list[str]:
    """Return the readings of one arm; of several each heading says whose."""
    robot, seen = blueprint.robots[name], frame.seen.arms[name]
    whose = f", {name}" if len(blueprint.robots) > 1 else ""
    lines = [html.heading(f"Joints{whose}")]
    for index, joint in enumerate(robot.joints):
        low, high, q = float(robot.lower[index]), float(robot.upper[index]), float(seen.q[index])
        scale, unit = (float(np.degrees(1.0)), "°") if blueprint.turns(index, robot) else (1000.0, " mm")
        limits = f"{html.number(scale * low, 1)} to {html.number(scale * high, 1)}{unit}"
        lines.append(html.gauge(joint, q, low, high, f"{html.number(scale * q, 1)}{unit}", limits=limits))
    if seen.gripper is not None and robot.gripper is not None:
        geometry, gripper = robot.gripper.geometry, seen.gripper
        lines.append(html.heading(f"Gripper{whose}"))
        width = f"{html.number(1000 * gripper.width, 1)} mm"
        low, high = geometry.min_aperture, geometry.max_aperture
        limits = f"{1000 * low:.1f} to {1000 * high:.1f} mm"
        lines.append(html.gauge("opening", gripper.width, low, high, width, limits=limits, warn=False))
        measured = gripper.force
        force = "not measured" if measured is None else f"{html.number(measured, 1)} {blueprint.force_unit(robot)}"
        lines.append(html.rows([("force", force), ("holds", frame.hands.get(hand_of(name)) or "nothing")]))
    lines.append(html.heading(f"Tool centre point{whose}"))
    lines.append(html.rows(_pose(seen.tcp_pose)))
    return lines


def _pose(pose: Pose) -> list[tuple[str, str]]:
    place = ", ".join(html.number(1000 * c, 1) for c in pose.xyz)
    # The approach is the frame's z axis, and straight down is the world's -z.
    lean = html.number(float(np.degrees(np.arccos(np.clip(-pose.rotation[2, 2], -1.0, 1.0)))), 1)
    return [
        ("x, y, z", f"{place} mm"),
        ("approach", "straight down" if lean == "0.0" else f"{lean}° off straight down"),
    ]
