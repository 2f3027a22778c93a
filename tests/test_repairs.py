"""Repairs are tried on the twin, offered with the error, and used by the planner."""

import numpy as np
import pytest
from support.performing import perform

from robosandbox import Pose, Scene, SceneObject, open_session
from robosandbox.errors import CollisionError, ErrorCode, GraspError


def block(name: str, x: float, y: float, rgba: tuple[float, float, float, float]) -> SceneObject:
    return SceneObject(id=name, kind="box", size=(0.02,) * 3, pose=Pose(xyz=(x, y, 0.061)), rgba=rgba)


RED, BLUE = (0.85, 0.2, 0.2, 1.0), (0.2, 0.2, 0.85, 1.0)
SIDES = ((0.043, 0.0), (-0.043, 0.0), (0.0, 0.043), (0.0, -0.043))
ENCLOSED = Scene(
    objects=(
        block("red_cube", 0.15, 0.0, RED),
        *(block(f"blue_{k}", 0.15 + dx, dy, BLUE) for k, (dx, dy) in enumerate(SIDES)),
    )
)


@pytest.mark.slow
def test_enclosed_cube_is_picked_after_the_repair_that_the_copy_showed() -> None:
    with open_session(ENCLOSED) as session:
        episode = session.run("pick up the red cube")
        assert episode.success and session.simulation.truth().held == "red_cube"
        (attempt,) = episode.attempts
        repairs = attempt.error.repairs
        assert repairs and all(repair.calls[-1] == attempt.failed for repair in repairs)
        assert tuple(step.call for step in episode.steps) == repairs[0].calls


def test_what_moves_the_fewest_others_is_offered_first_and_done() -> None:
    around = tuple(block(f"blue_{k}", 0.15 + dx, dy, BLUE) for k, (dx, dy) in enumerate(SIDES[:3]))
    with open_session(Scene(objects=(block("red_cube", 0.15, 0.0, RED), *around))) as session:
        episode = session.run("pick up the red cube")
        assert episode.success and session.simulation.truth().held == "red_cube"
        (attempt,) = episode.attempts
        assert attempt.error.code == ErrorCode.COLLISION
        repairs = attempt.error.repairs
        picked = [{call.arguments.get("object") for call in repair.calls} for repair in repairs]
        others = [len(ids - {None, "red_cube"}) for ids in picked]
        assert others == sorted(others) and others[0] == 1
        assert tuple(step.call for step in episode.steps) == repairs[0].calls


@pytest.mark.slow
def test_repairs_are_made_of_the_skills_of_the_agent() -> None:
    with open_session(ENCLOSED) as session:
        pick = session.agent.skills["pick"]
        with pytest.raises((GraspError, CollisionError)) as caught:
            perform(session.ctx, pick, {"object": "red_cube"})
        used = {call.skill for repair in caught.value.repairs for call in repair.calls}
        assert used > {"pick"}
        for name in used - {"pick"}:
            del session.agent.skills[name]
        with pytest.raises((GraspError, CollisionError)) as caught:
            perform(session.ctx, pick, {"object": "red_cube"})
        left = {call.skill for repair in caught.value.repairs for call in repair.calls}
        assert left.isdisjoint(used - {"pick"})


@pytest.mark.slow
def test_looking_for_repairs_leaves_the_world_as_it_is() -> None:
    with open_session(ENCLOSED) as session:
        before = session.simulation.snapshot()
        skill = next(skill for skill in session.skills if skill.name == "pick")
        with pytest.raises(CollisionError) as failed:
            perform(session.ctx, skill, {"object": "red_cube"})
        assert failed.value.repairs
        assert np.array_equal(session.simulation.snapshot(), before)


def test_nothing_is_tried_where_nothing_may_move() -> None:
    around = tuple(block(f"blue_{k}", 0.15 + dx, dy, BLUE) for k, (dx, dy) in enumerate(SIDES[:3]))
    with open_session(Scene(objects=(block("red_cube", 0.15, 0.0, RED), *around))) as session:
        pick = session.agent.skills["pick"]
        for fault in ("a servo is silent", ""):
            session.ctx.driver.safety.fault = fault
            with pytest.raises(CollisionError) as caught:
                perform(session.ctx, pick, {"object": "red_cube"})
            assert bool(caught.value.repairs) == (not fault)


