"""Things whose mesh the task gives, found whole in what is seen of their colour before anything else is recognized.

A mesh lies on one of its faces; `mesh_fit` finds out on which, and where.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from math import dist

import numpy as np

from robosandbox.errors import InputError
from robosandbox.perception.factory import Setup
from robosandbox.perception.fit import Fit
from robosandbox.perception.frames import FrameSet
from robosandbox.perception.groups import Group
from robosandbox.perception.mesh_fit import KnownMesh, MeshFit, fit_mesh, known_mesh
from robosandbox.perception.recognize import measurements
from robosandbox.perception.segments import Segment
from robosandbox.perception.thing import Thing
from robosandbox.perception.track import Track
from robosandbox.types import Array

# Distance of shares of red and green up to which a piece may be of a described colour; chosen as twice that of two views.
DESCRIBED_CHROMA = 0.12
# Number of seen points that tell how a mesh lies. Chosen.
_LEAST_POINTS = 60
# Confidence, a probability, of a mesh that explains what is seen. Chosen.
_CONFIDENCE = 0.95
# Standard deviations of its place, metres, and heading, radians. Chosen as the errors that benchmarks/meshes.py has.
_SIGMA = np.array([0.001, 0.001, 0.001, 0.01])


class KnownMeshes:
    """Finds the meshes that a task gives.

    Args:
        setup: What is known before the first look.
    """

    def __init__(self, setup: Setup) -> None:
        self._table = setup.scene.table_height
        self._told: dict[str, tuple[KnownMesh, Array]] = {}
        for item in setup.declared:
            known = setup.known.get(item.id)
            if known is None or known.mesh is None:
                continue
            try:
                self._told[item.id] = known_mesh(known.mesh, known.scale), np.array(item.rgb)
            except InputError:
                # The scene's own reader tells what is wrong with it.
                continue

    def find(
        self, segments: Sequence[Segment], frames: FrameSet, tracks: Mapping[str, Track], held: Collection[str]
    ) -> tuple[list[Thing], list[Segment]]:
        """Return the meshes that explain what is seen of their colour, and the pieces that are left.

        Args:
            segments: Of all views.
            frames: The views.
            tracks: What is remembered, by id.
            held: Ids of what is in grippers: it is where the hands are.
        """
        left, found = list(segments), []
        for name, (mesh, rgb) in self._told.items():
            own = _pieces(left, rgb, float(np.linalg.norm(mesh.half)))
            if name in held or sum(len(piece.points) for piece in own) < _LEAST_POINTS:
                continue
            track = tracks.get(name)
            near = [track.thing.pose] if track is not None and not track.thing.shape.size_fields else []
            fit = fit_mesh(
                mesh, np.vstack([piece.points for piece in own]), list(frames.by_camera.values()), self._table, near
            )
            if fit.explains:
                found.append(_thing(mesh, fit, rgb, Group(tuple(own)), frames))
                left = [piece for piece in left if piece not in own]
        return found, left


def _pieces(segments: Sequence[Segment], rgb: Array, radius: float) -> list[Segment]:
    """Return the pieces of a colour that are no farther from the largest one's middle than the mesh is large."""
    share = rgb[:2] / max(float(rgb.sum()), 1e-6)
    own = [piece for piece in segments if dist(piece.chroma, share) < DESCRIBED_CHROMA]
    if not own:
        return []
    middle = np.median(max(own, key=lambda piece: len(piece.points)).points, axis=0)
    return [piece for piece in own if float(np.linalg.norm(np.median(piece.points, axis=0) - middle)) < 1.5 * radius]


def _thing(mesh: KnownMesh, fit: MeshFit, rgb: Array, members: Group, frames: FrameSet) -> Thing:
    rotation, place = fit.pose.rotation, fit.pose.position
    seen = measurements(members, frames)
    box = Fit("box", place, mesh.half, 0.0, 0.0, np.zeros((7, 7)), seen.count, lean=rotation)
    return Thing(
        kind="mesh",
        size=tuple(map(float, mesh.half)),
        pose=fit.pose,
        rgb=rgb,
        confidence=_CONFIDENCE,
        sigma=_SIGMA,
        group=members,
        fit=box,
        seen=seen,
        resting=None,
    )
