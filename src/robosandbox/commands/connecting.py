"""Options and sessions for commands that work in another process's sim."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

if TYPE_CHECKING:
    from robosandbox.tasks.remote import RemoteSession

Connect = Annotated[
    list[str] | None, typer.Option("--connect", help="Zenoh endpoint of a sim or router; tcp/127.0.0.1:7447 is usual.")
]
RobotId = Annotated[str | None, typer.Option("--robot-id", help="Which robot, where there are several.")]
ZenohConfig = Annotated[
    Path | None, typer.Option("--zenoh-config", help="A Zenoh configuration with credentials, see examples/zenoh/.")
]


@contextmanager
def remote_session(
    endpoints: list[str],
    robot_id: str | None,
    zenoh_config: Path | None,
    *,
    planner: str = "stub",
    planner_options: Mapping[str, Any] | None = None,
    camera: str | None = None,
    max_replans: int = 3,
) -> Iterator[RemoteSession]:
    """Connect to a sim and put an agent before it.

    Raises:
        InputError: An endpoint, id or file is wrong.
        ServiceUnavailableError: No sim is there.
    """
    from robosandbox.agent.client import connect
    from robosandbox.tasks.remote import RemoteSession

    with connect(*endpoints, zenoh_config=zenoh_config) as client:
        yield RemoteSession(
            client.robot(robot_id),
            planner=planner,
            planner_options=planner_options,
            camera=camera,
            max_replans=max_replans,
        )