def test_search_ends_with_its_budget_of_simulated_seconds(caplog: pytest.LogCaptureFixture) -> None:
    with open_session(ENCLOSED) as session:
        session.ctx.what_if_seconds = 0.2
        skill = next(skill for skill in session.skills if skill.name == "pick")
        with pytest.raises(CollisionError) as failed:
            perform(session.ctx, skill, {"object": "red_cube"})
        assert failed.value.repairs == ()
        # Time that is used up is no fault of a skill.
        assert [record.message for record in caplog.records if record.levelname == "ERROR"] == []


@pytest.mark.slow
def test_without_what_if_there_are_no_repairs() -> None:
    with open_session(ENCLOSED, what_if=False) as session:
        episode = session.run("pick up the red cube")
        assert episode.attempts
        assert all(not attempt.error.repairs for attempt in episode.attempts)


def test_what_nothing_can_help_has_no_repairs() -> None:
    wide = SceneObject(id="red_box", kind="box", size=(0.06, 0.06, 0.02), pose=Pose(xyz=(0.15, 0.0, 0.061)), rgba=RED)
    with open_session(Scene(objects=(wide,))) as session:
        skill = next(skill for skill in session.skills if skill.name == "pick")
        with pytest.raises(GraspError) as failed:
            perform(session.ctx, skill, {"object": "red_box"})
        assert failed.value.repairs == ()


def standing(name: str, xy: tuple[float, float], size: tuple[float, float, float], z: float = 0.0) -> SceneObject:
    pose = Pose(xyz=(*xy, z or 0.041 + size[2]))
    return SceneObject(id=name, kind="box", size=size, pose=pose, rgba=BLUE, mass=0.1)


def chest(opening: float = 0.0) -> SceneObject:
    size, pose = (0.2, 0.16, 0.09, 0.12), Pose(xyz=(0.28, 0.05, 0.04))
    return SceneObject(id="drawer", kind="drawer", size=size, pose=pose, mass=3.0, open=opening)


IN_FRONT = Scene(objects=(chest(), standing("block", (0.12, 0.05), (0.02, 0.02, 0.03))))
TOO_TALL = Scene(objects=(chest(0.1), standing("block", (0.15, 0.05), (0.015, 0.015, 0.045), 0.115)))


@pytest.mark.parametrize(("scene", "prompt"), [(IN_FRONT, "open the drawer"), (TOO_TALL, "close the drawer")])
@pytest.mark.sample(every=2)
def test_what_keeps_a_drawer_from_sliding_is_put_aside(scene: Scene, prompt: str) -> None:
    with open_session(scene) as session:
        episode = session.run(prompt)
        assert episode.success, episode.final_detail
        (attempt,) = episode.attempts
        told = {repair.why for repair in attempt.error.repairs}
        aside, pushed = "block is in the way and is put aside first", "block is pushed out of the way first"
        assert told & ({aside, pushed} if scene is IN_FRONT else {aside}), told
        opening = session.simulation.truth().objects["drawer"].opening
        assert opening is not None and (opening > 0.08) == (scene is IN_FRONT)


@pytest.mark.slow
def test_what_is_in_the_way_of_pouring_is_put_aside() -> None:
    cup = SceneObject(id="cup", kind="cup", size=(0.03, 0.09), pose=Pose(xyz=(0.12, -0.12, 0.04)), mass=0.12)
    bowl = SceneObject(id="bowl", kind="bowl", size=(0.075, 0.06), pose=Pose(xyz=(0.15, 0.15, 0.04)), mass=0.3)
    beads = SceneObject(id="beads", kind="beads", size=(0.006,), count=3, inside="cup", mass=0.01)
    tower = standing("tower", (0.05, 0.12), (0.02, 0.02, 0.11))
    with open_session(Scene(objects=(cup, bowl, beads, tower))) as session:
        episode = session.run("pour the beads into the bowl")
        assert episode.success, episode.final_detail
        assert episode.attempts[0].error.code == ErrorCode.COLLISION
        assert episode.attempts[0].error.repairs[0].why == "from another start"
