"""What opens a world: the options that `run`, `plan`, `look`, `repl`, `viewer`, `sim`, `mcp`, `agent` and the bench share, as one value."""

from __future__ import annotations

import inspect
from collections.abc import Callable, Collection, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, fields
from typing import TYPE_CHECKING, Any, TypeVar, get_type_hints

from robosandbox.commands.connecting import Connect, RobotId, ZenohConfig
from robosandbox.commands.options import (
    BaseUrl,
    CalibrationFile,
    Camera,
    Cassette,
    DriverName,
    GraspName,
    MaxReplans,
    Model,
    MotionName,
    NoCache,
    PerceptionName,
    PlannerName,
    RobotName,
    Seed,
    SensorName,
    TaskName,
    TimeLimit,
    WhatIf,
)
from robosandbox.commands.packages import PackagePath
from robosandbox.errors import InputError

if TYPE_CHECKING:
    from robosandbox.service.client import Client
    from robosandbox.service.client.workcell import RemoteSession
    from robosandbox.tasks.session import Session
    from robosandbox.tasks.task import Task

Result = TypeVar("Result")
# What a sim process has of its own, so that no client says it.
OF_THE_WORLD = ("task", "robot", "driver", "perception", "sensor", "calibration", "grasp", "motion", "seed")


@dataclass(frozen=True, slots=True, kw_only=True)
class WorldOptions:
    """What a person says of a world and of who plans in it; each field is a command-line option.

    Attributes:
        task: A bundled task or a YAML file.
        robot: A model file or a bundled robot, in place of the task's.
        driver: An installed driver, with its options behind its name.
        package_path: Folders of ROS packages; the option's callback has put them on the search path.
        no_cache: Whether robots are measured anew; the option's callback has seen to that.
        planner: Name of an installed planner.
        base_url: Where the planner's or the perception's model is served.
        model: The model's name there.
        cassette: Where exchanges with the model are kept.
        time_limit: Seconds that a model may take for a prompt.
        camera: Whose picture the planner is sent.
        perception: Name of an installed perception.
        sensor: What the cameras are like.
        calibration: A file that says where the cameras are.
        grasp: Name of an installed grasp planner.
        motion: Name of an installed motion planner.
        seed: The layout.
        max_replans: How often a failure may be answered with a new plan.
        what_if: Whether skills may try repairs on copies of the world.
    """

    task: TaskName = None
    robot: RobotName = None
    driver: DriverName = "mujoco"
    package_path: PackagePath = None
    no_cache: NoCache = False
    planner: PlannerName = "stub"
    base_url: BaseUrl = None
    model: Model = None
    cassette: Cassette = None
    time_limit: TimeLimit = None
    camera: Camera = None
    perception: PerceptionName = "ground_truth"
    sensor: SensorName = "ideal"
    calibration: CalibrationFile = None
    grasp: GraspName = "analytic"
    motion: MotionName = "dls"
    seed: Seed = 0
    max_replans: MaxReplans = 3
    what_if: WhatIf = True

    @property
    def planner_options(self) -> dict[str, Any]:
        """What the planner takes besides the skills; None counts as not given."""
        return {name: getattr(self, name) for name in ("base_url", "model", "cassette", "time_limit")}

    def check_remote(self) -> None:
        """Refuse what only the owner of a world can say.

        Raises:
            InputError: It was said; the message names the option.
        """
        for field in fields(self):
            if field.name in OF_THE_WORLD and getattr(self, field.name) != field.default:
                raise InputError(
                    f"--{field.name}: a sim process has its own; give it to `robo-sandbox sim`, or leave --connect out"
                )

    def open(
        self, task: Task | None = None, *, render_size: tuple[int, int] = (240, 320), dialogue: bool = False
    ) -> Session:
        """Open the world in this process.

        Args:
            task: A task that is loaded already, in place of the named one.
            render_size: (height, width) of camera pictures, pixels.
            dialogue: Whether prompts may refer to those before them.

        Raises:
            InputError: A name, file or value is wrong.
        """
        from robosandbox.tasks.session import open_session

        return open_session(
            task or self.task,
            robot=self.robot,
            driver=self.driver,
            planner=self.planner,
            planner_options=self.planner_options,
            camera=self.camera,
            dialogue=dialogue,
            perception=self.perception,
            perception_options={"calibration": self.calibration},
            grasp=self.grasp,
            motion=self.motion,
            sensor=self.sensor,
            seed=self.seed,
            max_replans=self.max_replans,
            what_if=self.what_if,
            render_size=render_size,
        )

    def open_to_look(self) -> Session:
        """Open the world to look at: the model that is named is the perception's, and nothing is planned.

        Raises:
            InputError: A name, file or value is wrong.
        """
        from robosandbox.tasks.session import open_session

        options = {name: getattr(self, name) for name in ("calibration", "model", "base_url", "cassette")}
        return open_session(
            self.task,
            robot=self.robot,
            driver=self.driver,
            perception=self.perception,
            perception_options=options,
            sensor=self.sensor,
            seed=self.seed,
        )


