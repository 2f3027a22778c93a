"""The simulated state, for judging and for tests: what really is, not what is perceived."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from robosandbox.spatial import Array, Pose, Vec3
from robosandbox.types.objects import ObjectKind
from robosandbox.types.sensed import DetectedObject


@dataclass(frozen=True, slots=True, kw_only=True)
class ObjectTruth:
    """One object as simulated.

    Attributes:
        id: Its scene id.
        kind: Its shape.
        size: Metres, as its shape names them; for a mesh the half-extents of its box.
        rgba: Its colour.
        pose: In the world.
        linear_velocity: m/s, shape (3,).
        angular_velocity: rad/s, shape (3,).
        contacts: What it touches: "table", "floor", "robot", object ids.
        opening: For a drawer: how far it is open, metres.
        grains: For beads: where each is; their pose is in the middle, their velocity the mean.
        felt: The most that the robot has pressed or pulled it with since the reset, N; for what `feel` was asked about.
        tag: Number of its AprilTag.
    """

    id: str
    kind: ObjectKind
    size: tuple[float, ...]
    rgba: tuple[float, float, float, float]
    pose: Pose
    linear_velocity: Array
    angular_velocity: Array
    contacts: tuple[str, ...]
    opening: float | None = None
    grains: tuple[Vec3, ...] = ()
    felt: float = 0.0
    tag: int | None = None

    def detected(self) -> DetectedObject:
        """Return it as perception would, were perception perfect; the colour is left unnamed."""
        return DetectedObject(
            id=self.id,
            kind=self.kind,
            size=self.size,
            colour="",
            rgba=self.rgba,
            pose=self.pose,
            opening=self.opening,
            grains=self.grains,
            tag=self.tag,
        )


@dataclass(frozen=True, slots=True, kw_only=True)
class Truth:
    """The whole simulated state that success is judged on.

    Attributes:
        time: Simulated seconds since reset.
        q: Arm configuration, shape (n,).
        home_q: The robot's home, shape (n,).
        table_height: Metres.
        objects: By id.
        held: The object that both sides of the gripper touch.
    """

    time: float
    q: Array
    home_q: Array
    table_height: float
    objects: Mapping[str, ObjectTruth]
    held: str | None = None


@dataclass(frozen=True, slots=True)
class Verdict:
    """Whether a task succeeded.

    Attributes:
        success: The answer.
        detail: The measurements at the end of the episode, or at the moment at which it ceased to hold.
    """

    success: bool
    detail: dict[str, float]
