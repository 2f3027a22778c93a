"""Objects dragged with the mouse: lifted a little, moved level, let go where they are dropped."""

from __future__ import annotations

import queue

import numpy as np
import viser

from robosandbox.apps.viewer.control import Control
from robosandbox.apps.viewer.news import Complaint
from robosandbox.apps.viewer.scene import BodyScene
from robosandbox.apps.viewer.source import Blueprint, WorldSource
from robosandbox.errors import InputError
from robosandbox.types import Array, Pose
from robosandbox.values import frozen

_LIFT = 0.02  # Metres that a dragged thing is lifted, so that it does not scrape. Chosen.
_LOST_SECONDS = 20.0  # Seconds after which a drag that is heard of no more has ended. Chosen.


@frozen
class _Drag:
    targets: queue.Queue[Array | None]
    grabbed: Array


class Dragging:
    """Lets objects of a drawn scene be dragged.

    Args:
        source: Whose objects.
        control: Moves them when nothing else is under way.
    """

    def __init__(self, source: WorldSource, control: Control) -> None:
        self._source = source
        self._control = control
        self._drags: dict[int, _Drag] = {}

    def adopt(self, blueprint: Blueprint, body_scene: BodyScene) -> None:
        """Make the objects of a drawn scene draggable."""
        if self._source.teleop is None:
            return
        for name, body in blueprint.object_bodies.items():
            for mesh in body_scene.meshes(body):
                self._bind(mesh, name, body_scene, body)

    def _bind(self, mesh: viser.GlbHandle, name: str, body_scene: BodyScene, body: int) -> None:
        @mesh.on_drag
        async def _(event: viser.SceneNodeDragEvent[viser.GlbHandle]) -> None:
            # Asynchronous callbacks are called in the order of the mouse; none of this waits.
            match event.phase:
                case "start":
                    self._begin(event.client_id, name, body_scene.pose(body), np.array(event.start_position))
                case "update":
                    drag = self._drags.get(event.client_id)
                    if drag is not None:
                        eye = np.asarray(event.client.camera.position)
                        drag.targets.put(level(eye, np.array(event.end_position), drag.grabbed))
                case "end":
                    drag = self._drags.pop(event.client_id, None)
                    if drag is not None:
                        drag.targets.put(None)

    def _begin(self, client: int, name: str, pose: Pose, grabbed: Array) -> None:
        drag = _Drag(queue.Queue(), grabbed)
        if self._control.by_hand(f"move {name}", lambda: self._carry(name, pose, drag)):
            self._drags[client] = drag

    def _carry(self, name: str, pose: Pose, drag: _Drag) -> None:
        """Follow the mouse until the object is dropped; in the world's thread."""
        teleop = self._source.teleop
        if teleop is None:
            return
        complaint: InputError | None = None
        try:
            while True:
                try:
                    target = drag.targets.get(timeout=_LOST_SECONDS)
                    while target is not None and not drag.targets.empty():
                        target = drag.targets.get()
                except queue.Empty:
                    break
                if target is None:
                    break
                x, y, z = pose.position + target - drag.grabbed + [0.0, 0.0, _LIFT]
                try:
                    teleop.place(name, Pose(xyz=(x, y, z), quat_xyzw=pose.quat_xyzw))
                    complaint = None
                except InputError as error:
                    # Where it cannot be, it does not follow.
                    complaint = error
        finally:
            teleop.let_go()
        if complaint is not None:
            self._control.tell(Complaint(str(complaint)))


def level(eye: Array, pointed: Array, grabbed: Array) -> Array:
    """Return where the line of sight from `eye` to `pointed` passes the height of `grabbed`; `grabbed` where it does not."""
    sight = pointed - eye
    if abs(sight[2]) < 1e-6:
        return grabbed
    share = (grabbed[2] - eye[2]) / sight[2]
    return eye + share * sight if share > 0.0 else grabbed
