"""What the parts ask of one another: complete protocols, so that any part can be replaced."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import TYPE_CHECKING, Any, Protocol, runtime_checkable

from typing_extensions import TypeVar

if TYPE_CHECKING:
    from robosandbox.drivers import Capabilities
    from robosandbox.errors import CollisionError, Repair, SkillError
    from robosandbox.motion.planning_scene import PlanningScene
    from robosandbox.robots.spec import RobotSpec
    from robosandbox.types import (
        Array,
        DetectedObject,
        Grasp,
        Intent,
        Observation,
        ObservedScene,
        Plan,
        Pose,
        Refusal,
        RgbdFrame,
        Scene,
        SkillCall,
        SkillResult,
        Trajectory,
        Truth,
    )
    from robosandbox.world.alternatives import Failure


# Asked in a driver's control loop, after each tick: why the motion has to end with the arm holding, or None to go on. It moves
# nothing itself and does not raise.
Guard = Callable[[], Exception | None]


@runtime_checkable
class Driver(Protocol):
    """A world with one robot in it, advanced in control ticks.

    An entry point of `robosandbox.drivers` is called as `factory(scene, **options)` and returns one that is connected;
    `docs/drivers.md` says which options it may take. `testing.check_driver` tries every member.
    """

    @property
    def spec(self) -> RobotSpec:
        """What the robot is: joints, limits, gripper, reach."""
        ...

    @property
    def capabilities(self) -> Capabilities:
        """What it has; what is not there raises an UnsupportedError where it is asked for."""
        ...

    @property
    def episode(self) -> int:
        """Changes with every reset: what was seen before it is of another world."""
        ...

    @property
    def time(self) -> float: ...
    @property
    def control_timestep(self) -> float: ...
    @property
    def guards(self) -> list[Guard]:
        """Asked after every control tick of any motion or wait: limits of force and place, cancelling, deadlines."""
        ...

    def subscribe(self, listener: Callable[[], None]) -> Callable[[], None]:
        """Have `listener` called after every control tick, before the guards; return what ends that."""
        ...

    def state(self, cameras: Sequence[str] = ()) -> Observation: ...
    def capture(self, camera: str) -> RgbdFrame:
        """Return what the RGB-D sensor of a camera delivers now; raises RenderingError where nothing renders."""
        ...

    def follow(self, trajectory: Trajectory, guards: Sequence[Guard] = ()) -> None:
        """Follow the trajectory; return when its last row has been commanded.

        Where a guard says why not, one of these or a standing one, the driver stops the arm and raises that.
        """
        ...

    def trim(self, goal: Array, guards: Sequence[Guard] = ()) -> None:
        """Let one control tick pass with the commands shifted against what keeps the arm off `goal` (n,); guards as above."""
        ...

    def wait(self, seconds: float, guards: Sequence[Guard] = ()) -> None:
        """Let time pass with the last commands held; guards as above."""
        ...

    def stop(self) -> None:
        """Command the arm to stay where it is."""
        ...

    def set_gripper(self, closed: float, force: float | None = None) -> None:
        """Command the gripper: 0 is the sidecar's open, 1 its closed; with `force` newtons of its motors at most.

        Returns at once. Without a force it closes as hard as its motors do. Raises UnsupportedError for a force where
        `grip_limit` is not declared.
        """
        ...

    def strongest_contact(self) -> tuple[float, str, str]:
        """Return the largest normal force between the robot and anything else, N, and the two bodies; 0 without one."""
        ...

    def force_on(self, object_id: str | None) -> Array:
        """Return the sum of what the robot presses and pulls an object with, N in the world, shape (3,); None is all."""
        ...

    def grip_on(self, object_id: str | None) -> float:
        """Return with how much force each side of the gripper presses on an object, N, as pads that feel would; None is any."""
        ...

    def servo_force(self, joint: int) -> tuple[float, float]:
        """Return what an arm joint's servo gives now and the most that it can, N m or N; infinite without a limit."""
        ...

    def arm_contacts(self) -> tuple[tuple[str, str], ...]:
        """Return the pairs (robot body, other body) that touch now."""
        ...

    def close(self) -> None:
        """Let go of the robot, which holds where it is, or free the world."""
        ...


