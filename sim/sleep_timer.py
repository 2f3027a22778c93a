"""Sleep timer of bodies: they fall asleep after half a second of stillness, not after MuJoCo's ten steps."""

from __future__ import annotations

import mujoco
import numpy as np

# Seconds for which a body has to lie still before it sleeps. What stands on an edge leaves it by a factor of e every 0.07 s (a
# can of 50 mm): in this time it moves, unless it was within a micrometre of its balance. After MuJoCo's ten steps a can was left
# hanging up to 2 mrad beyond its balance (tests/test_sleep.py), and would have been judged to stand.
CALM_SECONDS = 0.5
# Steps that may pass between two looks: within MuJoCo's own ten (mjMINAWAKE) nothing falls asleep unseen.
MOST_STEPS = 9


class SleepTimer:
    """Starts MuJoCo's count of still steps lower, for each body that moves.

    MuJoCo counts a tree's still steps up to -1, from -11 whenever it moves; what it is set to between steps it goes on from.
    A count of its own is not kept: who will sleep when is in the state.

    Args:
        model: The world's.
        data: Its live state.
    """

    def __init__(self, model: mujoco.MjModel, data: mujoco.MjData) -> None:
        self._count = data.tree_asleep
        self._moving = moving_count(model)
        self._before = self._count.copy()

    def restart(self) -> None:
        """Take the counts as they are: the world was put into another state."""
        self._before[:] = self._count

    def stepped(self, steps: int) -> None:
        """Have what moved in the last steps, `MOST_STEPS` at most, lie still for the whole time from now on."""
        count, before = self._count, self._before
        np.minimum(before + steps, -1, out=before)
        moved = (count < 0) & (count != before)
        count[moved] = self._moving
        before[:] = count


def moving_count(model: mujoco.MjModel) -> int:
    """Return what a tree that moves is counted from, a number below zero."""
    return -(1 + round(CALM_SECONDS / float(model.opt.timestep)))
