"""The check of a perception passes what keeps its promises, and says which promise the others break."""

from dataclasses import replace

import pytest

from robosandbox.apps.conformance import check_perception
from robosandbox.driver import Driver
from robosandbox.perception.factory import Setup, make_perception
from robosandbox.perception.ground_truth import GroundTruthPerception
from robosandbox.tasks.layouts import Layouts
from robosandbox.tasks.loader import find_task
from robosandbox.types import ObservedScene, Pose, Scene


def layouts(task: str) -> tuple[Scene, Scene]:
    drawn = Layouts(find_task(task))
    return drawn.lay_out(0, lambda scene, _: scene), drawn.lay_out(1, lambda scene, _: scene)


@pytest.mark.parametrize("task", ["pick_from_three", "put_in_bin", "open_drawer"])
@pytest.mark.parametrize("name", ["ground_truth", "rgbd"])
def test_bundled_perceptions_keep_their_promises(name: str, task: str) -> None:
    check_perception(lambda setup: make_perception(name, setup), *layouts(task))


class Blind(GroundTruthPerception):
    def perceive(self, driver: Driver) -> ObservedScene:
        seen = super().perceive(driver)
        return replace(seen, objects=seen.objects[1:])


class Squinting(GroundTruthPerception):
    def perceive(self, driver: Driver) -> ObservedScene:
        seen = super().perceive(driver)
        x, y, z = seen.objects[0].pose.xyz
        aside = replace(seen.objects[0], pose=Pose(xyz=(x + 0.02, y, z), quat_xyzw=seen.objects[0].pose.quat_xyzw))
        return replace(seen, objects=(aside, *seen.objects[1:]))


class SeeingDouble(GroundTruthPerception):
    def perceive(self, driver: Driver) -> ObservedScene:
        seen = super().perceive(driver)
        return replace(seen, objects=(*seen.objects, replace(seen.objects[0], id="another")))


class Naming(GroundTruthPerception):
    looks = 0

    def perceive(self, driver: Driver) -> ObservedScene:
        seen = super().perceive(driver)
        self.looks += 1
        return replace(seen, objects=tuple(replace(item, id=f"{item.id}_{self.looks}") for item in seen.objects))


class Remembering(GroundTruthPerception):
    first: ObservedScene | None = None

    def perceive(self, driver: Driver) -> ObservedScene:
        self.first = self.first or super().perceive(driver)
        return replace(self.first, time=driver.time)


class Meddling(GroundTruthPerception):
    def perceive(self, driver: Driver) -> ObservedScene:
        driver.wait(driver.control_timestep)
        return super().perceive(driver)


@pytest.mark.parametrize(
    ("perception", "said"),
    [
        (Blind, "the nearest box is seen"),
        (Squinting, "is seen 0.02 m from it, of 0.01"),
        (SeeingDouble, "another: seen, and not there"),
        (Naming, "nothing moved, and"),
        (Remembering, "the nearest box is seen"),
        (Meddling, "changed the world"),
    ],
)
def test_a_broken_promise_is_named(perception: type[GroundTruthPerception], said: str) -> None:
    def make(setup: Setup) -> GroundTruthPerception:
        del setup
        return perception()

    with pytest.raises(AssertionError, match=said):
        check_perception(make, *layouts("pick_from_three"))
