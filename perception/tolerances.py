"""PerceptionTolerances of perception: how exact one look is, from which the limits in its files follow as multiples."""

from __future__ import annotations

from robosandbox.values import frozen


@frozen(kw_only=True)
class PerceptionTolerances:
    """How exact a look is, and how sure or well explained something has to be.

    Attributes:
        position: Error of a position, metres: the 95th percentile is 2.2 mm (docs/measured.md).
        size: Error of a size, metres: the median is 0.8 mm (docs/measured.md).
        depth: Noise of depth, metres: that of the sensor `rough` of sim/sensors.py at 0.7 m.
        least_depth: Standard deviation of depth that is assumed at the least, metres: what calibration leaves.
        acted_on: Confidence, a probability, from which a thing is acted on; what is seen less clearly is only told of.
        seen: Confidence from which a thing was surely seen.
        clear: Confidence from which one look tells a thing's size for good.
        cost: Mean squared residual over standard deviation of a shape that is what was seen: a standing one has about this much.
    """

    position: float = 0.002
    size: float = 0.001
    depth: float = 0.003
    least_depth: float = 0.0015
    acted_on: float = 0.3
    seen: float = 0.6
    clear: float = 0.9
    cost: float = 0.45


TOLERANCES = PerceptionTolerances()
"""PerceptionTolerances of the cameras that the benchmarks measure."""
