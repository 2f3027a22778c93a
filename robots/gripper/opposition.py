"""Opposing fingers of a hand, found by closing it on a probe: how each closes, and which joints only spread them."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from itertools import combinations, pairwise, product
from typing import TypeVar

import mujoco
import numpy as np

from robosandbox.robots.gripper.calibrate import (
    Drive,
    collision_geoms,
    control_range,
    free_hand,
    joints_below,
    moving_groups,
    palm_of,
    place,
)
from robosandbox.robots.surfaces import points_on
from robosandbox.robots.tolerances import ROBOT_TOLERANCES
from robosandbox.types import Array
from robosandbox.values import frozen

# Radius of the probe, metres: as half of a common object, the 24 mm cube of docs/arms.md.
_PROBE = 0.012
# Distance from the probe's centre, metres, down to which a finger must come to press on it, and not graze it. Chosen: half its radius.
_GRAZED = 0.006
_MEETING = 0.002  # Radius of the probe, metres, on which a hand counts as closed. Chosen: a wire.
_SAMPLES = 48  # Number of places from open to closed at which fingers are looked at. Chosen: 2 to 3 mm of a wide hand.
# Number of servos of a finger up to which one closes it and the other spreads it. Fingers with more have one at each joint.
MOST_SERVOS = 2
_PLACES = 9  # Number of places over the range of what spreads fingers at which the hand is closed. Chosen.
_MOVED = 1e-3  # Radians or metres that a joint moves at least which a servo moves. Chosen above what settling leaves.
_TIP_MOVED = 0.005  # Metres that a servo moves a fingertip at least which is its to move. Chosen: half a pad.
# Share of two fingers' way towards each other that goes into depth below which they wedge: the sine of the angle of friction,
# for half of the coefficient of 1 that gripper.collision gives them. Measured: the fingers of Robotiq's 3-finger hand, which
# pass beside each other, 0.17 and less; those of Kinova's Jaco, which meet head on, 1.1 and more.
_WEDGE = 0.45
_YIELD = 0.0005  # Metres of depth up to which fingers only touch. Chosen above what contacts yield.
# Outer shares of the fingers in the middle of which a probe is tried: straight fingers meet at their ends. Chosen.
_OUTER = (0.5, 0.25, 0.1)
# Shares of the way to the probe at which it is looked whether fingers meet each other. Chosen.
_ON_THE_WAY = (0.0, 0.25, 0.5, 0.75, 1.0)
_CELL = 0.003  # Metres between points on a finger. Chosen: a quarter of the probe.

_T = TypeVar("_T")


@frozen
class Closing:
    """Closing motion of one finger: its actuator and the joint it drives, by ids, and the joint's values.

    Attributes:
        actuator: What closes it.
        joint: The joint.
        open: Its value with the hand open.
        meets: Where the finger meets the probe.
        closed: Where the fingers meet.
    """

    actuator: int
    joint: int
    open: float
    meets: float
    closed: float


@frozen
class Opposition:
    """A hand closed on a probe.

    Attributes:
        fingers: How each closes.
        held: Joints that only spread them: id -> the value at which they oppose each other best.
        miss: How far the worst finger stays off where it presses on the probe, and how deep fingers go into one another on the way, metres.
    """

    fingers: tuple[Closing, ...]
    held: dict[int, float]
    miss: float


def find_opposition(model: mujoco.MjModel, joints: list[int]) -> Opposition | None:
    """Close a hand on a probe; None for a hand whose fingers have several servos each, or none, that close them.

    Args:
        model: The robot.
        joints: The hand's, by id.
    """
    hand = _Hand(model, joints)
    if (roles := hand.roles()) is None:
        return None
    closing, spreading = roles
    spread = {a: sum(control_range(model, a)) / 2.0 for a in spreading}
    if not spread:
        return hand.close(closing, spread)
    best: Opposition | None = None
    # One servo after the other, and round again while the fingers get nearer: five servos have 59,049 postures together.
    while True:
        before = best
        for a in spreading:
            postures = [spread | {a: float(place)} for place in np.linspace(*control_range(model, a), _PLACES)]
            # Of postures in which all fingers meet the probe the first one is as good as any.
            spread, best = _least(((each, hand.close(closing, each)) for each in postures), lambda one: one[1].miss)
        assert best is not None
        if len(spread) == 1 or (before is not None and _whole(best.miss) >= _whole(before.miss)):
            return best


class _Hand:
    """A hand alone and out of its own way, driven by its servos."""

    def __init__(self, model: mujoco.MjModel, joints: list[int]) -> None:
        self.solid, self.model = free_hand(model, joints), free_hand(model, joints)
        self.model.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_CONTACT.value
        self.joints = joints_below(model, joints)
        self.groups = moving_groups(model, joints)
        self.palm = palm_of(model, joints)
        bodies = {int(model.jnt_bodyid[j]): j for j in joints}
        self.actuators = [
            a
            for a in range(model.nu)
            if model.actuator_trntype[a] == mujoco.mjtTrn.mjTRN_JOINT.value
            and int(model.jnt_bodyid[model.actuator_trnid[a, 0]]) in bodies
        ]
        self.points = [{g: points_on(model, g, _CELL) for g in collision_geoms(model, side)} for side in self.groups]
        self.start = np.array(model.qpos0)
        for j in self.joints:
            if model.jnt_limited[j]:
                address = int(model.jnt_qposadr[j])
                self.start[address] = np.clip(self.start[address], *model.jnt_range[j])

    def at(self, controls: list[dict[int, float]], steps: int = 0) -> list[Array]:
        """Return the configurations at which the hand comes to rest under each of these controls, each (nq,).

        Args:
            controls: Actuator id -> control; what is not named stays in the middle.
            steps: Physics steps from one to the next; 0 waits for rest.
        """
        data = mujoco.MjData(self.model)
        data.qpos[:] = self.start
        middle = {a: sum(control_range(self.model, a)) / 2.0 for a in self.actuators}
        found = []
        for k, wanted in enumerate(controls):
            target = [float((middle | wanted)[a]) for a in self.actuators]
            drive = Drive(self.model, data, self.joints, self.actuators, np.column_stack([target, target]))
            if steps and k:
                drive.advance(0.0, steps)
            else:
                drive.rest(0.0)
            found.append(data.qpos.copy())
        return found

    def tips(self, qpos: Array, outer: float = 0.5) -> Array:
        """Return the middle of each finger's outer half, or another outer share, shape (fingers, 3)."""
        data = mujoco.MjData(self.model)
        place(self.model, data, qpos)
        found: Array = _tips([_world(data, side) for side in self.points], data.xpos[self.palm], (outer,))[0]
        return found

    def roles(self) -> tuple[dict[int, tuple[float, float]], list[int]] | None:
        """Return what closes the fingers, with its open and closed control, and what spreads them.

        None where a finger has not one servo that closes it.
        """
        model = self.model
        ranges = {a: control_range(model, a) for a in self.actuators}
        moved = {a: [self.at([{a: end}])[0] for end in ends] for a, ends in ranges.items()}
        tips = {a: [self.tips(qpos) for qpos in both] for a, both in moved.items()}
        outward = self._outward()
        moves = {
            a: int((np.linalg.norm(second - first, axis=1) > _TIP_MOVED).sum()) for a, (first, second) in tips.items()
        }
        mine: list[dict[int, float]] = [{} for _ in self.groups]
        for a in ranges:
            body = int(model.jnt_bodyid[model.actuator_trnid[a, 0]])
            side = next(k for k, group in enumerate(self.groups) if body in group)
            mine[side][a] = float((tips[a][0][side] - tips[a][1][side]) @ outward[side])
        if not all(1 <= len(servos) <= MOST_SERVOS for servos in mine):
            return None
        closing: dict[int, tuple[float, float]] = {}
        for servos in mine:
            # What moves several fingers spreads them; of two that move one alone, the one closes it that takes it farther inward.
            a = min(servos, key=lambda each: (moves[each] > 1, -abs(servos[each])))
            low, high = ranges[a]
            closing[a] = (low, high) if servos[a] > 0.0 else (high, low)
        return closing, [a for a in ranges if a not in closing]

    def _outward(self) -> Array:
        """Return the way from the middle of the palm to each finger's root, across that to the fingertips, metres, (fingers, 3)."""
        data = mujoco.MjData(self.model)
        place(self.model, data, self.at([{}])[0])
        roots = np.array([data.xpos[min(side)] for side in self.groups])
        approach = self.tips(data.qpos).mean(axis=0) - roots.mean(axis=0)
        approach /= np.linalg.norm(approach)
        out = roots - roots.mean(axis=0)
        across: Array = out - np.outer(out @ approach, approach)
        return across

    def close(self, closing: dict[int, tuple[float, float]], spread: dict[int, float]) -> Opposition:
        """Close the hand on the probe with what spreads its fingers at these controls."""
        shares = np.linspace(0.0, 1.0, _SAMPLES + 1)
        steps = max(1, int(ROBOT_TOLERANCES.sweep_seconds / self.model.opt.timestep / _SAMPLES))
        samples = self.at(
            [
                spread | {a: opened + share * (closed - opened) for a, (opened, closed) in closing.items()}
                for share in shares
            ],
            steps,
        )
        data = mujoco.MjData(self.model)
        clouds, ends = [], []
        for qpos in samples:
            place(self.model, data, qpos)
            clouds.append([_world(data, side) for side in self.points])
            ends.append(_tips(clouds[-1], data.xpos[self.palm], _OUTER))
        last = self._last_free(samples)
        tips = dict(zip(_OUTER, np.swapaxes(ends[: last + 1], 0, 1), strict=True))

        def probed() -> Iterator[tuple[float, Array]]:
            places = product(_shares(len(self.groups)), _OUTER)
            centres = np.array([np.einsum("f,kfx->kx", weights, tips[outer]) for weights, outer in places])
            for gaps in _gaps(clouds[: last + 1], centres):
                met = [_first(column, _PROBE) for column in gaps.T]
                yield max(0.0, float(gaps.min(axis=0).max()) - _GRAZED) + self._collide(samples, met), gaps

        # The probe lies among the fingertips, where they meet it best: of three two may stand against one.
        miss, gaps = _least(probed(), lambda one: one[0])
        model, fingers = self.model, []
        for a in closing:
            joint = int(model.actuator_trnid[a, 0])
            side = next(k for k, group in enumerate(self.groups) if int(model.jnt_bodyid[joint]) in group)
            address = int(model.jnt_qposadr[joint])
            meets, closed = (_first(gaps[:, side], radius) for radius in (_PROBE, _MEETING))
            fingers.append(
                Closing(
                    actuator=a,
                    joint=joint,
                    open=float(samples[0][address]),
                    meets=float(samples[meets][address]),
                    closed=float(samples[closed][address]),
                )
            )
        return Opposition(tuple(fingers), self._spread(list(spread), set(closing), samples[0]), miss)

    def _collide(self, samples: list[Array], meets: list[int]) -> float:
        """Return how deep fingers go into one another on their way to these samples, one a finger, in step; metres."""
        sides = [
            [int(self.model.jnt_qposadr[j]) for j in self.joints if self.model.jnt_bodyid[j] in g] for g in self.groups
        ]
        deepest = 0.0
        for share in _ON_THE_WAY:
            qpos = samples[0].copy()
            for side, end in zip(sides, meets, strict=True):
                qpos[side] = samples[round(share * end)][side]
            deepest = max(deepest, *self._overlaps(qpos).values(), 0.0)
        return deepest

    def _last_free(self, samples: list[Array]) -> int:
        """Return the last sample before fingers that pass beside each other would wedge; without such, the last of all.

        Fingers that meet head on press on each other and part again. Where their way makes a smaller angle with the
        surfaces that touch than friction does, they lock like a taper, and no servo opens them.
        """
        overlaps = [self._overlaps(qpos) for qpos in samples]
        met = set(overlaps[0])
        for k, (now, then) in enumerate(pairwise(overlaps)):
            for (a, b), depth in now.items():
                if (a, b) in met or depth <= _YIELD:
                    continue
                met.add((a, b))
                moved = self.tips(samples[k + 1]) - self.tips(samples[k])
                if then.get((a, b), 0.0) - depth < _WEDGE * float(np.linalg.norm(moved[a] - moved[b])):
                    return max(k - 1, 1)
        return len(samples) - 1

    def _overlaps(self, qpos: Array) -> dict[tuple[int, int], float]:
        """Return how deep fingers reach into each other at a configuration, metres: pairs of sides that do -> depth."""
        data = mujoco.MjData(self.solid)
        place(self.solid, data, qpos)
        side = {b: k for k, group in enumerate(self.groups) for b in group}
        found: dict[tuple[int, int], float] = {}
        for geoms, distance in zip(data.contact.geom, data.contact.dist, strict=True):
            first, second = sorted(side.get(int(self.solid.geom_bodyid[g]), -1) for g in geoms)
            if first >= 0 and first != second:
                found[first, second] = max(found.get((first, second), 0.0), -float(distance))
        return found

    def _spread(self, actuators: list[int], closing: set[int], qpos: Array) -> dict[int, float]:
        """Return what joints these actuators move, and their values at a configuration.

        A joint with a servo that closes it gives way a little to what spreads the fingers; it closes them all the same.
        """
        model, held = self.model, {}
        closed = {int(model.actuator_trnid[a, 0]) for a in closing}
        for a in actuators:
            first, second = (self.at([{a: end}])[0] for end in control_range(model, a))
            for j in self.joints:
                address = int(model.jnt_qposadr[j])
                if j not in closed and abs(second[address] - first[address]) > _MOVED:
                    held[j] = float(qpos[address])
        return held


