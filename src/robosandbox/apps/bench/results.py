"""Settings of a bench, its rows (one an episode), counts and rates."""

from __future__ import annotations

from dataclasses import KW_ONLY, asdict, fields
from typing import Any, Self

from robosandbox.apps.bench.interval import beta_interval
from robosandbox.values import frozen
from robosandbox.versions import versions
from robosandbox.workcell.options import WorkcellOptions
from robosandbox.workcell.recording.settings import RecordSettings

# The reason of a row whose episode could not be run or not be judged.
ERROR = "error"


# The options that outcomes depend on, besides task and seed.
_RECORDED = (
    "driver",
    "planner",
    "planner_options",
    "perception",
    "grasp",
    "motion",
    "sensor",
    "max_replans",
    "what_if",
)
# Those of them that stand in a row where they were said.
_OF_THE_ROBOT = ("robot", "sidecar", "arm", "gripper")


@frozen
class BenchSettings(WorkcellOptions):
    """Settings that all episodes of a bench share: how their workcells are opened, task and seed apart.

    Attributes:
        dialogue: Off: each prompt is the first one that is said.
        recording: Where and how to record the episodes; not at all when left out. No outcome depends on it.
    """

    _: KW_ONLY
    dialogue: bool = False
    recording: RecordSettings | None = None

    @classmethod
    def of(cls, options: WorkcellOptions, recording: RecordSettings | None = None) -> Self:
        """Return the settings of a bench whose workcells are opened so."""
        given = {field.name: getattr(options, field.name) for field in fields(options)}
        return cls(**{**given, "dialogue": False}, recording=recording)

    def record(self) -> dict[str, Any]:
        """Return the settings that outcomes depend on as JSON data."""
        found = {name: getattr(self, name) for name in _RECORDED}
        found |= {name: str(value) for name in _OF_THE_ROBOT if (value := getattr(self, name)) is not None}
        return {**found, "planner_options": dict(self.planner_options or {})}


@frozen(kw_only=True)
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
        physics_steps: Physics steps of it; None where the driver simulates none.
        reason: Why the agent ended; "fault" where the code failed in the episode, "error" where there was none to judge.
        detail: What success was judged on; and the agent's last sentence where it did not succeed. Under "error" why the
            episode could not be run or not be judged.
        settings: Those of the bench.
        versions: Of what the outcome depends on.
        assists: Interventions in the physics on the robot's behalf: there are none.
        touched: Contacts of the arm, or of what it moved, with what it was not to touch, as "link on object".
        worst_force_n: The largest normal force in such a contact; None where contacts cannot be watched.
        worst_intended_force_n: The most that the robot pressed or pulled what it was to move, N, its grip apart; None likewise.
        model_usage: Requests, tokens and seconds of language models; None where none was asked.
    """

    task: str
    seed: int
    success: bool
    claimed: bool
    steps: int
    replans: int
    secs: float
    sim_secs: float
    physics_steps: int | None
    reason: str
    detail: dict[str, float | str]
    settings: dict[str, Any]
    versions: dict[str, str]
    assists: tuple[str, ...] = ()
    touched: tuple[str, ...] = ()
    worst_force_n: float | None = None
    worst_intended_force_n: float | None = None
    model_usage: dict[str, Any] | None = None

    @classmethod
    def of_error(cls, task: str, seed: int, *, error: str, settings: BenchSettings) -> Self:
        """Return the row of an episode that could not be run or not be judged.

        Args:
            task: Its name.
            seed: Its layout.
            error: Why, in one line.
            settings: Those of the bench.
        """
        return cls(
            task=task,
            seed=seed,
            success=False,
            claimed=False,
            steps=0,
            replans=0,
            secs=0.0,
            sim_secs=0.0,
            physics_steps=0,
            reason=ERROR,
            detail={ERROR: " ".join(error.split())},
            settings=settings.record(),
            versions=versions(),
        )

    @property
    def result(self) -> str:
        """OK, FAIL, or ERROR where there was no episode to judge."""
        if self.reason == ERROR:
            return "ERROR"
        return "OK" if self.success else "FAIL"

    def record(self) -> dict[str, Any]:
        """Return the row as JSON data."""
        return asdict(self)


@frozen(kw_only=True)
class Rate:
    """Success rate of a task, with its 95% Beta interval."""

    task: str
    successes: int
    episodes: int
    low: float
    high: float


class Tally:
    """Counts the rows of a bench as they come, so that none has to be kept.

    Attributes:
        episodes: How many rows.
        successes: How many of them succeeded.
        errors: How many of them had no episode to judge; they count as episodes without success.
    """

    def __init__(self) -> None:
        self.episodes: int = 0
        self.successes: int = 0
        self.errors: int = 0
        self._tasks: dict[str, tuple[int, int]] = {}

    def add(self, row: Row) -> None:
        """Count a row."""
        self.episodes += 1
        self.successes += row.success
        self.errors += row.reason == ERROR
        successes, episodes = self._tasks.get(row.task, (0, 0))
        self._tasks[row.task] = (successes + row.success, episodes + 1)

    def rates(self) -> list[Rate]:
        """Return each task's rate, in the order in which the tasks came."""
        found = []
        for task, (successes, episodes) in self._tasks.items():
            low, high = beta_interval(successes, episodes)
            found.append(Rate(task=task, successes=successes, episodes=episodes, low=low, high=high))
        return found
