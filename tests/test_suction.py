"""A suction arm: its cup is found, measured, tried, and holds what is flat; what is not is refused for the cup's sake."""

from __future__ import annotations

import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import yaml

from robosandbox.agent.context import AgentContext
from robosandbox.apps.conformance.driver_check import check_driver
from robosandbox.apps.conformance.robot_check import check_robot
from robosandbox.errors import GraspError, InputError
from robosandbox.grasp.analytic import AnalyticTopDown
from robosandbox.grasp.suction import faces
from robosandbox.motion.ik import DLSMotionPlanner
from robosandbox.perception.ground_truth import GroundTruthPerception
from robosandbox.robots.infer.sidecar import infer
from robosandbox.robots.loader import load_robot
from robosandbox.robots.sidecar import SuctionRoles
from robosandbox.sim.opening import open_mujoco
from robosandbox.sim.suction import _inner_radius
from robosandbox.skills.pick import Pick
from robosandbox.types import DetectedObject, ObservedScene, Pose, Scene
from robosandbox.workcell.session import open_session

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "benchmarks"))
import suction


@pytest.fixture(scope="module")
def model(tmp_path_factory) -> Path:
    return suction.arm(tmp_path_factory.mktemp("cup"))


def seen(kind, size, xyz=(0.1, 0.0, 0.1), quat=(0.0, 0.0, 0.0, 1.0)) -> DetectedObject:
    return DetectedObject(
        id="it", kind=kind, size=size, colour="", rgba=(0, 0, 0, 1), pose=Pose(xyz=xyz, quat_xyzw=quat)
    )


def test_cup_is_found_with_its_lip_and_pull(model):
    found = infer(model)
    assert found.sidecar.gripper == SuctionRoles(kind="suction", actuator="suck")
    assert found.findings["gripper"].evidence == "a cup of 30 mm that pulls with up to 42 N"
    robot = load_robot(model)
    assert robot.gripper.geometry.cup == pytest.approx(0.030, abs=2e-4)


def test_check_tries_the_cup_and_picks(model):
    report = check_robot(model, sidecar=model.with_suffix(".robosandbox.yaml"))
    assert report.ok, [item for item in report.checks if not item.ok]
    assert {item.name: item.detail for item in report.checks}["gripper"] == "the cup pulls with 42 N, and lets go"


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (
            lambda side: side["gripper"].update(actuator="actuator1"),
            r"gripper\.actuator 'actuator1' is not an adhesion",
        ),
        (lambda side: side["ee_site"]["inject"].update(xyz=[0, 0, 0.03]), r"ee_site: is 40 mm off the lip of 'cup'"),
        (
            lambda side: side["gripper"].update(kind="sucktion"),
            r"gripper\.kind: 'sucktion' is not one of fingers, suction",
        ),
    ],
)
def test_wrong_cup_is_refused_by_its_field(model, tmp_path, change, message):
    side = yaml.safe_load(model.with_suffix(".robosandbox.yaml").read_text(encoding="utf-8"))
    change(side)
    config = tmp_path / "wrong.yaml"
    config.write_text(yaml.safe_dump(side), encoding="utf-8")
    with pytest.raises(InputError, match=message):
        load_robot(model, config)


def test_actuator_is_found_when_it_is_left_out(model, tmp_path):
    side = yaml.safe_load(model.with_suffix(".robosandbox.yaml").read_text(encoding="utf-8"))
    del side["gripper"]["actuator"]
    config = tmp_path / "short.yaml"
    config.write_text(yaml.safe_dump(side), encoding="utf-8")
    assert load_robot(model, config).sidecar.gripper.actuator_names == ("suck",)


@pytest.mark.parametrize(
    ("thing", "directions"),
    [
        (seen("box", (0.02, 0.03, 0.04)), 5),
        (seen("cylinder", (0.03, 0.05)), 1),
        (seen("cylinder", (0.03, 0.05), quat=(0.0, np.sqrt(0.5), 0.0, np.sqrt(0.5))), 2),
        (seen("sphere", (0.03,)), 0),
        (seen("bin", (0.06, 0.06, 0.05)), 4),
    ],
)
def test_faces_are_those_that_a_cup_can_come_to(thing, directions):
    found = faces(thing)
    assert len(found) == directions
    for face in found:
        # On the surface: a little inside is in its support, a little outside is not.
        outside = face.middle + 1e-4 * face.normal - thing.shape.centre(thing)
        reach = thing.shape.support(thing, face.normal[None])[0] - face.normal @ thing.shape.centre(thing)
        assert outside @ face.normal == pytest.approx(reach + 1e-4, abs=1e-6)


def test_faces_between_parts_are_none():
    left = np.array([[x, y, z] for x in (-0.04, 0.0) for y in (-0.03, 0.03) for z in (-0.03, 0.03)])
    found = faces(seen("box", (0.04, 0.03, 0.03)), (left, left + [0.04, 0.0, 0.0]))
    # Of each part's six the one below, and the one that it shares with the other, are out of reach.
    assert len(found) == 2 * (6 - 2)


