"""Test whether the hand can rise from a grasp, made before it goes there."""

from __future__ import annotations

import numpy as np

from robosandbox.errors import UnreachableError
from robosandbox.skills.primitives.manipulator import Manipulator, leaning, raised
from robosandbox.types import Array

# Rad from straight up; chosen so that a lift, which goes straight up where that can be reached, may lean outwards in
# steps of 20 degrees, as short arms must (docs/arms.md).
_LEANS = (0.0, 0.35, 0.7, 1.05)
# Turn of a joint, rad, below which two configurations are of one posture; chosen far below the half turn that an
# elbow's other side takes.
_SAME_POSTURE = 0.8


def check_rise(arm: Manipulator, q: Array, height: float, held: str) -> None:
    """Check that the TCP can rise from a configuration (n,) by `height`, straight or leaning outwards.

    Raises:
        UnreachableError: It cannot.
        CollisionError: The hand would touch something other than the table and what it holds.
    """
    motion, failure = arm.motion, None
    pose = motion.forward(q)
    top = raised(pose, height)
    if len(arm.start.objects) == 1:
        # Nothing can be above. Where the arm gets up there from here without another posture, a line leads there, too.
        try:
            if np.abs(motion.ik(top, q, restarts=0) - q).max() < _SAME_POSTURE:
                return
        except UnreachableError:
            pass
    motion.allow("table", held)
    for angle in _LEANS:
        try:
            motion.plan_line(q, leaning(top, arm.spec.base_position, angle))
            return
        except UnreachableError as error:
            failure = failure or error
    assert failure is not None
    raise failure
