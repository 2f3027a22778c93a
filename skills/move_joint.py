"""Move joint: turn one joint of the arm."""

from __future__ import annotations

from typing import Literal

import numpy as np

from robosandbox.errors import InvalidArgumentError, Phase
from robosandbox.skills.primitives.hand_move import HandMove, Mover
from robosandbox.skills.protocols import SkillContext
from robosandbox.skills.words import A_LITTLE_TURN, SENSES, Slot, Words
from robosandbox.types import SkillResult

_SET = ("set", "bring", "put", "drive")
_VERBS = (
    *(
        "move",
        "turn",
        "rotate",
        "bend",
        "flex",
        "turn only",
        "move only",
        "rotate only",
        "swing",
        "drive",
        "jog",
        "twist",
    ),
    *(
        "change",
        "shift",
        "swivel",
        "spin",
        "actuate",
        "advance",
        "run",
        "wiggle",
        "wiggle only",
        "bend only",
        "swing only",
    ),
)
_BY = Slot(
    argument="by",
    kind="angle",
    prepositions=("by", "", "through", "another"),
    phrases=(
        ("a little", A_LITTLE_TURN),
        ("a bit", A_LITTLE_TURN),
        ("a little bit", A_LITTLE_TURN),
        ("slightly", A_LITTLE_TURN),
    ),
    endings=(("more", 1.0), ("further", 1.0), ("back", -1.0)),
)
_HOW_FAR = (
    _BY,
    Slot(argument="to", kind="angle", prepositions=("to", "back to")),
)
# Joints by their place along the arm; those that are counted from its end are negative.
_BY_PLACE: tuple[tuple[str, float | str], ...] = tuple(
    (f"{whose} {place} {joint}".strip(), float(number))
    for whose in ("the", "your", "")
    for place, number in (
        *zip(("first", "second", "third", "fourth", "fifth", "sixth", "seventh"), range(1, 8), strict=True),
        ("base", 1),
        ("last", -1),
        ("final", -1),
        ("wrist", -1),
        ("last but one", -2),
    )
    for joint in ("joint", "axis")
)
_ELBOW = Slot(
    argument="joint",
    kind="phrase",
    phrases=tuple((f"{the}elbow{joint}", "elbow") for the in ("the ", "your ", "") for joint in ("", " joint")),
)
_BEND = Slot(
    argument="bend",
    kind="angle",
    prepositions=("by", "", "another"),
    phrases=tuple(
        (said, A_LITTLE_TURN) for said in ("a little", "a bit", "a little bit", "slightly", "more", "further")
    ),
    endings=(("more", 1.0), ("further", 1.0)),
)
_UNBEND = Slot(
    argument="bend",
    kind="angle",
    beginnings=(("by", -1.0), ("", -1.0)),
    phrases=tuple((said, -A_LITTLE_TURN) for said in ("a little", "a bit", "a little bit", "slightly")),
    bare=False,
)
_NUMBER = Slot(argument="joint", kind="number", prepositions=("joint", "joint number", "axis", "the joint"))


_SEEN_FROM_ABOVE = Slot(
    argument="turn", kind="angle", prepositions=("", "by"), beginnings=SENSES, endings=SENSES, bare=False
)
# Share of a joint's turn that is about the vertical from which on it is one to the left or to the right: 26 degrees from it.
_UPRIGHT = 0.9
# Vertical part of an axis up to which it is level; how many joints lean an arm that has an elbow: it, the shoulder, and one behind it.
_LEVEL, _WITH_ELBOW = 0.3, 3


