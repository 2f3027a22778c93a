"""Motion planners as skills ask them."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING, Protocol, runtime_checkable

if TYPE_CHECKING:
    from robosandbox.errors import CollisionError
    from robosandbox.motion.planning_scene import PlanningScene
    from robosandbox.types import ArmState, Array, DetectedObject, Pose, Speed, Trajectory


@runtime_checkable
class MotionPlanner(Protocol):
    """Joint configurations and collision-checked paths on data of its own."""

    def use(self, planning: PlanningScene, state: ArmState, *, held: str | None = None) -> None:
        """Take the world to plan in: objects as believed, the robot as it stands, `held` moving with the TCP."""
        ...

    def allow(self, *names: str, by_hand: Iterable[str] = (), touched: bool = False) -> None:
        """Let the robot touch these objects (and "table", with the floor beside it) in the plans that follow, and nothing else.

        What is named `by_hand` the hand and what it holds may touch, and no link before it. With `touched` the robot may touch what it
        touches where it stands as well, no deeper than it does.
        """
        ...

    def move_part(self, name: str, value: float, load: Iterable[DetectedObject] = ()) -> None:
        """Check the plans that follow with a part's joint at a value, metres or radians, and what goes with it where that is then."""
        ...

    def open_to(self, aperture: float) -> None:
        """Check the paths that follow with the fingers `aperture` metres apart."""
        ...

    def touch_between(self, q: Array, start: float, end: float) -> CollisionError | None:
        """Return the error that fingers would be which go at `q` (n,) from `start` metres apart to `end`, that included; None for none.

        What follows is checked with them `end` apart.
        """
        ...

    def ik(self, tcp_pose: Pose, seed: Array | None = None, *, restarts: int = 60) -> Array:
        """Return a configuration (n,) with the TCP at `tcp_pose`; raises UnreachableError.

        `restarts` bounds how hard it is searched for away from `seed`.
        """
        ...

    def forward(self, q: Array) -> Pose:
        """Return the TCP pose in the world at `q` (n,)."""
        ...

    def touch(self, q: Array) -> CollisionError | None:
        """Return the error that standing at `q` (n,) would be, or None."""
        ...

    def plan_joints(self, q_start: Array, q_goal: Array, *, speed: Speed = 0.5) -> Trajectory:
        """Return a collision-free trajectory; raises CollisionError."""
        ...

    def plan_through(self, q_start: Array, tcp_poses: Sequence[Pose], *, speed: Speed = 0.5) -> Trajectory:
        """Return straight TCP lines through poses, with a stop only where there is no room for none; raises UnreachableError or CollisionError."""
        ...

    def plan_line(self, q_start: Array, tcp_pose: Pose, *, speed: Speed = 0.5) -> Trajectory:
        """Return a straight TCP line, checked all along; raises UnreachableError or CollisionError."""
        ...