def _least(tried: Iterable[_T], miss: Callable[[_T], float]) -> _T:
    """Return the first that misses by the least, to a millimetre; none is tried after one that misses by nothing."""
    best: tuple[float, _T] | None = None
    for one in tried:
        off = _whole(miss(one))
        if best is None or off < best[0]:
            best = off, one
        if off <= 0.0:
            break
    assert best is not None
    return best[1]


def _whole(metres: float) -> float:
    """Return a length to a millimetre: what is nearer by less is not nearer."""
    return round(metres, 3)


def _world(data: mujoco.MjData, side: dict[int, Array]) -> Array:
    """Return a side's points in the world, shape (k, 3)."""
    return np.concatenate([data.geom_xpos[g] + local @ data.geom_xmat[g].reshape(3, 3).T for g, local in side.items()])


def _tips(cloud: list[Array], palm: Array, outer: tuple[float, ...]) -> Array:
    """Return the middle of these outer shares of each finger, shape (shares, fingers, 3).

    Args:
        cloud: The fingers' points, in the world.
        palm: The place from which what is far is a fingertip's.
        outer: The shares.
    """
    found = np.empty((len(outer), len(cloud), 3))
    for f, side in enumerate(cloud):
        far = np.linalg.norm(side - palm, axis=1)
        for k, least in enumerate(np.quantile(far, [1.0 - share for share in outer])):
            found[k, f] = side[far > least].mean(axis=0)
    return found


