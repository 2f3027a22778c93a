"""AprilTags on objects (Olson, 2011; family 36h11): how many there are, where on an object one sits, how large it is."""

from __future__ import annotations

TAG_FAMILY = "DICT_APRILTAG_36h11"
TAG_COUNT = 587  # Number of tags of the family 36h11, as in AprilTag's tables (Olson 2011).
TAG_CELLS = 8  # Number of cells a side, border included, as of AprilTag's 36h11.
BORDERED = (TAG_CELLS + 2) / TAG_CELLS

_USUAL_SHARE = 0.8  # Share of a face that tag and white frame take where the tag's size is not given. Chosen.


def usual_tag_size(face: float) -> float:
    """Return the edge of a tag's black square where a scene gives none, metres: a rim of a face stays free around its border.

    Args:
        face: Edge of the largest square on the face, metres.
    """
    return _USUAL_SHARE * face / BORDERED
