"""Rising with what is held: at once with light things, by feel with heavy or fixed ones, and with nothing else."""

from __future__ import annotations

import math

from robosandbox.driver import Guard
from robosandbox.errors import CollisionError, GraspError, Phase, UnreachableError
from robosandbox.evidence import GraspEvidence
from robosandbox.skills.primitives.manipulator import LIFT_HEIGHT, Manipulator, raised
from robosandbox.skills.primitives.sensing import around
from robosandbox.types import CAREFUL, DetectedObject, ObservedScene
from robosandbox.world.relations import contents, on_top

# N on what is lifted from which it is lifted slowly; chosen as the weight of 1.5 kg, above what any lighter thing's inertia
# gives at the start of a lift.
_HEAVY = 15.0
# Metres that such a thing is lifted at first, and the share of the joints' speed limits; chosen so that the force of a fixed one
# grows by less than a tenth of the limit in a control tick.
_TRIAL, _TRIAL_SPEED = 0.005, 0.02
# N on anything else, and control ticks, after which it is looked whether that comes along; chosen as the weight of 100 g, and
# as what a lift takes to raise it by a perceptible height.
_RUBS, _RUBBING = 1.0, 10
# How often it is looked; chosen so that a finger that rubs along a wall all the way up does not stop at each step.
_LOOKS = 4
# Metres that a thing has to have risen to have come along; chosen above perception's error.
_ALONG = 0.004


class _Heavy(Exception):
    """The lifted thing pulls harder than light things do; the driver holds the arm."""


class _Rubs(Exception):
    """The hand presses on something else, too; the driver holds the arm."""


def rise_with(
    arm: Manipulator,
    held: DetectedObject,
    scene: ObservedScene,
    width: float,
    grip: Guard,
    *,
    slowly: bool = False,
) -> float:
    """Rise by the height of a lift, or as far as can be reached; return how far, metres.

    Args:
        arm: Whose hand; its motion planner knows what it holds.
        held: That.
        scene: As it was when the fingers had closed.
        width: Its extent between them, metres.
        grip: Holds it as hard as it has to be held.
        slowly: As slowly from the start as what turned out to be heavy.

    Raises:
        UnreachableError: Not even a quarter of it can be reached.
        CollisionError: Something is above.
        LimitError: It pulled as hard as the robot may.
        TrackingError: The arm did not arrive.
        GraspError: Something else came along; it is put back.
    """
    has, ticks, looks = arm.driver.capabilities, 0, _LOOKS

    def heavy() -> Exception | None:
        return _Heavy() if math.hypot(*arm.force_on(held.id).tolist()) > _HEAVY else None

    def rubs() -> Exception | None:
        nonlocal ticks
        forces = arm.forces().items()
        felt = any(name != held.id and math.hypot(*force.tolist()) > _RUBS for name, force in forces)
        ticks += felt
        return _Rubs() if ticks >= _RUBBING else None

    begin = arm.state.tcp_pose.xyz[2]
    guards = [grip, *([heavy] if has.wrist_wrench else []), *([rubs] if has.contact == "named" else [])]
    gone, speed = 0.0, CAREFUL.lower if slowly else arm.tempo.lift
    while gone < LIFT_HEIGHT:
        try:
            gone += arm.rise(LIFT_HEIGHT - gone, Phase.LIFT, speed=speed, guards=guards)
            break
        except _Heavy:
            guards.remove(heavy)
            arm.rise(_TRIAL, Phase.LIFT, speed=_TRIAL_SPEED, guards=(grip,))
            speed = CAREFUL.lower
        except _Rubs:
            ticks, looks = 0, looks - 1
            if not looks:
                guards.remove(rubs)
            alone(arm, held, scene, width, arm.state.tcp_pose.xyz[2] - begin)
        gone = arm.state.tcp_pose.xyz[2] - begin
    return gone


def alone(arm: Manipulator, held: DetectedObject, scene: ObservedScene, width: float, risen: float) -> ObservedScene:
    """Check that nothing has come up along with what is held, and return the look; what has is put back.

    Args:
        arm: Whose hand.
        held: As it was when the fingers had closed.
        scene: Likewise.
        width: Its extent between them, metres.
        risen: How far the hand is above where they closed, metres.

    Raises:
        GraspError: Something has.
    """
    now = arm.look(*around(held, scene))
    cargo = _cargo(held, scene)
    along = tuple(
        item.id
        for item in scene.objects
        if item.id != held.id
        and item.id not in cargo
        and (up := now.find(item.id))
        and up.pose.xyz[2] - item.pose.xyz[2] > _ALONG
    )
    if along:
        raise _put_back(arm, held, width, risen, along, scene, f"{', '.join(along)} came up together with {held.id}")
    return now


def free_of_others(arm: Manipulator, held: DetectedObject, scene: ObservedScene, width: float, risen: float) -> None:
    """Check that the hand at rest presses on nothing but what it holds: fingers around a wall as well hold it no less.

    Args:
        arm: Whose hand; without contact by name nothing is known.
        held: As it was when the fingers had closed.
        scene: Likewise.
        width: Its extent between them, metres.
        risen: How far the hand is above where they closed, metres.

    Raises:
        GraspError: It presses on something else; what is held is put back.
    """
    if arm.driver.capabilities.contact != "named":
        return
    cargo = _cargo(held, scene)
    pressed = {name: math.hypot(*force.tolist()) for name, force in arm.forces().items()}
    others = tuple(name for name, force in pressed.items() if force > _RUBS and name not in {held.id, *cargo})
    if others:
        said = f"the hand holds {held.id} and presses on {', '.join(others)} with {max(map(pressed.__getitem__, others)):.0f} N"
        raise _put_back(arm, held, width, risen, others, scene, said)


def _cargo(held: DetectedObject, scene: ObservedScene) -> set[str]:
    """Return the ids of what lies in or on the held object."""
    cargo = {name for name, _ in contents(scene.objects, held)}
    return cargo | {item.id for item in scene.objects if item.id != held.id and on_top(item, held).holds}


def _put_back(
    arm: Manipulator,
    held: DetectedObject,
    width: float,
    risen: float,
    others: tuple[str, ...],
    scene: ObservedScene,
    said: str,
) -> GraspError:
    """Put back what came up with something else, and return the error of it."""
    arm.motion.allow("table", *(item.id for item in scene.objects))
    try:
        observation = arm.state
        back = arm.motion.plan_line(observation.q, raised(observation.tcp_pose, -risen), speed=CAREFUL.carry)
        arm.follow(back, Phase.LOWER, yielding=True)
    except (UnreachableError, CollisionError):
        # From here it is let go all the same: it has come up by as little as the hand has.
        pass
    names = ", ".join(others)
    return wedged(
        arm,
        held,
        width,
        others,
        f"{said}: the hand is wedged between them; it was put back; try another grasp, or move "
        f"{held.id} away from {names} first",
    )


def wedged(arm: Manipulator, held: DetectedObject, width: float, others: tuple[str, ...], said: str) -> GraspError:
    """Return the error of a thing so many metres wide that others keep from coming up with the hand."""
    return GraspError(
        said,
        phase=Phase.LIFT,
        evidence=GraspEvidence(
            object=held.id,
            reason="wedged",
            object_width=width,
            aperture=arm.gripper.width,
            max_aperture=arm.geometry.max_aperture,
            touching=others,
        ),
    )
