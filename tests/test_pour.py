"""Beads: where they start, what they weigh, and where they go when they are poured."""

import numpy as np
import pytest
from support.performing import perform

from robosandbox.errors import InputError, PlacementError, PourError
from robosandbox.evidence import PourEvidence
from robosandbox.sim.mujoco_backend import MuJoCoBackend
from robosandbox.skills.pick import Pick
from robosandbox.skills.pour import Pour
from robosandbox.tasks.loader import find_task
from robosandbox.types import Pose, Scene, SceneObject
from robosandbox.workcell.session import open_session
from robosandbox.world.relations import contents

CUP = SceneObject(id="cup", kind="cup", size=(0.03, 0.09), pose=Pose(xyz=(0.12, -0.12, 0.04)), mass=0.12)
BOWL = SceneObject(id="bowl", kind="bowl", size=(0.075, 0.06), pose=Pose(xyz=(0.15, 0.15, 0.04)), mass=0.3)


def beads(count: int = 30) -> SceneObject:
    return SceneObject.model_validate(
        {"id": "beads", "kind": "beads", "size": (0.006,), "count": count, "inside": "cup", "mass": 0.03}
    )


def test_beads_start_in_their_container_weigh_what_they_should_and_stay() -> None:
    with MuJoCoBackend() as sim:
        sim.load(Scene(objects=(CUP, beads())))
        seen = [item.detected() for item in sim.truth().objects.values()]
        assert len(contents(seen, seen[0])) == 30
        before = sim.snapshot()
        sim.reset()
        assert (sim.snapshot() == before).all()
        assert sum(sim.model.body_mass[b] for b in range(sim.model.nbody) if sim.body_names[b] == "beads") == (
            pytest.approx(0.03)
        )
        moved = CUP.model_copy(update={"pose": Pose(xyz=(0.2, 0.1, 0.04))})
        sim.reset(Scene(objects=(moved, beads())))
        seen = [item.detected() for item in sim.truth().objects.values()]
        assert sim.compilations == 1 and len(contents(seen, seen[0])) == 30
        assert np.linalg.norm(np.array(seen[1].pose.xyz[:2]) - [0.2, 0.1]) < 0.005


def test_too_many_beads_are_refused_with_how_many_fit() -> None:
    with MuJoCoBackend() as sim, pytest.raises(InputError, match=r"100 beads of radius 6 mm.*which holds [0-9]+;"):
        sim.load(Scene(objects=(CUP, beads(100))))


@pytest.mark.parametrize(
    ("fields", "message"),
    [
        ({"kind": "beads", "size": [0.005], "count": 3, "inside": "none"}, "no bin, bowl or cup"),
        ({"kind": "beads", "size": [0.005], "inside": "cup"}, "count of 1 or more"),
        ({"kind": "box", "size": [0.1] * 3, "pose": Pose(xyz=(0, 0, 0)), "count": 3}, "no count"),
        ({"kind": "box", "size": [0.1] * 3, "pose": Pose(xyz=(0, 0, 0)), "locked": True}, "no drawer"),
    ],
)
def test_wrong_fields_are_named(fields: dict[str, object], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        Scene.model_validate({"objects": [CUP, {"id": "wrong", **fields}]})


def test_beads_are_poured_and_counted() -> None:
    task = find_task("pour_beads")
    # Fewer beads than the bench pours: what they cost is contacts among them.
    fewer = tuple(item.model_copy(update={"count": 10}) if item.id == "beads" else item for item in task.scene.objects)
    task = task.model_copy(update={"scene": task.scene.model_copy(update={"objects": fewer})})
    with open_session(task, what_if=False) as session:
        episode = session.run()
        verdict = session.judge()
        assert episode.success and verdict.success, episode.final_detail
        result = episode.steps[-1].result
        assert result is not None and result.detail["poured"] == 10 and result.detail["spilled"] == 0


def test_an_empty_cup_is_not_poured_and_no_pour_is_claimed() -> None:
    cube = SceneObject(id="cube", kind="box", size=(0.015,) * 3, pose=Pose(xyz=(0.1, 0.0, 0.055)))
    with open_session(Scene(objects=(CUP, BOWL, cube)), what_if=False) as session:
        perform(session.ctx, Pick(), {"object": "cup"})
        with pytest.raises(PlacementError, match="cube is a box"):
            perform(session.ctx, Pour(), {"target": "cube"})
        with pytest.raises(PourError, match="nothing is seen in cup") as failure:
            perform(session.ctx, Pour(), {"target": "bowl"})
        assert isinstance(failure.value.evidence, PourEvidence) and failure.value.evidence.count == 0
