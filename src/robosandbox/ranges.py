"""Valid ranges of a scene's values; outside them lies a slip of the pen or an attack, and no sensible physics.

Every refusal names the value and the range; the field's path is added by who reads the file or message.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Annotated

from pydantic import AfterValidator, Field

# Kilograms. A milligram is a grain; a tonne is more than a table or any bundled arm bears. Beyond a ratio of about 1e9
# between two bodies in contact MuJoCo's solver no longer converges in double precision.
LEAST_MASS, MOST_MASS = 1e-6, 1e3
# kg/m^3: from below that of foams, about 10, to above that of osmium, 22,600.
LEAST_DENSITY, MOST_DENSITY = 1.0, 3e4
# Metres. A tenth of a millimetre is a tenth of what contacts give way under load here; ten metres are ten tables.
LEAST_LENGTH, MOST_LENGTH = 1e-4, 10.0
# Metres from the origin; chosen as a hall: arithmetic with poses keeps its micrometres there.
MOST_DISTANCE = 100.0
# Metres per unit of a mesh file: files in micrometres to files in kilometres.
LEAST_SCALE, MOST_SCALE = 1e-6, 1e3
# Number of a task's layouts: what a signed 32-bit integer, which messages and files of other languages hold, can count.
LAYOUTS = 2**31
# Radians; chosen as a whole turn either way, rounded up.
MOST_TURN = 6.3


def within(low: float, high: float, unit: str) -> Callable[[float], float]:
    """Return a check that a value lies between two others, both included."""

    def check(value: float) -> float:
        if not low <= value <= high:
            raise ValueError(f"{value:g} is outside {low:g} to {high:g} {unit}{_other_unit(value, low, high, unit)}")
        return value

    return check


def _other_unit(value: float, low: float, high: float, unit: str) -> str:
    """Return the question whether a value is in the unit that people think in, where it would do then."""
    name, factor = {"m": ("millimetres", 1e-3), "rad": ("degrees", math.pi / 180.0)}.get(unit, ("", 0.0))
    return f": are these {name}?" if name and low <= value * factor <= high else ""


Number = Annotated[float, Field(allow_inf_nan=False)]
Density = Annotated[Number, AfterValidator(within(LEAST_DENSITY, MOST_DENSITY, "kg/m^3"))]
Mass = Annotated[Number, AfterValidator(within(LEAST_MASS, MOST_MASS, "kg"))]
Length = Annotated[Number, AfterValidator(within(LEAST_LENGTH, MOST_LENGTH, "m"))]
Scale = Annotated[Number, AfterValidator(within(LEAST_SCALE, MOST_SCALE, "m per unit of the file"))]
Spread = Annotated[Number, AfterValidator(within(0.0, MOST_LENGTH, "m"))]
Turn = Annotated[Number, AfterValidator(within(0.0, MOST_TURN, "rad"))]
Coordinate = Annotated[Number, AfterValidator(within(-MOST_DISTANCE, MOST_DISTANCE, "m"))]
