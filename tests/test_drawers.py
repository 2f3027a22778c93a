"""Drawers: opening, closing, filling, and saying why not."""

from collections.abc import Iterator

import numpy as np
import pytest
from pydantic import ValidationError
from support.performing import perform

from robosandbox.agent.context import AgentContext
from robosandbox.errors import DrawerError, InvalidArgumentError, PlacementError
from robosandbox.evidence import DrawerEvidence, PlacementEvidence
from robosandbox.robots.loader import load_robot
from robosandbox.shapes.drawer import LEAST_DRAWER
from robosandbox.sim.world import build_world
from robosandbox.skills.close_drawer import CloseDrawer
from robosandbox.skills.open_drawer import OpenDrawer
from robosandbox.skills.pick import Pick
from robosandbox.skills.place_in import PlaceIn
from robosandbox.types import Pose, Scene, SceneObject
from robosandbox.workcell.embedded import EmbeddedWorkcell
from robosandbox.workcell.session import open_session
from robosandbox.world.relations import CLOSED_WITHIN, inside

OPEN = 0.08


def drawer(**fields: object) -> SceneObject:
    return SceneObject.model_validate(
        {
            "id": "drawer",
            "kind": "drawer",
            "size": (0.2, 0.16, 0.09, 0.12),
            "pose": Pose(xyz=(0.28, 0.05, 0.04)),
            "mass": 3.0,
            **fields,
        }
    )


CUBE = SceneObject(id="cube", kind="box", size=(0.015,) * 3, pose=Pose(xyz=(0.1, -0.2, 0.055)), mass=0.05)


def session_of(*objects: SceneObject) -> EmbeddedWorkcell:
    return open_session(Scene(objects=objects), what_if=False)


@pytest.fixture
def closed() -> Iterator[EmbeddedWorkcell]:
    with session_of(drawer(), CUBE) as session:
        yield session


def opening(ctx: AgentContext) -> float:
    found = ctx.driver.simulation.truth().objects["drawer"].opening
    assert found is not None
    return found


def test_a_drawer_opens_takes_a_cube_and_shuts(closed: EmbeddedWorkcell) -> None:
    ctx = closed.ctx
    result = perform(ctx, OpenDrawer(), {"drawer": "drawer"})
    assert opening(ctx) == pytest.approx(float(result.detail["opening_mm"]) / 1e3) and opening(ctx) > OPEN
    assert not result.side_effects
    perform(ctx, Pick(), {"object": "cube"})
    perform(ctx, PlaceIn(), {"container": "drawer"})
    result = perform(ctx, CloseDrawer(), {"drawer": "drawer"})
    assert opening(ctx) < CLOSED_WITHIN and not result.side_effects
    objects = ctx.driver.simulation.truth().objects
    assert inside(objects["cube"].detected(), objects["drawer"].detected())
    assert perform(ctx, OpenDrawer(), {"drawer": "drawer"}).detail["opening_mm"] > 1e3 * OPEN


def test_what_is_open_stays_open_and_what_is_closed_stays_closed() -> None:
    with session_of(drawer(open=0.12)) as session:
        assert perform(session.ctx, OpenDrawer(), {"drawer": "drawer"}).detail["already_open"] is True
    with session_of(drawer()) as session:
        assert perform(session.ctx, CloseDrawer(), {"drawer": "drawer"}).detail["already_closed"] is True


@pytest.mark.parametrize("start", [0.0, 0.06])
def test_a_locked_drawer_is_named_as_the_cause_and_nothing_is_dragged_along(start: float) -> None:
    with session_of(drawer(locked=True, open=start)) as session:
        skill = OpenDrawer() if start == 0.0 else CloseDrawer()
        with pytest.raises(DrawerError, match=r"is locked: p.* with [0-9]+ N") as failure:
            perform(session.ctx, skill, {"drawer": "drawer"})
        evidence = failure.value.evidence
        assert isinstance(evidence, DrawerEvidence) and evidence.reason == "locked"
        assert evidence.force > 10.0 and evidence.opening == pytest.approx(start, abs=0.002)
        before, after = session.start.objects["drawer"].pose, session.simulation.truth().objects["drawer"].pose
        assert np.linalg.norm(before.position - after.position) < 0.005


