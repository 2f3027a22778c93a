"""The twin: a simulation made of what is believed, and what is tried on it beside an exact copy of the world."""

from dataclasses import replace

import numpy as np
import pytest
from support.behind import work_with
from support.performing import perform

from robosandbox import Pose, Scene, SceneObject, open_session
from robosandbox.agent.context import AgentContext
from robosandbox.agent.repairs import find_repairs
from robosandbox.drivers.hardware import Hardware
from robosandbox.errors import CollisionError, DrawerError, Repair, SkillError
from robosandbox.grasp.analytic import AnalyticTopDown
from robosandbox.motion.beliefs import DeclaredProperties, believed_scene
from robosandbox.motion.ik import DLSMotionPlanner
from robosandbox.perception.factory import Setup
from robosandbox.perception.rgbd import RgbdPerception
from robosandbox.sim.opening import require_mujoco
from robosandbox.skills.catalogue import load_skills
from robosandbox.skills.pick import Pick
from robosandbox.types import SkillCall
from robosandbox.workcell.embedded import EmbeddedWorkcell
from robosandbox.world.alternatives import FailedCall
from robosandbox.world.operators import bind

RED, BLUE = (0.85, 0.2, 0.2, 1.0), (0.2, 0.2, 0.85, 1.0)
CUP = SceneObject(id="cup", kind="cup", size=(0.03, 0.09), pose=Pose(xyz=(0.12, -0.12, 0.04)))
BEADS = SceneObject(id="beads", kind="beads", size=(0.006,), count=3, inside="cup")
CHEST = SceneObject(
    id="drawer", kind="drawer", size=(0.2, 0.16, 0.09, 0.12), pose=Pose(xyz=(0.28, 0.05, 0.04)), open=0.1, mass=3.0
)
CUBE = SceneObject(id="cube", kind="box", size=(0.02,) * 3, pose=Pose(xyz=(0.1, -0.2, 0.061)), rgba=RED)


def block(name: str, x: float, y: float, *, mass: float = 0.05) -> SceneObject:
    return SceneObject(id=name, kind="box", size=(0.02,) * 3, pose=Pose(xyz=(x, y, 0.061)), rgba=BLUE, mass=mass)


def test_the_twin_is_as_what_is_believed() -> None:
    with open_session(Scene(objects=(CUP, BEADS, CHEST, CUBE))) as session:
        assert session.run("pick up the cube").success
        truth = session.simulation.truth()
        twin = session.ctx.twin().driver
        twin = require_mujoco(twin, "it is a model of what is believed")
        assert twin.model is not session.mujoco.model
        believed = twin.truth()
        assert believed.held == truth.held == "cube"
        assert believed.time > truth.time and np.abs(believed.arms["arm"].q - truth.arms["arm"].q).max() < 2e-3
        for name, item in truth.objects.items():
            other = believed.objects[name]
            assert np.linalg.norm(other.pose.position - item.pose.position) < 1e-3, name
            assert len(other.grains) == len(item.grains)
        opening = believed.objects["drawer"].opening
        assert opening == pytest.approx(0.1, abs=1e-3)
        twin.wait(1.0)
        assert twin.in_hands() == {"hand": "cube"}
        assert session.simulation.truth().time == truth.time


def test_of_what_is_seen_the_task_tells_the_mass_or_the_density_of_plastic_does() -> None:
    with open_session(Scene(objects=(CUBE, block("other", 0.2, 0.2, mass=0.3)))) as session:
        seen = session.observe()
        made = believed_scene(
            Scene(), seen.objects, {"other": DeclaredProperties.of(session.simulation.scene.objects[1])}
        )
    assert [item.mass for item in made.objects] == pytest.approx([0.064, 0.3])


def test_grains_without_a_container_are_left_out() -> None:
    with open_session(Scene(objects=(CUP, BEADS))) as session:
        seen = session.observe()
    assert [item.id for item in believed_scene(Scene(), seen.objects, {}).objects] == ["cup", "beads"]
    spilt = tuple(item for item in seen.objects if item.id == "beads")
    assert believed_scene(Scene(), spilt, {}).objects == ()


