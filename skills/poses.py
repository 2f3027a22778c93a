"""Poses with names: the arm's configuration is remembered, and gone to again."""

from __future__ import annotations

from typing import Annotated

import numpy as np
from pydantic import Field

from robosandbox.errors import InvalidArgumentError, Phase
from robosandbox.skills.primitives.hand_move import HAND_GOES, HandMove, Mover
from robosandbox.skills.protocols import SkillContext
from robosandbox.skills.words import Slot, Words
from robosandbox.suggestions import did_you_mean
from robosandbox.types import BEFORE, SkillResult

_Name = Annotated[str, Field(pattern=r"^[a-z][a-z0-9_]{0,31}$")]
_HOME = "home"
# Name of a pose to which nobody gives one, and of that in which the arm stands when an order begins.
_HERE = "here"
_START = "start"
_PLACES = ("pose", "position", "spot", "place", "point", "location")
_BACK = (
    "go back",
    "return",
    "come back",
    "move back",
    "get back",
    "head back",
    "go",
    "move the hand back",
    "move your hand back",
    *("go back up", "come back up", "move back up", "go back down", "come back down"),
)
_EARLIER = (
    "before",
    "before that",
    "before the last move",
    "before your last move",
    "just now",
    "a moment ago",
    "just before",
    "a second ago",
)
_NAMED = (
    *(
        "to pose",
        "to the pose",
        "back to pose",
        "to position",
        "to the position",
        "back to the",
        "to the",
        "to",
        "back to",
        "to my",
    ),
    *(
        f"{to} the {what} {called}"
        for to in ("to", "back to")
        for what in _PLACES
        for called in ("called", "named", "i called", "i named", "that i called", "we called", "i saved as")
    ),
)


class SavePose(HandMove):
    """Remember how the arm stands under a name."""

    name = "save_pose"
    words = (
        Words(
            verbs=(
                *(
                    f"{verb} {what}"
                    for verb in ("save", "store", "memorise", "memorize", "remember", "record", "note", "keep", "mark")
                    for what in (
                        *(
                            f"{which} {place}"
                            for which in (
                                *("the current", "your", "your current", "this", "the", "the present", "your present"),
                                *("this exact", "my", "current", "the arm", "that", "this hand"),
                            )
                            for place in _PLACES
                        ),
                        "where you are",
                        "where you are now",
                        "where you stand",
                        "where your hand is",
                        "where you are right now",
                        "where you are standing",
                        "the position you are in",
                        "the pose you are in",
                        "how you stand",
                        "where the hand is",
                        "this",
                        "it",
                        "that",
                    )
                ),
            ),
            slots=(
                Slot(
                    argument="pose",
                    kind="name",
                    prepositions=(
                        "as",
                        "under",
                        "under the name",
                        "by the name",
                        "with the name",
                        "as pose",
                        "as position",
                        "and call it",
                    ),
                ),
            ),
            required=("pose",),
        ),
        Words(
            verbs=tuple(
                f"{call} {what}"
                for call in ("call", "name", "label", "let us call", "we call", "mark", "tag")
                for what in (
                    *(
                        f"{which} {place}"
                        for which in ("this", "the current", "your current", "the present", "that")
                        for place in _PLACES
                    ),
                    *(() if call == "name" else ("this", "that", "it", "where you are")),
                )
            ),
            slots=(Slot(argument="pose", kind="name"),),
            required=("pose",),
        ),
        Words(
            verbs=tuple(
                f"{remember} {where}"
                for remember in ("remember", "memorise", "memorize")
                for where in (
                    *(
                        "where you are",
                        "where you are now",
                        "where you are right now",
                        "this place",
                        "this pose",
                        "this position",
                        "this spot",
                        "how you stand",
                        "where you stand",
                    ),
                    *(
                        "the way you are standing",
                        "the way you stand",
                        "how you are standing",
                        "where you are standing",
                    ),
                )
            ),
            means=(("pose", _HERE),),
        ),
    )

    def run(self, ctx: SkillContext, *, pose: _Name) -> SkillResult:
        """Move nothing; the name counts for this arm until the workcell is closed.

        Args:
            pose: The name; one that is taken is given anew.

        Raises:
            InvalidArgumentError: It is "home", which the sidecar says.
        """
        if pose == _HOME:
            raise InvalidArgumentError(
                "pose: the robot's sidecar says where home is; take another name", phase=Phase.CHECK
            )
        ctx.poses[ctx.arm.name, pose] = ctx.arm.state().q
        return SkillResult(skill=self.name, detail={"pose": pose})


