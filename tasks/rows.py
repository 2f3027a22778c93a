"""What a bench is told and what it tells: settings, a row per episode, rates."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, field
from typing import Any

from robosandbox.recording.settings import RecordSettings
from robosandbox.tasks.interval import beta_interval


@dataclass(frozen=True, slots=True, kw_only=True)
class BenchSettings:
    """What all episodes of a bench share.

    Attributes:
        planner: Name of an installed planner.
        planner_options: What it takes besides the skills.
        perception: Name of an installed perception.
        sensor: What its cameras are like.
        max_replans: How often a failure may be answered with a new plan.
        what_if: Whether skills may try repairs on copies of the world.
        recording: Where and how to record the episodes; not at all when left out. No outcome depends on it.
    """

    planner: str = "stub"
    planner_options: Mapping[str, Any] = field(default_factory=dict)
    perception: str = "ground_truth"
    sensor: str = "ideal"
    max_replans: int = 3
    what_if: bool = True
    recording: RecordSettings | None = None

    def record(self) -> dict[str, Any]:
        """Return the settings that outcomes depend on as JSON data."""
        return {name: value for name, value in asdict(self).items() if name != "recording"}


@dataclass(frozen=True, slots=True, kw_only=True)
class Row:
    """One episode.

    Attributes:
        task: Its name.
        seed: Its layout.
        success: What simulated truth says.
        claimed: What the agent said.
        steps: Skill calls that reached their post-condition.
        replans: New plans after failures.
        secs: Wall time of the episode, loading excluded.
        sim_secs: Simulated time of it.
        physics_steps: Physics steps of it.
        reason: Why the agent ended.
        detail: What success was judged on; and the agent's last sentence where it did not succeed.
        settings: Those of the bench.
        versions: Of what the outcome depends on.
        assists: Interventions in the physics on the robot's behalf: there are none.
        touched: Contacts of the arm, or of what it moved, with what it was not to touch, as "link on object".
        worst_force_n: The largest normal force in such a contact; None where contacts cannot be watched.
    """

    task: str
    seed: int
    success: bool
    claimed: bool
    steps: int
    replans: int
    secs: float
    sim_secs: float
    physics_steps: int
    reason: str
    detail: dict[str, float | str]
    settings: dict[str, Any]
    versions: dict[str, str]
    assists: tuple[str, ...] = ()
    touched: tuple[str, ...] = ()
    worst_force_n: float | None = None

    def record(self) -> dict[str, Any]:
        """Return the row as JSON data."""
        return asdict(self)


@dataclass(frozen=True, slots=True, kw_only=True)
class Rate:
    """How often a task succeeded, with the 95% Beta interval of the rate."""

    task: str
    successes: int
    episodes: int
    low: float
    high: float


def rates(rows: Sequence[Row]) -> list[Rate]:
    """Return each task's rate, in the order of the rows."""
    found = []
    for task in dict.fromkeys(row.task for row in rows):
        results = [row.success for row in rows if row.task == task]
        low, high = beta_interval(sum(results), len(results))
        found.append(Rate(task=task, successes=sum(results), episodes=len(results), low=low, high=high))
    return found