class MoveJoint(HandMove):
    """Turn one joint of the arm."""

    name = "move_joint"
    words = (
        Words(verbs=_VERBS, slots=(_NUMBER, *_HOW_FAR), required=("by", "to"), needed=("joint",), alone=True),
        Words(
            verbs=_SET,
            slots=(_NUMBER, Slot(argument="to", kind="angle", prepositions=("to", "at", "back to"))),
            needed=("joint", "to"),
        ),
        # "swing the base joint 30 degrees to the left"
        *(
            Words(verbs=_VERBS, slots=(which, _SEEN_FROM_ABOVE), needed=("joint", "turn"))
            for which in (Slot(argument="joint", kind="phrase", phrases=_BY_PLACE), _NUMBER)
        ),
        Words(
            verbs=_SET,
            slots=(
                Slot(argument="joint", kind="phrase", phrases=_BY_PLACE),
                Slot(argument="to", kind="angle", prepositions=("to", "at", "back to")),
            ),
            required=("joint",),
        ),
        # "bend the elbow by 10 degrees", "straighten your elbow a bit"
        Words(verbs=("bend", "flex", "bend only", "fold"), slots=(_ELBOW, _BEND), needed=("joint", "bend")),
        Words(verbs=("straighten", "extend", "unbend", "stretch"), slots=(_ELBOW, _UNBEND), needed=("joint", "bend")),
        Words(
            verbs=tuple(dict.fromkeys((*(v for v in _VERBS if v not in ("bend", "flex", "bend only")), *_SET))),
            slots=(_ELBOW, *_HOW_FAR),
            required=("by", "to"),
            needed=("joint",),
        ),
        Words(
            verbs=("increase joint", "raise joint", "increment joint"),
            slots=(Slot(argument="joint", kind="number"), _BY),
            required=("by",),
        ),
        Words(
            verbs=("decrease joint", "reduce joint", "lower joint", "decrement joint"),
            slots=(
                Slot(argument="joint", kind="number"),
                Slot(argument="by", kind="angle", beginnings=(("by", -1.0),), bare=False),
            ),
            required=("by",),
        ),
        Words(
            verbs=_VERBS,
            slots=(Slot(argument="joint", kind="phrase", phrases=_BY_PLACE), *_HOW_FAR),
            required=("by", "to"),
            needed=("joint",),
            alone=True,
        ),
    )

    def run(
        self,
        ctx: SkillContext,
        *,
        joint: int | Literal["elbow"],
        by: float | None = None,
        to: float | None = None,
        turn: float | None = None,
        bend: float | None = None,
    ) -> SkillResult:
        """Turn a joint on a free way, the others staying as they are in the end; what the hand holds stays held.

        Args:
            joint: Its number, counted from the base, which is 1, or from the hand, which is -1; or the elbow, the second that leans
                the arm.
            by: By how much, rad; metres for a sliding one.
            to: To which angle, in place of that.
            turn: By how much as seen from above, in place of both, rad; counterclockwise, to the left, is positive.
            bend: By how much further it is bent, in place of all, rad, which brings the hand nearer to the shoulder; negative straightens it.

        Raises:
            InvalidArgumentError: There is no such joint, it does not go so far, not exactly one of `by`, `to`, `turn` and `bend` is
                given, or it does not turn about the vertical.
            CollisionError: Something is in the way.
            UnsupportedError: What lies in what is held would fall out.
            TrackingError: The arm did not arrive.
        """
        arm = Mover(ctx)
        robot = arm.spec
        if sum(told is not None for told in (by, to, turn, bend)) != 1:
            raise InvalidArgumentError("by, to, turn, bend: give one of them", phase=Phase.CHECK)
        joint = _elbow(arm) if joint == "elbow" else joint
        joint = robot.n + 1 + joint if joint < 0 else joint
        if not 1 <= joint <= robot.n:
            raise InvalidArgumentError(f"joint: {robot.name} has joints 1 to {robot.n}, not {joint}", phase=Phase.CHECK)
        if turn is not None:
            upwards = _upwards(arm, joint)
            if abs(upwards) < _UPRIGHT:
                told = f"turn: {robot.joints[joint - 1]} does not turn about the vertical as it stands; say by how much"
                raise InvalidArgumentError(told, phase=Phase.CHECK)
            by = float(np.copysign(turn, turn * upwards))
        if bend is not None:
            by = bend * _bending(arm, joint)
        goal = arm.q.copy()
        goal[joint - 1] = goal[joint - 1] + by if by is not None else to
        low, high = robot.lower[joint - 1], robot.upper[joint - 1]
        if not low <= goal[joint - 1] <= high:
            raise InvalidArgumentError(
                f"{robot.joints[joint - 1]} goes from {low:.3f} to {high:.3f} rad, not to {goal[joint - 1]:.3f}",
                phase=Phase.CHECK,
            )
        arm.follow(arm.way_to(goal), Phase.APPROACH)
        return SkillResult(skill=self.name, detail={"joint_error": float(np.abs(arm.q - goal).max())})


def _upwards(arm: Mover, joint: int) -> float:
    """Return the vertical component of the axis about which a joint turns the hand, counterclockwise seen from above positive."""
    little = 1e-5
    further = arm.q.copy()
    further[joint - 1] += little
    turned = arm.motion.forward(further).rotation @ arm.motion.forward(arm.q).rotation.T
    return float(turned[1, 0] - turned[0, 1]) / (2.0 * little)


def _leaning(arm: Mover) -> list[int]:
    """Return the numbers of the joints that lean the arm where it stands at home: those that turn about level lines."""
    kinematics = arm.planning.kinematics()
    point, _ = kinematics.forward(arm.spec.home_q)
    axes = kinematics.jacobian(point.copy())[3:]
    return [k + 1 for k in range(arm.spec.n) if np.linalg.norm(axes[:, k]) > 0.0 and abs(axes[2, k]) < _LEVEL]


def _elbow(arm: Mover) -> int:
    leaning = _leaning(arm)
    if len(leaning) < _WITH_ELBOW:
        raise InvalidArgumentError(
            f"joint: {arm.spec.name} has no elbow; its joints are {', '.join(arm.spec.joints)}", phase=Phase.CHECK
        )
    return leaning[1]


def _bending(arm: Mover, joint: int) -> float:
    """Return the sense, 1 or -1, in which a joint brings the hand nearer to the one that leans the arm first."""
    leaning = _leaning(arm)
    if not leaning:
        raise InvalidArgumentError(f"bend: no joint of {arm.spec.name} leans its arm", phase=Phase.CHECK)
    kinematics = arm.planning.kinematics()
    point, _ = kinematics.forward(arm.q)
    columns = kinematics.jacobian(point.copy())
    # From the shoulder's axis to the hand, at a right angle to the axis.
    away = np.cross(columns[:3, leaning[0] - 1], columns[3:, leaning[0] - 1])
    return -1.0 if float(columns[:3, joint - 1] @ away) > 0.0 else 1.0
