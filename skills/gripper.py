"""The gripper by itself: opened and closed where the arm is."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Any, ClassVar

import numpy as np
from pydantic import Field

from robosandbox.driver import Driver, require
from robosandbox.errors import AlreadyHoldingError, GraspError, InvalidArgumentError, Phase
from robosandbox.skills.base import Skill
from robosandbox.skills.primitives.manipulator import Manipulator
from robosandbox.skills.protocols import SkillContext
from robosandbox.skills.words import A_LITTLE, Slot, Words
from robosandbox.types import SkillResult
from robosandbox.world.contracts import Contract
from robosandbox.world.facts import fact

# Share by which a grip's force may differ from the one asked for.
_CLOSE_ENOUGH = 0.05
# Times that the motors' force is set anew by what is felt: friction in the fingers' joints takes an unknown part of it.
_CORRECTIONS = 24
# Share of a force with which the motors begin gently, and by how much it grows as long as the fingers stick: jaws press 9 to 15 times as
# many N at their tips as their motors have N m (SO-101, xArm6, 2F-85).
_FAINT, _FIRMER = 0.02, 1.5
# Metres that fingers close at least which are not stuck in their joints: a Panda's creep with 5 N at 4 mm/s, 0.1 s at a time.
_STUCK = 0.0005
# Metres between fingers that have closed on nothing.
_SHUT = 0.001

# How the force of a grip is said.
FORCE = Slot(
    argument="force",
    kind="force",
    endings=tuple((most, 1.0) for most in ("at most", "max", "maximum", "tops", "or less", "at the most", "of force")),
    prepositions=(
        "",
        *(
            "with",
            "to",
            "at",
            "using",
            "with a force of",
            "with about",
            "at about",
            "with like",
            "with only",
            "with just",
        ),
        *("with around", "with roughly", "at a force of", "using a force of", "with a grip of", "with a grip force of"),
        # What is not to be passed is what is set.
        *(
            "with no more than",
            "no harder than",
            "no more than",
            "with at most",
            "at most",
            "not more than",
            "with a maximum of",
        ),
        *("at a maximum of", "with a force of at most", "at no more than"),
        *("but no harder than", "but no more than", "with up to", "up to", "not harder than", "but not more than"),
    ),
)

_HARD = ("as hard as you can", "hard", "tight")
_WHOLLY = (
    *("all the way", "fully", "completely", "as far as you can", "as far as they go", "as far as it goes"),
    *("as far as possible", "as wide as you can", "as wide as they go", "as wide as it goes", "as wide as possible"),
    *("to the maximum", "to its maximum", "to the widest", "entirely", "over the full stroke", "over its full stroke"),
    *("until they meet", "until they touch", "until it is shut", "until they are shut", "until it is closed"),
)
_UNTIL = tuple(
    f"{until} {who} {only}".rstrip()
    for until in ("until", "till")
    for who in ("it is", "they are")
    for only in ("", "only", "about", "just")
)
_HALF = tuple((f"{about}{half}", 0.5) for about in ("", "about ", "only ") for half in ("halfway", "half way", "half"))
_SHARES = (("halfway", 0.5), ("half way", 0.5), *((said, 1.0) for said in _WHOLLY))
# "I want the gripper open", "fingers wide open"
_OPEN = Slot(
    argument="share",
    kind="phrase",
    phrases=tuple((f"{wholly}open", 1.0) for wholly in ("", "wide ", "fully ", "all the way ", "completely ")),
)


def _more(argument: str, sign: float) -> Slot:
    """Return how a change of the gap is said: "by 1 cm", "5 mm more", "a bit"."""
    return Slot(
        argument=argument,
        kind="length",
        prepositions=("", "by", "about", "just"),
        beginnings=(
            *(("by", sign), ("by another", sign), ("another", sign)),
            *((f"{way}{by}", -1.0) for way in ("in", "inwards", "together") for by in ("", " by")),
            *((f"{way}{by}", 1.0) for way in ("out", "outwards") for by in ("", " by")),
        ),
        endings=(
            *((narrower, -1.0) for narrower in ("narrower", "tighter", "closer", "closer together")),
            *((less, -sign) for less in ("less", "less than now", "less than they are", "less than it is")),
            *((way, -1.0) for way in ("in", "inward", "inwards", "together")),
            *((way, 1.0) for way in ("out", "outward", "outwards")),
            *(
                (more, sign)
                for more in (
                    "more",
                    *(
                        f"{wider} than {now}"
                        for wider in ("wider", "further", "more")
                        for now in ("they are now", "they are", "it is now")
                    ),
                    "wider",
                    "further",
                    "farther",
                    "more than now",
                    "more than it is now",
                    "wider than it is now",
                    "wider than it is",
                    "wider than now",
                )
            ),
        ),
        phrases=tuple(
            (f"{just}{some}{more}", sign * A_LITTLE)
            for just in ("", "just ")
            for some in ("a bit", "a little", "slightly", "a little bit", "a crack", "a tiny bit", "a touch")
            for more in ("", " more", " wider", " further")
        ),
        bare=False,
    )


_OPENING = ("open", "open up", "spread", "widen", "part", "spread out")
# "set the gripper to 4 cm", and "gripper to 50 percent" in notes.
_GAPS = tuple(
    f"{verb} {the} {what}{of}".replace("  ", " ")
    for verb in ("set", "adjust", "make", "change", "bring")
    for the in ("the", "your", "")
    for what in (
        *("gap", "opening", "width", "jaw gap", "finger gap", "gripper opening", "gripper width", "jaw opening"),
        *("gripper gap", "finger opening", "jaw width", "finger spacing", "aperture", "spacing", "distance"),
    )
    for of in (
        "",
        " of the gripper",
        " between the fingers",
        " between your fingers",
        " between the jaws",
        " of the jaws",
    )
)
_SET = ("set {}", "adjust {}", "have {}", "put {}")
_MOVE = ("bring {}", "move {}", "draw {}")
_CLOSING = ("close", "shut", "narrow", "close up", "bring {} together")

_GERMAN_OPEN = """
order : Command
  = verb=worded skill=open_gripper simple(OPEN_VERB opened_hand)
