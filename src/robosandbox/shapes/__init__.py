"""Kinds of objects: one file each, answering for itself."""

from robosandbox.shapes.registry import kinds_that_hold, shape_of, shapes
from robosandbox.shapes.room import CONTAINER_WALL, Room
from robosandbox.shapes.shape import Shape, Size, Solid

__all__ = ["CONTAINER_WALL", "Room", "Shape", "Size", "Solid", "kinds_that_hold", "shape_of", "shapes"]
