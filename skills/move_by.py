"""Move by: the hand goes some way in a straight line, also until it touches something."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, ClassVar

import numpy as np
from pydantic import Field

from robosandbox.driver import require
from robosandbox.errors import Phase
from robosandbox.skills.primitives.guarded import follow_until
from robosandbox.skills.primitives.hand_move import HAND_GOES, LIGHT, HandMove, Mover
from robosandbox.skills.protocols import SkillContext
from robosandbox.skills.words import A_LITTLE, Slot, Words
from robosandbox.types import Pose, SkillResult

_Way = Annotated[float, Field(ge=-2.0, le=2.0)]


def _along(name: str) -> dict[str, float]:
    """Return how a way along an axis is said by its letter: "along x", "in the negative x direction"."""
    return {
        f"{along} {sense}{name}{what}".strip(): sign
        for along in ("", "in", "along", "on", "in the", "along the", "on the")
        for sense, sign in (
            *(("", 1.0), ("+ ", 1.0), ("plus ", 1.0), ("positive ", 1.0)),
            *(("- ", -1.0), ("minus ", -1.0), ("negative ", -1.0)),
        )
        for what in ("", " direction", " axis")
    }


# Words for the way along an axis, with its sign.
_FORWARD = {
    "forward": 1.0,
    **{
        f"{to} {whom}": -1.0
        for to in ("toward", "towards", "closer to", "nearer to")
        for whom in ("yourself", "you", "your base", "the base", "the robot")
    },
    # Who is there stands before the arm, as where it hands things over.
    **{
        f"{to} {whom}": 1.0
        for to in ("toward", "towards", "closer to", "nearer to")
        for whom in ("me", "us", "the person", "the user")
    },
    **{f"away from {whom}": 1.0 for whom in ("yourself", "you", "your base", "the base", "the robot")},
    **_along("x"),
    "straight ahead": 1.0,
    "straight forward": 1.0,
    "straight back": -1.0,
    "out": 1.0,
    "outward": 1.0,
    "outwards": 1.0,
    "back towards you": -1.0,
    "back towards the base": -1.0,
    "back towards yourself": -1.0,
    "forwards": 1.0,
    "ahead": 1.0,
    "away": 1.0,
    "back": -1.0,
    "backward": -1.0,
    "backwards": -1.0,
}
_LEFT = {
    **{
        f"{way} {side}".strip(): sign
        for way in ("", "to the", "to your", "towards the", "over to the", "over to your", "leftwards to the")
        for side, sign in (("left", 1.0), ("right", -1.0))
    },
    **_along("y"),
}
_UP = {
    **_along("z"),
    "up": 1.0,
    "straight up": 1.0,
    "back up": 1.0,
    "back down": -1.0,
    "straight down": -1.0,
    "upward": 1.0,
    "upwards": 1.0,
    "higher": 1.0,
    "down": -1.0,
    "towards the table": -1.0,
    "toward the table": -1.0,
    "downward": -1.0,
    "downwards": -1.0,
    "lower": -1.0,
}
_DOWNWARDS = (
    *("down", "straight down", "downward", "downwards", "down slowly"),
    *("down on the table", "down onto the table", "down to the table", "down towards the table"),
)
# Metres by which a hand goes away that is told no way; as one that hovers.
_CLEAR = 0.1
# Metres; farther than any arm on a table reaches down.
_FAR = 2.0


def _sideways(argument: str, words: Mapping[str, float]) -> Slot:
    """Return how a way along an axis is said: "up 5 cm", "5 cm to the left"."""
    way = tuple(words.items())
    return Slot(
        argument=argument,
        kind="length",
        prepositions=("", "by"),
        beginnings=tuple((f"{word}{by}", sign) for word, sign in way for by in ("", " by")),
        endings=(*way, *((f"further {word}", sign) for word, sign in way)),
        phrases=tuple(
            (said, sign * A_LITTLE)
            for word, sign in way
            for some in (
                *(
                    "a little",
                    "a bit",
                    "a little bit",
                    "slightly",
                    "a touch",
                    "a tiny bit",
                    "just a little",
                    "just a bit",
                ),
                *("a tad", "a fraction", "a smidge", "some more", "somewhat"),
            )
            for said in (f"{word} {some}", f"{some} {word}")
        ),
        bare=False,
    )


def _far(argument: str, sign: float) -> Slot:
    """Return how a way is said of which the verb tells the direction: "by 5 cm"."""
    return Slot(
        argument=argument,
        kind="length",
        beginnings=(("by", sign), ("", sign)),
        phrases=tuple((said, sign * A_LITTLE) for said in ("a little", "a bit", "a little bit", "slightly", "a touch")),
        bare=False,
    )


_TOUCHES = (
    "contact",
    "touch",
    "you make contact",
    "you are in contact",
    *(
        f"{who} {does}{what}"
        for who, does in (
            *(("it", "touches"), ("you", "touch"), ("you", "feel"), ("you", "hit"), ("you", "meet")),
            *(("they", "touch"), ("they", "meet"), ("it", "meets"), ("you", "make contact with"), ("it", "hits")),
        )
        for what in (
            "",
            " it",
            " contact",
            " something",
            " anything",
            " the table",
            " the tabletop",
            " the surface",
            " resistance",
            " contact with the table",
        )
    ),
)
_UNTIL_TOUCH = Slot(
    argument="until_force",
    kind="phrase",
    phrases=tuple(
        (f"{until} {what}{then}", LIGHT)
        for until in ("until", "till")
        for what in _TOUCHES
        for then in ("", " and stop there", " and stop", " then stop")
    ),
)
_UNTIL_PRESSED = Slot(
    argument="until_force",
    kind="force",
    prepositions=tuple(
        f"{until} {who} {feel}"
        for until in ("until", "till")
        for who, feel in (("you", "feel"), ("you", "feel about"), ("you", "press with"), ("it", "presses with"))
    ),
)

_GERMAN = """
ALONG_X
  1.0 = nach vorn, nach vorne, vorwärts
  -1.0 = zurück, nach hinten, rückwärts
