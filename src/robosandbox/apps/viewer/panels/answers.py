"""Answers to a question of the robot by a click: on a button for each thing that could be meant, or on the thing itself."""

from __future__ import annotations

from typing import Literal

import viser

from robosandbox.apps.viewer import operator
from robosandbox.apps.viewer.operator import Doing, News, Operator
from robosandbox.apps.viewer.orders import Order, obey
from robosandbox.apps.viewer.panels.order_form import answer_form
from robosandbox.apps.viewer.scene import BodyScene
from robosandbox.apps.viewer.source import Blueprint
from robosandbox.types import Refusal

# What asks once more with the answer, by what was under way when the question came up.
_DO: dict[Doing, Literal["run", "plan", "simulate"]] = {
    Doing.RUNNING: "run",
    Doing.PLANNING: "plan",
    Doing.TRYING: "simulate",
}


class AnswersPanel:
    """Offers what could be meant as long as a question is open; an answer is said as if it were typed.

    Args:
        server: Where.
        control: Takes the answers.
    """

    def __init__(self, server: viser.ViserServer, control: Operator) -> None:
        self._control = control
        self._form = server.gui.add_html("")
        self._offered: tuple[str, ...] = ()
        self._do = _DO[Doing.RUNNING]

    def hear(self, news: News) -> None:
        """Take news."""
        match news:
            case operator.Began(Doing.RUNNING | Doing.PLANNING | Doing.TRYING as doing, _):
                self._do = _DO[doing]
                self._offer(())
            case operator.Came(question=Refusal(candidates=candidates)):
                self._offer(candidates)
            case operator.Went() | operator.Loaded():
                self._offer(())
            case _:
                pass

    def adopt(self, blueprint: Blueprint, body_scene: BodyScene) -> None:
        """Let the objects of a drawn scene be pointed at."""
        for name, body in blueprint.object_bodies.items():
            for mesh in body_scene.meshes(body):
                self._bind(mesh, name)

    def _bind(self, mesh: viser.GlbHandle, name: str) -> None:
        @mesh.on_click
        def _(_: viser.SceneNodePointerEvent[viser.GlbHandle]) -> None:
            if name in self._offered:
                obey(Order(do=self._do, prompt=name), self._control)

    def _offer(self, candidates: tuple[str, ...]) -> None:
        self._offered = candidates
        self._form.content = answer_form(candidates, self._do) if candidates else ""
