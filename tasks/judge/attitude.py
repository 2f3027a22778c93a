"""The checks of how an object stands: upright, or on its side."""

from __future__ import annotations

import math
from typing import Literal

from robosandbox.shapes import shape_of
from robosandbox.tasks.judge.checks import OfObject
from robosandbox.tasks.judge.finding import Judgement
from robosandbox.types import Truth

# Beyond this angle between its axis and the vertical a thing has tipped over, degrees; chosen well past where anything here still stands by itself.
_TIPPED_DEG = 30.0


class Upright(OfObject):
    """The object's own axis is about vertical; a container's opening is above, of others either end may be."""

    kind: Literal["upright"]

    def evaluate(self, start: Truth, now: Truth) -> Judgement:
        """Measure the angle between its axis and the vertical."""
        del start
        item = now.objects[self.object]
        cosine = float(item.pose.rotation[2, 2])
        angle = math.degrees(
            math.acos(max(-1.0, min(1.0, cosine if shape_of(item.kind).holds_things else abs(cosine))))
        )
        return Judgement(angle < _TIPPED_DEG, {"tilt_deg": angle})


class Lying(OfObject):
    """The object's own axis is about level."""

    kind: Literal["lying"]

    def evaluate(self, start: Truth, now: Truth) -> Judgement:
        """Measure the angle between its axis and the horizontal."""
        del start
        angle = math.degrees(math.asin(min(1.0, abs(float(now.objects[self.object].pose.rotation[2, 2])))))
        return Judgement(angle < _TIPPED_DEG, {"off_level_deg": angle})
