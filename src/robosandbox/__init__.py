"""RoboSandbox: say what the robot should do; the arm does it, or says exactly why it cannot.

The package's names load on first use, so that `import robosandbox` stays cheap.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from robosandbox.tasks.session import Session as Session, open_session as open_session
    from robosandbox.types import Pose as Pose, Scene as Scene, SceneObject as SceneObject

__version__ = "0.1.0"

_LAZY = {
    "Pose": "robosandbox.types",
    "Scene": "robosandbox.types",
    "SceneObject": "robosandbox.types",
    "Session": "robosandbox.tasks.session",
    "open_session": "robosandbox.tasks.session",
}

__all__ = ["Pose", "Scene", "SceneObject", "Session", "__version__", "open_session"]


def __getattr__(name: str) -> Any:
    if name not in _LAZY:
        raise AttributeError(f"module 'robosandbox' has no attribute '{name}'; it has {', '.join(__all__)}")
    return getattr(import_module(_LAZY[name]), name)