@dataclass(frozen=True, slots=True, kw_only=True)
class Connection:
    """Whose sim process a command works in.

    Attributes:
        connect: Zenoh endpoints.
        robot_id: Which robot, where there are several.
        zenoh_config: A Zenoh configuration with credentials.
    """

    connect: Connect = None
    robot_id: RobotId = None
    zenoh_config: ZenohConfig = None

    def __bool__(self) -> bool:
        return bool(self.connect or self.robot_id or self.zenoh_config)

    @contextmanager
    def client(self, **options: Any) -> Iterator[Client]:
        """Connect; `options` are those of `agent.client.connect`.

        Raises:
            InputError: An endpoint or file is wrong.
            ServiceUnavailableError: No sim is there.
        """
        from robosandbox.service.client import connect

        with connect(*(self.connect or ()), zenoh_config=self.zenoh_config, **options) as client:
            yield client

    @contextmanager
    def session(self, world: WorldOptions) -> Iterator[RemoteSession]:
        """Connect and put the agent that the options describe before the robot.

        Raises:
            InputError: An endpoint, id or file is wrong.
            ServiceUnavailableError: No sim is there.
        """
        with self.client() as client:
            yield self.before(client, world)

    def before(self, client: Client, world: WorldOptions, *, dialogue: bool = False) -> RemoteSession:
        """Return an agent before the robot of a client that is connected."""
        from robosandbox.service.client.workcell import RemoteSession

        return RemoteSession(
            client.robot(self.robot_id),
            planner=world.planner,
            planner_options=world.planner_options,
            camera=world.camera,
            dialogue=dialogue,
            max_replans=world.max_replans,
        )


def takes_world(
    *, without: Collection[str] = (), **defaults: Any
) -> Callable[[Callable[..., Result]], Callable[..., Result]]:
    """Let a command take `WorldOptions` as `world`, and a `Connection` where it has such a parameter, option by option.

    Args:
        without: Fields that are no options of this command; they keep their defaults.
        defaults: Other defaults than the fields' own.
    """

    def expand(command: Callable[..., Result]) -> Callable[..., Result]:
        hints = get_type_hints(command, include_extras=True)
        groups = {name: hint for name, hint in hints.items() if hint in (WorldOptions, Connection)}
        taken = {name: _parameters(group, without, defaults) for name, group in groups.items()}
        parameters: list[inspect.Parameter] = []
        for name, own in inspect.signature(command).parameters.items():
            parameters += taken.get(name) or [own.replace(annotation=hints[name], kind=inspect.Parameter.KEYWORD_ONLY)]

        def called(**given: Any) -> Result:
            for name, group in groups.items():
                values = {item.name: given.pop(item.name, item.default) for item in taken[name]}
                given[name] = group(**values)
            return command(**given)

        called.__name__, called.__doc__, called.__module__ = command.__name__, command.__doc__, command.__module__
        called.__signature__ = inspect.Signature(parameters)  # type: ignore[attr-defined]
        called.__annotations__ = {item.name: item.annotation for item in parameters}
        return called

    return expand


def _parameters(group: type, without: Collection[str], defaults: dict[str, Any]) -> list[inspect.Parameter]:
    hints = get_type_hints(group, include_extras=True)
    return [
        inspect.Parameter(
            field.name,
            inspect.Parameter.KEYWORD_ONLY,
            default=defaults.get(field.name, field.default),
            annotation=hints[field.name],
        )
        for field in fields(group)
        if field.name not in without
    ]