opened_hand
  = DETERMINER.acc ARM.acc slots+:opened_by?
opened_by : slot
  = width:opened_width
opened_width : product
  = ("auf" | "um") of+:length
"""
_SPANISH_OPEN = """
order : Command
  = verb=worded skill=open_gripper act(OPEN_VERB opened_hand)
opened_hand
  = DETERMINER? ARM slots+:opened_by?
opened_by : slot
  = width:opened_width
opened_width : product
  = ("a" | "hasta")? of+:length
"""
_SPANISH_CLOSE = """
order : Command
  = verb=worded skill=close_gripper act(SHUT_VERB closed_hand)
closed_hand
  = DETERMINER? ARM
"""
_GERMAN_CLOSE = """
order : Command
  = verb=worded skill=close_gripper simple(SHUT_VERB closed_hand)
closed_hand
  = DETERMINER.acc ARM.acc
"""


class OpenGripper(Skill):
    """Open the gripper."""

    name = "open_gripper"
    words = (
        Words(
            verbs=_CLOSING,
            body="fingers",
            slots=(
                Slot(
                    argument="width",
                    kind="length",
                    prepositions=(
                        "to",
                        "down to",
                        "to a gap of",
                        "but leave",
                        "but leave a gap of",
                        "leaving",
                        "leaving a gap of",
                        "till",
                        *(
                            f"until {it} {is_it}"
                            for it in (
                                "the fingers",
                                "your fingers",
                                "the jaws",
                                "they",
                                "the gripper",
                                "it",
                                "the gap",
                            )
                            for is_it in ("are", "is")
                        ),
                        "until there is a gap of",
                        *("so that there is", "so there is"),
                        *("until there are", "until there is", "until only", "until just"),
                    ),
                    endings=(
                        *(
                            ("apart", 1.0),
                            ("wide", 1.0),
                            ("open", 1.0),
                            ("left", 1.0),
                            ("are left", 1.0),
                            ("is left", 1.0),
                        ),
                        *((f"{left}between {them}", 1.0) for left in ("", "left ") for them in ("them", "the fingers")),
                    ),
                ),
            ),
            required=("width",),
        ),
        Words(verbs=("half close", "half open"), body="fingers", means=(("share", 0.5),)),
        Words(
            verbs=tuple(f"{have} {{}}" for have in ("have", "keep", "leave", "get")),
            body="fingers",
            alone=True,
            slots=(_OPEN,),
            required=("share",),
        ),
        Words(
            verbs=_CLOSING,
            body="fingers",
            slots=(
                Slot(
                    argument="share",
                    kind="share",
                    prepositions=("to", "down to", *_UNTIL),
                    phrases=_HALF,
                    endings=(("open", 1.0), ("of the way open", 1.0)),
                ),
            ),
            required=("share",),
        ),
        # "close the fingers by 1 cm"
        Words(verbs=_CLOSING, body="fingers", slots=(_more("by", -1.0),), required=("by",)),
        Words(
            verbs=(*_OPENING, *_SET, *_MOVE),
            body="fingers",
            alone=True,
            slots=(_more("by", 1.0),),
            required=("by",),
        ),
        Words(
            verbs=(*_OPENING, *(f"{verb} {{}} wide" for verb in _OPENING), *_SET),
            body="fingers",
            alone=True,
            slots=(
                Slot(
                    argument="width",
                    kind="length",
                    prepositions=("to", "up to", "as wide as", "to a gap of", "to a width of", "at", "to about", ""),
                    endings=(("wide", 1.0), ("apart", 1.0), ("open", 1.0)),
                ),
                Slot(
                    argument="share",
                    kind="share",
                    prepositions=("", "to", "by", "at", *_UNTIL),
                    phrases=_SHARES,
                    endings=(("open", 1.0),),
                ),
            ),
        ),
        Words(
            verbs=_GAPS,
            slots=(
                Slot(
                    argument="width", kind="length", prepositions=("to", "at", "to about", ""), endings=(("wide", 1.0),)
                ),
                Slot(argument="share", kind="share", prepositions=("", "to", "at"), phrases=_SHARES),
            ),
            required=("width", "share"),
        ),
        # "I need the jaws 45 mm apart", "half open"
        Words(
            verbs=tuple(f"{verb} {{}}" for verb in ("keep", "hold", "have", "put", "bring", "place", "move")),
            body="fingers",
            slots=(
                Slot(
                    argument="width",
                    kind="length",
                    prepositions=("", "exactly", "about", "to"),
                    endings=(("apart", 1.0), ("open", 1.0), ("away from each other", 1.0)),
                    bare=False,
                ),
                Slot(argument="share", kind="share", phrases=_SHARES, endings=(("open", 1.0),), bare=False),
            ),
            required=("width", "share"),
        ),
        Words(
            verbs=(
                "half open",
                "halfway open",
                "open half way",
                "open halfway",
                "gripper half open",
                "fingers half open",
            ),
            means=(("share", 0.5),),
        ),
        Words(
            verbs=(
                "open up",
                "open again",
                "open the rest of the way",
                "open up again",
                "open wide",
                "open up wide",
                "gripper open",
                "fingers open",
                "hand open",
                "open hand",
                "open fingers",
            )
        ),
    )

    translations: ClassVar[Mapping[str, str]] = {"german": _GERMAN_OPEN, "spanish": _SPANISH_OPEN}

    def run(
        self,
        ctx: SkillContext,
        *,
        width: Annotated[float, Field(ge=0.0)] | None = None,
        share: Annotated[float, Field(ge=0.0, le=1.0)] | None = None,
        by: float | None = None,
    ) -> SkillResult:
        """Open the gripper where the arm is; what is held has to be put down by a skill.

        Args:
            width: Gap between the fingers, metres; all the way when left out.
            share: The same as a share of the widest gap.
            by: How much wider than now it is to be, metres; narrower where negative.

        Raises:
            AlreadyHoldingError: Something is held, which would fall.
            InvalidArgumentError: It does not open so far.
            UnsupportedError: The robot has no gripper.
        """
        arm = Manipulator(ctx)
        if arm.start.held is not None:
            raise AlreadyHoldingError(
                f"the gripper holds {arm.start.held}, which would fall; put it down with place_at, place_on or place_in",
                phase=Phase.CHECK,
            )
        widest = arm.geometry.max_aperture
        told = {"width": width, "share": share, "by": by}
        said = [name for name, value in told.items() if value is not None]
        if len(said) > 1:
            raise InvalidArgumentError(f"{said[1]}: {said[0]} says the gap already", phase=Phase.CHECK)
        if share is not None:
            width = share * widest
        elif by is not None:
            width = max(arm.gripper.width + by, 0.0)
        if width is not None and width > widest:
            raise InvalidArgumentError(
                f"width: {1e3 * width:.0f} mm; the gripper opens to {1e3 * widest:.0f} mm", phase=Phase.CHECK
            )
        arm.open(width)
        return SkillResult(skill=self.name, detail={"width_mm": 1e3 * arm.gripper.width})


class CloseGripper(Skill):
    """Close the gripper."""

    name = "close_gripper"
    words = (
        Words(
            verbs=(
                *_CLOSING,
                *(f"{verb} {{}} {wholly}" for verb in ("close", "shut") for wholly in _WHOLLY),
                *("close {} the rest of the way", "shut {} the rest of the way"),
                *("squeeze", "grip", "clench", "make a fist", "close tight", "close {} tight"),
            ),
            body="fingers",
            slots=(FORCE,),
        ),
        Words(
            verbs=("grip force", "gripping force", "squeeze", "grip", "make a fist", "clench your fist"),
            slots=(FORCE,),
        ),
        Words(
            verbs=tuple(f"squeeze {{}} {hard}" for hard in _HARD),
            object="held",
            slots=(FORCE,),
            hand="holding",
        ),
        Words(
            verbs=("grip", "hold", "grasp", "grab", "take", "take hold of", "pick up", "seize"),
            object="held",
            slots=(FORCE,),
            required=("force",),
            hand="holding",
        ),
    )

    translations: ClassVar[Mapping[str, str]] = {"german": _GERMAN_CLOSE, "spanish": _SPANISH_CLOSE}

    def contract(self, *, held: str | None = None, **others: Any) -> Contract:
        """Return that what is to be squeezed is held, and stays so."""
        del others
        return Contract(needs=() if held is None else (fact("holding", held),), keeps_hold=held is not None)

    def run(
        self,
        ctx: SkillContext,
        *,
        force: Annotated[float, Field(gt=0.0, le=200.0)] | None = None,
        held: str | None = None,
    ) -> SkillResult:
        """Close the gripper where the arm is, until its fingers stop.

        Args:
            held: Id of what is held and squeezed; whatever is between the fingers when left out.
            force: With which each side is to press on what is between them, N; as hard as the motors do when left out.

        Raises:
            UnsupportedError: The robot has no gripper, or it does not feel or limit its force.
            GraspError: The force is not reached.
        """
        arm = Manipulator(ctx)
        if force is None:
            arm.close()
        else:
            squeeze(arm, force, on_nothing=held is None)
        detail: dict[str, float | str | bool] = {"width_mm": 1e3 * arm.gripper.width, "held": arm.look().held or ""}
        if arm.driver.capabilities.gripper_force:
            detail["force_n"] = arm.hand.grip_on(None)
        found = "" if detail["held"] or not _is_shut(arm) else "the fingers are shut, with nothing between them"
        return SkillResult(skill=self.name, detail=detail, found=found)


def _is_shut(arm: Manipulator) -> bool:
    return arm.gripper.width <= arm.geometry.min_aperture + _SHUT


def check_force_is_felt(driver: Driver) -> None:
    """Check that a grip can be as hard as it is asked for.

    Raises:
        UnsupportedError: The robot does not feel or limit its force.
    """
    require(driver, "gripper_force", "a force of the grip is asked for")
    require(driver, "grip_limit", "a force of the grip is asked for")


def squeeze(arm: Manipulator, force: float, *, on_nothing: bool = False, gently: bool = False) -> None:
    """Close the fingers until each side presses with a force, N; or until they are shut, where they may be on nothing.

    Where it is done gently the force is come to from below, which takes some seconds: a thing is known to be near.

    Raises:
        UnsupportedError: The robot does not feel or limit its force.
        GraspError: The force is not reached.
    """
    check_force_is_felt(arm.driver)
    motors, felt = _FAINT * force if gently else force, 0.0
    for _ in range(_CORRECTIONS):
        before = arm.gripper.width
        arm.hand.set_gripper(1.0, motors)
        arm.wait_for_fingers()
        felt = arm.hand.grip_on(None)
        if abs(felt - force) <= _CLOSE_ENOUGH * force:
            return
        if felt == 0.0 and _is_shut(arm):
            if on_nothing:
                return
            break
        if felt:
            motors *= float(np.clip(force / felt, 0.25, 4.0))
        elif not gently:
            motors *= 4.0
        elif before - arm.gripper.width < _STUCK:
            motors *= _FIRMER
    said = f"presses with {felt:.1f} N" if felt else "closed on nothing"
    raise GraspError(f"the gripper {said}, and was to press with {force:.1f} N", phase=Phase.GRASP)
