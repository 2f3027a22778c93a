"""Samples a perturbed episode: a bundled task's layout, its objects, and the phases of the same episode without a fault."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from support.faults import Fault

from robosandbox.agent.episode import SkillStarted
from robosandbox.driver import simulated
from robosandbox.perception.protocols import Perception
from robosandbox.tasks.judge.checks import Check, Undisturbed
from robosandbox.tasks.loader import find_task
from robosandbox.tasks.success import AllOf
from robosandbox.tasks.task import Task
from robosandbox.types import Array, DetectedObject, Pose, Scene, SceneObject
from robosandbox.workcell.session import open_session
from robosandbox.world.relations import gap

# What each task moves, and where to.
SUBJECTS: dict[str, tuple[str, str | None]] = {
    "pick_cube_scrambled": ("red_cube", None),
    "pick_can": ("can", None),
    "pick_ball": ("yellow_ball", None),
    "pick_from_three": ("green_cube", None),
    "put_in_bin": ("red_cube", "grey_bin"),
    "stack_two": ("red_cube", "blue_cube"),
    "place_on_block": ("red_cube", "blue_block"),
    "place_beside": ("red_cube", "blue_block"),
    "push_left": ("red_cube", None),
    "push_forward": ("red_cube", None),
    "stack_three": ("green_cube", "blue_cube"),
    "open_drawer": ("drawer", None),
    "put_in_drawer": ("drawer", None),
}
# Within these, from the base, an object can be grasped from above.
_NEAR, _FAR = 0.3, 0.75
# How far from the table's middle things are put along x and y, metres; chosen as 6 cm inside its edge, where a hand
# fits beside them.
_EDGE = 0.44
# How far from the hand a thing is to lie that is moved, metres; chosen as a hand's length: nothing is put into it.
_HAND_AWAY = 0.15
# Seconds before an episode's end in which nothing happens any more; chosen so that each fault is met.
_BEFORE_THE_END = 0.1
# Number of tries to find a place; chosen far above what crowded bundled tasks need (37 for 12 objects).
DRAWS = 500


@dataclass(frozen=True, slots=True)
class Moment:
    """One control tick of the episode as it would have gone."""

    time: float
    step: int
    phase: str
    tcp: Array


@dataclass(slots=True, kw_only=True)
class Perturbation:
    """What is done to an episode.

    Attributes:
        scene: How it begins.
        fault: What happens.
        at: In which simulated second; 0 is before it begins.
        perception: What the robot sees with.
        hopeless: Whether the task cannot be done any more.
        about: The drawn figures, for the row.
    """

    scene: Scene
    fault: Fault | None = None
    at: float = 0.0
    perception: Perception | None = None
    hopeless: bool = False
    about: str = ""


class EpisodeSampler:
    """The random numbers of one episode, and the course of the same episode without a fault.

    Args:
        case: The case's name.
        seed: The episode's.
        tasks: Bundled tasks, of which the seed takes one.
    """

    def __init__(self, case: str, seed: int, tasks: Sequence[str]) -> None:
        self.rng: np.random.Generator = np.random.default_rng([seed, *case.encode()])
        task = find_task(tasks[seed % len(tasks)])
        self.subject: str
        self.target: str | None
        self.subject, self.target = SUBJECTS[task.name]
        with open_session(task, seed=int(self.rng.integers(1, 10**6))) as session:
            scene = simulated(session.driver, "its layout is changed").scene
            self.base: Array = session.driver.arms["arm"].spec.base_position
        criterion = _without_undisturbed(task.success)
        self.task: Task = task.model_copy(update={"scene": scene, "success": criterion})
        self._moments: list[Moment] | None = None

    @property
    def scene(self) -> Scene:
        """The scene as drawn so far."""
        return self.task.scene

    def change(self, scene: Scene) -> None:
        """Take another scene."""
        self.task = self.task.model_copy(update={"scene": scene})
        self._moments = None

    def ask(self, prompt: str, success: Mapping[str, object]) -> None:
        """Ask for something else, judged by another criterion."""
        fields = {**self.task.model_dump(), "prompt": prompt, "success": success}
        self.task = Task.model_validate(fields)

    def replace(self, name: str, **fields: object) -> None:
        """Change fields of one object."""
        objects = tuple(
            SceneObject.model_validate({**item.model_dump(), **fields}) if item.id == name else item
            for item in self.scene.objects
        )
        self.change(self.scene.model_copy(update={"objects": objects}))

    def add(self, item: SceneObject) -> None:
        """Add an object."""
        self.change(self.scene.model_copy(update={"objects": (*self.scene.objects, item)}))

    def item(self, name: str) -> DetectedObject:
        """Return an object as it stands at the start."""
        item = next(item for item in self.scene.objects if item.id == name)
        return DetectedObject(id=item.id, kind=item.kind, size=item.size, colour="", rgba=item.rgba, pose=item.pose)

    def uniform(self, low: float, high: float) -> float:
        """Return a number between two."""
        return float(self.rng.uniform(low, high))

    def direction(self) -> Array:
        """Return a unit vector (2,)."""
        angle = self.uniform(0.0, 2.0 * math.pi)
        return np.array([math.cos(angle), math.sin(angle)])

    def radius(self, xy: Array) -> float:
        """Return the distance from the robot's base, metres."""
        return float(np.hypot(*(xy - self.base[:2])))

    def easy(self, xy: Array) -> bool:
        """Tell whether a place is well within reach and on the table."""
        return _NEAR < self.radius(xy) < _FAR and bool((np.abs(xy) < _EDGE).all())

    def free(self, item: DetectedObject, but: Iterable[str] = (), least: float = 0.004) -> bool:
        """Tell whether an object has room there."""
        others = [self.item(other.id) for other in self.scene.objects if other.id not in (item.id, *but)]
        return all(gap(item, other) > least for other in others)

    def offset(self, name: str, low: float, high: float) -> Array:
        """Return by how much (2,) an object may be moved to a free and easy place."""
        item = self.item(name)
        for _ in range(DRAWS):
            step = self.direction() * self.uniform(low, high)
            there = moved_by(item, step)
            if self.easy(there.pose.position[:2]) and self.free(there):
                return step
        raise ValueError(f"no room for {name}")

    def moment(self, phases: Iterable[str], *, step: int = 0, away_from: Array | None = None) -> float:
        """Return a moment of the undisturbed episode: in these phases of one skill call, the hand away from a place.

        Phases that come again when the object has been grasped count only the first time, if "grasp" is not among them.

        Raises:
            ValueError: There is none.
        """
        if self._moments is None:
            self._moments = _timeline(self.task)
        grasp = [m.time for m in self._moments if m.step == step and m.phase in ("grasp", "push")]
        last = min(grasp, default=math.inf) if not {"grasp", "lift", "transfer", "push"} & set(phases) else math.inf
        fit = [
            moment.time
            for moment in self._moments[: -round(_BEFORE_THE_END / 0.01)]
            if moment.step == step
            and moment.phase in phases
            and moment.time < last
            and (away_from is None or float(np.linalg.norm(moment.tcp[:2] - away_from[:2])) > _HAND_AWAY)
        ]
        if not fit:
            raise ValueError(f"no moment in {', '.join(phases)}")
        return fit[int(self.rng.integers(len(fit)))]


