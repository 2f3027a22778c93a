"""A simulated world's whole state as a value: for undoing, for recordings, and for surviving the end of a process."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field

from robosandbox.ranges import LAYOUTS
from robosandbox.spatial import StrictModel
from robosandbox.types.scene import Scene

# Beyond this MuJoCo takes a number for divergence (mjMAXVAL in its mjmodel.h).
_MOST = 1e10

StateNumber = Annotated[float, Field(ge=-_MOST, le=_MOST, allow_inf_nan=False)]


class Checkpoint(StrictModel):
    """Everything that the future of a simulated world depends on.

    Attributes:
        seed: The layout.
        scene: Robot and objects as last reset.
        start: State vector after that reset, which success is judged against.
        state: MuJoCo's integration state.
        physics_steps: Since the last reset.
    """

    seed: Annotated[int, Field(ge=0, lt=LAYOUTS)]
    scene: Scene
    start: tuple[StateNumber, ...]
    state: tuple[StateNumber, ...]
    physics_steps: Annotated[int, Field(ge=0, lt=2**31)]
