"""Support of an object, told from the forces at its contacts."""

from __future__ import annotations

from collections import defaultdict

from robosandbox.types import Truth

ROBOT = "robot"
# Share of what carries an object from below that something has to bear to be among what it rests on; chosen far above what
# a contact that has just been made or a thing that leans against it bears.
_BEARS = 0.05
# Share from which something is what an object rests on, and not what it leans against: more than half.
_MOST = 0.5


def touched(now: Truth, name: str) -> bool:
    """Tell whether the robot touches an object."""
    return ROBOT in now.objects[name].contacts


def rests_on(now: Truth, name: str, support: str) -> bool:
    """Tell whether most of what carries an object from below is the support; true where the world tells no forces."""
    shares = _shares(now, name)
    return shares is None or shares.get(support, 0.0) > _MOST


def borne_by(now: Truth, name: str, support: str) -> bool:
    """Tell whether the support carries an object, itself or through what lies on it; true where the world tells no forces."""
    known, ask = {name}, [name]
    while ask:
        shares = _shares(now, ask.pop())
        if shares is None:
            return True
        bearing = {other for other, share in shares.items() if share > _BEARS}
        if support in bearing:
            return True
        ask += [other for other in bearing - known if other in now.objects]
        known |= bearing
    return False


def _shares(now: Truth, name: str) -> dict[str, float] | None:
    """Return what share of all upward force each thing under or beside an object gives; None where no forces are told."""
    touches = now.objects[name].touches
    if touches is None:
        return None
    upward: defaultdict[str, float] = defaultdict(float)
    for one in touches:
        upward[one.other] += one.force[2]
    bearing = {other: force for other, force in upward.items() if force > 0.0}
    total = sum(bearing.values())
    return {other: force / total for other, force in bearing.items()}
