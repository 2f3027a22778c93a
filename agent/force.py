"""How hard the robot may press, whatever anybody plans: checked at every control tick."""

from __future__ import annotations

from robosandbox.errors import LimitError, Phase
from robosandbox.evidence import LimitEvidence
from robosandbox.protocols import Driver

# Control ticks of 10 ms in a row that make pressing out of an impact; chosen above the one tick that impacts were
# measured to last in push_left and close_drawer: with 1 each of them would end a call, with 6 the arm presses 60 ms
# before it stops.
_TICKS = 3


class ForceGuard:
    """A guard that stops the arm when it presses on something harder than allowed.

    Args:
        sim: Whose arm.
        max_force: Newtons.
    """

    def __init__(self, sim: Driver, max_force: float) -> None:
        self._sim = sim
        self._max_force = max_force
        self._ticks = 0
        self._told = False

    def __call__(self) -> LimitError | None:
        """Return what is wrong with a contact that was too strong for several ticks.

        It is returned once, so that what cleans up may move, and again after the force has been within the limit.
        """
        force, body, other = self._sim.strongest_contact()
        if force <= self._max_force:
            self._ticks, self._told = 0, False
            return None
        self._ticks += 1
        if self._told or self._ticks < _TICKS:
            return None
        self._told = True
        return LimitError(
            f"{body} presses on {other} with {force:.0f} N, and limits.max_force allows {self._max_force:g}; the arm holds: "
            "clear what is in the way, or allow more",
            phase=Phase.CHECK,
            evidence=LimitEvidence(
                quantity=f"force of {body} on {other}, N", value=force, low=0.0, high=self._max_force
            ),
        )
