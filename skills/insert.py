"""Insert: put what is held into a hole that it just fits, by feel."""

from __future__ import annotations

import math

import numpy as np

from robosandbox.driver import require
from robosandbox.errors import Phase, PlacementError
from robosandbox.evidence import PlacementEvidence
from robosandbox.skills.base import Skill
from robosandbox.skills.primitives.guarded import follow_until, nowhere_faster
from robosandbox.skills.primitives.hand_move import Mover
from robosandbox.skills.primitives.placing import PlacePlan, place
from robosandbox.skills.primitives.yielding import YieldingHand
from robosandbox.skills.protocols import SkillContext
from robosandbox.skills.words import Words
from robosandbox.types import Array, DetectedObject, ObservedScene, Pose, SkillResult
from robosandbox.world.contracts import Contract
from robosandbox.world.facts import HELD, fact
from robosandbox.world.placement_sampling import Placement, about_z, middle_of, turns, yaw_to_align
from robosandbox.world.relations import MeasuredRelation, bottom, inside, mouth_of

# Metres over the rim to which what is held is brought freely.
_OVER = 0.005
# m/s of a hand that comes down on what it may meet, and N at which it has.
_COMING, _MET = 0.01, 1.5
# N with which it is pressed on what it searches over, and into its hole.
_SEARCHING, _PUSHING = 3.0, 12.0
# Metres about where the hole is believed to be that are searched, those between the turns of the spiral, and m/s along it.
_AROUND, _PITCH, _ALONG = 0.004, 0.0005, 0.005
# Angles by which it is turned in a search, where it does not sink in as it is, rad.
_TURNED = (0.0, math.radians(2.0), math.radians(-2.0), math.radians(4.0), math.radians(-4.0))
# Metres by which it sinks where it finds the hole, by which it is in far enough to be let go, and short of the floor where it is in.
_FOUND, _BEGUN, _IN = 0.0015, 0.006, 0.003
# Share of what it presses with that keeps it from going on where it is caught, more than anything rubs, and metres along the spiral
# between two that are looked into.
_CAUGHT, _APART = 2.0, 0.003
# Metres that fingertips stay over the rim.
_CLEAR = 0.002
# m/s for each newton that is given way to at the side, m/s of a hand that rises, and rad/s with which it turns.
_GIVING, _FASTEST, _TURNING = 0.0005, 0.01, 0.2
# Seconds without a way down after which it is stuck, metres that count as a way, times that it is freed, and pushes where it has
# sunk in a little.
_STUCK, _WAY, _FREED, _TRIED = 0.6, 0.0003, 4, 2
# Metres by which it is drawn back to be freed, seconds for which it is worked at then, metres by which it is led round, and the
# angle by which it is turned either way the first time, rad.
_BACK, _WORKED, _SWUNG, _TWISTED = 0.002, 1.5, 0.0003, math.radians(1.0)
# Seconds in which a force comes to rest, and in which something is met at all.
_SETTLED, _PATIENCE = 0.5, 4.0


class Insert(Skill):
    """Put what is held into a hole that it just fits."""

    name = "insert"
    words = Words(verbs=("plug it into", "fit it into"), object="container", hand="any")

    def contract(self, *, container: str) -> Contract:
        """Return what putting the held object into a hole needs and brings about."""
        return Contract(
            needs=(
                fact("has_gripper"),
                fact("holding", HELD),
                fact("distinct", HELD, container),
                fact("holds_things", container),
                fact("upright", container),
                fact("empty", container),
                fact("slides_in", HELD, container),
                fact("reachable_over", HELD, container),
            ),
            gives=(fact("inside", HELD, container), fact("hand_empty")),
            rank=1,
        )

    def run(self, ctx: SkillContext, *, container: str) -> SkillResult:
        """Bring the held object over a hole, search about it until the object sinks in, push it in by feel and let go.

        Args:
            container: Id of what has the hole.

        Raises:
            UnsupportedError: The driver feels no force.
            NotHoldingError: The gripper is empty.
            ObjectNotFoundError: The hole is not seen.
            PlacementError: The object did not find the hole, sticks in it, or did not stay.
            UnreachableError: The hole is out of reach.
            CollisionError: Something is in the way.
            LimitError: The arm pressed too hard.
        """
        require(ctx.driver, "wrist_wrench", "what the hand presses with is felt")
        arm = Mover(ctx)
        held, hole = arm.held, arm.find(container)
        room = mouth_of(hole)
        rim, floor = hole.pose.xyz[2] + room.rim, hole.pose.xyz[2] + room.floor
        middle = hole.pose.position + hole.pose.rotation[:, :2] @ room.middle
        # An object's origin need not be its middle.
        aside = np.array([*(held.pose.position - middle_of(held))[:2], 0.0])
        spots = []
        for yaw in turns(yaw_to_align(held, hole)):
            x, y, _ = middle + about_z(yaw) @ aside
            spots.append(Placement((float(x), float(y)), rim + _OVER, (yaw,)))

        def check(placed: DetectedObject, scene: ObservedScene) -> MeasuredRelation:
            return inside(placed, arm.find(container, scene))

        def lower(way: PlacePlan) -> None:
            insertion = _Insertion(arm, held, hole, way)
            insertion.go(rim, floor)
            insertion.ease()

        done = place(
            arm, held, spots, skill=self.name, target=container, allowed=(container,), check=check, lower=lower
        )
        over = _seat(arm, held.id, hole, floor)
        return SkillResult(skill=self.name, detail={**done.detail, "over_floor_mm": 1e3 * over})


