"""Tempo of the arm: the share of its limits that it uses in each situation, and how motions are timed."""

from __future__ import annotations

import math
import re
from dataclasses import replace

from robosandbox.errors import InputError
from robosandbox.suggestions import did_you_mean
from robosandbox.values import frozen

# Share of the joints' speed limits with something in hand, or near things; chosen: halved, episodes of six tasks take
# 25 % longer, doubled 15 % less, and all succeed at either.
_CARRY = 0.35
# Likewise just above a support; chosen so that a bump is felt before it pushes (halved 4 % longer, doubled 2 % less).
_FINE = 0.15
# Likewise with nothing near; chosen by the same six tasks.
_FREE = 0.5
# m/s of the TCP near where it meets or leaves something; chosen as the careful tempo has it there: a thing that is lowered is
# 4 mm from its support at 0.04 m/s, a hand that comes down to a grasp 4 mm from it at 0.055.
_TOUCH = 0.05
# m/s of the TCP where fingers have opened off what they held; chosen twice that, as halved it takes 1 % of an episode more.
_OFF = 0.1
# How near that is, metres; chosen as twice the planner's clearance, from where a placement may touch its support.
_NEAR = 0.004
# Before where it is believed to be a thing may be met, metres; chosen as three times what pixels err by (2.2 mm p95). From there
# on the TCP comes to rest as gently as the careful tempo has it.
_UNSURE = 0.007
# m/s of the TCP, at most, where fingers pass beside what they are to grip or what is held comes down: what ISO 10218-1 calls
# reduced speed. A finger that comes down on a can 15 mm from where it is believed to be presses 150 N, and 260 N at full speed.
_REDUCED = 0.25


@frozen(kw_only=True)
class Timing:
    """A motion that is timed optimally: along each stretch of its path as fast as the joints' limits let it go there.

    Attributes:
        share: Of the velocity and acceleration limits of the joints.
        departure: The most that the TCP moves at near the start, m/s.
        arrival: The most that it moves at near the end, m/s.
        most: The most that the TCP moves at anywhere, m/s.
        near: How near the ends are, metres along the TCP's way.
        unsure: How far before the end a thing may be met: there the speed grows as the square root of the distance, metres.
        least: The least time that it takes from rest to rest, s.
    """

    share: float
    departure: float = math.inf
    arrival: float = math.inf
    most: float = math.inf
    near: float = _NEAR
    unsure: float = _UNSURE
    least: float = 0.0

    def __mul__(self, share: float) -> Timing:
        """Return the motion at a share of these limits."""
        return replace(self, share=self.share * share)

    __rmul__ = __mul__


# How fast a motion goes: with a number, at one cruise speed that keeps this share of the joints' limits all along.
Speed = float | Timing


def share_of(speed: Speed) -> float:
    """Return the share of the joints' limits that a speed uses."""
    return speed.share if isinstance(speed, Timing) else speed


@frozen(kw_only=True)
class Tempo:
    """Speeds of the arm in each situation. Where a skill works in contact it has speeds of its own, at every tempo.

    Attributes:
        name: What people call it.
        free: With nothing in hand and nothing near.
        near: Down to what is to be gripped or touched.
        lift: Up with what was gripped, whose weight is not known yet.
        carry: With something in hand, at most: how heavy it is and how hard it is held may ask for less.
        full: With something in hand that holds things.
        lower: Down to a support with something in hand.
        leave: Up from what was let go.
    """

    name: str
    free: Speed
    near: Speed
    lift: Speed
    carry: Speed
    full: Speed
    lower: Speed
    leave: Speed


CAREFUL = Tempo(
    name="careful", free=_FREE, near=_CARRY, lift=_CARRY, carry=_CARRY, full=_CARRY, lower=_FINE, leave=_CARRY
)


def _optimal(name: str, share: float) -> Tempo:
    """Return the tempo whose motions are timed optimally within a share of the joints' limits, slow only near contact."""
    return Tempo(
        name=name,
        free=Timing(share=share),
        near=Timing(share=share, arrival=_TOUCH, most=_REDUCED),
        lift=Timing(share=share, departure=_TOUCH),
        carry=Timing(share=share),
        full=_CARRY,
        lower=Timing(share=share, arrival=_TOUCH, most=_REDUCED),
        leave=Timing(share=share, departure=_OFF),
    )


def _limited(tempo: Tempo, *, most: float = math.inf, least: float = 0.0) -> Tempo:
    """Return a tempo whose motions are no faster than a speed of the TCP, m/s, nor over before a time, s."""

    def limited(speed: Speed) -> Timing:
        timing = speed if isinstance(speed, Timing) else Timing(share=speed)
        return replace(timing, most=min(timing.most, most), least=least)

    told = {name: limited(getattr(tempo, name)) for name in ("free", "near", "lift", "carry", "full", "lower", "leave")}
    return Tempo(name=f"{most:g} m/s" if least == 0.0 else f"{least:g} s", **told)


# By name, from the slowest to the fastest. Brisk is half of the limits, as the careful tempo's free motions; fast all of them.
TEMPOS = {tempo.name: tempo for tempo in (CAREFUL, _optimal("brisk", _FREE), _optimal("fast", 1.0))}
# The tempo where none is asked for.
DEFAULT_TEMPO = TEMPOS["fast"]


SLOWEST = f"{_TOUCH:g} m/s"
"""Name of the tempo that goes everywhere as slowly as the others where they meet something."""
# A speed of the TCP that is not passed, or how long each motion takes.
_NUMBER = re.compile(r"(?P<number>\d+(?:\.\d+)?) ?(?P<unit>m/s|s|%)")


def find_tempo(name: str) -> Tempo:
    """Return the tempo of a name; of "20 %" one that takes so much of the limits, of "0.05 m/s" the usual one, in which the TCP goes no faster than that, of "8 s" in which a motion lasts so long.

    Raises:
        InputError: There is none.
    """
    told = _NUMBER.fullmatch(name)
    if told is not None and told["unit"] == "%" and 0.0 < (share := float(told["number"])) <= 100.0:
        return _optimal(name, share / 100.0)
    if told is not None and told["unit"] != "%" and (number := float(told["number"])) > 0.0:
        return _limited(DEFAULT_TEMPO, **{"most" if told["unit"] == "m/s" else "least": number})
    if name not in TEMPOS:
        raise InputError(f"--tempo: no tempo {name[:60]!r}; there is {', '.join(TEMPOS)}{did_you_mean(name, TEMPOS)}")
    return TEMPOS[name]
