"""The robot's sidecar: home, TCP and base on sliders, seen on a transparent robot, and written back."""

from __future__ import annotations

import math
from pathlib import Path

import viser

from robosandbox.apps.viewer import html
from robosandbox.apps.viewer.control import Control
from robosandbox.apps.viewer.layers.preview import SidecarPreview
from robosandbox.apps.viewer.news import Began, Complaint, News
from robosandbox.apps.viewer.scene import BodyScene
from robosandbox.apps.viewer.sidecar_file import Changes, SidecarFile
from robosandbox.apps.viewer.source import Blueprint, WorldSource
from robosandbox.apps.viewer.theme import assign
from robosandbox.errors import InputError
from robosandbox.types import Pose, Vec3

_BASE_REACH = 1.0
_TCP_REACH = 300.0  # Millimetres that the TCP's sliders go to either side. Chosen longer than any gripper.
_AXES = "xyz"


class SidecarPanel:
    """Edits the fields that decide where the robot works; what they would do is drawn before they are written.

    Args:
        server: Where.
        source: Whose robot.
        control: Loads the robot again.
    """

    def __init__(self, server: viser.ViserServer, source: WorldSource, control: Control) -> None:
        self._gui = server.gui
        self._source = source
        self._control = control
        self._preview = SidecarPreview(server)
        self._file: SidecarFile | None = None
        self._made: list[viser.GuiSliderHandle[float] | viser.GuiHtmlHandle] = []
        self._about = server.gui.add_html("")
        self._fields = server.gui.add_folder(None)
        self._target = server.gui.add_text("Save to", "", hint="Ends in .robosandbox.yaml")
        write = server.gui.add_button("Save and reload", icon=viser.Icon.DEVICE_FLOPPY)
        undo = server.gui.add_button("Discard changes", icon=viser.Icon.ARROW_BACK_UP)
        write.on_click(lambda _: self._write())
        undo.on_click(lambda _: self._read())

    def adopt(self, blueprint: Blueprint, body_scene: BodyScene) -> None:
        """Edit another robot."""
        self._preview.adopt(blueprint, body_scene)
        self._robot = blueprint.robot
        self._hinges = [blueprint.turns(index) for index in range(len(self._robot.joints))]
        self._scene = blueprint.robot_scene
        self._read()

    def hear(self, news: News) -> None:
        """Take news."""
        if isinstance(news, Began):
            self._preview.clear()

    def _read(self) -> None:
        """Show the fields as the file has them."""
        self._preview.clear()
        for child in self._made:
            child.remove()
        self._made = []
        try:
            self._file = SidecarFile.of(self._scene)
        except InputError as error:
            self._file = None
            self._about.content = html.block(html.line(str(error), "red"))
            return
        sidecar = self._file.sidecar
        inject = sidecar.ee_site.inject
        x, y, z, w = sidecar.base_pose.quat_xyzw
        upright = abs(x) < 1e-6 and abs(y) < 1e-6
        self._now = Changes(
            home_qpos=sidecar.arm.home_qpos,
            tcp_xyz=inject.xyz if inject else None,
            base_xyz=sidecar.base_pose.xyz,
            base_yaw=Pose(xyz=sidecar.base_pose.xyz, quat_xyzw=(x, y, z, w)).yaw if upright else None,
        )
        source = str(self._file.source) if self._file.source else "inferred from the model, or shipped for it"
        self._about.content = html.block(html.rows([("model", self._file.model.name), ("sidecar", source)]))
        assign(self._target, str(self._file.target))
        self._make_fields(inject.attach_body if inject else None)

    def _make_fields(self, tcp_body: str | None) -> None:
        now, robot = self._now, self._robot
        with self._fields:
            self._head("Home")
            self._home = []
            for index, name in enumerate(robot.joints):
                scale, unit = (math.degrees(1.0), "°") if self._hinges[index] else (1000.0, "mm")
                low, high = float(robot.lower[index]), float(robot.upper[index])
                low, high = max(low, -2.0 * math.pi), min(high, 2.0 * math.pi)
                self._home.append(
                    self._slider(f"{name}, {unit}", scale * low, scale * high, scale * now.home_qpos[index])
                )
            self._tcp = []
            if now.tcp_xyz is not None:
                self._head(f"TCP on {tcp_body}")
                for axis, value in zip(_AXES, now.tcp_xyz, strict=True):
                    centre = 1000.0 * value
                    self._tcp.append(self._slider(f"TCP {axis}, mm", centre - _TCP_REACH, centre + _TCP_REACH, centre))
            self._head("Base")
            self._base = [
                self._slider(f"base {axis}, m", value - _BASE_REACH, value + _BASE_REACH, value, 0.001)
                for axis, value in zip(_AXES, now.base_xyz, strict=True)
            ]
            self._yaw = None
            if now.base_yaw is not None:
                self._yaw = self._slider("base yaw, °", -180.0, 180.0, math.degrees(now.base_yaw))

    def _head(self, text: str) -> None:
        self._made.append(self._gui.add_html(html.block(html.heading(text))))

    def _slider(
        self, name: str, low: float, high: float, value: float, step: float = 0.1
    ) -> viser.GuiSliderHandle[float]:
        # Whole steps to read, and room for the value itself.
        low, high = math.floor(low * 10.0) / 10.0, math.ceil(high * 10.0) / 10.0
        shown = min(max(round(round(value / step) * step, 4) + 0.0, low), high)
        slider = self._gui.add_slider(name, min=low, max=high, step=step, initial_value=shown)
        slider.on_update(lambda _: self._preview.show(self._changes(), self._now))
        self._made.append(slider)
        return slider

    def _changes(self) -> Changes:
        """Return what the sliders say; a slider that was not moved says what the file says."""
        now = self._now
        scales = [math.radians(1.0) if hinge else 0.001 for hinge in self._hinges]
        home = zip(now.home_qpos, self._home, scales, strict=True)
        return Changes(
            home_qpos=tuple(_kept(was, slider, scale) for was, slider, scale in home),
            tcp_xyz=None if now.tcp_xyz is None else _three(now.tcp_xyz, self._tcp, 0.001),
            base_xyz=_three(now.base_xyz, self._base, 1.0),
            base_yaw=None
            if self._yaw is None or now.base_yaw is None
            else _kept(now.base_yaw, self._yaw, math.radians(1.0)),
        )

    def _write(self) -> None:
        if self._file is None:
            return
        file, changes, target = self._file, self._changes(), Path(self._target.value).expanduser()
        try:
            file.write(changes, target)
        except InputError as error:
            self._control.tell(Complaint(str(error)))
            return
        task = self._source.host.cell.task
        if target.resolve() != (file.source or file.beside):
            task = task.model_copy(
                update={
                    "scene": task.scene.model_copy(
                        update={"robot_config": target.resolve(), "robot_arm": None, "robot_gripper": None}
                    )
                }
            )
        self._control.load(task, None)


def _kept(was: float, slider: viser.GuiSliderHandle[float], unit: float) -> float:
    """Return what a slider says, times `unit`; the old value where the slider's step hides the difference."""
    value = slider.value * unit
    return was if abs(value - was) <= 0.51 * slider.step * unit else value


def _three(was: Vec3, sliders: list[viser.GuiSliderHandle[float]], unit: float) -> Vec3:
    x, y, z = (_kept(old, slider, unit) for old, slider in zip(was, sliders, strict=True))
    return x, y, z
