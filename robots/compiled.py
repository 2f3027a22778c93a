"""The descent of inverse kinematics in C, where it was built: `descent.c`, called by `ctypes`.

It is built when the package is installed, where there is a C compiler; without one `Kinematics` descends in NumPy, ten times slower.
Both take the same steps, up to rounding.
"""

from __future__ import annotations

import ctypes
from collections.abc import Sequence
from functools import cache
from importlib.machinery import EXTENSION_SUFFIXES
from pathlib import Path
from typing import TYPE_CHECKING

import mujoco
import numpy as np

from robosandbox.types import Array

if TYPE_CHECKING:
    from robosandbox.robots.kinematics import Kinematics

# As in descent.c: the most joints of an arm, and what the two structures look like.
_MOST_JOINTS, _LAYOUT = 16, 1
_real, _whole = ctypes.c_double, ctypes.c_int


class _Arm(ctypes.Structure):
    _fields_ = (
        ("n", _whole),
        ("order", _whole * _MOST_JOINTS),
        ("slides", _whole * _MOST_JOINTS),
        ("axes", _real * 3 * _MOST_JOINTS),
        ("anchors", _real * 3 * _MOST_JOINTS),
        ("position", _real * 3),
        ("rotation", _real * 9),
        ("reference", _real * _MOST_JOINTS),
        ("lower", _real * _MOST_JOINTS),
        ("upper", _real * _MOST_JOINTS),
        ("metres_per_radian", _real),
        ("damping", _real),
        ("min_damping", _real),
        ("max_step", _real),
        ("stall_share", _real),
        ("max_steps", _whole),
        ("stall_steps", _whole),
    )


class _Aim(ctypes.Structure):
    _fields_ = (
        ("free_turn", _whole),
        ("position", _real * 3),
        ("orientation", _real * 9),
        ("q", _real * _MOST_JOINTS),
        ("position_tolerance", _real),
        ("orientation_tolerance", _real),
        ("usual", _real),
        ("yielding", _real),
        ("position_error", _real),
        ("orientation_error", _real),
    )


@cache
def library() -> ctypes.CDLL | None:
    """Return what was built, or None."""
    for suffix in EXTENSION_SUFFIXES:
        path = Path(__file__).with_name(f"_descent{suffix}")
        if path.exists():
            try:
                found = ctypes.CDLL(str(path))
            except OSError:
                # Built for another machine.
                continue
            if found.layout() == _LAYOUT:
                return found
    return None


class CompiledDescent:
    """Descents of one arm.

    Args:
        found: What was built.
        kinematics: Of the arm, which stays as everything but its joints is now.
        numbers: By field of `_Arm`: damping and what else bounds a descent.
    """

    def __init__(self, found: ctypes.CDLL, kinematics: Kinematics, numbers: dict[str, float]) -> None:
        model, data = kinematics.model, kinematics.data
        joints: Sequence[int] = kinematics.joints.tolist()
        self._arm, self._aim, self._descend = _Arm(**numbers), _Aim(), found.descend
        arm = self._arm
        arm.n = len(joints)
        # Joints of a chain are numbered from its base to its tip.
        arm.order[: arm.n] = np.argsort(joints).tolist()
        moving = _above(model, kinematics.tool.body)
        for index, joint in enumerate(joints):
            moves = int(model.jnt_bodyid[joint]) in moving
            arm.slides[index] = int(not moves or model.jnt_type[joint] == mujoco.mjtJoint.mjJNT_SLIDE)
            if moves:
                arm.axes[index][:] = data.xaxis[joint].tolist()
                arm.anchors[index][:] = data.xanchor[joint].tolist()
            arm.reference[index] = float(data.qpos[kinematics.addresses[index]])
        q = data.qpos[kinematics.addresses]
        position, rotation = kinematics.forward(q)
        arm.position[:], arm.rotation[:] = position.tolist(), rotation.ravel().tolist()
        arm.lower[: arm.n], arm.upper[: arm.n] = kinematics.lower.tolist(), kinematics.upper.tolist()
        self._aim.position_tolerance = kinematics.position_tolerance
        # Views: making them anew costs as much as the descent.
        self._arm_at, self._aim_at = ctypes.addressof(arm), ctypes.addressof(self._aim)
        self._descend.argtypes = (ctypes.c_void_p, ctypes.c_void_p)
        self._position = _view(self._aim, "position", 3)
        self._rotation = _view(self._aim, "orientation", 9).reshape(3, 3)
        self._direction, self._q = _view(self._aim, "orientation", 3), _view(self._aim, "q", arm.n)

    def __call__(
        self, position: Array, orientation: Array, seed: Array, *, tolerance: float, weights: tuple[float, float]
    ) -> tuple[Array, float, float, bool]:
        """Descend from `seed` (n,).

        Args:
            position: Of the TCP, shape (3,).
            orientation: Rotation (3, 3) or approach (3,).
            seed: Shape (n,).
            tolerance: Of the orientation, radians.
            weights: Metres that a radian counts as, usually and where the orientation is within its tolerance.

        Returns:
            The best configuration (n,), its errors in metres and radians, and whether they are within tolerance.
        """
        aim = self._aim
        self._position[:], self._q[:] = position, seed
        aim.free_turn = orientation.ndim == 1
        if aim.free_turn:
            self._direction[:] = orientation
        else:
            self._rotation[:] = orientation
        aim.orientation_tolerance = tolerance
        aim.usual, aim.yielding = weights
        solved = self._descend(self._arm_at, self._aim_at) == 1
        return self._q.copy(), aim.position_error, aim.orientation_error, solved


def can_descend(kinematics: Kinematics) -> bool:
    """Tell whether an arm has joints of the kinds and number that `descent.c` takes."""
    known = (mujoco.mjtJoint.mjJNT_HINGE, mujoco.mjtJoint.mjJNT_SLIDE)
    kinds = kinematics.model.jnt_type[kinematics.joints]
    return len(kinds) <= _MOST_JOINTS and bool(np.isin(kinds, known).all())


def _above(model: mujoco.MjModel, body: int) -> set[int]:
    """Return the bodies from this one to the world."""
    found = set()
    while body > 0:
        found.add(body)
        body = int(model.body_parentid[body])
    return found


def _view(structure: ctypes.Structure, field: str, count: int) -> Array:
    offset = getattr(type(structure), field).offset
    return np.frombuffer(structure, dtype=np.float64, count=count, offset=offset)  # type: ignore[call-overload, no-any-return]
