"""The face of a running workcell to ROS 2: a node with its state, pictures and things, actions that it carries out, services."""

from __future__ import annotations

import json
import tempfile
import threading
import time
import uuid
from collections.abc import Callable, Mapping
from concurrent.futures import Future, wait
from pathlib import Path
from typing import Any

from robosandbox.errors import InputError, InvalidArgumentError, RoboSandboxError
from robosandbox.motion.planning_scene import PlanningScenes
from robosandbox.tasks.loader import find_task
from robosandbox.types import ArmState, ObservedScene, SkillCall, SkillResult
from robosandbox.workcell.host import Activity, WorkcellHost
from robosandbox.workcell.loop import Loop
from robosandbox.workcell.orders import ORDERS, BoundOrder, OrderResult, bind_order
from robosandbox.workcell.pictures import Kind
from robosandbox.workcell.ros2 import messages
from robosandbox.workcell.ros2.description import WORLD, RobotDescription
from robosandbox.workcell.ros2.graph import PICTURES, Graph, Publisher, Qos
from robosandbox.workcell.studio import Shot
from robosandbox.workcell.zenoh.messages import MAX_TIMEOUT, STATE_HZ, Picture
from robosandbox.workcell.zenoh.server.readings import Readings
from robosandbox.world.operators import BoundCall, bind

# What `perform` leaves to an action or a service of its own.
_ELSEWHERE = {"run": "the action say", "judge": "the service judge"}
# Looks a second while somebody listens to things or markers, as at the other faces.
_THINGS_HZ = 5.0
# Seconds between two looks whether a goal's client wants it to end.
_CANCEL_SECONDS = 0.02


