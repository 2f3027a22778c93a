"""The ways to hold an object that were weighed, drawn as grippers of lines."""

from __future__ import annotations

import numpy as np

from robosandbox.agent.episode import Intended, PhaseEntered, SkillStarted
from robosandbox.apps.viewer.layers.layer import Layer
from robosandbox.apps.viewer.news import Came, Loaded, News, Went
from robosandbox.errors import Phase
from robosandbox.types import Array, Grasp, GraspSearch
from robosandbox.workcell.orders import OrderResult

_MOST_SHOWN = 40  # Number of grasps that are drawn. Chosen so that they can be told apart.
_FINGER, _STEM = 0.035, 0.05
_WEIGHED, _REFUSED, _CHOSEN = (122, 150, 184), (214, 60, 50), (24, 160, 80)


class GraspCandidates(Layer):
    """Draws each candidate as two fingers, a palm and the approach; the chosen one in green."""

    title = "Grasp candidates"
    hint = "Green is carried out; blue was weighed; all red: none of them can be"

    def hear(self, news: News) -> None:
        """Draw the candidates of a search, until the next skill."""
        match news:
            case Intended(_, GraspSearch() as search) if self.shown:
                self._show(search)
            case PhaseEntered(_, Phase.LIFT) | SkillStarted() | Went() | Loaded():
                self.clear()
            case Came(result=OrderResult(failure=None)):
                self.clear()
            case _:
                pass

    def _show(self, search: GraspSearch) -> None:
        plain = _WEIGHED if search.chosen is not None else _REFUSED
        others = [grasp for index, grasp in enumerate(search.candidates[:_MOST_SHOWN]) if index != search.chosen]
        self._draw("weighed", others, plain, 1.5)
        self._draw("chosen", [] if search.chosen is None else [search.candidates[search.chosen]], _CHOSEN, 5.0)

    def _draw(self, name: str, grasps: list[Grasp], colour: tuple[int, int, int], thickness: float) -> None:
        self.drop(name)
        if grasps:
            points = np.concatenate([glyph(grasp) for grasp in grasps])
            handle = self.scene.add_line_segments(
                self.node(name), points, colour, thickness=thickness, thickness_units="screen"
            )
            self.keep(name, handle)


def glyph(grasp: Grasp) -> Array:
    """Return a grasp as line segments in the world, shape (4, 2, 3): two fingers, the palm, the approach."""
    half = grasp.width / 2.0
    corners = [(0.0, side * half, height) for side in (-1.0, 1.0) for height in (0.0, -_FINGER)]
    left_tip, left, right_tip, right = (np.array(corner) for corner in corners)
    palm = np.array([0.0, 0.0, -_FINGER])
    stem = palm - [0.0, 0.0, _STEM]
    local = np.array([[left_tip, left], [right_tip, right], [left, right], [palm, stem]])
    return local @ grasp.tcp_pose.rotation.T + grasp.tcp_pose.position
