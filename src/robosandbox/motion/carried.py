"""Beliefs between two looks: what the hand held at the last one has moved with it since."""

from __future__ import annotations

from dataclasses import replace

from robosandbox.types import ArmState, DetectedObject, ObservedScene, Pose


class SinceLook:
    """Follows what was seen last while the arm moves on."""

    def __init__(self) -> None:
        self._time: float | None = None
        self._tcp = Pose(xyz=(0.0, 0.0, 0.0))

    def objects(self, seen: ObservedScene, state: ArmState) -> tuple[DetectedObject, ...]:
        """Return the objects where they are believed to be now.

        Args:
            seen: What perception saw last.
            state: How the robot stands now; asked often, it stood like that at a look which is new here.
        """
        if seen.time != self._time:
            self._time, self._tcp = seen.time, state.tcp_pose
        moved = state.tcp_pose @ self._tcp.inverse()
        return tuple(replace(item, pose=moved @ item.pose) if item.id == seen.held else item for item in seen.objects)
