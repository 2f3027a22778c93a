"""The viewer: one world, one server, any number of browsers."""

from __future__ import annotations

import threading

import mujoco
import numpy as np
import viser

from robosandbox.apps.viewer.control import Control
from robosandbox.apps.viewer.dragging import Dragging
from robosandbox.apps.viewer.framing import FOV, Window, first_view
from robosandbox.apps.viewer.layers.contacts import ContactForces
from robosandbox.apps.viewer.layers.evidence import FailureEvidence
from robosandbox.apps.viewer.layers.grasps import GraspCandidates
from robosandbox.apps.viewer.layers.layer import Layer
from robosandbox.apps.viewer.layers.path import PlannedPath
from robosandbox.apps.viewer.layers.shapes import CollisionShapes
from robosandbox.apps.viewer.layers.tool import BaseAndReach, HomePreview, TcpFrame
from robosandbox.apps.viewer.layers.trail import TcpTrail
from robosandbox.apps.viewer.news import Loaded, News, Went
from robosandbox.apps.viewer.orders import taker
from robosandbox.apps.viewer.panels.answers import AnswersPanel
from robosandbox.apps.viewer.panels.cameras import CamerasPanel
from robosandbox.apps.viewer.panels.jog import JogPanel
from robosandbox.apps.viewer.panels.layers import LayersPanel
from robosandbox.apps.viewer.panels.prompt import PromptPanel
from robosandbox.apps.viewer.panels.readings import ReadingsPanel
from robosandbox.apps.viewer.panels.repairs import RepairsPanel
from robosandbox.apps.viewer.panels.replay import ReplayPanel
from robosandbox.apps.viewer.panels.sidecar import SidecarPanel
from robosandbox.apps.viewer.panels.strip import StripPanel
from robosandbox.apps.viewer.panels.world import WorldPanel
from robosandbox.apps.viewer.replay import RecordedFrames
from robosandbox.apps.viewer.scene import BodyScene
from robosandbox.apps.viewer.server import HOST, open_server
from robosandbox.apps.viewer.source import Blueprint, Frame, WorldSource
from robosandbox.apps.viewer.stream import FrameStream
from robosandbox.sim.saved_state import put_state

_LAYERS: tuple[type[Layer], ...] = (
    TcpTrail,
    PlannedPath,
    GraspCandidates,
    FailureEvidence,
    ContactForces,
    CollisionShapes,
    TcpFrame,
    BaseAndReach,
    HomePreview,
)
# What most windows leave to the scene, and more: between the panel and the strip it is wider still.
_USUAL = Window(aspect=1.3)
# Distance in metres below which two eyes see the same view. Chosen: a millimetre, which no hand holds a mouse to.
_SAME_VIEW = 1e-3
# Below this width in pixels viser shows its panel over the scene's lower part, at most this share of the height.
_PHONE_PX, _SHEET = 577, 0.6


