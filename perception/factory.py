"""Perceptions by name, and what a perception may know before its first look."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import field
from typing import Any

from robosandbox.motion.beliefs import DeclaredProperties
from robosandbox.perception.naming import Declared
from robosandbox.perception.protocols import Perception
from robosandbox.plugins import make_plugin
from robosandbox.types import Scene
from robosandbox.values import frozen


@frozen(kw_only=True)
class Setup:
    """Prior knowledge of the place: the table, and names and looks of the task's objects, not where they are.

    Attributes:
        scene: Robot and table; its objects are left out.
        declared: The task's objects.
        known: What the task says of them that no camera shows, by id.
    """

    scene: Scene = field(default_factory=Scene)
    declared: tuple[Declared, ...] = field(default_factory=tuple)
    known: Mapping[str, DeclaredProperties] = field(default_factory=dict)

    @classmethod
    def of(cls, scene: Scene) -> Setup:
        """Return what a task says of its scene, places left out."""
        bare = scene.model_copy(update={"objects": ()})
        return cls(
            scene=bare,
            declared=tuple(Declared.of(item) for item in scene.objects),
            known={item.id: DeclaredProperties.of(item) for item in scene.objects},
        )


def make_perception(name: str, setup: Setup, options: Mapping[str, Any] | None = None) -> Perception:
    """Return an installed perception.

    Args:
        name: As registered under `robosandbox.perceptions`.
        setup: Given to those that take `setup`.
        options: Keyword arguments of its own; those that are None count as not given.

    Raises:
        InputError: There is none, it does not load or is none, or it takes no such option.
    """
    perception: Perception = make_plugin("perceptions", Perception, name, options=options, supplied={"setup": setup})
    return perception
