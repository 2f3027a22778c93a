"""Why what was gripped did not come up: what holds a thing back is told from its weight, by what touches it and how it pulls."""

import numpy as np
import pytest

from robosandbox.errors import GraspError, SkillError
from robosandbox.evidence import GraspEvidence
from robosandbox.skills.primitives.loads import LoadMeter, held_back
from robosandbox.skills.primitives.manipulator import Manipulator
from robosandbox.types import DetectedObject, ObservedScene, Pose, Scene, SceneObject, SkillCall
from robosandbox.workcell.session import open_session

TABLE = 0.04


def item(
    name: str, kind: str, size: tuple[float, ...], xy: tuple[float, float], *, bottom: float = TABLE
) -> DetectedObject:
    height = size[-1] if kind in ("box", "cylinder") else 0.0
    return DetectedObject(
        id=name, kind=kind, size=size, colour="red", rgba=(1.0, 0.0, 0.0, 1.0), pose=Pose(xyz=(*xy, bottom + height))
    )


def seen(*items: DetectedObject) -> ObservedScene:
    return ObservedScene(time=0.0, objects=items, table_height=TABLE, base_xy=(-0.3, 0.0))


CAN = item("can", "cylinder", (0.02, 0.03), (0.15, 0.0), bottom=TABLE + 0.004)


@pytest.mark.parametrize(
    ("others", "how", "names"),
    [
        ((), None, ()),
        ((item("far", "box", (0.02, 0.02, 0.03), (0.25, 0.0)),), None, ()),
        ((item("under", "box", (0.02, 0.02, 0.002), (0.15, 0.0)),), None, ()),
        ((item("plank", "box", (0.02, 0.09, 0.006), (0.15, 0.0), bottom=0.11),), "caught", ("plank",)),
        ((item("a", "box", (0.02, 0.02, 0.03), (0.191, 0.0)),), "braced", ("a",)),
        (
            (
                item("a", "box", (0.02, 0.02, 0.03), (0.191, 0.0)),
                item("b", "box", (0.02, 0.02, 0.03), (0.109, 0.0)),
            ),
            "wedged",
            ("a", "b"),
        ),
        ((item("bin", "bin", (0.1, 0.1, 0.06), (0.15, 0.0)),), None, ()),
        ((item("bin", "bin", (0.1, 0.1, 0.06), (0.071, 0.0)),), "braced", ("bin",)),
        ((item("bin", "bin", (0.021, 0.1, 0.06), (0.15, 0.0)),), "wedged", ("bin",)),
    ],
)
def test_what_touches_a_thing_holds_it_back(
    others: tuple[DetectedObject, ...], how: str | None, names: tuple[str, ...]
) -> None:
    found = held_back(CAN, seen(CAN, *others))
    assert (found.how, found.names) == (how, names)


def test_a_load_that_stays_is_a_weight_and_one_that_grows_is_none() -> None:
    with open_session(Scene(objects=()), what_if=False) as session:
        rising = np.linspace(0.0, 0.05, 60)
        for forces, weight in (
            (np.full(60, 20.0), 20.0),
            (1000.0 * rising, None),
            (20.0 + 0.8 * np.sin(rising * 400.0), 20.0),
            (np.where(np.arange(60) == 30, 40.0, 1.0), 1.0),
        ):
            meter = LoadMeter(Manipulator(session.ctx), "it")
            meter.readings.extend(zip(rising.tolist(), forces.tolist(), strict=True))
            assert meter.weight == (None if weight is None else pytest.approx(weight, rel=0.1))
        standing = LoadMeter(Manipulator(session.ctx), "it")
        standing.readings.extend((0.1, 20.0) for _ in range(60))
        assert standing.weight is None, "a hand that does not rise weighs nothing"


def test_what_is_fixed_is_not_too_heavy_and_the_limit_is_kept() -> None:
    post = SceneObject(id="post", kind="box", size=(0.02, 0.02, 0.03), pose=Pose(xyz=(0.15, 0.0, 0.0705)), mass=200.0)
    with open_session(Scene(objects=(post,)), what_if=False) as session:
        pulls: list[float] = []
        session.driver.subscribe(lambda: pulls.append(float(np.linalg.norm(session.driver.senses.force_on("post")))))
        with pytest.raises(GraspError, match="nothing that is seen holds it: it is fixed") as caught:
            session.agent.perform(SkillCall(skill="pick", arguments={"object": "post"}))
        evidence = caught.value.evidence
        assert isinstance(evidence, GraspEvidence) and evidence.reason == "immovable"
        assert evidence.pull is not None and evidence.pull > 30.0 and max(pulls) < 1.1 * 60.0
        session.agent.perform(SkillCall(skill="home", arguments={}))


@pytest.mark.slow
def test_a_bin_does_not_come_up_with_what_lies_in_its_corner() -> None:
    can = SceneObject(id="can", kind="cylinder", size=(0.018, 0.024), pose=Pose(xyz=(0.18, 0.0, 0.07)), mass=0.02)
    corner = SceneObject(
        id="bin", kind="bin", size=(0.062, 0.074, 0.079), pose=Pose(xyz=(0.14, 0.052, 0.0405)), mass=0.25
    )
    with open_session(Scene(objects=(can, corner)), what_if=False) as session:
        start = session.observe().find("bin")
        pressed: list[float] = []
        session.driver.subscribe(
            lambda: pressed.append(float(np.linalg.norm(session.driver.senses.forces().get("bin", np.zeros(3)))))
        )
        with pytest.raises(SkillError) as caught:
            session.agent.perform(SkillCall(skill="pick", arguments={"object": "can"}))
        session.driver.wait(0.5)
        now = session.observe().find("bin")
        assert start is not None and now is not None and abs(now.pose.xyz[2] - start.pose.xyz[2]) < 0.005
        assert caught.value.evidence is not None and "bin" in caught.value.evidence.met()
        assert max(pressed) < 1.1 * 60.0
        session.agent.perform(SkillCall(skill="home", arguments={}))
