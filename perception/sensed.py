"""The world as skills may know it where cameras see: the robot's own senses, without what a simulation knows."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from robosandbox.driver import Capabilities, PassingDriver
from robosandbox.errors import UnsupportedError
from robosandbox.types import Array


class SensedSim(PassingDriver):
    """A sim without its truth: joints, cameras and commands are the sim's; no contact is told by what it is with.

    Args:
        inner: The real one.
    """

    @property
    def capabilities(self) -> Capabilities:
        """Capabilities of the sim, less those that only a simulation has."""
        whole = super().capabilities
        felt = whole.contact and "felt"
        return replace(whole, contact=felt, fork=False, reset=False, truth=False)

    def arm_contacts(self) -> tuple[tuple[str, str], ...]:
        """Refuse: the arm feels that it touches something, not what.

        Raises:
            UnsupportedError: Always.
        """
        raise UnsupportedError("contact: this driver tells contact without what is touched; read strongest_contact()")

    def strongest_contact(self) -> tuple[float, str, str]:
        """Return the largest force that the robot feels, and on which link; not what it touches."""
        force, link, _ = super().strongest_contact()
        return force, link, "something" if link else ""

    def forces(self) -> Mapping[str, Array]:
        """Return all that the robot presses and pulls with, N in the world, shape (3,), as of one thing: it is not told which."""
        found = tuple(super().forces().values())
        return {"something": np.sum(found, axis=0)} if found else {}

    def force_on(self, object_id: str | None) -> Array:
        """Return what a force sensor at the wrist feels, N in the world, shape (3,); it cannot tell of which object."""
        del object_id
        return super().force_on(None)

    def grip_on(self, object_id: str | None) -> float:
        """Return how hard pads that feel are pressed, N; they cannot tell by which object."""
        del object_id
        return super().grip_on(None)
