"""The versions that an outcome depends on."""

from __future__ import annotations

import importlib.metadata
import platform
from functools import cache
from importlib.util import find_spec

from robosandbox import __version__


@cache
def _found() -> tuple[tuple[str, str], ...]:
    found = [(name, importlib.metadata.version(name)) for name in ("mujoco", "numpy")]
    return (
        ("robosandbox", __version__),
        *found,
        ("python", platform.python_version()),
        ("machine", platform.machine()),
        # Rounding is another with each, which a long episode shows.
        ("kinematics", "compiled" if find_spec("robosandbox.robots._descent") else "numpy"),
    )


def versions() -> dict[str, str]:
    """Return them by name."""
    return dict(_found())
