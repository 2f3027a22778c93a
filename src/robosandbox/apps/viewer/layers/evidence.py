"""Failures, drawn where they happened: what could not be reached and what could, what touched what, what did not fit."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from types import MappingProxyType
from typing import Literal

import mujoco
import numpy as np

from robosandbox.agent.episode import SkillFailed, SkillStarted
from robosandbox.apps.viewer.layers.layer import Layer
from robosandbox.apps.viewer.news import Began, Came, Loaded, News, Went
from robosandbox.apps.viewer.preview import add_gripper, gripper_shape
from robosandbox.apps.viewer.scene import body_ids
from robosandbox.apps.viewer.source import Frame
from robosandbox.errors import Failure
from robosandbox.evidence import (
    CollisionEvidence,
    GraspEvidence,
    PlacementEvidence,
    TrackingEvidence,
    UnreachableEvidence,
)
from robosandbox.skills.push import PushEvidence
from robosandbox.types import Array, Pose, Refusal

_RED, _GREEN, _AMBER = (225, 40, 35), (30, 165, 80), (235, 150, 20)
_ANCHOR: Literal["bottom-center"] = "bottom-center"
_ABOVE, _BELOW = np.array([0.0, 0.0, 0.07]), np.array([0.0, 0.0, -0.05])


class FailureEvidence(Layer):
    """Draws the evidence of the last failure."""

    title = "Failures"
    hint = "Red: the pose that is out of reach, or the pair that is in the way; green: the nearest reachable pose"

    _error: Failure | None = None
    _where: Mapping[str, Array] = MappingProxyType({})

    def hear(self, news: News) -> None:
        """Draw a failure until something else is begun."""
        match news:
            case SkillFailed(_, error) if self.shown:
                self.clear()
                self._error = error
                self._show(error)
            case SkillStarted() | Went() | Loaded() | Began():
                self.clear()
            case Came(refusal=Refusal(candidates=names)) if self.shown:
                self._name_all(names)
            case _:
                pass

    def clear(self) -> None:
        """Forget the failure."""
        super().clear()
        if self._error is not None:
            self.body_scene.mark(())
        self._error = None

    def draw(self, frame: Frame, data: mujoco.MjData) -> None:
        """Remember where bodies are, for labels."""
        self._where = {name: data.xpos[body].copy() for body, name in enumerate(self.blueprint.names)}

    def _show(self, error: Failure) -> None:
        match error.evidence:
            case UnreachableEvidence() as found:
                self._reach(found)
            case CollisionEvidence(body=body, other=other) as found:
                self._mark((body, other))
                self._label("pair", other if other in self.blueprint.object_bodies else body, found.told())
            case GraspEvidence() as found:
                self._mark((found.object,))
                width = "" if found.object_width is None else f"{1000 * found.object_width:.0f} mm wide; "
                fingers = (
                    f"gripper opens to {1000 * found.max_aperture:.0f} mm" if found.max_aperture else "suction cup"
                )
                self._label("grasp", found.object, f"{found.object}: {found.reason} ({width}{fingers})")
            case PlacementEvidence() as found:
                self._mark(found.blocking or (found.object,))
                if found.expected is not None:
                    self._cross("expected", found.expected, _GREEN, f"where {found.object} should be")
                if found.actual is not None:
                    self._label("actual", found.object, f"{found.object}: {found.reason}")
            case PushEvidence() as found:
                self._mark((found.object,))
                text = f"{found.object} went {1000 * found.along:.0f} of {1000 * found.wanted:.0f} mm"
                self._label("push", found.object, f"{text}, {1000 * abs(found.across):.0f} mm aside")
            case TrackingEvidence(joint=joint, error=off, contacts=contacts):
                # "finger on cube": what is said to touch, both sides.
                self._mark(part for pair in contacts for part in pair.split(" on "))
                self._label("joint", self._moved_by(joint), f"{joint} stays {off:.3f} off")
            case _:
                pass

    def _reach(self, found: UnreachableEvidence) -> None:
        shape = gripper_shape(self.blueprint, self.body_scene)
        if shape is not None:
            self.keep("target", add_gripper(self.server, self.node("target"), shape, found.target, _RED))
            self.keep("nearest", add_gripper(self.server, self.node("nearest"), shape, found.nearest, _GREEN))
        off = f"{1000 * found.position_error:.0f} mm and {np.degrees(found.orientation_error):.0f}° short"
        self._cross("wanted", found.target, _RED, f"out of reach: {off}")
        self._cross("reached", found.nearest, _GREEN, "nearest reachable", _BELOW)
        if np.linalg.norm(found.target.position - found.nearest.position) > 1e-3:
            points = np.array([[found.target.xyz, found.nearest.xyz]])
            line = self.scene.add_line_segments(
                self.node("gap"), points, _AMBER, thickness=4.0, thickness_units="screen"
            )
            self.keep("gap", line)
        self._mark(self._moved_by(joint) for joint in found.joints_at_limits)

    def _mark(self, names: Iterable[str]) -> None:
        ids = body_ids(self.blueprint.names)
        self.body_scene.mark(ids[name] for name in dict.fromkeys(names) if name in ids)

    def _moved_by(self, joint: str) -> str:
        """Return the name of the body that an arm joint moves."""
        robot, model = self.blueprint.robot, self.blueprint.model
        if joint not in robot.joints:
            return joint
        dof = int(robot.dof_indices[robot.joints.index(joint)])
        return self.blueprint.names[int(model.dof_bodyid[dof])]

    def _cross(self, name: str, pose: Pose, colour: tuple[int, int, int], text: str, aside: Array = _ABOVE) -> None:
        frame = self.scene.add_frame(
            self.node(name),
            axes_length=0.045,
            axes_radius=0.0016,
            origin_radius=0.006,
            origin_color=colour,
            position=pose.xyz,
            wxyz=(pose.quat_xyzw[3], *pose.quat_xyzw[:3]),
        )
        self.keep(name, frame)
        self.keep(
            f"{name}_said",
            self.scene.add_label(self.node(f"{name}_said"), text, position=pose.position + aside, anchor=_ANCHOR),
        )

    def _label(self, name: str, body: str, text: str) -> None:
        where = self._where.get(body)
        if where is not None:
            self.keep(name, self.scene.add_label(self.node(name), text, position=where + _ABOVE, anchor=_ANCHOR))

    def _name_all(self, names: Iterable[str]) -> None:
        """Label the objects that a question is about."""
        for name in names:
            self._label(f"named_{name}", name, f"{name}?")