@runtime_checkable
class Simulated(Driver, Protocol):
    """A simulated world: it knows its own state, starts over and can be copied.

    Judges, ground-truth perception, replay and trials ask for it; `drivers.simulated` says so where it is not there.
    """

    @property
    def scene(self) -> Scene:
        """The scene as loaded or last reset to."""
        ...

    @property
    def physics_steps(self) -> int:
        """Physics steps since the last reset."""
        ...

    @property
    def jump_hooks(self) -> list[Callable[[], None]]:
        """Called after the state was set in another way than by letting time pass."""
        ...

    @property
    def wait_hooks(self) -> list[Callable[[], None]]:
        """Called again and again while a scene is loaded and settles. One that raises ends that."""
        ...

    def truth(self) -> Truth:
        """Return the simulated state, for judging and ground-truth perception; skills and planners never read it."""
        ...

    def reset(self, scene: Scene | None = None, q: Array | None = None) -> None:
        """Start over, in a scene with the same robot and the arm at `q` (n,); as it began where they are left out.

        Raises:
            InputError: Objects start inside something.
        """
        ...

    def snapshot(self) -> Array:
        """Return the whole simulated state as one vector."""
        ...

    def restore(self, state: Array) -> None:
        """Go back to a snapshot of this scene."""
        ...

    def resume(self, scene: Scene, state: Array, physics_steps: int) -> None:
        """Go back to a snapshot that was taken in `scene` after so many physics steps; raises InputError."""
        ...

    def fork(self) -> Simulated:
        """Return a copy that shares nothing that moves."""
        ...


@runtime_checkable
class Refereed(Driver, Protocol):
    """A driver that comes with a judge of its own: what it measures for a verdict, apart from what skills are told.

    A judge and a bench alone may call it. A simulated world's judge is its truth.
    """

    def referee(self) -> Truth:
        """Return the state to judge on."""
        ...


@runtime_checkable
class Perception(Protocol):
    """What is where."""

    def perceive(self, sim: Driver) -> ObservedScene: ...
    def view(self, sim: Driver) -> Driver:
        """Return the sim as skills may see it: without its truth, where the perception does without it."""
        ...

    def planning(self, sim: Driver, seen: ObservedScene) -> PlanningScene:
        """Return what to plan among where things are believed to be as `seen`; changes nothing of the sim."""
        ...


@runtime_checkable
class GraspPlanner(Protocol):
    """Ways to hold an object, best first, made as they are asked for; feasibility is the motion planner's to say.

    `pieces`, each (k, 3), span a mesh's convex pieces in the object's frame; `hand` (3, 3) is the TCP's rotation now, so that of
    grasps about as good the one that turns it least may come first.
    """

    def candidates(
        self,
        target: DetectedObject,
        scene: ObservedScene,
        robot: RobotSpec,
        *,
        pieces: Sequence[Array] = (),
        hand: Array | None = None,
    ) -> Iterable[Grasp]: ...


