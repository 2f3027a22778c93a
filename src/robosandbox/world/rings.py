"""Relations of what has a hole through it and goes over a post: a nut on a peg, a ring on a pole."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from robosandbox.errors import Phase, PlacementError, SkillError
from robosandbox.evidence import PlacementEvidence
from robosandbox.shapes.room import Room
from robosandbox.types import Array, DetectedObject, ObservedScene, Pose
from robosandbox.world.effects import put
from robosandbox.world.episode_cache import cached_for_episode
from robosandbox.world.placement_sampling import (
    Placement,
    about_z,
    levelled,
    resting_pose,
    turns,
    with_pose,
    yaw_to_align,
)
from robosandbox.world.predicate import Finding, View, is_clearly_seen, predicate, sentence
from robosandbox.world.relations import MeasuredRelation, bottom, bounds, centre, let_down, of_one_piece, top

# Metres between a post and the wall of a hole on each side: above a descent's error.
_PLAY = 0.002
# Cosine of the tilt up to which a hole is looked through from above.
_UPRIGHT = 0.98
# Shares of the way from where it rests to the top of the post at which it is let go, the lowest first: it slides down the rest.
_HELD_OVER = (0.0, 0.5, 0.8)
# Scenes for which placements are kept: a search asks of the same thing and post again and again.
_CACHED = 256


def bore_of(item: DetectedObject) -> Room | None:
    """Return the hole through an object, in the frame of its pose; None without one."""
    return None if item.geometry is None or item.is_fixed else item.geometry.bore


def placements_around(held: DetectedObject, post: DetectedObject, scene: ObservedScene) -> list[Placement]:
    """Return where an object with a hole may be let go around a post, the lowest first; none where it does not go over it.

    Args:
        held: What has the hole, as it is held.
        post: What it goes over.
        scene: What is seen.
    """
    return list(_placements(held, post, scene.table_height))


@cached_for_episode(_CACHED)
def _placements(held: DetectedObject, post: DetectedObject, table: float) -> tuple[Placement, ...]:
    bore = bore_of(held)
    if bore is None or post.id == held.id:
        return ()
    level, (axis, _), thick = levelled(held), _tip(post), bore.rim - bore.floor
    found: list[Placement] = []
    headings = [yaw for yaw in turns(yaw_to_align(held, post)) if _play(bore, about_z(yaw) @ level, post) > _PLAY]
    spots = []
    for yaw in headings:
        rotation = about_z(yaw) @ level
        x, y = axis - (rotation @ np.array([*bore.middle, 0.0]))[:2]
        assert held.geometry is not None
        there = Pose.from_matrix(np.array([x, y, 0.0]), rotation)
        middle = there.position + rotation @ held.geometry.box[0]
        rests = let_down(with_pose(held, there), post, (float(middle[0]), float(middle[1])))
        spots.append((float(x), float(y), yaw, max(table, rests if rests is not None else table)))
    for share in _HELD_OVER:
        for x, y, yaw, rests in spots:
            way = top(post) - thick - rests
            if way > 0.0:
                height = rests + share * way
                found.append(Placement((x, y), height, (yaw,), over=top(post) - height))
    return tuple(found)


def goes_around(item: DetectedObject, post: DetectedObject) -> MeasuredRelation:
    """Tell whether a post stands in the hole of an object: its top within the hole's walls, and over the object's middle."""
    bore = bore_of(item)
    if bore is None or item.pose.rotation[2, 2] < _UPRIGHT:
        return MeasuredRelation(holds=False)
    axis, _ = _tip(post)
    height = (top(item) + bottom(item)) / 2.0
    margin = bore.margin(item.pose.rotation.T @ (np.array([*axis, height]) - item.pose.position))
    over = top(post) - height
    return MeasuredRelation(margin > 0.0 and over > 0.0, {"margin_mm": 1e3 * margin, "post_over_mm": 1e3 * over})


def _tip(post: DetectedObject) -> tuple[Array, Array]:
    """Return the middle (2,) of the top of a post, and the corners (n, 3) of what reaches up to there, in the world, metres."""
    highest, solid = top(post), post.geometry or of_one_piece(post)
    if solid is None:
        return centre(post)[:2], np.array(bounds(post))
    corners = [post.pose.position + points @ post.pose.rotation.T for points in solid.corners]
    reach = [points for points in corners if points[:, 2].max() > highest - _PLAY]
    points = np.vstack(reach)
    return (points[:, :2].min(axis=0) + points[:, :2].max(axis=0)) / 2.0, points


def _play(bore: Room, rotation: Array, post: DetectedObject) -> float:
    """Return how far a post's tip stays off the walls of a hole that is turned so (3, 3), metres; negative where it is too wide."""
    middle, points = _tip(post)
    local = (points - np.array([*middle, 0.0])) @ rotation
    if bore.is_round:
        return float(bore.half[0] - np.hypot(local[:, 0], local[:, 1]).max())
    return float((bore.half - np.abs(local[:, :2]).max(axis=0)).min())


def _too_wide(view: View, arguments: Sequence[Any], finding: Finding) -> SkillError:
    del view
    evidence = PlacementEvidence(object=str(arguments[0]), target=str(arguments[1]), reason="unsuitable")
    return PlacementError(sentence(finding), phase=Phase.CHECK, evidence=evidence)


def _put_over(scene: ObservedScene, a: str, b: str) -> ObservedScene:
    item, post = scene.find(a), scene.find(b)
    spots = [] if item is None or post is None else placements_around(item, post, scene)
    if item is None or not spots:
        return scene
    return put(scene, a, resting_pose(item, spots[0], about_z(spots[0].yaws[0]) @ levelled(item)))


@predicate("object", "object", effect=_put_over, lasts=True)
def around(view: View, a: str, b: str) -> Finding:
    """An object with a hole is over a post."""
    item, post = view.get(a), view.get(b)
    found = goes_around(item, post)
    return Finding(
        holds=found.holds and a not in view.scene.in_hands,
        margin=found.detail.get("margin_mm", -1.0) / 1e3,
        is_sure=is_clearly_seen(item, post),
        cause=f"{a} is not around {b}",
        help=f"put {a} over {b}",
    )


@predicate("object", "object", fixed=True, blame=_too_wide)
def goes_over(view: View, a: str, b: str) -> Finding:
    """An object has a hole through which a post goes."""
    item, post = view.get(a), view.get(b)
    has_bore = bore_of(item) is not None
    return Finding(
        holds=bool(placements_around(item, post, view.scene)),
        is_sure=is_clearly_seen(item, post),
        cause=f"{b} does not go through the hole in {a}" if has_bore else f"{a} has no hole",
        help="choose another post" if has_bore else "put it on the post with place_on",
    )
