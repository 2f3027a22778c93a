"""What the arm hides from the cameras is told, and looked for from aside before somebody hears that it is not there."""

from __future__ import annotations

import pytest

from robosandbox.skills.events import SkillStarted
from robosandbox.types import Pose, Scene, SceneObject
from robosandbox.workcell.embedded import EmbeddedWorkcell
from robosandbox.workcell.session import open_session

UNDER_THE_HAND = SceneObject(
    id="red_cube", kind="box", size=(0.015, 0.015, 0.015), pose=Pose(xyz=(0.25, 0.0, 0.055)), rgba=(0.85, 0.2, 0.2, 1.0)
)


def from_above(*objects: SceneObject) -> EmbeddedWorkcell:
    """Open a world that is seen by one camera, over the table, under which the bundled arm stands."""
    return open_session(Scene(objects=objects), perception="rgbd", perception_options={"cameras": ("top",)})


def called(cell: EmbeddedWorkcell) -> list[str]:
    calls: list[str] = []
    cell.ctx.events.subscribe(lambda event: calls.append(event.call.skill) if isinstance(event, SkillStarted) else None)
    return calls


@pytest.mark.gl
def test_what_the_arm_hides_is_looked_for_from_aside() -> None:
    with from_above(UNDER_THE_HAND) as cell:
        calls, before = called(cell), cell.observe()
        assert not before.objects and before.unseen > 0.05, "the hand is right over the cube"
        episode = cell.run("pick up the red cube")
        assert episode.success, episode.final_detail
        assert calls == ["step_aside", "pick"]
        assert cell.simulation.truth().held == "red_cube"


@pytest.mark.gl
def test_what_is_not_there_is_looked_for_once_and_what_stays_hidden_is_told() -> None:
    with from_above() as cell:
        calls, before = called(cell), cell.observe().unseen
        episode = cell.run("pick up the red cube")
        assert not episode.success
        assert calls == ["step_aside"]
        assert cell.observe().unseen < before / 2.0
        assert episode.final_detail.startswith("I see no red cube")
        assert "the arm has hidden" in episode.final_detail, "its base stands on something"


@pytest.mark.gl
def test_what_was_seen_past_the_arm_once_is_not_looked_for_again() -> None:
    with from_above() as cell:
        cell.do("step_aside")
        seen = cell.observe().unseen
        cell.do("home")
        assert cell.observe().unseen == seen


def test_who_sees_the_truth_has_nothing_to_uncover() -> None:
    with open_session(Scene(objects=(UNDER_THE_HAND,))) as cell:
        before = cell.state().q
        assert "nothing" in cell.do("step_aside").found
        assert (cell.state().q == before).all()
        assert cell.observe().unseen == 0.0
