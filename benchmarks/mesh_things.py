"""Meshes out of wheels of the Python index, each at rest on the table on one of the faces on which it can lie."""

from __future__ import annotations

import math
import re
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from odd_scenes import TABLE, Odd
from support.models import wheel_files

from robosandbox.shapes.body import Piece
from robosandbox.shapes.mesh_file import mesh_pieces
from robosandbox.types import Pose, SceneObject

PYBULLET, ROBOSUITE = "pybullet==3.2.7", "robosuite==1.5.1"
_SUITE = "robosuite/models/assets/objects/meshes"
# Name -> wheel, file, and what its own URDF or MJCF says: metres per unit, kilograms (or kg/m^3 as a second figure).
# What is longer than an arm's table, or no thing by itself (a door's handles, a ball of a metre), is left out.
HOUSEHOLD: dict[str, tuple[str, str, float, float | None, float | None]] = {
    "bottle": (ROBOSUITE, f"{_SUITE}/bottle.stl", 1.0, None, 50.0),
    "bread": (ROBOSUITE, f"{_SUITE}/bread.stl", 0.8, None, 50.0),
    "can": (ROBOSUITE, f"{_SUITE}/can.stl", 1.0, None, 100.0),
    "cereal_box": (ROBOSUITE, f"{_SUITE}/cereal.stl", 1.0, None, 150.0),
    "lemon": (ROBOSUITE, f"{_SUITE}/lemon.stl", 1.0, None, 50.0),
    "milk_carton": (ROBOSUITE, f"{_SUITE}/milk.stl", 0.9, None, 100.0),
    "mug": (PYBULLET, "pybullet_data/objects/mug.obj", 1.0, 1.0, None),
    "duck": (PYBULLET, "pybullet_data/duck_vhacd.obj", 0.05, 0.1, None),
    "lego_brick": (PYBULLET, "pybullet_data/lego/lego.obj", 0.1, 0.1, None),
    "domino": (PYBULLET, "pybullet_data/domino/domino.obj", 1.0, 0.025, None),
    "teddy": (PYBULLET, "pybullet_data/teddy2_VHACD_CHs.obj", 0.1, 0.1, None),
    "toy_cube": (PYBULLET, "pybullet_data/toys/cube.obj", 1.0, None, 500.0),
    "toy_cylinder": (PYBULLET, "pybullet_data/toys/cylinder.obj", 1.0, None, 500.0),
    "toy_prism": (PYBULLET, "pybullet_data/toys/prism.obj", 1.0, None, 500.0),
}
RANDOM_OBJECTS = 1000
# Colour of every one: seen apart from the table.
RED = (0.85, 0.1, 0.1, 1.0)
# Angle by which a thing has to be tipped before it falls from a face that it is laid on, radians: less is no rest.
_LEAST_TIP = math.radians(8.0)
_FLAT = 1e-3


@dataclass(frozen=True, slots=True)
class Thing:
    """A mesh and what its own file says of it.

    Attributes:
        name: Its id in prompts.
        mesh: The file.
        scale: Metres per unit.
        mass: Kilograms; None where a density is given.
        density: kg/m^3; None where a mass is given.
    """

    name: str
    mesh: Path
    scale: float
    mass: float | None
    density: float | None

    def placed(self, pose: Pose) -> SceneObject:
        """Return it as an object of a scene."""
        told = {"mass": self.mass} if self.mass is not None else {"density": self.density}
        fields = {"id": self.name, "kind": "mesh", "pose": pose, "mesh": self.mesh, "scale": self.scale, "rgba": RED}
        return SceneObject.model_validate({**fields, "collision": "coacd", **told})


def random_object(number: int) -> Thing:
    """Return one of pybullet_data's thousand random objects."""
    folder = wheel_files(PYBULLET) / "pybullet_data" / "random_urdfs" / f"{number:03d}"
    told = (folder / f"{number:03d}.urdf").read_text()
    scale, mass = (float(re.findall(pattern, told)[0]) for pattern in (r'scale="([\d.]+) ', r'mass value="([\d.]+)"'))
    return Thing(f"object_{number:03d}", folder / f"{number:03d}.obj", scale, mass, None)


def household(name: str) -> Thing:
    """Return a household object."""
    wheel, file, scale, mass, density = HOUSEHOLD[name]
    return Thing(name, wheel_files(wheel) / file, scale, mass, density)


def laid(thing: Thing, seed: int) -> Odd:
    """Return a scene with a thing at rest on a face, turned and placed by a seed, that is to be picked up."""
    rng = np.random.default_rng([sum(map(ord, thing.name)), seed])
    pieces = mesh_pieces(thing.mesh, thing.scale, 1.0, decomposed=True, of=thing.name)
    downs = resting_faces(pieces)
    down = downs[int(rng.integers(len(downs)))]
    turn = _turn(down, np.array([0.0, 0.0, -1.0]))
    yaw = float(rng.uniform(-math.pi, math.pi))
    c, s = math.cos(yaw), math.sin(yaw)
    rotation = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]]) @ turn
    lowest = float((_points(pieces) @ rotation.T)[:, 2].min())
    x, y = float(rng.uniform(0.05, 0.25)), float(rng.uniform(-0.2, 0.2))
    pose = Pose.from_matrix(np.array([x, y, TABLE - lowest + 0.0005]), rotation)
    said = thing.name.replace("_", " ") if thing.name in HOUSEHOLD else thing.name
    objects = (thing.placed(pose),)
    return Odd(
        family="meshes", seed=seed, prompt=f"pick up the {said}", objects=objects, subject=thing.name, goal="held"
    )


def resting_faces(pieces: tuple[Piece, ...]) -> list[np.ndarray]:
    """Return outward normals (3,) of the hull's faces on which a thing of these pieces stays, the steadiest first."""
    from scipy.spatial import ConvexHull

    points = _points(pieces)
    middle = np.sum([piece.mass * np.array(piece.centre) for piece in pieces], axis=0)
    middle = middle / sum(piece.mass for piece in pieces)
    hull = ConvexHull(points)
    left, found = list(range(len(hull.equations))), []
    while left:
        plane = hull.equations[left[0]]
        same = [k for k in left if plane[:3] @ hull.equations[k][:3] > 1.0 - _FLAT]
        left = [k for k in left if k not in same]
        normal = plane[:3]
        axes = np.linalg.svd(normal[None])[2][1:]
        outline = ConvexHull(points[np.unique(hull.simplices[same])] @ axes.T).equations
        inside = -float((outline[:, :2] @ (axes @ middle) + outline[:, 2]).max())
        height = -float(plane[:3] @ middle + plane[3])
        found.append((math.atan2(inside, height), normal))
    found.sort(key=lambda pair: -pair[0])
    steady = [normal for tip, normal in found if tip > _LEAST_TIP]
    return steady or [found[0][1]]


def _points(pieces: tuple[Piece, ...]) -> np.ndarray:
    return np.concatenate([piece.hull.corners + np.array(piece.centre) for piece in pieces])  # type: ignore[union-attr]


def _turn(one: np.ndarray, other: np.ndarray) -> np.ndarray:
    """Return the rotation (3, 3) that takes one unit vector to another."""
    axis, cosine = np.cross(one, other), float(one @ other)
    if cosine < -0.999999:
        across = np.linalg.svd(one[None])[2][1]
        return 2.0 * np.outer(across, across) - np.eye(3)
    skew = np.array([[0.0, -axis[2], axis[1]], [axis[2], 0.0, -axis[0]], [-axis[1], axis[0], 0.0]])
    return np.asarray(np.eye(3) + skew + skew @ skew / (1.0 + cosine))
