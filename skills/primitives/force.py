"""A force that the hand keeps up on what it has met, by how far it is sent beyond where it is."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from robosandbox.errors import Phase
from robosandbox.skills.primitives.guarded import follow_until
from robosandbox.skills.primitives.manipulator import Manipulator
from robosandbox.skills.primitives.pressing import StraightPath
from robosandbox.types import Trajectory
from robosandbox.values import frozen

# N at which something is met, and share of a force by which what is felt may be off it.
_MET, _CLOSE_ENOUGH = 1.0, 0.05
# Share of what is missing by which the hand follows it in a second, and m/s at most; chosen so that a force that is told 40 ms late
# does not swing. What a metre beyond the contact presses with is measured on the way, once the hand is so many metres beyond.
_FOLLOWING, _FASTEST, _MEASURED = 2.0, 0.004, 0.0002
# N/m until it is: of a stiff arm, which presses hard at once.
_STIFF = 20_000.0
# Seconds in which a force is to be reached, and over which its mean counts as it: readings of a wrist are noisy.
_REACHED_WITHIN, _MEAN = 30.0, 0.3


@dataclass(slots=True)
class Following:
    """Way of a hand beyond what it has met, as long as it presses on that with a force.

    Attributes:
        beyond: Metres.
        _stiffness: What a metre of it presses with, N.
    """

    beyond: float = 0.0
    _stiffness: float = _STIFF

    def follow(self, felt: float, force: float, tick: float) -> float:
        """Return how far to be sent beyond in the next control tick, metres.

        Args:
            felt: What the hand presses with now, N.
            force: What it is to press with, N.
            tick: Seconds.
        """
        if self.beyond > _MEASURED and felt > 0.0:
            self._stiffness = felt / self.beyond
        self.beyond += float(np.clip(_FOLLOWING * (force - felt) / self._stiffness, -_FASTEST, _FASTEST)) * tick
        return self.beyond


@frozen
class Kept:
    """A force that was kept up.

    Attributes:
        mean: Over the time, N.
        least: Of the readings, N.
        most: The same.
    """

    mean: float
    least: float
    most: float


def press_with(
    arm: Manipulator, way: Trajectory, felt: Callable[[], float], force: float, seconds: float
) -> Kept | None:
    """Go along a straight way until something is met, and press on it with a force for some time.

    Args:
        arm: Its hand is where the way begins.
        way: Of the TCP, straight and slow, farther than to what is met.
        felt: Tells what the hand presses with along the way, N.
        force: With which it is to press, N.
        seconds: For how long.

    Returns:
        None where nothing was met, or the force was not reached.

    Raises:
        LimitError: The robot pressed too hard on something.
    """
    path = StraightPath.of(arm, way)
    if not follow_until(arm, way, Phase.TOUCH, lambda: felt() > _MET):
        return None
    arm.ctx.enter(Phase.PUSH)
    tick = arm.driver.control_timestep
    place = met = path.place(arm.state.tcp_pose.position)
    row, deadline, following = path.at(place, 0.0), arm.driver.time + _REACHED_WITHIN, Following()
    last, kept = list[float](), list[float]()
    while len(kept) < round(seconds / tick):
        now = felt()
        last = [*last, now][-round(_MEAN / tick) :]
        reached = len(last) * tick >= _MEAN and abs(float(np.mean(last)) - force) <= _CLOSE_ENOUGH * force
        if kept or reached:
            kept.append(now)
        elif arm.driver.time > deadline or place >= path.length:
            return None
        place = met + following.follow(now, force, tick)
        before, row = row, path.at(place, 0.0)
        arm.send(Trajectory(q=np.array([before, row]), dt=tick))
    return Kept(mean=float(np.mean(kept)), least=min(kept), most=max(kept))
