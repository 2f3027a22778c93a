"""Options that open a world, as one value: `run`, `plan`, `look`, `repl`, `viewer`, `sim`, `mcp`, `agent` and the bench share them."""

from __future__ import annotations

import inspect
from collections.abc import Callable, Collection, Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import fields, is_dataclass, replace
from typing import TYPE_CHECKING, Any, TypeVar, get_type_hints

from robosandbox.apps.commands.connecting import Connect, Reconnect, RobotId, ZenohConfig
from robosandbox.apps.commands.options import (
    ArmName,
    BaseUrl,
    CalibrationFile,
    Camera,
    Cassette,
    Confirm,
    DriverName,
    GraspName,
    GripperModel,
    MaxReplans,
    Mode,
    Model,
    ModelLimits,
    MotionName,
    NoCache,
    PerceptionName,
    PlannerName,
    RobotBase,
    RobotName,
    SceneFile,
    Seed,
    SensorName,
    SidecarFile,
    StopSwitchPath,
    TaskName,
    TempoName,
    TimeLimit,
    WhatIf,
    read_base,
)
from robosandbox.apps.commands.packages import PackagePath
from robosandbox.errors import InputError
from robosandbox.progress import doing
from robosandbox.values import frozen
from robosandbox.workcell.options import WorkcellOptions

if TYPE_CHECKING:
    from robosandbox.workcell.embedded import EmbeddedWorkcell
    from robosandbox.workcell.zenoh.client import Client
    from robosandbox.workcell.zenoh.client.workcell import RemoteWorkcell

Result = TypeVar("Result")
# What a sim process has of its own, so that no client says it.
OF_THE_WORLD = (
    "task",
    "scene",
    "robot_base",
    "robot",
    "sidecar",
    "arm",
    "gripper",
    "driver",
    "perception",
    "sensor",
    "calibration",
    "grasp",
    "motion",
    "tempo",
    "seed",
    "confirm",
    "stop_switch",
)


# Each option of a command line that says something of a workcell. Most are fields of `WorkcellOptions`; `package_path` and
# `no_cache` are dealt with by their callbacks, the rest goes to the planner or the perception.
_OPTIONS: dict[str, Any] = {
    "task": TaskName,
    "scene": SceneFile,
    "robot_base": RobotBase,
    "robot": RobotName,
    "sidecar": SidecarFile,
    "arm": ArmName,
    "gripper": GripperModel,
    "driver": DriverName,
    "package_path": PackagePath,
    "no_cache": NoCache,
    "planner": PlannerName,
    "base_url": BaseUrl,
    "model": Model,
    "mode": Mode,
    "model_limits": ModelLimits,
    "cassette": Cassette,
    "time_limit": TimeLimit,
    "camera": Camera,
    "perception": PerceptionName,
    "sensor": SensorName,
    "calibration": CalibrationFile,
    "grasp": GraspName,
    "motion": MotionName,
    "tempo": TempoName,
    "seed": Seed,
    "max_replans": MaxReplans,
    "what_if": WhatIf,
    "confirm": Confirm,
    "stop_switch": StopSwitchPath,
}
_OF_THE_PLANNER = ("base_url", "model", "mode", "model_limits", "cassette", "time_limit")
_DEFAULTS: dict[str, Any] = {"no_cache": False, **{field.name: field.default for field in fields(WorkcellOptions)}}


def _options(given: dict[str, Any]) -> WorkcellOptions:
    """Return the options that a command line says."""
    said = {name: value for name, value in given.items() if name in _DEFAULTS and name != "no_cache"}
    if said.get("robot_base") is not None:
        said["robot_base"] = read_base(said["robot_base"])
    return WorkcellOptions(
        planner_options={name: given.get(name) for name in _OF_THE_PLANNER},
        perception_options={"calibration": given.get("calibration")},
        **said,
    )


def open_here(world: WorkcellOptions, **changes: Any) -> EmbeddedWorkcell:
    """Open the world in this process; `changes` are fields that are to be otherwise.

    Raises:
        InputError: A name, file or value is wrong.
    """
    from robosandbox.workcell.session import open_workcell

    return open_workcell(replace(world, **changes))