def test_what_stands_out_of_a_drawer_keeps_it_open_and_is_named() -> None:
    tall = SceneObject(id="tall", kind="box", size=(0.012, 0.012, 0.06), pose=Pose(xyz=(0.15, 0.05, 0.11)), mass=0.4)
    with session_of(drawer(open=0.12), tall) as session:
        with pytest.raises(DrawerError, match="clear tall away") as failure:
            perform(session.ctx, CloseDrawer(), {"drawer": "drawer"})
        assert isinstance(failure.value.evidence, DrawerEvidence)
        assert failure.value.evidence.blocking == ("tall",)


def test_a_drawer_is_pushed_shut_by_closed_fingers_beside_a_can_that_open_ones_would_meet() -> None:
    can = SceneObject(id="can", kind="cylinder", size=(0.03, 0.05), pose=Pose(xyz=(-0.02, 0.227, 0.09)), mass=0.1)
    pose = Pose(xyz=(0.246, 0.115, 0.04), quat_xyzw=(0.0, 0.0, -0.0662, 0.9978))
    with session_of(drawer(pose=pose, open=0.1), can) as session:
        session.ctx.driver.hands["hand"].set_gripper(0.0)
        perform(session.ctx, CloseDrawer(), {"drawer": "drawer"})
        assert opening(session.ctx) < CLOSED_WITHIN
        after = session.simulation.truth().objects["can"].pose
        assert np.linalg.norm(session.start.objects["can"].pose.position - after.position) < 0.001


def test_a_hand_that_has_pushed_a_drawer_shut_steps_back_before_it_rises() -> None:
    # Risen while it pressed, the hand pulled the drawer up by friction, and pressed ever harder for it: with 100 N.
    with open_session("close_drawer", seed=0) as session:
        pressed: list[float] = []
        end = session.driver.subscribe(
            lambda: pressed.append(float(np.linalg.norm(session.driver.senses.forces().get("drawer", np.zeros(3)))))
        )
        assert session.run().success
        end()
    assert 10.0 < max(pressed) < 60.0


def test_nothing_goes_into_a_closed_drawer(closed: EmbeddedWorkcell) -> None:
    perform(closed.ctx, Pick(), {"object": "cube"})
    with pytest.raises(PlacementError, match=r"closed.*open it first") as failure:
        perform(closed.ctx, PlaceIn(), {"container": "drawer"})
    assert isinstance(failure.value.evidence, PlacementEvidence) and failure.value.evidence.reason == "closed"


def test_only_drawers_open(closed: EmbeddedWorkcell) -> None:
    with pytest.raises(InvalidArgumentError, match="cube is a box and no drawer; there is drawer"):
        perform(closed.ctx, OpenDrawer(), {"drawer": "cube"})


def test_the_stub_planner_opens_a_drawer_first_unless_it_is_open() -> None:
    for start, first in ((0.0, "open_drawer"), (0.12, "pick")):
        with session_of(drawer(open=start), CUBE) as session:
            plan = session.agent.plan("put the cube in the drawer")
            assert next(call.skill for call in plan.steps) == first  # type: ignore[union-attr]


def test_a_drawer_comes_back_with_its_checkpoint_and_copies_slide_alone() -> None:
    with session_of(drawer(open=0.05)) as session:
        kept = session.checkpoint()
        copy = session.ctx.twin()
        perform(copy, OpenDrawer(), {"drawer": "drawer"})
        assert opening(copy) > OPEN
        assert opening(session.ctx) == pytest.approx(0.05, abs=1e-4)
        perform(session.ctx, CloseDrawer(), {"drawer": "drawer"})
        session.restore(kept)
        assert opening(session.ctx) == pytest.approx(0.05, abs=1e-4)


def test_a_drawer_has_room_between_its_walls() -> None:
    smallest = drawer(size=(LEAST_DRAWER, LEAST_DRAWER, LEAST_DRAWER, 0.02))
    assert build_world(Scene(objects=(smallest,)), load_robot(None, None)).object_bodies
    with pytest.raises(ValidationError, match="leaves no room"):
        drawer(size=(0.2, 0.012, 0.09, 0.01))
