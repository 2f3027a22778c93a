"""What skills plan with: perception, ways to hold things, configurations and paths."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING, Protocol, runtime_checkable

if TYPE_CHECKING:
    from robosandbox.errors import CollisionError
    from robosandbox.motion.planning_scene import PlanningScene
    from robosandbox.protocols.drivers import Driver
    from robosandbox.robots.spec import RobotSpec
    from robosandbox.types import Array, DetectedObject, Grasp, Observation, ObservedScene, Pose, Speed, Trajectory


@runtime_checkable
class Perception(Protocol):
    """What is where."""

    def perceive(self, sim: Driver) -> ObservedScene: ...
    def view(self, sim: Driver) -> Driver:
        """Return the sim as skills may see it: without its truth, where the perception does without it."""
        ...

    def planning(self, sim: Driver, seen: ObservedScene) -> PlanningScene:
        """Return what to plan among where things are believed to be as `seen`; changes nothing of the sim."""
        ...


@runtime_checkable
class Glancing(Perception, Protocol):
    """A perception that need not look at everything each time."""

    def glance(self, sim: Driver, names: Sequence[str]) -> ObservedScene:
        """Return what is believed now, having looked at these things alone; without any, what is remembered and felt."""
        ...

    def doubt(self) -> None:
        """Look at everything anew next time: something went otherwise than it was believed to."""
        ...


@runtime_checkable
class GraspPlanner(Protocol):
    """Ways to hold an object, best first, made as they are asked for; feasibility is the motion planner's to say.

    `pieces`, each (k, 3), span a mesh's convex pieces in the object's frame; `hand` (3, 3) is the TCP's rotation now, so that of
    grasps about as good the one that turns it least may come first.
    """

    def candidates(
        self,
        target: DetectedObject,
        scene: ObservedScene,
        robot: RobotSpec,
        *,
        pieces: Sequence[Array] = (),
        hand: Array | None = None,
    ) -> Iterable[Grasp]: ...


@runtime_checkable
class MotionPlanner(Protocol):
    """Joint configurations and collision-checked paths on data of its own."""

    def use(self, planning: PlanningScene, state: Observation, *, held: str | None = None) -> None:
        """Take the world to plan in: objects as believed, the robot as it stands, `held` moving with the TCP."""
        ...

    def allow(self, *names: str) -> None:
        """Let the robot touch these objects (and "table", with the floor beside it) in the plans that follow, and nothing else."""
        ...

    def open_to(self, aperture: float) -> None:
        """Check the paths that follow with the fingers `aperture` metres apart."""
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
        """Return straight TCP lines through poses, without a stop; raises UnreachableError or CollisionError."""
        ...

    def plan_line(self, q_start: Array, tcp_pose: Pose, *, speed: Speed = 0.5) -> Trajectory:
        """Return a straight TCP line, checked all along; raises UnreachableError or CollisionError."""
        ...
