"""Perception as the other rooms ask it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Protocol, runtime_checkable

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from robosandbox.driver import Driver
    from robosandbox.motion.planning_scene import PlanningScene
    from robosandbox.types import Array, ObservedScene


@runtime_checkable
class Perception(Protocol):
    """Perception of the objects in a scene."""

    def perceive(self, driver: Driver) -> ObservedScene: ...
    def view(self, driver: Driver) -> Driver:
        """Return the driver as skills may see it: without its truth, where the perception does without it."""
        ...

    def planning(self, driver: Driver, seen: ObservedScene) -> PlanningScene:
        """Return what to plan among where things are believed to be as `seen`; changes nothing of the driver."""
        ...


@runtime_checkable
class Pictured(Perception, Protocol):
    """A perception that looks through cameras."""

    def picture(self) -> NDArray[np.uint8]:
        """Return what the last look made of its pictures, side by side, (height, width, 3) RGB."""
        ...


@runtime_checkable
class Glancing(Perception, Protocol):
    """A perception that need not look at everything each time."""

    def glance(self, driver: Driver, names: Sequence[str]) -> ObservedScene:
        """Return what is believed now, having looked at these things alone; without any, what is remembered and felt."""
        ...

    def doubt(self) -> None:
        """Look at everything anew next time: something went otherwise than it was believed to."""
        ...


@runtime_checkable
class Uncovering(Perception, Protocol):
    """A perception that knows what the robots hide from its cameras."""

    @property
    def half_hidden(self) -> Sequence[Array]:
        """Surface points, (n, 3) each, of what the last look showed too unclearly to act on, cut off by a robot."""
        ...

    def uncovered(self, driver: Driver, arms: Mapping[str, Array]) -> float:
        """Return the share of what robots have hidden so far that fixed cameras would show with arms in configurations (n,), by name."""
        ...
