"""Answers to a question of the robot by a click: on a button for each thing that could be meant, or on the thing itself."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import partial
from typing import Literal

import viser

from robosandbox.apps.viewer.control import Control
from robosandbox.apps.viewer.news import Began, Came, Doing, Loaded, News, Went
from robosandbox.apps.viewer.orders import PageOrder, obey
from robosandbox.apps.viewer.panels.order_form import answer_form
from robosandbox.apps.viewer.scene import BodyScene
from robosandbox.apps.viewer.source import Blueprint
from robosandbox.types import Refusal

_Do = Literal["run", "plan", "simulate"]
# What asks once more with the answer, by what was under way when the question came up.
_DO: dict[Doing, _Do] = {
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

    def __init__(self, server: viser.ViserServer, control: Control) -> None:
        self._control = control
        self._form = server.gui.add_html("")
        self._offered: tuple[str, ...] = ()
        self._do: _Do = _DO[Doing.RUNNING]
        self._meshes: Mapping[str, Sequence[viser.GlbHandle]] = {}
        self._clickable: list[viser.GlbHandle] = []

    def hear(self, news: News) -> None:
        """Take news."""
        match news:
            case Began(Doing.RUNNING | Doing.PLANNING | Doing.TRYING as doing, _):
                self._do = _DO[doing]
                self._offer(())
            case Came(question=Refusal(candidates=candidates)):
                self._offer(candidates)
            case Went() | Loaded():
                self._offer(())
            case _:
                pass

    def adopt(self, blueprint: Blueprint, body_scene: BodyScene) -> None:
        """Have the objects of another drawn scene pointed at."""
        self._meshes = {name: body_scene.meshes(body) for name, body in blueprint.object_bodies.items()}
        self._clickable = []
        self._let_click()

    def _offer(self, candidates: tuple[str, ...]) -> None:
        self._offered = candidates
        self._form.content = answer_form(candidates, self._do) if candidates else ""
        for mesh in self._clickable:
            mesh.remove_click_callback()
        self._clickable = []
        self._let_click()

    def _let_click(self) -> None:
        # What can be clicked lights up under the mouse, so that nothing else may be.
        for name in self._offered:
            for mesh in self._meshes.get(name, ()):
                self._clickable.append(mesh)
                mesh.on_click(partial(self._say, name))

    def _say(self, answer: str, _: viser.SceneNodePointerEvent[viser.GlbHandle]) -> None:
        obey(PageOrder(do=self._do, prompt=answer), self._control)