class WorkcellNode:
    """Serves a running workcell under a node's name.

    `/joint_states`, `/tf` and `/robot_description` are where ROS has them. A machine on the wall's clock may be in the graph itself:
    its joints and description are told of below the node's name, where no driver takes them for the machine's own, and of the
    transforms only those of cameras.

    Args:
        host: Owns the workcell, which is of this process; it has been started and stays the caller's to close.
        graph: That it is a node of; closed with it.
        world: Name of the frame that is this package's world; a simulated robot's description begins at `world`.

    Raises:
        InputError: The robot has no description, or the world of a simulated one is to have another name.
    """

    def __init__(self, host: WorkcellHost, graph: Graph, *, world: str = WORLD) -> None:
        self._host = host
        self._readings = Readings(host, boot_id="", with_truth=False)
        self._folder = tempfile.TemporaryDirectory()
        self._world = world
        self._is_machine = host.embedded.driver.capabilities.clock == "wall"
        place, frames = ("~/", "robosandbox/") if self._is_machine else ("/", "")
        if world != WORLD and not self._is_machine:
            raise InputError(f"--world-frame {world}: the description of a simulated robot begins at the frame {WORLD}")
        self._graph, self._messages = graph, messages.Messages(graph.kind, world=world, frames=frames)
        self._joints = graph.publisher("sensor_msgs/msg/JointState", f"{place}joint_states")
        self._transforms = graph.publisher("tf2_msgs/msg/TFMessage", "/tf", Qos(depth=100))
        self._description = graph.publisher(
            "std_msgs/msg/String", f"{place}robot_description", Qos(depth=1, latched=True)
        )
        # The reading that was asked for, and the joints as they were told last.
        self._asked: Future[tuple[Mapping[str, ArmState], float]] | None = None
        self._told: Any = None
        self._things = graph.publisher("robosandbox_msgs/msg/Things", "~/things")
        self._markers = graph.publisher("visualization_msgs/msg/MarkerArray", "~/markers")
        self._cameras: dict[str, dict[str, Publisher]] = {}
        self._streams: set[Shot] = set()
        graph.serve_action("robosandbox_msgs/action/Say", "~/say", self._say)
        graph.serve_action("robosandbox_msgs/action/Perform", "~/perform", self._perform)
        graph.serve("robosandbox_msgs/srv/Look", "~/look", self._answering(self._look))
        for kind, service, answer in (
            ("robosandbox_msgs/srv/Reset", "reset", lambda asked: self._change(self._host.reset(asked.seed))),
            ("robosandbox_msgs/srv/Load", "load", lambda asked: self._change(self._host.load(find_task(asked.task)))),
            ("std_srvs/srv/Trigger", "judge", lambda asked: self._judge()),
            (
                "std_srvs/srv/Trigger",
                "stop",
                lambda asked: f"stopped {what}" if (what := self._host.stop()) else "nothing was done",
            ),
        ):
            graph.serve(kind, f"~/{service}", self._answering(answer))
        self._task: Any = None
        self._describe()
        self._loops = [
            Loop("ros2 state", self._tell_state, hz=STATE_HZ),
            Loop("ros2 things", self._tell_things, hz=_THINGS_HZ),
        ]

    def start(self) -> None:
        """Begin to serve."""
        self._graph.start()
        for loop in self._loops:
            loop.start()

    def close(self) -> None:
        """Leave the graph; what is under way is stopped."""
        for loop in self._loops:
            loop.stop()
        self._host.stop_all()
        for shot in self._streams:
            self._host.studio.stream(shot, None)
        self._graph.close()
        self._folder.cleanup()

    # What is told.

    def _describe(self) -> None:
        """Take over the loaded task: its robots, and its cameras."""
        cell = self._host.embedded
        if cell.task is self._task:
            return
        self._task = cell.task
        nothing = ObservedScene(time=0.0, objects=(), table_height=cell.task.scene.table_height, base_xy=(0.0, 0.0))
        folder = Path(self._folder.name) / uuid.uuid4().hex
        folder.mkdir()
        self._robots = RobotDescription(PlanningScenes(cell.task.scene).world_of(nothing), folder)
        self._description.publish(self._graph.kind("std_msgs/msg/String")(data=self._robots.urdf))
        self._mounts = dict(cell.driver.capabilities.cameras)
        for name in self._mounts.keys() - self._cameras.keys():
            topics = {
                "rgb": ("Image", "image_raw"),
                "rgb info": ("CameraInfo", "camera_info"),
                "depth": ("Image", "depth/image_raw"),
                "depth info": ("CameraInfo", "depth/camera_info"),
            }
            self._cameras[name] = {
                key: self._graph.publisher(f"sensor_msgs/msg/{kind}", f"~/{name}/{topic}", PICTURES)
                for key, (kind, topic) in topics.items()
            }

    def _tell_state(self) -> float:
        """Publish the joints, and where frames are; while the world's thread is busy the last joints, which keep their stamp."""
        if self._asked is None:
            self._asked = self._host.reading(self._read)
        if not wait([self._asked], 1.0 / STATE_HZ).done:
            if self._told is not None:
                self._joints.publish(self._told)
            return 0.0
        asked, self._asked = self._asked, None
        arms, stamp = asked.result()
        self._describe()
        if arms.keys() != self._robots.tools.keys():
            return 0.0
        names, values, speeds = self._robots.joints(arms)
        joints = self._graph.kind("sensor_msgs/msg/JointState")
        self._told = joints(header=self._messages.header(stamp), name=names, position=values, velocity=speeds)
        self._joints.publish(self._told)
        frames = []
        if not self._is_machine:
            frames = [self._messages.transform(*frame, stamp) for frame in self._robots.frames(arms)]
        for camera, spec in self._mounts.items():
            parent, pose = self._world, spec.pose
            if spec.arm is not None and self._is_machine:
                pose = arms[spec.arm].tcp_pose @ pose
            elif spec.arm is not None:
                parent = self._robots.tools[spec.arm]
            frames.append(self._messages.mounted(parent, camera, pose, stamp))
        if frames:
            self._transforms.publish(self._graph.kind("tf2_msgs/msg/TFMessage")(transforms=frames))
        return 0.0

    def _read(self) -> tuple[Mapping[str, ArmState], float]:
        """Return the arms' states, and of when the oldest is, seconds since 1970; in the world's thread."""
        arms = self._host.cell.state().arms
        age = self._host.embedded.driver.time - min(arm.time for arm in arms.values())
        return arms, time.time() - max(0.0, age)

    def _tell_things(self) -> float:
        """Publish what is seen, and have pictures drawn, while somebody listens."""
        self._stream()
        if self._things.get_subscription_count() or self._markers.get_subscription_count():
            scene = self._host.reading(self._readings.objects).result().scene
            now = time.time()
            self._things.publish(self._messages.things(scene, now))
            self._markers.publish(self._messages.markers(scene, now))
        return 0.0

    def _stream(self) -> None:
        """Have those cameras drawn that somebody listens to, and no other."""
        kinds: tuple[Kind, ...] = ("rgb", "depth")
        wanted = {
            Shot(camera, kind, "raw")
            for camera in self._mounts
            for kind in kinds
            if any(self._cameras[camera][key].get_subscription_count() for key in (kind, f"{kind} info"))
        }
        for shot in self._streams - wanted:
            self._host.studio.stream(shot, None)
        for shot in wanted - self._streams:
            self._host.studio.stream(shot, self._deliver(self._cameras[shot.camera], shot.kind))
        self._streams = wanted

    def _deliver(self, publishers: dict[str, Publisher], kind: Kind) -> Callable[[bytes, Picture], None]:
        def deliver(data: bytes, picture: Picture) -> None:
            publishers[kind].publish(self._messages.image(data, picture, kind))
            publishers[f"{kind} info"].publish(self._messages.camera_info(picture))

        return deliver

    # What is done.

    def _say(self, goal: Any) -> Any:
        return self._carried_out(goal, "Say", lambda: bind_order("run", {"prompt": goal.request.sentence}))

    def _perform(self, goal: Any) -> Any:
        return self._carried_out(goal, "Perform", lambda: self._bound(goal.request.name, goal.request.arguments))

    def _bound(self, name: str, text: str) -> BoundCall | BoundOrder:
        """Return a call or an order with its arguments checked.

        Raises:
            SkillError: There is none of that name, or it takes others.
        """
        if name in _ELSEWHERE:
            raise InvalidArgumentError(f"{name}: that is {_ELSEWHERE[name]} here")
        try:
            arguments = json.loads(text or "{}")
        except ValueError as error:
            raise InvalidArgumentError(f"arguments: {error}; give a JSON object") from None
        if not isinstance(arguments, dict):
            raise InvalidArgumentError(f"arguments: {text[:60]} is no JSON object")
        if name in ORDERS:
            return bind_order(name, arguments)
        return bind(SkillCall(skill=name, arguments=arguments), self._host.cell.calls)

    def _carried_out(self, goal: Any, name: str, bound: Callable[[], BoundCall | BoundOrder]) -> Any:
        """Carry out a goal, telling its client what happens, and stopping where that wants it to end."""
        came: SkillResult | OrderResult | RoboSandboxError
        kind = self._graph.kind(f"robosandbox_msgs/action/{name}")

        def tell(event: object) -> None:
            if text := messages.said(event):
                goal.publish_feedback(kind.Feedback(said=text))

        try:
            call, timeout = bound(), goal.request.timeout
            if not 0.0 <= timeout <= MAX_TIMEOUT:
                raise InvalidArgumentError(
                    f"timeout is {timeout:g}; give simulated seconds above 0, {MAX_TIMEOUT:g} at most, or 0 for none"
                )
            activity = Activity[Any](call.name, is_goal=True, goal_id=uuid.uuid4().hex, timeout=timeout or None)
            self._host.claim(activity)
            leave = self._host.events.subscribe(tell)
            try:
                self._host.begin(activity, lambda: self._host.perform(call))
                ended = threading.Event()
                activity.done.add_done_callback(lambda _: ended.set())
                while not ended.wait(_CANCEL_SECONDS):
                    if goal.is_cancel_requested:
                        self._host.stop(activity)
                came = activity.done.result()
            finally:
                leave()
        except RoboSandboxError as error:
            came = error
        result = messages.outcome(kind.Result(), came)
        if result.success:
            goal.succeed()
        elif goal.is_cancel_requested:
            goal.canceled()
        else:
            goal.abort()
        return result

    # What is answered.

    def _answering(self, answer: Callable[[Any], Any]) -> Callable[[Any, Any], Any]:
        """Return what answers a service: what goes wrong is an answer as well."""

        def call(asked: Any, given: Any) -> Any:
            try:
                came = answer(asked)
                given.success, given.message = True, came if isinstance(came, str) else ""
                if hasattr(given, "things"):
                    given.things = came
                elif isinstance(came, OrderResult):
                    given.success, given.message = bool(came.data["success"]), json.dumps(came.data["detail"])
            except RoboSandboxError as error:
                given.success, given.message = False, str(error)
            return given

        return call

    def _look(self, asked: Any) -> Any:
        del asked
        return self._messages.things(self._host.reading(self._readings.objects).result().scene, time.time())

    def _judge(self) -> Any:
        return self._host.carry_out(bind_order("judge", {})).done.result()

    def _change(self, activity: Activity[None]) -> str:
        """Wait for a change of the world, and return which task is loaded."""
        activity.done.result()
        self._describe()
        cell = self._host.cell
        return f"{cell.task.name}, seed {cell.seed}: {cell.task.prompt}"
