"""A scene in which things sleep, and who does."""

from __future__ import annotations

import mujoco

from robosandbox.sim.mujoco_backend import MuJoCoBackend
from robosandbox.types import Pose, Scene, SceneObject

HALF = 0.02
TABLE = 0.04


def box(name: str, x: float, y: float, level: int = 0) -> SceneObject:
    pose = Pose(xyz=(x, y, TABLE + HALF * (2 * level + 1) + 0.001))
    return SceneObject(id=name, kind="box", size=(HALF,) * 3, pose=pose, mass=0.05)


# A tower of three, a box beside it, one far away, a ball, a can in a bin, and an open drawer.
SCENE = Scene(
    objects=(
        box("low", 0.15, 0.0),
        box("middle", 0.15, 0.0, 1),
        box("high", 0.15, 0.0, 2),
        box("beside", 0.15, 0.06),
        box("far", -0.1, -0.3),
        SceneObject(id="ball", kind="sphere", size=(HALF,), pose=Pose(xyz=(0.3, 0.3, 0.06)), mass=0.05),
        SceneObject(id="bin", kind="bin", size=(0.06, 0.06, 0.05), pose=Pose(xyz=(0.0, 0.3, TABLE)), mass=0.3),
        SceneObject(id="can", kind="cylinder", size=(0.02, 0.03), pose=Pose(xyz=(0.0, 0.3, 0.08)), mass=0.1),
        SceneObject(
            id="drawer",
            kind="drawer",
            size=(0.2, 0.16, 0.09, 0.12),
            pose=Pose(xyz=(0.3, -0.25, TABLE)),
            open=0.05,
            mass=3.0,
        ),
    )
)


def live(sim: MuJoCoBackend) -> mujoco.MjData:
    return sim._live


def sleeping(sim: MuJoCoBackend) -> set[str]:
    """Return the objects of which every part sleeps."""
    asleep = live(sim).tree_asleep >= 0
    return {name for name, parts in sim.world.parts.items() if asleep[sim.model.body_treeid[parts]].all()}


def height(sim: MuJoCoBackend, name: str) -> float:
    return float(sim.truth().objects[name].pose.position[2])
