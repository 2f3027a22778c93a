"""Options of commands that work in another process's sim."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

Connect = Annotated[
    list[str] | None, typer.Option("--connect", help="Zenoh endpoint of a sim or router; tcp/127.0.0.1:7447 is usual.")
]
RobotId = Annotated[str | None, typer.Option("--robot-id", help="Which robot, where there are several.")]
ZenohConfig = Annotated[
    Path | None, typer.Option("--zenoh-config", help="A Zenoh configuration with credentials, see examples/zenoh/.")
]
Reconnect = Annotated[float, typer.Option("--reconnect", help="Seconds that commands wait for a sim that went away.")]
