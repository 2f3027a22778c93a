"""Beliefs between two looks: what hands held at the last one has moved with them since."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

from robosandbox.types import ArmState, DetectedObject, ObservedScene, Pose
from robosandbox.types.robot import hand_of


class SinceLook:
    """Follows what was seen last while the arms move on."""

    def __init__(self) -> None:
        self._time: float | None = None
        self._tcps: dict[str, Pose] = {}

    def objects(self, seen: ObservedScene, arms: Mapping[str, ArmState]) -> tuple[DetectedObject, ...]:
        """Return the objects where they are believed to be now.

        Args:
            seen: What perception saw last.
            arms: How each arm stands now; asked often, they stood like that at a look which is new here.
        """
        if seen.time != self._time:
            self._time, self._tcps = seen.time, {name: state.tcp_pose for name, state in arms.items()}
        held = {seen.hands.get(hand_of(name)): name for name in arms}
        objects = list[DetectedObject]()
        for item in seen.objects:
            if (name := held.get(item.id)) is not None:
                item = replace(item, pose=arms[name].tcp_pose @ self._tcps[name].inverse() @ item.pose)
            objects.append(item)
        return tuple(objects)
