"""Shake: move the hand, and what it holds, to and fro."""

from __future__ import annotations

from typing import Annotated, Any, Literal

import numpy as np
from pydantic import Field

from robosandbox.errors import Phase, UnsupportedError
from robosandbox.skills.primitives.hand_move import HandMove, Mover
from robosandbox.skills.protocols import SkillContext
from robosandbox.skills.words import ROUNDS, Slot, Words
from robosandbox.types import Pose, SkillResult
from robosandbox.world.contracts import Contract
from robosandbox.world.facts import fact

_TIMES = Slot(
    argument="times",
    kind="number",
    endings=tuple((said, 1.0) for said in ("times", "swings", "waves", "wiggles", "goes", "strokes")),
    bare=False,
    phrases=(
        *ROUNDS,
        ("a couple of times", 2.0),
        ("a few times", 3.0),
        ("several times", 3.0),
        ("a bit", 3.0),
        ("a little", 3.0),
    ),
)
_WAVED_AT = (
    "me",
    "us",
    "them",
    "him",
    "her",
    "everyone",
    "everybody",
    *(
        f"the {who}"
        for who in ("visitors", "people", "camera", "audience", "children", "kids", "guests", "crowd", "class")
    ),
)

_WIDTH = Slot(
    argument="width",
    kind="length",
    prepositions=("", "by"),
    endings=(("each", 1.0), ("each time", 1.0), ("every time", 1.0), ("each way", 2.0)),
)
_AXIS = Slot(
    argument="axis",
    kind="phrase",
    phrases=(
        *(
            (said, "sideways")
            for said in ("side to side", "left and right", "from side to side", "left right", "sideways")
        ),
        *((said, "vertical") for said in ("up and down", "vertically")),
    ),
)
_FROM_SIDE_TO_SIDE = Slot(
    argument="axis", kind="phrase", phrases=tuple(each for each in _AXIS.phrases if each[1] == "sideways")
)
_SIDEWAYS = (
    "left and right",
    "left to right",
    "right and left",
    "side to side",
    "from left to right",
    "from side to side",
    "to and fro",
    "back and forth",
    "sideways",
)
_UP_AND_DOWN = ("up and down", "down and up")


def _to_and_fro(ways: tuple[str, ...]) -> tuple[str, ...]:
    goes = (
        "move",
        "go",
        "swing",
        "sway",
        *(f"{verb} {{}}" for verb in ("move", "swing", "shake", "wave", "bring")),
    )
    return tuple(f"{verb} {way}" for verb in goes for way in ways)


class Shake(HandMove):
    """Move the hand to and fro."""

    name = "shake"
    words = (
        Words(
            verbs=(
                "shake",
                *(f"give {{}} a {some}shake" for some in ("", "little ", "good ", "gentle ", "quick ", "short ")),
            ),
            nouns=("shake", "wiggle", "jiggle", "wobble"),
            object="object",
            slots=(_TIMES, _WIDTH, _AXIS),
            hand="holding",
        ),
        Words(
            verbs=(
                *(
                    "wave",
                    "wiggle",
                    "wobble",
                    "jiggle",
                    "waggle",
                    "sway",
                    "rock",
                    "swing {} to and fro",
                    "give {} a shake",
                ),
                "wave hello",
                "wave to me",
                "wave at me",
                "wave goodbye",
                *(
                    f"wave{what} {to} {who}"
                    for what in ("", " hello", " goodbye")
                    for to in ("to", "at")
                    for who in _WAVED_AT
                ),
                *(
                    "give me a wave",
                    "give us a wave",
                    "give a wave",
                    "give a little wave",
                ),
                *(
                    "shake your head",
                    "shake {}",
                    "waggle your head",
                ),
                *_to_and_fro(_SIDEWAYS),
            ),
            body="wrist",
            nouns=("wave", "wiggle", "wobble", "shake", "waggle"),
            slots=(_TIMES, _WIDTH, _FROM_SIDE_TO_SIDE),
        ),
        Words(
            verbs=(
                "nod",
                "nod your head",
                *("nod {}", "nod {} up and down", "nod up and down"),
                *(f"{nod} {to} {whom}" for nod in ("nod", "bow") for to in ("to", "at") for whom in _WAVED_AT),
                *("nod yes", "bow", "bow down", "take a bow", "curtsy"),
                "bob",
                "bob up and down",
                "bounce",
                *(f"{bob} {{}}{ways}" for bob in ("bob", "bounce") for ways in ("", " up and down")),
                *_to_and_fro(_UP_AND_DOWN),
            ),
            body="hand",
            nouns=("nod", "bow", "bob", "bounce"),
            slots=(_TIMES, _WIDTH),
            means=(("axis", "vertical"),),
        ),
    )

    def contract(self, *, object: str | None = None, **others: Any) -> Contract:
        """Return that what is to be shaken is held, and stays so."""
        del others
        return Contract(needs=() if object is None else (fact("holding", object),), keeps_hold=True)

    def run(
        self,
        ctx: SkillContext,
        *,
        object: str | None = None,
        times: Annotated[int, Field(ge=1, le=20)] = 3,
        width: Annotated[float, Field(gt=0.0, le=0.3)] = 0.05,
        axis: Literal["sideways", "vertical"] = "sideways",
    ) -> SkillResult:
        """Move the tool centre point to and fro about where it is, and back there; what it holds stays held.

        Args:
            object: Id of what is held and to be shaken; nothing, or whatever is held, when left out.
            times: How often it goes to each side.
            width: From side to side, metres.
            axis: To the left and to the right, or up and down.

        Raises:
            NotHoldingError: It is not held.
            UnsupportedError: What lies in what is held would be spilt.
            UnreachableError: The hand cannot go there in straight lines.
            CollisionError: Something is in the way.
            TrackingError: The arm did not arrive.
        """
        arm = Mover(ctx)
        if arm.carries:
            raise UnsupportedError(
                f"{arm.start.held} holds {', '.join(arm.carries)}, which would be spilt; put it down, or pour it out first",
                phase=Phase.CHECK,
            )
        here = arm.state.tcp_pose
        along = np.array([0.0, 0.0, width / 2.0] if axis == "vertical" else [0.0, width / 2.0, 0.0])
        sides = [sign * along for _ in range(times) for sign in (1.0, -1.0)]
        points = [*(here.position + side for side in sides), here.position]
        poses = [Pose(xyz=tuple(point), quat_xyzw=here.quat_xyzw) for point in points]
        way = arm.motion.plan_through(arm.q, poses, speed=arm.speed)
        return SkillResult(skill=self.name, detail={**arm.arrive(way, here), "times": float(times)})