def _seat(arm: Mover, name: str, hole: DetectedObject, floor: float) -> float:
    """Push what was let go in a hole down with closed fingers, if it is not down; return how far it is over the floor, metres.

    Raises:
        PlacementError: It does not go down.
    """
    seen = arm.find(name, arm.look(name))
    if bottom(seen) - floor > _IN:
        arm.use(arm.start)
        arm.come_over(name)
        hand = YieldingHand(arm)
        above, deepest, since = hand.height, math.inf, 0.0
        while since < _STUCK:
            hand.press(_PUSHING)
            since += hand.tick
            if hand.height < deepest - _WAY:
                deepest, since = hand.height, 0.0
        for _ in range(round((above - deepest) / _FASTEST / hand.tick)):
            hand.go(np.array([0.0, 0.0, _FASTEST]))
        seen = arm.find(name, arm.settle(name))
    stands = bottom(seen) - floor
    if stands > _IN:
        raise _failure(
            f"{name} sticks {1e3 * stands:.1f} mm over the floor of {hole.id}, pushed with {_PUSHING:.0f} N: the hole is too narrow "
            "or not as deep as it is seen",
            seen,
            hole,
            seen.pose,
        )
    return stands


def _failure(why: str, item: DetectedObject, hole: DetectedObject, expected: Pose) -> PlacementError:
    evidence = PlacementEvidence(object=item.id, target=hole.id, reason="missed", expected=expected, actual=item.pose)
    return PlacementError(why, phase=Phase.LOWER, evidence=evidence)


