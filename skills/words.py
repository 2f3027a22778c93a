"""Words of a skill, its verbs and the phrases that fill its arguments, as data that a planner's grammar reads."""

from __future__ import annotations

import math
from typing import Any, Literal

from robosandbox.values import frozen

SlotKind = Literal[
    "object",
    "pair",
    "angle",
    "length",
    "duration",
    "force",
    "speed",
    "share",
    "number",
    "point",
    "name",
    "pose",
    "phrase",
]


@frozen(kw_only=True)
class Slot:
    """Words that may follow a verb and its object, and the argument that they fill.

    Attributes:
        argument: Of the skill; of a pair two, of a point three of them, with spaces between, as "x y z".
        kind: What is said: an object, two of them ("the cube and the ball"), a number with the unit of an angle, length, duration or
            force, a speed (which becomes a tempo, "0.1 m/s"), a share ("half", "40 %"), a plain number, the three numbers of a point,
            a new name ("dock", "spot 2"), the name of a pose, or nothing but one of `phrases`.
        prepositions: What comes before it, as "by" or "parallel to"; "" where nothing needs to.
        phrases: Whole phrases with the value that each stands for, SI units, as ("a quarter turn", 1.5708).
        beginnings: Phrases before a number with what they multiply it by, as ("down", -1).
        endings: The same behind a number, as ("clockwise", -1).
        bare: Whether a number may do without any of `beginnings` and `endings`.
    """

    argument: str
    kind: SlotKind
    prepositions: tuple[str, ...] = ("",)
    phrases: tuple[tuple[str, float | str], ...] = ()
    beginnings: tuple[tuple[str, float], ...] = ()
    endings: tuple[tuple[str, float], ...] = ()
    bare: bool = True


@frozen(kw_only=True)
class Words:
    """Words with which people ask for a skill.

    Attributes:
        verbs: In their base form; "{}" marks the object where words follow it, as in "set {} upright", or where there is none what of
            the robot has to be named, as in "bring {}".
        nouns: Of the act, said with a verb that does not tell it: "make a move", "do a small turn".
        body: What of the robot may be named behind a verb without an object: "move your arm"; "" for none.
        alone: Whether slots may be said without a verb, as notes have it: "5 cm up".
        object: The argument that is the verb's object; "" for a verb without one.
        slots: What may follow, each at most once, in any order.
        required: Arguments of which at least one has to be said; none asks for nothing.
        needed: Arguments that all have to be said.
        hand: What the hand is before the call: empty, holding the object, which is picked up first where it is not held, or any. A verb
            without an object that is said of a holding hand is called with what that holds as `held`.
        holds: Whether the object is in the hand afterwards, whatever it was before.
        in_hand: Skill that does the same to an object that the hand holds; "" where it has to be put down first.
        returns: Whether the object is put back to where it was picked up for this.
        pace: The argument that words of manner say, as "slowly" does; "" where they say how the act is done.
        means: Arguments with the values that the verb itself stands for, as ("tempo", "careful"), unless others are said.
    """

    verbs: tuple[str, ...]
    nouns: tuple[str, ...] = ()
    body: Literal["", "hand", "wrist", "fingers"] = ""
    alone: bool = False
    object: str = ""
    slots: tuple[Slot, ...] = ()
    required: tuple[str, ...] = ()
    needed: tuple[str, ...] = ()
    hand: Literal["empty", "holding", "any"] = "empty"
    holds: bool = False
    in_hand: str = ""
    returns: bool = False
    pace: str = ""
    means: tuple[tuple[str, float | str], ...] = ()

    def __hash__(self) -> int:
        # Each reading of a sentence holds them and is told apart from others by its hash; verbs alone may be hundreds.
        return hash((self.verbs[:1], self.body, self.object, len(self.slots)))

    def __deepcopy__(self, memo: dict[int, Any]) -> Words:
        # Nothing in them changes, and what was spoken of, which holds them, is copied for each reading.
        return self


ROUNDS = tuple(
    (f"{times} {round_}".rstrip(), count)
    for times, count in (("once", 1.0), ("twice", 2.0), ("thrice", 3.0))
    for round_ in ("", "round", "around", "over")
)
"""Counts of a stroke that are said in a word, as in "twice round"."""
# What somebody means who says "a little", metres and rad. Chosen: seen across a table, and short of what is beside.
A_LITTLE, A_LITTLE_TURN = 0.02, math.radians(10.0)
TURNS = (
    ("a quarter turn", math.pi / 2.0),
    ("a quarter of a turn", math.pi / 2.0),
    ("an eighth of a turn", math.pi / 4.0),
    ("half a turn", math.pi),
    ("a half turn", math.pi),
    ("a half-turn", math.pi),
    ("a turn", 2.0 * math.pi),
    ("a full turn", 2.0 * math.pi),
    ("a whole turn", 2.0 * math.pi),
    ("a full circle", 2.0 * math.pi),
    *((f"{half} {round_}", math.pi) for half in ("halfway", "half way") for round_ in ("around", "round")),
)
"""Turns that are said as a share of a whole one, rad."""
_SENSES = (
    ("clockwise", -1.0),
    ("counterclockwise", 1.0),
    ("counter clockwise", 1.0),
    ("anticlockwise", 1.0),
    ("to the left", 1.0),
    ("left", 1.0),
    ("to the right", -1.0),
    ("right", -1.0),
    ("one way", 1.0),
    ("the other way", -1.0),
    ("back the other way", -1.0),
    ("in the other direction", -1.0),
    ("back", -1.0),
    # Which of the two is left open; "in the same direction" alone may be that of the turn before.
    *((way, 1.0) for way in ("in one direction", "in the one direction", "all in one direction")),
    *((f"{all_} {way}", 1.0) for all_ in ("all", "always") for way in ("in the same direction", "the same way")),
)
# "from above" goes without saying, and is passed over.
SENSES = tuple(
    (f"{said}{seen}{by}", sign)
    for by in ("", " by")
    for said, sign in _SENSES
    for seen in (("", " seen", " as seen", " viewed", " when seen") if "clockwise" in said else ("",))
)
"""Senses of a turn seen from above, with the sign of its angle: `beginnings` and `endings` of a slot."""
