"""Press down: push on what is below the hand with a force, for some time."""

from __future__ import annotations

from typing import Annotated, Any

from pydantic import Field

from robosandbox.driver import require
from robosandbox.errors import Phase, TrackingError
from robosandbox.skills.primitives.force import press_with
from robosandbox.skills.primitives.hand_move import HandMove, Mover
from robosandbox.skills.protocols import SkillContext
from robosandbox.skills.words import Slot, Words
from robosandbox.types import Pose, SkillResult
from robosandbox.world.contracts import Contract
from robosandbox.world.relations import top

# Metres below where the hand is down to which it looks for something to press on, where no thing is named.
_DEEPEST = 0.5
# Metres beyond what is met that the hand may be sent: a soft arm presses with 20 N where it is sent so far into what is hard.
_INTO = 0.02

# Seconds of a tap. Chosen.
_SHORT = 0.2
_TOUCHES = ("tap", "tap on", "touch", "knock on", "press", "press on", "press down on", "poke")
_SAID = (
    Slot(
        argument="force",
        kind="force",
        prepositions=(
            *("with", "by", "", "up to"),
            *(
                f"{until} {you} {feel}"
                for until in ("until", "till")
                for you in ("you", "it")
                for feel in ("feel", "feel about", "feels", "reach", "read", "measure", "presses with", "press with")
            ),
        ),
    ),
    Slot(argument="seconds", kind="duration", prepositions=("for",)),
)


class PressDown(HandMove):
    """Press down on what is below the hand."""

    name = "press_down"
    words = (
        Words(
            verbs=("press down", "push down", "press", "press {} down", "push {} down"),
            body="hand",
            slots=(*_SAID, Slot(argument="object", kind="object", prepositions=("on", "onto", "on top of"))),
            required=("force", "seconds"),
        ),
        Words(
            verbs=tuple(f"{verb} the {table}" for verb in _TOUCHES for table in ("table", "tabletop", "table top")),
            slots=_SAID,
            means=(("seconds", _SHORT),),
        ),
        Words(
            verbs=(
                "press down on",
                "push down on",
                "push down on the top of",
                "press on",
                "press",
                "press {} down",
                "press the top of",
                "press on the top of",
                "press on top of",
                "press down on the top of",
                "push on the top of",
            ),
            object="object",
            slots=_SAID,
            required=("force", "seconds"),
            hand="any",
        ),
    )

    def contract(self, *, object: str | None = None, **others: Any) -> Contract:
        """Return that what is held stays held."""
        del object, others
        return Contract(keeps_hold=True)

    def run(
        self,
        ctx: SkillContext,
        *,
        force: Annotated[float, Field(gt=0.0, le=60.0)] = 5.0,
        seconds: Annotated[float, Field(gt=0.0, le=600.0)] = 1.0,
        object: str | None = None,
    ) -> SkillResult:
        """Come down slowly until something is met, press on it with a force for some time, and go back up; what is held stays held.

        Args:
            force: N.
            seconds: For how long.
            object: Id of what is pressed on; what is below the hand when left out.

        Raises:
            ObjectNotFoundError: It is not seen.
            UnsupportedError: The driver feels no force at the wrist.
            UnreachableError: The hand cannot be there.
            CollisionError: Something is in the way.
            LimitError: The force is beyond what the robot or the task allows.
            TrackingError: Nothing was met, or the force was not reached.
        """
        arm = Mover(ctx)
        require(ctx.driver, "wrist_wrench", "what the hand presses with is felt")
        if object is not None:
            arm.come_over(object)
        else:
            arm.come_down_near()
        above = arm.state.tcp_pose
        arm.motion.allow("table", *(item.id for item in arm.start.objects))
        deepest = above.xyz[2] - top(arm.find(object)) - arm.hangs + _INTO if object is not None else _DEEPEST
        goal = Pose(xyz=(above.xyz[0], above.xyz[1], above.xyz[2] - deepest), quat_xyzw=above.quat_xyzw)
        way = arm.as_far_as_it_goes(above, goal)
        before = arm.pressed()
        done = press_with(arm, way, lambda: float(before[2] - arm.pressed()[2]), force, seconds)
        felt = float(before[2] - arm.pressed()[2])
        arm.arrive(arm.motion.plan_line(arm.q, above, speed=arm.tempo.leave), above)
        if done is None:
            raise TrackingError(
                f"the hand went down and pressed with {max(felt, 0.0):.1f} N at the end, not with {force:.1f} N",
                phase=Phase.PUSH,
            )
        return SkillResult(
            skill=self.name,
            detail={"force_n": done.mean, "least_n": done.least, "most_n": done.most, "object": object or ""},
        )
