"""Paths for the arm and ways to hold an object."""

from __future__ import annotations

from robosandbox.spatial import Array, Pose
from robosandbox.values import frozen


@frozen(kw_only=True)
class Trajectory:
    """Configurations at equal steps of time.

    Attributes:
        q: Shape (t, n); the first row is the start.
        dt: Seconds between rows.
        goes_on: Whether another one follows at once, so that this one may end at a speed.
    """

    q: Array
    dt: float
    goes_on: bool = False

    @property
    def duration(self) -> float:
        """Seconds from the first to the last row."""
        return (len(self.q) - 1) * self.dt


@frozen(kw_only=True)
class Grasp:
    """A way to hold an object: where the TCP is when the fingers close.

    The TCP frame has z along the approach and y along the closing direction.

    Attributes:
        object: Id.
        tcp_pose: The TCP in the world at closure.
        width: Extent of the object between the fingers, metres.
        quality: Higher is better; for ranking only.
        how: Its kind, in a word: "top-down", "shallow", "angled", "leaning", "side", "rim", "upright".
    """

    object: str
    tcp_pose: Pose
    width: float
    quality: float
    how: str = "top-down"


@frozen(kw_only=True)
class GraspSearch:
    """The ways to hold an object that a skill has weighed.

    Attributes:
        candidates: In the order in which they were tried.
        chosen: Index of the one that is to be carried out; None when none of them can be.
    """

    candidates: tuple[Grasp, ...]
    chosen: int | None


# Intent of a skill, for those who watch: a path for the arm, or a search for grasps.
Intent = Trajectory | GraspSearch