def check_remote(world: WorkcellOptions) -> None:
    """Refuse what only the owner of a world can say.

    Raises:
        InputError: It was said; the message names the option.
    """
    said = {name: getattr(world, name, None) != _DEFAULTS.get(name) for name in OF_THE_WORLD}
    said["calibration"] = (world.perception_options or {}).get("calibration") is not None
    for name in OF_THE_WORLD:
        if said[name]:
            raise InputError(
                f"--{name.replace('_', '-')}: a sim process has its own; give it to `robo-sandbox sim`, or leave --connect out"
            )


@frozen(kw_only=True)
class Connection:
    """Connection to the sim process that a command works in.

    Attributes:
        connect: Zenoh endpoints.
        robot_id: Which robot, where there are several.
        zenoh_config: A Zenoh configuration with credentials.
        reconnect: Seconds to wait for a sim that went away.
    """

    connect: Connect = None
    robot_id: RobotId = None
    zenoh_config: ZenohConfig = None
    reconnect: Reconnect = 30.0

    def __post_init__(self) -> None:
        """Check the time to wait.

        Raises:
            InputError: It is no time.
        """
        if not 0.0 <= self.reconnect <= 86400.0:
            raise InputError(f"--reconnect: {self.reconnect:g} is not within 0..86400 seconds")

    def __bool__(self) -> bool:
        return bool(self.connect or self.robot_id or self.zenoh_config)

    @contextmanager
    def client(self, **options: Any) -> Iterator[Client]:
        """Connect; `options` are those of `service.client.connect`.

        Raises:
            InputError: An endpoint or file is wrong.
            ServiceUnavailableError: No sim is there.
        """
        from robosandbox.workcell.zenoh.client import connect

        with ExitStack() as opened:
            with doing("connecting"):
                given = {"zenoh_config": self.zenoh_config, "reconnect": self.reconnect, **options}
                client = opened.enter_context(connect(*(self.connect or ()), **given))
            yield client

    @contextmanager
    def workcell(self, world: WorkcellOptions, **options: Any) -> Iterator[RemoteWorkcell]:
        """Connect and put the agent that the options describe before the robot; `options` as for `client`.

        Raises:
            InputError: An endpoint, id or file is wrong.
            ServiceUnavailableError: No sim is there.
        """
        with self.client(**options) as client:
            yield self.before(client, world)

    def before(self, client: Client, world: WorkcellOptions) -> RemoteWorkcell:
        """Return an agent before the robot of a client that is connected."""
        from robosandbox.workcell.zenoh.client.workcell import RemoteWorkcell

        with doing("looking for the robot"):
            return RemoteWorkcell(client.robot(self.robot_id), world)


def takes_world(
    *, without: Collection[str] = (), **defaults: Any
) -> Callable[[Callable[..., Result]], Callable[..., Result]]:
    """Let a command take each parameter that is a dataclass, such as `WorkcellOptions` and `Connection`, option by option.

    Args:
        without: Fields that are no options of this command; they keep their defaults.
        defaults: Other defaults than the fields' own.
    """

    def expand(command: Callable[..., Result]) -> Callable[..., Result]:
        hints = get_type_hints(command, include_extras=True)
        groups = {name: hint for name, hint in hints.items() if isinstance(hint, type) and is_dataclass(hint)}
        taken = {name: _parameters(group, without, defaults) for name, group in groups.items()}
        parameters: list[inspect.Parameter] = []
        for name, own in inspect.signature(command).parameters.items():
            parameters += taken.get(name) or [own.replace(annotation=hints[name], kind=inspect.Parameter.KEYWORD_ONLY)]

        def called(**given: Any) -> Result:
            for name, group in groups.items():
                values = {item.name: given.pop(item.name, item.default) for item in taken[name]}
                given[name] = _options(values) if group is WorkcellOptions else group(**values)
            return command(**given)

        called.__name__, called.__doc__, called.__module__ = command.__name__, command.__doc__, command.__module__
        called.__signature__ = inspect.Signature(parameters)  # type: ignore[attr-defined]
        called.__annotations__ = {item.name: item.annotation for item in parameters}
        return called

    return expand


def _parameters(group: type, without: Collection[str], defaults: dict[str, Any]) -> list[inspect.Parameter]:
    ours = group is WorkcellOptions
    hints = _OPTIONS if ours else get_type_hints(group, include_extras=True)
    usual = _DEFAULTS if ours else {field.name: field.default for field in fields(group)}
    return [
        inspect.Parameter(
            name,
            inspect.Parameter.KEYWORD_ONLY,
            default=defaults.get(name, usual.get(name)),
            annotation=hint,
        )
        for name, hint in hints.items()
        if name not in without
    ]
