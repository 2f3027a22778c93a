"""Wait: let time pass."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, ClassVar

from pydantic import Field

from robosandbox.errors import Phase
from robosandbox.skills.primitives.hand_move import HandMove
from robosandbox.skills.protocols import MOST_BACK, SkillContext
from robosandbox.skills.words import Slot, Words
from robosandbox.types import SkillResult

# What is done after some time.
_ENGLISH = """
some_time : Command
  = verb=worded skill=wait slots+:that_long
that_long : slot
  = seconds:duration
told_on : Steps
  = ("in" | "after") first+:some_time ","? last+:order
  = last+:order ","? ("after" first+:some_time | first+:some_time "later")
later_on : Steps
  = then+:order (","? "and" | ",") then+:some_time ("later" | "after" "that" | "afterwards") ","? then+:order
plain : any
  = is:later_on
"""
_GERMAN = """
WAITING
  wait = verb wart
SECONDS
  1.0 = sekunde, sekunden
  60.0 = minute, minuten
order : Command
  = verb=worded skill=wait simple(WAITING for_some_time)
for_some_time
  = slots+:waiting
waiting : slot
  = seconds:waited
waited : product
  = "für"? of+:count of+:SECONDS
"""
_SPANISH = """
WAITING
  wait = ar esper, ar aguard
SECONDS
  1.0 = segundo, segundos
  60.0 = minuto, minutos
order : Command
  = verb=worded skill=wait act(WAITING for_some_time)
for_some_time
  = slots+:waiting
waiting : slot
  = seconds:waited
waited : product
  = ("por" | "durante")? of+:count of+:SECONDS
"""

# Seconds that somebody means who names none. Chosen.
_MOMENT = 2.0
_WHILES = tuple(
    (f"{before}{some}", seconds)
    for before in ("", "for ")
    for some, seconds in (("a moment", _MOMENT), ("a bit", _MOMENT), ("a little", _MOMENT), ("a sec", 1.0))
)
_FOR_A_WHILE = tuple((said, seconds) for said, seconds in _WHILES if said.startswith("for "))
_HELD_UP = (
    *("up", "up high", "still", "in the air", "up in the air", "in your hand", "in the hand", "like that", "steady"),
    *("in place", "at that height", "aloft", "raised", "lifted", "tight"),
)
_STILL = ("still", "steady", "motionless", "there", "where it is", "in place", "in position", "like that", "as it is")


class Wait(HandMove):
    """Let time pass."""

    name = "wait"
    words = (
        Words(
            verbs=(
                "wait",
                "pause",
                "stay still",
                *("do not move a muscle", "do not budge", "do not move at all", "do not move an inch"),
                "hold still",
                "stand still",
                "do nothing",
                "stay there",
                "stay where you are",
                "hold it there",
                "hang on",
                "hold on",
                "sit tight",
                "take a break",
                "freeze",
                "dwell",
                "stay put",
                "keep still",
                "remain still",
                "remain there",
                "wait there",
                "pause there",
                "wait here",
                "hold position",
                "hold your position",
                "hold that position",
                "stay like that",
                "stay like this",
                "give me",
                "give it",
                "give us",
                *(
                    "rest",
                    "relax",
                    "hover there",
                    "stop there",
                    "rest there",
                    "chill",
                    "stay",
                    "idle",
                    "stand by",
                    "be still",
                    "sit still",
                    "remain",
                    "hold there",
                    *(
                        f"{stay} {how}"
                        for stay in ("stay", "remain", "keep", "stand", "rest", "wait")
                        for how in ("stationary", "completely still", "frozen", "without moving")
                    ),
                    *("stay exactly as you are", "stay exactly where you are", "stay quiet"),
                ),
                *(
                    "do not move",
                    "stay as you are",
                    "remain where you are",
                    "stop and wait",
                    "keep it there",
                    "hold this",
                ),
                *("stay in place", "stay in position", "remain motionless", "stay motionless", "do not do anything"),
                *("hold that", "hold this pose", "hold that pose", "hold this position", "keep this position"),
                *(f"{verb} {{}} {how}" for verb in ("hold", "keep", "leave") for how in _STILL),
                *(
                    f"{stay} {there}".rstrip()
                    for stay in (
                        "hold",
                        "hang",
                        "hover",
                        "linger",
                        "stop",
                        "remain",
                        "pause",
                        "freeze",
                        "stay",
                        "rest",
                        "wait",
                    )
                    for there in (
                        "",
                        "there",
                        "here",
                        "right there",
                        "right here",
                        "up there",
                        "in position",
                        "a moment",
                    )
                ),
            ),
            nouns=("break", "pause", "rest", "wait", "breather", "stop"),
            body="hand",
            slots=(
                Slot(
                    argument="seconds",
                    kind="duration",
                    prepositions=(
                        "",
                        "for",
                        "another",
                        "for another",
                        "about",
                        "for about",
                        "for a full",
                        "for at least",
                        "for exactly",
                    ),
                    phrases=_WHILES,
                ),
            ),
            required=("seconds",),
        ),
        # "count to twenty"
        Words(
            verbs=("count to", "count up to", "count slowly to", "count from one to", "count from 1 to"),
            slots=(
                Slot(
                    argument="seconds",
                    kind="number",
                    endings=tuple(
                        (said, 1.0) for said in ("in your head", "silently", "slowly", "quietly", "to yourself")
                    ),
                ),
            ),
            required=("seconds",),
        ),
        Words(
            verbs=(
                "hold",
                "keep",
                "keep holding",
                "hold on to",
                *(f"{verb} {{}} {how}" for verb in ("hold", "keep") for how in _HELD_UP),
                *(f"show {{}}{me}" for me in (" to me", " to us", " to the class", "")),
                *("show me", "show us"),
            ),
            object="held",
            slots=(Slot(argument="seconds", kind="duration", prepositions=("for", "for about"), phrases=_FOR_A_WHILE),),
            required=("seconds",),
            hand="holding",
        ),
    )
    translations: ClassVar[Mapping[str, str]] = {"english": _ENGLISH, "german": _GERMAN, "spanish": _SPANISH}

    def run(
        self,
        ctx: SkillContext,
        *,
        seconds: Annotated[float, Field(gt=0.0, le=3600.0)],
        since: Annotated[int, Field(ge=0, le=MOST_BACK)] = 0,
        held: str | None = None,
    ) -> SkillResult:
        """Stand still for some time; what is held stays held.

        Args:
            seconds: How long, of the driver's clock.
            since: From the start of which call that is counted: 0 this one, 1 the one before, and so on; not at all where it is over.
            held: Id of what is to be held meanwhile; nothing, or whatever is held, when left out.

        Raises:
            NotHoldingError: What is to be held is not.
        """
        del held
        ctx.enter(Phase.WAIT)
        began = ctx.driver.time
        starts = ctx.starts
        left = seconds - (began - starts[max(0, len(starts) - 1 - since)] if since else 0.0)
        if left >= 0.5 * ctx.driver.control_timestep:
            ctx.driver.wait(left)
        return SkillResult(skill=self.name, detail={"seconds": ctx.driver.time - began})
