"""Repairs are tried on a copy of the world, offered with the error, and used by the planner."""

import numpy as np
import pytest

from robosandbox import Pose, Scene, SceneObject, open_session
from robosandbox.errors import CollisionError, GraspError


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


def test_enclosed_cube_is_picked_after_the_repair_that_the_copy_showed() -> None:
    with open_session(ENCLOSED) as session:
        episode = session.run("pick up the red cube")
        assert episode.success and session.sim.truth().held == "red_cube"
        (attempt,) = episode.attempts
        repairs = attempt.error.repairs
        assert repairs and [repair.cost for repair in repairs] == sorted(repair.cost for repair in repairs)
        assert tuple(step.call for step in episode.steps) == repairs[0].calls


def test_looking_for_repairs_leaves_the_world_as_it_is() -> None:
    with open_session(ENCLOSED) as session:
        before = session.sim.snapshot()
        skill = next(skill for skill in session.skills if skill.name == "pick")
        with pytest.raises(CollisionError) as failed:
            skill(session.ctx, {"object": "red_cube"})
        assert failed.value.repairs
        assert np.array_equal(session.sim.snapshot(), before)


def test_search_ends_with_its_budget_of_simulated_seconds() -> None:
    with open_session(ENCLOSED) as session:
        session.ctx.what_if_seconds = 0.2
        skill = next(skill for skill in session.skills if skill.name == "pick")
        with pytest.raises(CollisionError) as failed:
            skill(session.ctx, {"object": "red_cube"})
        assert failed.value.repairs == ()


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
            skill(session.ctx, {"object": "red_box"})
        assert failed.value.repairs == ()