@runtime_checkable
class MotionPlanner(Protocol):
    """Joint configurations and collision-checked paths on data of its own."""

    def use(self, planning: PlanningScene, state: Observation, *, held: str | None = None) -> None:
        """Take the world to plan in: objects as believed, the robot as it stands, `held` moving with the TCP."""
        ...

    def allow(self, *names: str) -> None:
        """Let the robot touch these objects (and "table", with the floor beside it) in the plans that follow, and nothing else."""
        ...

    def open_to(self, aperture: float) -> None:
        """Check the paths that follow with the fingers `aperture` metres apart."""
        ...

    def ik(self, tcp_pose: Pose, seed: Array | None = None, *, restarts: int = 60) -> Array:
        """Return a configuration (n,) with the TCP at `tcp_pose`; raises UnreachableError.

        `restarts` bounds how hard it is searched for away from `seed`.
        """
        ...

    def forward(self, q: Array) -> Pose:
        """Return the TCP pose in the world at `q` (n,)."""
        ...

    def touch(self, q: Array) -> CollisionError | None:
        """Return the error that standing at `q` (n,) would be, or None."""
        ...

    def plan_joints(self, q_start: Array, q_goal: Array, *, speed: float = 0.5) -> Trajectory:
        """Return a collision-free trajectory; raises CollisionError."""
        ...

    def plan_through(self, q_start: Array, tcp_poses: Sequence[Pose], *, speed: float = 0.5) -> Trajectory:
        """Return straight TCP lines through poses, without a stop; raises UnreachableError or CollisionError."""
        ...

    def plan_line(self, q_start: Array, tcp_pose: Pose, *, speed: float = 0.5) -> Trajectory:
        """Return a straight TCP line, checked all along; raises UnreachableError or CollisionError."""
        ...


@runtime_checkable
class SkillContext(Protocol):
    """All that a skill may use."""

    @property
    def sim(self) -> Driver: ...
    @property
    def perception(self) -> Perception: ...
    @property
    def grasp(self) -> GraspPlanner: ...
    @property
    def motion(self) -> MotionPlanner: ...
    @property
    def what_if(self) -> bool: ...
    @property
    def listeners(self) -> list[Callable[[str], None]]:
        """Called with each phase that begins."""
        ...

    def look(self) -> ObservedScene:
        """Return what perception sees now."""
        ...

    def permit(self, call: SkillCall) -> None:
        """Check a call against the limits before anything moves; raises LimitError."""
        ...

    def planning(self, seen: ObservedScene) -> PlanningScene:
        """Return what to plan among where things are believed to be as `seen`."""
        ...

    def repairs_for(self, failure: Failure) -> tuple[Repair, ...]:
        """Return what would do in place of a failed call, tried on a simulation of what is believed."""
        ...

    def advice_for(self, error: SkillError) -> str:
        """Return what is wrong with the robot's own sidecar, to be put behind a failure's message; often nothing."""
        ...

    def enter(self, phase: str) -> None:
        """Tell listeners which phase begins."""
        ...

    def announce(self, intent: Intent) -> None:
        """Tell listeners what is about to be done; costs nothing when there are none."""
        ...


# Where a skill is called: in a world of this process, if nothing else is said.
Ctx = TypeVar("Ctx", contravariant=True, default=SkillContext)


@runtime_checkable
class Skill(Protocol[Ctx]):
    """One verb. `run` takes keyword arguments; its signature is its schema."""

    @property
    def name(self) -> str: ...

    @property
    def description(self) -> str: ...
    @property
    def schema(self) -> Mapping[str, Any]:
        """JSON schema of the arguments."""
        ...

    def check(self, arguments: Mapping[str, Any]) -> Mapping[str, Any]:
        """Return the arguments converted to their types; raises InvalidArgumentError."""
        ...

    def __call__(self, ctx: Ctx, arguments: Mapping[str, Any]) -> SkillResult:
        """Check the arguments and run; raises SkillError."""
        ...


class Attempt(Protocol):
    """A plan that ended early."""

    @property
    def completed(self) -> Sequence[SkillCall]: ...
    @property
    def failed(self) -> SkillCall: ...
    @property
    def remaining(self) -> Sequence[SkillCall]:
        """The plan's calls after the failed one, which were not begun."""
        ...

    @property
    def error(self) -> SkillError: ...


@runtime_checkable
class Planner(Protocol):
    """From a sentence to skill calls; a PlannerError where there is no answer."""

    def plan(self, prompt: str, scene: ObservedScene, history: Sequence[Attempt] = ()) -> Plan | Refusal: ...