def test_grasps_fit_the_cup_and_come_from_above_first(model):
    robot = load_robot(model)
    with open_session(suction.tasks(model)["pick, carton"]) as session:
        spec = session.ctx.driver.arms["arm"].spec
    target = seen("box", (0.045, 0.03, 0.06))
    scene = ObservedScene(
        objects=(target,), time=0.0, hands={"hand": None}, table_height=0.04, base_xy=(0, 0), reach=(0.1, 0.8)
    )
    grasps = list(AnalyticTopDown().candidates(target, scene, spec))
    assert len(grasps) == 5 * 8 and grasps[0].tcp_pose.rotation[2, 2] == pytest.approx(-1.0)
    small = seen("box", (0.015, 0.03, 0.015))
    # The cup is 30 mm wide and wants a millimetre around it.
    assert robot.gripper is not None and not list(AnalyticTopDown().candidates(small, scene, spec))


def test_seal_tells_how_much_of_the_lip_lies_on_something():
    angles = np.arange(12) * np.pi / 6.0
    circle = 0.01 * np.column_stack([np.cos(angles), np.sin(angles)])
    assert _inner_radius(circle) == pytest.approx(0.01 * np.cos(np.pi / 12.0))
    assert _inner_radius(circle[:7]) == pytest.approx(0.0, abs=1e-9)
    assert _inner_radius(circle[:5]) == 0.0 and _inner_radius(circle[:2]) == 0.0
    # Ten points: the circle is bounded by the chord over the two that are missing.
    assert _inner_radius(circle[:10]) == pytest.approx(0.01 * np.cos(np.pi / 4.0))


def test_driver_keeps_its_promises_with_a_cup(model):
    check_driver(open_mujoco(Scene(robot_urdf=model)))


def test_what_the_cup_pulls_is_not_told_as_pressing(model):
    with open_session(suction.tasks(model)["pick, can"]) as session:
        session.reset(1)
        assert session.run().success
        sim = session.mujoco
        sim.wait(0.5)
        weight = suction.THINGS["can"]["mass"] * 9.81
        assert float(sim.force_on("red_thing")[2]) == pytest.approx(weight, rel=0.1)
        assert sim.strongest_contact()[0] < 10.0
        assert sim.state().gripper.seal >= sim.arms["arm"].spec.gripper.geometry.seal


@pytest.mark.parametrize("name", ["pick, carton", "place_on, can", "place_in, cube", "stack, cube"])
@pytest.mark.sample(every=2)
def test_skills_work_with_a_cup(model, name):
    assert suction.run(name, suction.tasks(model)[name], 2)["done"] == 2


def test_refusal_speaks_of_the_cup(model):
    with open_session(suction.tasks(model)["pick, ball"]) as session:
        episode = session.run()
    assert "this cup holds flat faces of at least 32 mm across, and it has none" in episode.final_detail
    assert "gripper opens" not in episode.final_detail


def test_what_is_heavier_than_the_cup_holds_is_told_with_both_forces(model):
    crate = suction._object("red_thing", {"kind": "box", "size": [0.04, 0.04, 0.04], "mass": 4.6}, (0.1, 0.0))
    lifted = {"kind": "lifted", "object": "red_thing", "min_mm": 50.0}
    with open_session(suction._task(model, "pick up the red object", [crate], lifted, 0.0), what_if=False) as session:
        episode = session.run()
    assert "came off the cup under a pull of" in episode.final_detail and "the cup holds 42 N" in episode.final_detail
    assert "heavier than 4.3 kg or fixed" in episode.final_detail


class Swollen(GroundTruthPerception):
    """Sees a thin rod as a box that a cup would fit on."""

    def perceive(self, sim):
        scene = super().perceive(sim)
        return replace(scene, objects=tuple(replace(item, size=(0.02, 0.02, item.size[2])) for item in scene.objects))


def test_cup_that_leaks_says_by_how_much_and_lets_go(model):
    rod = {"kind": "box", "size": [0.006, 0.006, 0.04], "mass": 0.05}
    scene = suction.tasks(model)["pick, cube"].scene.model_dump(mode="json")
    scene["objects"] = [suction._object("red_thing", rod, (0.1, 0.0))]
    sim = open_mujoco(Scene.model_validate(scene))
    try:
        ctx = AgentContext(sim=sim, perception=Swollen(), grasp=AnalyticTopDown(), motion=DLSMotionPlanner())
        with pytest.raises(GraspError) as caught:
            Pick().run(ctx, object="red_thing")
        evidence = caught.value.evidence
        assert evidence.reason == "no_seal" and 0.0 <= evidence.seal < evidence.needed_seal
        assert "mm about its axis" in caught.value.message
        assert sim.state().gripper.closed == 0.0 and sim.in_hands()["hand"] is None
    finally:
        sim.close()
