"""AprilTags on objects (Olson, 2011; family 36h11): how many there are, where on an object one sits, how large it is."""

from __future__ import annotations

import math
from collections.abc import Sequence

TAG_FAMILY = "DICT_APRILTAG_36h11"
TAG_COUNT = 587
# Black cells along an edge, a frame of one cell around six included; a white border of one cell lies around them.
TAG_CELLS = 8
BORDERED = (TAG_CELLS + 2) / TAG_CELLS
TAGGED_KINDS = ("box", "cylinder")

_USUAL_SHARE = 0.8


def tag_face(kind: str, size: Sequence[float]) -> tuple[float, float]:
    """Return the edge of the largest square on the flat face at the end of local z, and its height over the pose, metres.

    Args:
        kind: One of `TAGGED_KINDS`.
        size: As in `OBJECT_SIZES`.
    """
    if kind == "cylinder":
        return math.sqrt(2.0) * size[0], size[1]
    return 2.0 * min(size[0], size[1]), size[2]


def usual_tag_size(kind: str, size: Sequence[float]) -> float:
    """Return the edge of a tag's black square where a scene gives none, metres: a rim of the face stays free around its border."""
    return _USUAL_SHARE * tag_face(kind, size)[0] / BORDERED