def _timeline(task: Task) -> list[Moment]:
    """Run the task as if nothing happened, and return its control ticks.

    Raises:
        ValueError: It fails all by itself.
    """
    moments: list[Moment] = []
    step = -1

    def count(event: object) -> None:
        nonlocal step
        step += isinstance(event, SkillStarted)

    with open_session(task, what_if=False, max_replans=0) as session:
        sim, ctx = session.driver, session.ctx
        session.ctx.events.subscribe(count)
        sim.subscribe(lambda: moments.append(Moment(sim.time, step, str(ctx.phase), sim.state().tcp_pose.position)))
        episode = session.run()
    if not episode.success:
        raise ValueError(f"fails undisturbed: {episode.final_detail}")
    return moments


def standing_at(item: DetectedObject, pose: Pose) -> DetectedObject:
    """Return the object as if it stood at a pose."""
    return replace(item, pose=pose)


def moved_by(item: DetectedObject, step: Array) -> DetectedObject:
    """Return the object as if it stood elsewhere by `step` (2,), metres."""
    x, y, z = item.pose.xyz
    return standing_at(item, Pose(xyz=(x + float(step[0]), y + float(step[1]), z), quat_xyzw=item.pose.quat_xyzw))


def _without_undisturbed(check: Check) -> Check:
    """Leave out that other things stay where they are: faults move them, and a blocker has to be moved."""
    if not isinstance(check, AllOf):
        return check
    kept = tuple(_without_undisturbed(child) for child in check.checks if not isinstance(child, Undisturbed))
    return check.model_copy(update={"checks": kept})
