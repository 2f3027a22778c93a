"""Limits of workspace and force for a robot, from a task or a sidecar."""

from __future__ import annotations

from typing import Self

from pydantic import model_validator

from robosandbox.spatial import Finite, Positive, StrictModel

# N with which a robot may press what it was told to move, where no limit is given: below 65 N, the least that
# ISO/TS 15066:2016 allows any part of a person to be pressed with for long (the face; table A.2, quasi-static contact).
MAX_FORCE_N = 60.0
# N with which a robot may press anything else: below the 50 N at which a Panda's reflex is commonly set to stop it
# (force thresholds of `setCollisionBehavior` in franka_bringup), and above the 20 N of its most sensitive setting, which
# the impacts of a hand at working speed pass (measured: up to 30 N for a control tick).
MAX_UNINTENDED_FORCE_N = 40.0


class Workspace(StrictModel):
    """Box in which the arm may work, world frame, metres; an axis that is left out is free.

    Attributes:
        x: Least and most.
        y: Least and most.
        z: Least and most, for the tool centre point alone.
    """

    x: tuple[Finite, Finite] | None = None
    y: tuple[Finite, Finite] | None = None
    z: tuple[Finite, Finite] | None = None

    @model_validator(mode="after")
    def _bounds_are_in_order(self) -> Self:
        for axis in ("x", "y", "z"):
            bounds = getattr(self, axis)
            if bounds is not None and not bounds[0] < bounds[1]:
                raise ValueError(f"{axis}: {list(bounds)} is empty; give [least, most]")
        return self


class Limits(StrictModel):
    """Limits that no planner can pass; at least one of them.

    Attributes:
        workspace: Where the arm may be: its tool centre point, and each link that is inside at home.
        max_force_n: With how many newtons the robot may press or pull what a call is to move; the grip, which presses from
            both sides, is not counted. `MAX_FORCE_N` where nobody gives one.
        max_unintended_force_n: The same for whatever else it touches; never more than `max_force_n`.
            `MAX_UNINTENDED_FORCE_N` where nobody gives one.
    """

    workspace: Workspace | None = None
    max_force_n: Positive | None = None
    max_unintended_force_n: Positive | None = None

    @model_validator(mode="after")
    def _limits_something(self) -> Self:
        if self.workspace is None and self.max_force_n is None and self.max_unintended_force_n is None:
            raise ValueError("limits nothing; give workspace, max_force_n or max_unintended_force_n, or leave it out")
        return self


def force_limits(*limits: Limits | None) -> tuple[float, float]:
    """Return the most that a robot may press with under several limits, N: what it is to move, and anything else."""
    kept = [one for one in limits if one is not None]
    intended = min((one.max_force_n for one in kept if one.max_force_n is not None), default=MAX_FORCE_N)
    given = [one.max_unintended_force_n for one in kept if one.max_unintended_force_n is not None]
    return intended, min(intended, *(given or [MAX_UNINTENDED_FORCE_N]))
