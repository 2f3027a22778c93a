"""The cell as skills may know it where cameras see: the robot's own senses, without what a simulation knows."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace

import numpy as np

from robosandbox.driver import Capabilities, Hand, PassingDriver, PassingHand, PassingSenses, Senses, Simulated
from robosandbox.errors import UnsupportedError
from robosandbox.types import Array, Truth


class SensedDriver(PassingDriver):
    """A driver without the truth: joints, cameras and commands are those behind it; no contact is told by what it is with."""

    @property
    def simulation(self) -> Simulated | None:
        """None: the true state is nobody's business."""
        return None

    @property
    def capabilities(self) -> Capabilities:
        """Capabilities of the driver, less those that only a simulation has."""
        whole = super().capabilities
        felt = whole.contact and "felt"
        return replace(whole, contact=felt, fork=False, reset=False, truth=False)

    @property
    def hands(self) -> Mapping[str, Hand]:
        """The hands by name."""
        return {name: _SensedHand(hand) for name, hand in super().hands.items()}

    @property
    def senses(self) -> Senses:
        """Cameras, and contact and forces without what they are with."""
        return _Senses(super().senses)

    @property
    def referee(self) -> Callable[[], Truth] | None:
        """None: whoever acts does not judge."""
        return None


class _SensedHand(PassingHand):
    def grip_on(self, object_id: str | None) -> float:
        """Return how hard pads that feel are pressed, N; they cannot tell by which object."""
        del object_id
        return super().grip_on(None)


class _Senses(PassingSenses):
    def contacts(self, arm: str | None = None) -> tuple[tuple[str, str], ...]:
        """Refuse: the arm feels that it touches something, not what.

        Raises:
            UnsupportedError: Always.
        """
        del arm
        raise UnsupportedError("contact: this driver tells contact without what is touched; read strongest_contact()")

    def strongest_contact(self, arm: str | None = None) -> tuple[float, str, str]:
        """Return the largest force that an arm feels, and on which link; not what it touches."""
        force, link, _ = super().strongest_contact(arm)
        return force, link, "something" if link else ""

    def forces(self, arm: str | None = None) -> Mapping[str, Array]:
        """Return all that an arm presses and pulls with, N in the world, shape (3,), as of one thing: it is not told which."""
        found = tuple(super().forces(arm).values())
        return {"something": np.sum(found, axis=0)} if found else {}

    def force_on(self, object_id: str | None, arm: str | None = None) -> Array:
        """Return what a force sensor at the wrist feels, N in the world, shape (3,); it cannot tell of which object."""
        del object_id
        return super().force_on(None, arm)