class MoveToPose(HandMove):
    """Move the arm to a pose with a name."""

    name = "move_to_pose"
    words = (
        Words(
            verbs=(*HAND_GOES, "return", "go back", "come back", "get back", "go on"),
            body="hand",
            slots=(Slot(argument="pose", kind="pose", prepositions=_NAMED),),
            required=("pose",),
        ),
        Words(
            verbs=(
                *(f"{go} to where you were" for go in _BACK),
                "back to where you were",
                *(f"{go} there" for go in ("go back", "return", "come back", "get back")),
                *(
                    f"{go} to {the} {place} {you} {remembered}".replace("  ", " ")
                    for go in _BACK
                    for place in _PLACES
                    for the, you in (("the", "you"), ("the", "that you"))
                    for remembered in ("remembered", "memorised", "memorized", "noted")
                ),
                *(
                    f"{go} to {which} {place}"
                    for go in _BACK
                    for which in (
                        "the remembered",
                        *(f"{exactly}{this}" for exactly in ("", "exactly ") for this in ("this", "the same")),
                    )
                    for place in _PLACES
                ),
            ),
            means=(("pose", _HERE),),
        ),
        Words(
            verbs=(
                *(f"{go} to where you were {when}" for go in (*_BACK, "back") for when in _EARLIER),
                *(
                    f"{go} to {the} {last} {place}"
                    for go in _BACK
                    for the in ("your", "the")
                    for last in ("previous", "last")
                    for place in _PLACES
                ),
                *(
                    f"undo {what}"
                    for what in (
                        "that move",
                        "the move",
                        "the last move",
                        "your last move",
                        "that motion",
                        "that movement",
                        "the last movement",
                    )
                ),
                "go back to where you came from",
                "return to where you came from",
            ),
            means=(("pose", BEFORE),),
        ),
        Words(
            verbs=tuple(
                f"{go} to where you {began}"
                for go in (*_BACK, "back")
                for began in (
                    "started",
                    "began",
                    "started from",
                    "were at the start",
                    "were at the beginning",
                    "were when you started",
                )
            ),
            means=(("pose", _START),),
        ),
    )

    def run(self, ctx: SkillContext, *, pose: _Name) -> SkillResult:
        """Move the arm to how it stood when the pose was saved, on a free way; what it holds stays held.

        Args:
            pose: Its name; "home" is the sidecar's.

        Raises:
            InvalidArgumentError: No pose of that name was saved.
            CollisionError: Something is in the way.
            UnsupportedError: What lies in what is held would fall out.
            TrackingError: The arm did not arrive.
        """
        saved = {name: q for (arm, name), q in ctx.poses.items() if arm == ctx.arm.name}
        saved[_HOME] = ctx.arm.spec.home_q
        if pose == _HERE and BEFORE in saved:
            # Nobody said "remember where you are": where it was before it went.
            saved.setdefault(_HERE, saved[BEFORE])
        if pose not in saved:
            raise InvalidArgumentError(
                f"pose: none is called {pose!r}; there is {', '.join(sorted(saved))}{did_you_mean(pose, saved)}",
                phase=Phase.CHECK,
            )
        arm = Mover(ctx)
        arm.follow(arm.way_to(saved[pose]), Phase.APPROACH)
        return SkillResult(skill=self.name, detail={"joint_error": float(np.abs(arm.q - saved[pose]).max())})


class ForgetPose(HandMove):
    """Forget a pose."""

    name = "forget_pose"
    words = Words(
        verbs=tuple(
            f"{verb} {the}"
            for verb in ("forget", "delete", "remove", "erase", "clear")
            for the in (
                "pose",
                "the pose",
                "position",
                "the",
                "my",
                "the pose called",
                "the position called",
                "the saved",
                "the spot called",
            )
        ),
        slots=(Slot(argument="pose", kind="pose"),),
        required=("pose",),
    )

    def run(self, ctx: SkillContext, *, pose: _Name) -> SkillResult:
        """Move nothing; the arm's posture of that name is no longer known.

        Args:
            pose: Its name.

        Raises:
            InvalidArgumentError: No pose of that name was saved.
        """
        if ctx.poses.pop((ctx.arm.name, pose), None) is None:
            raise InvalidArgumentError(f"pose: none that was saved is called {pose!r}", phase=Phase.CHECK)
        return SkillResult(skill=self.name, detail={"pose": pose})
