"""The kinds of objects: what they weigh, where they stand, what they hold."""

import mujoco
import numpy as np
import pytest

from robosandbox.shapes import CONTAINER_WALL
from robosandbox.sim.mujoco_backend import MuJoCoBackend
from robosandbox.sim.saved_state import put_state
from robosandbox.types import ObjectKind, Pose, Scene, SceneObject
from robosandbox.world.relations import bounds, inside


def loaded(*objects: SceneObject) -> MuJoCoBackend:
    sim = MuJoCoBackend()
    sim.load(Scene(objects=objects))
    return sim


@pytest.mark.parametrize(("kind", "size"), [("bin", (0.06, 0.05, 0.05)), ("bowl", (0.06, 0.05)), ("cup", (0.03, 0.09))])
def test_a_container_stands_where_it_is_put_and_holds_what_falls_into_it(
    kind: ObjectKind, size: tuple[float, ...]
) -> None:
    ball = SceneObject(id="ball", kind="sphere", size=(0.012,), pose=Pose(xyz=(0.16, 0.0, 0.16)))
    vessel = SceneObject(id="vessel", kind=kind, size=size, pose=Pose(xyz=(0.15, 0.0, 0.04)), mass=0.2)
    with loaded(vessel, ball) as sim:
        seen = {name: item.detected() for name, item in sim.truth().objects.items()}
        assert inside(seen["ball"], seen["vessel"])
        assert np.linalg.norm(np.array(seen["vessel"].pose.xyz) - vessel.pose.xyz) < 0.002
        assert seen["ball"].pose.xyz[2] == pytest.approx(0.04 + CONTAINER_WALL + 0.012, abs=0.002)
        body = sim.object_bodies["vessel"]
        assert sim.model.body_mass[body] == pytest.approx(0.2)


@pytest.mark.parametrize(("kind", "size"), [("bowl", (0.06, 0.05)), ("cup", (0.03, 0.09))])
def test_a_round_wall_fills_its_hull_and_leaves_the_inside_free(kind: ObjectKind, size: tuple[float, ...]) -> None:
    vessel = SceneObject(id="vessel", kind=kind, size=size, pose=Pose(xyz=(0.15, 0.0, 0.04)), mass=0.2)
    with loaded(vessel) as sim:
        item = sim.truth().objects["vessel"].detected()
        low, high = bounds(item)
        data = mujoco.MjData(sim.model)
        put_state(sim.model, data, sim.snapshot())
        mujoco.mj_forward(sim.model, data)
        geom = np.zeros(1, dtype=np.int32)
        x, y, z = item.pose.xyz
        for angle in np.linspace(0.0, 2.0 * np.pi, 36, endpoint=False):
            outwards = np.array([np.cos(angle), np.sin(angle), 0.0])
            start = np.array([x, y, z + 0.5 * size[1]])
            free = mujoco.mj_ray(sim.model, data, start, outwards, None, 1, -1, geom)
            assert size[0] - 1e-4 <= free <= 1.02 * size[0]
            thick = mujoco.mj_ray(sim.model, data, start + 0.3 * outwards, -outwards, None, 1, -1, geom)
            assert 0.3 - thick == pytest.approx(size[0] + CONTAINER_WALL, rel=0.02)
        assert high[2] - low[2] == pytest.approx(size[1], abs=1e-3)
