"""MuJoCo's warnings to Python's log, in place of a MUJOCO_LOG.TXT in whatever folder the process was started in."""

from __future__ import annotations

import logging

import mujoco

_log = logging.getLogger("robosandbox.mujoco")


def route_warnings() -> None:
    """Send what MuJoCo warns of to the log from now on, for the whole process.

    A handler that somebody else has set stays. Errors need none: the bindings raise them as exceptions.
    """
    if mujoco.get_mju_user_warning() is None:
        mujoco.set_mju_user_warning(_warn)


def _warn(message: str) -> None:
    # A world that diverges says so again and again; the levels of the log are for whoever runs it.
    _log.warning("%s", " ".join(message.split()))