ALONG_Y
  1.0 = nach links
  -1.0 = nach rechts
ALONG_Z
  1.0 = hoch, nach oben, aufwärts, höher
  -1.0 = runter, herunter, hinunter, nach unten, abwärts, tiefer
order : Command
  = verb=worded skill=move_by simple(GO gone)
gone
  = (DETERMINER.acc ARM.acc)? slots+:going ("und" slots+:going)?
going : slot
  = dx:along_x
  = dy:along_y
  = dz:along_z
along_x : product
  = "um"? of+:length of+:ALONG_X
  = of+:ALONG_X "um"? of+:length
along_y : product
  = "um"? of+:length of+:ALONG_Y
  = of+:ALONG_Y "um"? of+:length
along_z : product
  = "um"? of+:length of+:ALONG_Z
  = of+:ALONG_Z "um"? of+:length
"""
_SPANISH = """
RAISE
  1.0 = sube, suba, subir, subas, eleva, eleve, elevar
  -1.0 = baja, baje, bajar, bajes, desciende, descienda, descender
ALONG_X
  1.0 = hacia adelante, hacia delante, adelante, a el frente
  -1.0 = hacia atrás, atrás
ALONG_Y
  1.0 = a la izquierda, hacia la izquierda
  -1.0 = a la derecha, hacia la derecha
ALONG_Z
  1.0 = hacia arriba, arriba, más arriba
  -1.0 = hacia abajo, abajo, más abajo
order : Command
  = verb=worded skill=move_by act(MOVE gone)
  = verb=worded skill=move_by slots+:raised
gone
  = (DETERMINER? ARM)? slots+:going ("y" slots+:going)?
raised : slot
  = dz:raised_by
raised_by : product
  = of+:RAISE (DETERMINER? ARM)? of+:length
going : slot
  = dx:along_x
  = dy:along_y
  = dz:along_z
along_x : product
  = of+:length of+:ALONG_X
  = of+:ALONG_X of+:length
along_y : product
  = of+:length of+:ALONG_Y
  = of+:ALONG_Y of+:length
along_z : product
  = of+:length of+:ALONG_Z
  = of+:ALONG_Z of+:length