class Viewer:
    """Serves a world to browsers on this machine.

    Args:
        source: The world.
        port: 0 takes any free one.
        playback: A recorded episode of the source's task, to be shown state by state.

    Attributes:
        source: The world.
        control: Does what people click.
        server: What browsers talk to.
        stream: Sends frames.

    Raises:
        InputError: The port is taken.
    """

    def __init__(self, source: WorldSource, port: int, playback: RecordedFrames | None = None) -> None:
        self.source = source
        self.control: Control = Control(source)
        self.server = open_server(port, taker(self.control))
        self._lock = threading.RLock()
        self._layers = [layer(self.server) for layer in _LAYERS]
        self._dragging = Dragging(source, self.control)
        self.stream: FrameStream = FrameStream(self._draw, lambda: bool(self.server.get_clients()))
        self._replay: ReplayPanel | None = None
        self._lay_out(playback)
        self._adopt(source.blueprint)
        self._aim()
        self.control.listeners += [self._hear, *(panel.hear for panel in self._hearing)]
        self.server.on_client_connect(self._welcome)

    @property
    def url(self) -> str:
        """URL for browsers."""
        return f"http://{HOST}:{self.server.get_port()}"

    def start(self) -> None:
        """Begin to serve."""
        self.stream.start()
        self.source.host.start()
        self.source.start(self.stream.put, self.control.changed_elsewhere)
        if self._replay is not None:
            self._replay.rewind()

    def stop(self) -> None:
        """Stop the arm and the server."""
        if self._replay is not None:
            self._replay.stop()
        self.source.stop()
        self.source.host.close()
        self.stream.stop()
        self.server.stop()

    def _lay_out(self, playback: RecordedFrames | None) -> None:
        server, control, source = self.server, self.control, self.source
        prompt = PromptPanel(server, control)
        self._answers = AnswersPanel(server, control)
        self._strip = StripPanel(server)
        repairs = RepairsPanel(server, control)
        tabs = server.gui.add_tab_group()
        if playback is not None:
            with tabs.add_tab("Replay"):
                self._replay = ReplayPanel(server, playback, self.stream.put)
        with tabs.add_tab("Robot"):
            self._readings = ReadingsPanel(server)
        with tabs.add_tab("Show"):
            LayersPanel(server, self._layers, self._switch)
        with tabs.add_tab("Camera"):
            self._cameras = CamerasPanel(server, source)
        with tabs.add_tab("Hand"):
            JogPanel(server, source, control)
        with tabs.add_tab("Sidecar"):
            self._sidecar = SidecarPanel(server, source, control)
        with tabs.add_tab("World"):
            world = WorldPanel(server, source, control)
        replay = (self._replay,) if self._replay is not None else ()
        self._hearing = (prompt, self._answers, self._strip, repairs, self._cameras, self._sidecar, world, *replay)

    def _hear(self, news: News) -> None:
        """Hand news to the layers, over another world if there is one."""
        with self._lock:
            found = self.source.blueprint
            if isinstance(news, Loaded | Went) and not found.looks_like(self._blueprint):
                self._replace(found)
                self._aim()
            for layer in self._layers:
                layer.hear(news)

    def _switch(self, layer: Layer, shown: bool) -> None:
        with self._lock:
            layer.switch(shown)
        self.source.refresh()

    def _adopt(self, blueprint: Blueprint) -> None:
        self._blueprint = blueprint
        self._data = mujoco.MjData(blueprint.model)
        self._body_scene = BodyScene(self.server, blueprint.model, blueprint.names)
        for layer in self._layers:
            layer.adopt(blueprint, self._body_scene)
        self._dragging.adopt(blueprint, self._body_scene)
        self._answers.adopt(blueprint, self._body_scene)
        self._sidecar.adopt(blueprint, self._body_scene)
        self._strip.adopt(blueprint)

    def _replace(self, blueprint: Blueprint) -> None:
        with self.server.atomic():
            self._body_scene.remove()
            self._adopt(blueprint)

    def _aim(self) -> None:
        """Have browsers begin, and those that are there go on, with the first view of the world."""
        usual = first_view(self._blueprint, _USUAL)
        camera = self.server.initial_camera
        camera.position, camera.look_at, camera.fov = usual.position, usual.look_at, FOV
        for client in self.server.get_clients().values():
            self._turn(client)

    def _welcome(self, client: viser.ClientHandle) -> None:
        """Show a browser whose window is too narrow for the usual first view one that fits."""
        if client.camera.aspect < _USUAL.aspect:
            with self._lock:
                self._turn(client)
        # A browser may come to the usual view after it was turned: with its first picture, and when its view is reset.
        client.camera.on_update(lambda _: self._keep_fitting(client))
        self.stream.wake()

    def _keep_fitting(self, client: viser.ClientHandle) -> None:
        """Turn a browser that stands at the usual first view and whose window is too narrow for it."""
        camera, usual = client.camera, self.server.initial_camera
        if camera.aspect < _USUAL.aspect and np.allclose(camera.position, usual.position, atol=_SAME_VIEW):
            with self._lock:
                self._turn(client)

    def _turn(self, client: viser.ClientHandle) -> None:
        camera = client.camera
        phone = camera.image_width < _PHONE_PX and camera.aspect < 1.0
        view = first_view(self._blueprint, Window(aspect=camera.aspect, bottom=_SHEET if phone else 0.0))
        with client.atomic():
            camera.position, camera.look_at = view.position, view.look_at

    def _draw(self, frame: Frame) -> None:
        with self._lock:
            found = self.source.blueprint
            drawn = self._blueprint
            if (frame.model is not drawn.model or found.arm != drawn.arm) and frame.model is found.model:
                # Other things are believed now than before, or calls are made with another arm.
                self._replace(found)
            if frame.model is self._blueprint.model:
                self._show(frame)

    def _show(self, frame: Frame) -> None:
        model, data = frame.model, self._data
        shown = [layer for layer in self._layers if layer.shown]
        if frame.state is None:
            data.qpos[:] = frame.qpos
        else:
            put_state(model, data, frame.state)
        if frame.state is not None and any(layer.needs_forces for layer in shown):
            mujoco.mj_forward(model, data)
        else:
            mujoco.mj_kinematics(model, data)
        with self.server.atomic():
            self._body_scene.show(data)
            for layer in shown:
                layer.draw(frame, data)
        self._readings.draw(frame, self._blueprint)
        self._strip.draw(frame, self._blueprint)
        self._cameras.draw(frame)