def _shares(fingers: int) -> list[Array]:
    """Return weights of fingertips that put a point among them, each (fingers,): alike, and between some and the rest."""
    found = [np.full(fingers, 1.0 / fingers)]
    for count in range(1, fingers // 2 + 1):
        for side in combinations(range(fingers), count):
            weights = np.full(fingers, 0.5 / (fingers - count))
            weights[list(side)] = 0.5 / count
            found.append(weights)
    return found


def _gaps(clouds: list[list[Array]], centres: Array) -> Array:
    """Return the fingers' gaps to the centre of each probe, shape (p, k, fingers), metres.

    Args:
        clouds: The fingers' points at each sample.
        centres: Of each probe a place for each sample, shape (p, k, 3); it lies at that where it fits best between them.
    """
    there = np.array([_nearest(cloud, centres[:, k]) for k, cloud in enumerate(clouds)])
    fits = np.abs(there.mean(axis=2) - _PROBE).argmin(axis=0)
    around = centres[np.arange(len(centres)), fits]
    return np.array([_nearest(cloud, around) for cloud in clouds]).swapaxes(0, 1)


def _nearest(cloud: list[Array], centres: Array) -> Array:
    """Return how far each finger's nearest point is from each of these centres, shape (p, fingers), metres."""
    middle = centres.mean(axis=0)
    off = centres - middle
    square = np.einsum("px,px->p", off, off)
    found = []
    for side in cloud:
        there = side - middle
        # The square of a difference, so that one product of matrices takes all centres.
        less = (np.einsum("kx,kx->k", there, there)[:, None] - 2.0 * there @ off.T).min(axis=0)
        found.append(np.sqrt(np.maximum(less + square, 0.0)))
    return np.column_stack(found)


def _first(gaps: Array, radius: float) -> int:
    """Return the first sample at which a finger meets a ball of this radius; where it never does, the one nearest to it."""
    near = np.flatnonzero(gaps <= radius)
    return int(near[0]) if len(near) else int(gaps.argmin())