def test_what_is_not_seen_is_not_in_the_twin() -> None:
    with open_session(Scene(objects=(CUBE, block("other", 0.2, 0.2)))) as session:
        seen = session.observe()
        twin = session.ctx.planning(replace(seen, objects=seen.objects[:1])).twin(session.ctx.arm.state())
        assert list(twin.simulation.truth().objects) == ["cube"]


def test_a_pick_on_the_twin_takes_as_long_as_on_an_exact_copy() -> None:
    with open_session(Scene(objects=(CUBE,))) as session:
        ctx, seconds = session.ctx.twin(), []
        for sim in (session.simulation.fork(), ctx.driver):
            begin = sim.time
            perform(work_with(ctx, sim), Pick(), {"object": "cube"})
            seconds.append(sim.time - begin)
    assert seconds[0] == pytest.approx(seconds[1], abs=0.05)


def on_exact_copy(session: EmbeddedWorkcell) -> type[AgentContext]:
    """Return a context that tries things out on an exact copy of the world in place of the twin."""

    class Exact(AgentContext):
        def twin(self) -> AgentContext:
            return work_with(super().twin(), session.simulation.fork())

    return Exact


def found_both_ways(session: EmbeddedWorkcell, call: SkillCall, kind: type[SkillError]) -> list[tuple[Repair, ...]]:
    session.ctx.what_if = False
    before = session.observe()
    with pytest.raises(kind) as failed:
        session.agent.perform(call)
    contract = bind(call, session.agent.skills).contract
    failure = FailedCall(
        call=call,
        error=failed.value.failure,
        contract=contract.resolved(before),
        before=before,
        scene=session.observe(),
    )
    twin = find_repairs(session.ctx, failure)
    session.ctx.__class__ = on_exact_copy(session)
    return [twin, find_repairs(session.ctx, failure)]


TALL = SceneObject(id="block", kind="box", size=(0.015, 0.015, 0.045), pose=Pose(xyz=(0.15, 0.05, 0.115)), rgba=BLUE)


@pytest.mark.slow
def test_the_twin_gives_the_repairs_that_an_exact_copy_gives_for_a_drawer_that_jams() -> None:
    with open_session(Scene(objects=(CHEST, TALL))) as session:
        call = SkillCall(skill="close_drawer", arguments={"drawer": "drawer"})
        twin, copy = found_both_ways(session, call, DrawerError)
    assert twin and [repair.calls for repair in twin] == [repair.calls for repair in copy]
    assert [repair.cost for repair in twin] == pytest.approx([repair.cost for repair in copy], abs=0.1)
    assert not any(repair.believed for repair in twin)


@pytest.mark.slow
def test_the_twin_gives_repairs_that_an_exact_copy_gives_for_a_cube_that_is_enclosed() -> None:
    sides = ((0.043, 0.0), (-0.043, 0.0), (0.0, 0.043), (0.0, -0.043))
    around = tuple(block(f"blue_{k}", 0.15 + dx, dy) for k, (dx, dy) in enumerate(sides))
    cube = CUBE.model_copy(update={"pose": Pose(xyz=(0.15, 0.0, 0.061))})
    with open_session(Scene(objects=(cube, *around))) as session:
        twin, copy = found_both_ways(session, SkillCall(skill="pick", arguments={"object": "cube"}), CollisionError)
    # The fingers rub along what is left beside the cube, so that a tenth of a millimetre decides whether it comes along.
    calls = [repair.calls for repair in copy]
    assert twin and all(repair.calls in calls for repair in twin)


@pytest.mark.gl
@pytest.mark.slow
def test_a_driver_that_cannot_be_copied_has_repairs_too() -> None:
    on_top = SceneObject(id="lid", kind="box", size=(0.018,) * 3, pose=Pose(xyz=(0.1, -0.2, 0.1)), rgba=BLUE)
    scene = Scene(objects=(CUBE, on_top))
    robot = Hardware(scene)
    perception = RgbdPerception(setup=Setup.of(scene))
    ctx = AgentContext(sim=robot, perception=perception, grasp=AnalyticTopDown(), motion=DLSMotionPlanner())
    ctx.skills = {skill.name: skill for skill in load_skills()}
    with pytest.raises(SkillError) as failed:
        perform(ctx, Pick(), {"object": "cube"})
    robot.close()
    assert failed.value.repairs and all(repair.believed for repair in failed.value.repairs)
