"""The TCP moved by hand: buttons and keys for small steps, and the gripper."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Literal

import viser

from robosandbox.apps.viewer import html
from robosandbox.apps.viewer.control import Control
from robosandbox.apps.viewer.source import Teleop, WorldSource
from robosandbox.types import Pose, Vec3
from robosandbox.values import frozen

_STEP_MM = 10.0  # Millimetres of one press at the start. Chosen.
_TURN_DEG = 5.0  # Degrees of one press. Chosen.
_WRITTEN = (
    "Keys and mouse move only a world of this process; this one is {title}. Its hand moves by what is written into the "
    "prompt: move_to(x=0.2, y=0.1, z=0.3), open_gripper(), close_gripper()."
)
Key = Literal["I", "J", "K", "L", "U", "O", "N", "M", "G"]


@frozen
class Move:
    """A step: a direction in the world, or a turn about the approach axis."""

    name: str
    key: Key
    along: Vec3 = (0.0, 0.0, 0.0)
    turn: float = 0.0


# Forward, left and up are the world's x, y and z. W, A, S, D, Q and E fly the camera, so these are others.
MOVES = (
    Move("Forward", "I", (1.0, 0.0, 0.0)),
    Move("Back", "K", (-1.0, 0.0, 0.0)),
    Move("Left", "J", (0.0, 1.0, 0.0)),
    Move("Right", "L", (0.0, -1.0, 0.0)),
    Move("Up", "U", (0.0, 0.0, 1.0)),
    Move("Down", "O", (0.0, 0.0, -1.0)),
    Move("Turn left", "N", turn=-1.0),
    Move("Turn right", "M", turn=1.0),
)
_ROWS = (("Forward", "Back"), ("Left", "Right"), ("Up", "Down"), ("Turn left", "Turn right"))


class JogPanel:
    """Moves the TCP in small steps, checked like every motion.

    Args:
        server: Where.
        source: Whose arm.
        control: Runs a step when nothing else is under way.
    """

    def __init__(self, server: viser.ViserServer, source: WorldSource, control: Control) -> None:
        self._source = source
        self._control = control
        self._closed = False
        gui = server.gui
        if source.teleop is None:
            gui.add_html(html.block(html.line(_WRITTEN.format(title=source.title), "grey")))
            return
        keys = ", ".join(f"{move.key} {move.name.lower()}" for move in MOVES)
        gui.add_html(html.block(html.line(f"Keys: {keys}, G gripper. Objects are dragged with the mouse.", "grey")))
        self._step = gui.add_slider("Step, mm", min=1.0, max=50.0, step=1.0, initial_value=_STEP_MM)
        by_name = {move.name: move for move in MOVES}
        for names in _ROWS:
            group = gui.add_button_group("", names)
            group.on_click(lambda event: self._move(by_name[event.target.value]))
        gripper = gui.add_button_group("Gripper", ("Open", "Close"))
        gripper.on_click(lambda event: self._grip(event.target.value == "Close"))
        for move in MOVES:
            self._bind(server, move)
        grip = server.gui.add_command("Gripper", description="Close or open it", hotkey="G")
        grip.on_trigger(lambda _: self._grip(not self._closed))

    def _bind(self, server: viser.ViserServer, move: Move) -> None:
        command = server.gui.add_command(f"Jog: {move.name.lower()}", hotkey=move.key)
        command.on_trigger(lambda _: self._move(move))

    def _move(self, move: Move) -> None:
        step = float(self._step.value) / 1000.0
        half = math.radians(_TURN_DEG) * move.turn / 2.0
        x, y, z = (step * c for c in move.along)
        change = Pose(xyz=(x, y, z), quat_xyzw=(0.0, 0.0, math.sin(half), math.cos(half)))
        self._do(f"jog {move.name.lower()}", lambda teleop: teleop.jog(change))

    def _grip(self, closed: bool) -> None:
        self._closed = closed
        self._do("gripper", lambda teleop: teleop.grip(closed))

    def _do(self, what: str, act: Callable[[Teleop], None]) -> None:
        def job() -> None:
            # The world may be another one by now.
            teleop = self._source.teleop
            if teleop is not None:
                act(teleop)

        self._control.by_hand(what, job)
