"""RoboSandbox: say what the robot should do; the arm does it, or says exactly why it cannot.

The package's names load on first use, so that `import robosandbox` stays cheap.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from robosandbox.types import Pose as Pose, Scene as Scene, SceneObject as SceneObject
    from robosandbox.workcell.options import WorkcellOptions as WorkcellOptions
    from robosandbox.workcell.session import open_session as open_session
    from robosandbox.workcell.workcell import Workcell as Workcell

__version__ = "0.1.0"

_LAZY = {
    "Pose": "robosandbox.types",
    "Scene": "robosandbox.types",
    "SceneObject": "robosandbox.types",
    "Workcell": "robosandbox.workcell.workcell",
    "WorkcellOptions": "robosandbox.workcell.options",
    "open_session": "robosandbox.workcell.session",
}

__all__ = ["Pose", "Scene", "SceneObject", "Workcell", "WorkcellOptions", "__version__", "open_session"]


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})


def __getattr__(name: str) -> Any:
    if name not in _LAZY:
        raise AttributeError(f"module 'robosandbox' has no attribute '{name}'; it has {', '.join(__all__)}")
    return getattr(import_module(_LAZY[name]), name)