"""


class MoveBy(HandMove):
    """Move the hand some way in a straight line."""

    name = "move_by"
    words = (
        Words(
            verbs=(
                *HAND_GOES,
                *("extend", "extend {}", "reach", "retract", "retract {}", "draw {}", "drop", "come on"),
                *(
                    "retreat",
                    "reach out",
                    "withdraw",
                    "withdraw {}",
                    "back off",
                    "back away",
                    "pull back",
                    "pull away",
                ),
                *("draw a line", "trace a line", "draw a straight line", "lower", "raise", "lift {}"),
            ),
            nouns=("move", "movement", "motion", "step", "shift", "hop", "lift", "nudge"),
            body="hand",
            alone=True,
            slots=(_sideways("dx", _FORWARD), _sideways("dy", _LEFT), _sideways("dz", _UP), _UNTIL_TOUCH),
            required=("dx", "dy", "dz"),
        ),
        Words(
            verbs=(
                *(
                    "rise",
                    "rise up",
                    "ascend",
                    "climb",
                    "climb up",
                    "raise {}",
                    "lift {}",
                    "clear",
                    "lift off",
                    "lift clear",
                ),
                *("come up", "get up", "pull up", "pull {} up"),
            ),
            body="hand",
            slots=(_far("dz", 1.0), _UNTIL_TOUCH),
            required=("dz",),
        ),
        Words(
            verbs=("descend", "sink", "sink down", "dip", "drop", "drop down", "lower {}"),
            body="hand",
            slots=(_far("dz", -1.0), _UNTIL_TOUCH),
            required=("dz",),
        ),
        Words(verbs=("advance", "extend", "reach out"), body="hand", slots=(_far("dx", 1.0),), required=("dx",)),
        Words(
            verbs=("retract", "retract {}", "withdraw {}", "retreat"),
            body="hand",
            slots=(_far("dx", -1.0),),
            required=("dx",),
        ),
        Words(
            verbs=(
                *(f"{goes} {down}" for goes in HAND_GOES for down in _DOWNWARDS),
                *("descend", "keep descending", "keep lowering", "lower {}", "keep lowering {}"),
                *(f"lower {{}} {down}" for down in _DOWNWARDS),
                *(f"lower {{}} {to} the table" for to in ("onto", "to", "towards", "down to", "down onto")),
                *(
                    f"{keep} {going} {down}"
                    for keep in ("keep", "continue")
                    for going in ("going", "moving")
                    for down in _DOWNWARDS
                ),
            ),
            body="hand",
            slots=(_UNTIL_TOUCH, _UNTIL_PRESSED),
            required=("until_force",),
            means=(("dz", -_FAR),),
        ),
        # "take your hand away": up, clear of what stands there.
        Words(
            verbs=(
                *(
                    f"{take} {{}} {away}"
                    for take in ("take", "draw", "pull", "get", "move")
                    for away in ("away", "out of the way", "clear")
                ),
                *(
                    "get out of the way",
                    "move out of the way",
                    "get back up out of the way",
                    "back up out of the way",
                    "get clear",
                ),
            ),
            body="hand",
            means=(("dz", _CLEAR),),
        ),
        # From what it points at.
        Words(verbs=("back off", "back away", "pull back"), slots=(_far("dz", 1.0),), required=("dz",)),
        Words(
            verbs=("lower", "lower {} down", "bring {} down", "lower {} slowly"),
            object="held",
            slots=(_UNTIL_TOUCH,),
            required=("until_force",),
            hand="holding",
            means=(("dz", -_FAR),),
        ),
    )
    translations: ClassVar[Mapping[str, str]] = {"german": _GERMAN, "spanish": _SPANISH}

    def run(
        self,
        ctx: SkillContext,
        *,
        dx: _Way = 0.0,
        dy: _Way = 0.0,
        dz: _Way = 0.0,
        until_force: Annotated[float, Field(ge=0.0, le=20.0)] = 0.0,
        held: str | None = None,
    ) -> SkillResult:
        """Move the tool centre point in a straight line without turning the hand; what it holds stays held.

        Args:
            dx: Forward, metres.
            dy: To the left, metres.
            dz: Up, metres.
            until_force: Force on anything at which it stops, N; it then goes slowly, may touch things, and goes no farther than it
                reaches. 0 touches nothing.
            held: Id of what is held meanwhile; nothing, or whatever is held, when left out.

        Raises:
            UnreachableError: The hand cannot go there in a straight line.
            CollisionError: Something is in the way.
            LimitError: It is outside of the workspace.
            UnsupportedError: The driver feels no touch.
            TrackingError: The arm did not arrive.
        """
        del held
        arm = Mover(ctx)
        start = arm.state.tcp_pose
        goal = Pose(xyz=tuple(start.position + np.array([dx, dy, dz])), quat_xyzw=start.quat_xyzw)
        if until_force == 0.0:
            way = arm.motion.plan_line(arm.q, goal, speed=arm.speed)
            return SkillResult(skill=self.name, detail=arm.arrive(way, goal))
        require(ctx.driver, "wrist_wrench", "the way ends where something is felt")
        if dx == dy == 0.0 and dz < 0.0:
            arm.come_down_near(-dz)
        arm.motion.allow("table", *(item.id for item in arm.start.objects))
        trajectory = arm.as_far_as_it_goes(arm.state.tcp_pose, goal)
        before, most = arm.pressed(), 0.0

        def felt() -> bool:
            # Beside what is held, which weighs something.
            nonlocal most
            most = max(most, float(np.linalg.norm(arm.pressed() - before)))
            return most >= until_force

        touched = follow_until(arm, trajectory, Phase.TOUCH, felt)
        gone = arm.state.tcp_pose.position - start.position
        return SkillResult(
            skill=self.name,
            detail={
                "dx": float(gone[0]),
                "dy": float(gone[1]),
                "dz": float(gone[2]),
                "touched": touched,
                "force_n": most,
            },
            found=f"{'touched something' if touched else 'touched nothing'} after {100.0 * float(np.linalg.norm(gone)):.1f} cm, "
            f"{100.0 * (arm.state.tcp_pose.xyz[2] - arm.start.table_height):.1f} cm above the table, with {most:.1f} N",
        )
