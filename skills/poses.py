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
from robosandbox.types import SkillResult

_Name = Annotated[str, Field(pattern=r"^[a-z][a-z0-9_]{0,31}$")]
_HOME = "home"
# Name of a pose to which nobody gives one.
_HERE = "here"


class SavePose(HandMove):
    """Remember how the arm stands under a name."""

    name = "save_pose"
    words = (
        Words(
            verbs=(
                "save this pose",
                "save this position",
                "save the pose",
                "remember this pose",
                "remember this position",
                "remember this",
                "remember this spot",
                *(
                    f"{verb} {what}"
                    for verb in ("save", "store", "memorise", "memorize", "remember")
                    for what in (
                        "the current pose",
                        "the current position",
                        "your pose",
                        "your position",
                        "where you are",
                        "where you stand",
                    )
                ),
            ),
            slots=(Slot(argument="pose", kind="name", prepositions=("as", "under")),),
            required=("pose",),
        ),
        Words(
            verbs=("call this pose", "call this position", "name this pose", "call this", "call this spot"),
            slots=(Slot(argument="pose", kind="name"),),
            required=("pose",),
        ),
        Words(verbs=("remember where you are", "remember this place"), means=(("pose", _HERE),)),
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
            verbs=(*HAND_GOES, "return", "travel"),
            slots=(
                Slot(
                    argument="pose",
                    kind="name",
                    prepositions=(
                        "to pose",
                        "to the pose",
                        "back to pose",
                        "to position",
                        *(
                            f"{to} the {what} {called}"
                            for to in ("to", "back to")
                            for what in ("pose", "position", "spot")
                            for called in ("called", "named")
                        ),
                    ),
                ),
            ),
            required=("pose",),
        ),
        Words(verbs=("go back to where you were", "return to where you were"), means=(("pose", _HERE),)),
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
        if pose not in saved:
            raise InvalidArgumentError(
                f"pose: none is called {pose!r}; there is {', '.join(sorted(saved))}{did_you_mean(pose, saved)}",
                phase=Phase.CHECK,
            )
        arm = Mover(ctx)
        arm.follow(arm.way_to(saved[pose]), Phase.APPROACH)
        return SkillResult(skill=self.name, detail={"joint_error": float(np.abs(arm.q - saved[pose]).max())})