class _Insertion:
    """A held thing on its way into a hole."""

    def __init__(self, arm: Mover, held: DetectedObject, hole: DetectedObject, way: PlacePlan) -> None:
        self._arm, self._held, self._hole, self._way = arm, held, hole, way
        self._hand = YieldingHand(arm)
        self._turned = 0.0
        # The tool centre point over the lowest of what is held, which may have slipped on the way.
        now = arm.find(held.id, arm.look(held.id))
        self._hangs = self._hand.height - bottom(now)

    def go(self, rim: float, floor: float) -> None:
        """Come down on a rim at a height, search where it does not sink in, and push to the floor, metres.

        Raises:
            PlacementError: It did not find the hole; it is over it again, in the hand.
        """
        arm, hand = self._arm, self._hand
        follow_until(
            arm, nowhere_faster(arm, self._way.descent, _COMING), Phase.LOWER, lambda: self._hand.pressed > _MET
        )
        hand.take_up()
        met = self._meet(rim)
        if met is not None and not any(self._search(turn) for turn in _TURNED):
            self._come_out()
            raise self._failure(
                f"{self._held.id} did not sink into {self._hole.id} within {1e3 * _AROUND:.0f} mm of where its hole is seen: it is "
                "elsewhere, or too narrow; look again"
            )
        self._push(rim, floor)

    def ease(self) -> None:
        """Let the fingers press on nothing before they open."""
        for _ in range(round(_SETTLED / self._hand.tick)):
            self._hand.press(0.0, -_GIVING * self._hand.felt[:2])

    @property
    def _lowest(self) -> float:
        """Height of the lowest of what is held, metres."""
        return self._hand.height - self._hangs

    def _meet(self, rim: float) -> float | None:
        """Come down until it stands on something, and return that height; None where it went into the hole."""
        calm, deadline = 0, self._arm.driver.time + _PATIENCE
        while self._lowest > rim - _BEGUN and self._arm.driver.time < deadline:
            self._hand.press(_SEARCHING)
            calm = calm + 1 if self._hand.pressed > 0.5 * _SEARCHING else 0
            if calm * self._hand.tick > _SETTLED:
                return self._lowest
        return None

    def _search(self, turn: float) -> bool:
        """Go round about where it is, farther and farther, pressed down and turned by an angle; tell whether it goes in.

        Where it sinks a little, or is kept from going on, it is pushed; what does not go in then has slipped in the fingers, or
        met an edge: the search goes on from there.
        """
        hand = self._hand
        centre, angle, met, gone = hand.place[:2].copy(), 0.0, self._stands(), 0.0
        while (radius := _PITCH * angle / (2.0 * math.pi)) < _AROUND:
            angle += _ALONG * hand.tick / max(radius, _PITCH)
            away = centre + radius * np.array([math.cos(angle), math.sin(angle)]) - hand.place[:2]
            step = min(max(turn - self._turned, -_TURNING * hand.tick), _TURNING * hand.tick)
            self._turned += step
            # Where it was pushed it has given way to the side, and comes back no faster than it goes.
            hand.press(
                _SEARCHING,
                away * min(1.0 / hand.tick, 2.0 * _ALONG / max(float(np.linalg.norm(away)), 1e-9)),
                step / hand.tick,
            )
            gone += _ALONG * hand.tick
            caught = gone > _APART and float(np.linalg.norm(hand.felt[:2])) > _CAUGHT * max(hand.pressed, _SEARCHING)
            if met - self._lowest > _FOUND or caught:
                if self._goes_in(met):
                    return True
                met, gone = self._stands(), 0.0
        self._lift_to(centre)
        return False

    def _stands(self) -> float:
        """Press it on what is below; return how high it stands, metres."""
        calm = 0
        for _ in range(round(_PATIENCE / self._hand.tick)):
            self._hand.press(_SEARCHING, -_GIVING * self._hand.felt[:2])
            calm = calm + 1 if self._hand.pressed > 0.5 * _SEARCHING else 0
            if calm * self._hand.tick > _SETTLED:
                break
        return self._lowest

    def _goes_in(self, met: float) -> bool:
        """Push where it has sunk in a little, and once more after it was worked at; tell whether it goes on down."""
        hand = self._hand
        for times in range(1, _TRIED + 1):
            deepest, since = math.inf, 0.0
            while since < _STUCK:
                hand.press(_PUSHING, -_GIVING * hand.felt[:2])
                since += hand.tick
                if met - self._lowest > _BEGUN:
                    return True
                if self._lowest < deepest - _WAY:
                    deepest, since = self._lowest, 0.0
            self._free(times)
        return False

    def _push(self, rim: float, floor: float) -> None:
        """Push it down until it stands on the floor, or cannot go on and is in; the fingertips stay over the rim."""
        hand, freed, deepest, since = self._hand, 0, math.inf, 0.0
        last = rim - self._hangs + self._arm.geometry.tip_depth + _CLEAR
        while self._lowest > max(last, floor):
            hand.press(_PUSHING, -_GIVING * hand.felt[:2])
            since += hand.tick
            if self._lowest < deepest - _WAY:
                deepest, since = self._lowest, 0.0
            if since <= _STUCK:
                continue
            if self._lowest - floor <= _IN or freed == _FREED:
                # What is stuck finds its way by itself once it is let go of, or is pushed from above.
                return
            freed, since = freed + 1, 0.0
            self._free(freed)

    def _free(self, times: int) -> None:
        """Draw it back a little, and press it lightly while it is turned to and fro and led round, more each time."""
        hand = self._hand
        for _ in range(round(_BACK / _FASTEST / hand.tick)):
            hand.go(np.array([*(-_GIVING * hand.felt[:2]), _FASTEST]))
        for tick in range(round(_WORKED / hand.tick)):
            angle = 2.0 * math.pi * tick * hand.tick / _WORKED
            round_about = 2.0 * math.pi / _WORKED * _SWUNG * np.array([-math.sin(2.0 * angle), math.cos(2.0 * angle)])
            swing = times * _TWISTED * 2.0 * math.pi / _WORKED * math.cos(angle)
            hand.press(_SEARCHING, 2.0 * round_about - _GIVING * hand.felt[:2], swing)

    def _lift_to(self, centre: Array) -> None:
        """Rise a little and go back to the middle of a search."""
        hand = self._hand
        for _ in range(round(_SETTLED / hand.tick)):
            hand.go(np.array([0.0, 0.0, _BACK / _SETTLED]))
        for left in range(round(_AROUND / _ALONG / hand.tick), 0, -1):
            hand.go(np.array([*((centre - hand.place[:2]) / (left * hand.tick)), 0.0]))

    def _come_out(self) -> None:
        """Rise to where it came from."""
        hand = self._hand
        goal = self._arm.motion.forward(self._way.descent.q[0]).xyz[2]
        deadline = self._arm.driver.time + 10.0
        while hand.place[2] < goal and self._arm.driver.time < deadline:
            hand.go(np.array([*(-_GIVING * hand.felt[:2]), _FASTEST]))

    def _failure(self, why: str) -> PlacementError:
        return _failure(why, self._held, self._hole, self._way.goal)
