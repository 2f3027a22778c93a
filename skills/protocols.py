"""The context that skills are given."""

from __future__ import annotations

from typing import TYPE_CHECKING, Protocol, runtime_checkable

if TYPE_CHECKING:
    from collections import deque

    from robosandbox.driver import Arm, Driver, Hand
    from robosandbox.errors import Failure, Repair
    from robosandbox.grasp.protocols import GraspPlanner
    from robosandbox.motion.planning_scene import PlanningScene
    from robosandbox.motion.protocols import MotionPlanner
    from robosandbox.perception.protocols import Perception
    from robosandbox.types import Array, Intent, ObservedScene, Tempo
    from robosandbox.world.alternatives import FailedCall
    from robosandbox.world.operators import BoundCall

# Calls before a call whose beginnings are remembered.
MOST_BACK = 40


@runtime_checkable
class SkillContext(Protocol):
    """All that a skill may use."""

    @property
    def driver(self) -> Driver:
        """Driver of the cell."""
        ...

    @property
    def arm(self) -> Arm:
        """The arm that the call works with; of a cell with one, that one."""
        ...

    @property
    def hand(self) -> Hand | None:
        """The hand that this arm carries; None where it carries none."""
        ...

    def work_with(self, arm_name: str | None) -> None:
        """Have the calls that follow work with an arm, by its name."""
        ...

    @property
    def poses(self) -> dict[tuple[str, str], Array]:
        """Configurations that were given a name, shape (n,) each, by arm and name."""
        ...

    @property
    def starts(self) -> deque[float]:
        """When the calls before this one and this one began, on the driver's clock, seconds; the last `MOST_BACK` and one."""
        ...

    @property
    def perception(self) -> Perception: ...
    @property
    def grasp(self) -> GraspPlanner: ...
    @property
    def motion(self) -> MotionPlanner: ...
    @property
    def what_if(self) -> bool: ...
    @property
    def max_force_n(self) -> float:
        """Largest force on the object that a skill manipulates, N."""
        ...

    @property
    def tempo(self) -> Tempo:
        """Speeds of the arm in each situation."""
        ...

    def go_at(self, tempo: Tempo) -> None:
        """Have the calls that follow go at a tempo."""
        ...

    def look(self, *names: str) -> ObservedScene:
        """Return what perception sees now; with names, of these things, and what is remembered of the others."""
        ...

    def feel(self) -> ObservedScene:
        """Return what is believed now without a look: what was seen last, what the hand holds where the hand is."""
        ...

    def doubt(self) -> None:
        """Have the next look be at everything anew: something went otherwise than it was believed to."""
        ...

    def permit(self, call: BoundCall) -> None:
        """Check a call against the limits before anything moves; raises LimitError."""
        ...

    def planning(self, seen: ObservedScene) -> PlanningScene:
        """Return what to plan among where things are believed to be as `seen`."""
        ...

    def repairs_for(self, failed: FailedCall) -> tuple[Repair, ...]:
        """Return what would do in place of a failed call, tried on a simulation of what is believed."""
        ...

    def advice_for(self, failure: Failure) -> str:
        """Return what is wrong with the robot's own sidecar, to be put behind a failure's message; often nothing."""
        ...

    def enter(self, phase: str) -> None:
        """Tell listeners which phase begins."""
        ...

    def announce(self, intent: Intent) -> None:
        """Tell listeners what is about to be done; costs nothing when there are none."""
        ...
