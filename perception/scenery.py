"""All that one look gives: the views, where the robot is in each, and the table."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from robosandbox.perception.view import Image, Mask, Table, View


@dataclass(frozen=True, slots=True, eq=False)
class Look:
    """One camera's view and the robot in it.

    Attributes:
        view: What it shows.
        robot: Where the robot is, (height, width).
        robot_near: How near its nearest part is there, metres.
    """

    view: View
    robot: Mask
    robot_near: Image


@dataclass(frozen=True, slots=True, eq=False)
class Scenery:
    """What all cameras show.

    Attributes:
        looks: By camera.
        table: What is known of it.
    """

    looks: Mapping[str, Look]
    table: Table
