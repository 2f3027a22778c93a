"""The judge: what it shares with skills, what it asks of contacts, and that what still topples, rolls or leans is not done."""

from __future__ import annotations

import ast
import math
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from pydantic import TypeAdapter

from robosandbox.sim.intervention import Intervention
from robosandbox.tasks.judge.checks import Check
from robosandbox.tasks.judge.polygons import depth, outline, separation, surrounded
from robosandbox.tasks.judge.rest import rests_for_good
from robosandbox.tasks.success import Criterion
from robosandbox.tasks.task import Task
from robosandbox.types import Array, Pose, Scene, SceneObject
from robosandbox.workcell.embedded import EmbeddedWorkcell
from robosandbox.workcell.session import open_session

JUDGE = Path(__file__).resolve().parents[1] / "tasks"
# A can of 40 x 100 mm on a pillar whose edge is 2 mm from its middle.
RADIUS, HALF, OVER = 0.02, 0.05, 0.018
TOP = 0.16


def test_the_judge_shares_no_code_with_skills_plans_or_agent() -> None:
    files = [*(JUDGE / "judge").glob("*.py"), JUDGE / "success.py", JUDGE / "evaluate.py"]
    assert len(files) > 8
    for file in files:
        for node in ast.walk(ast.parse(file.read_text())):
            names = [alias.name for alias in node.names] if isinstance(node, ast.Import) else []
            names += [node.module or ""] if isinstance(node, ast.ImportFrom) else []
            for name in names:
                assert not name.startswith(("robosandbox.world", "robosandbox.skills", "robosandbox.agent")), (
                    file,
                    name,
                )
                assert not name.startswith(("robosandbox.motion", "robosandbox.grasp", "robosandbox.sim")), (file, name)


@pytest.fixture(scope="module")
def pillar() -> Iterator[EmbeddedWorkcell]:
    objects = (
        SceneObject(id="pillar", kind="box", size=(0.02, 0.02, 0.06), pose=Pose(xyz=(0.15, 0.0, 0.1)), mass=2.0),
        SceneObject(id="can", kind="cylinder", size=(RADIUS, HALF), pose=Pose(xyz=(0.15, 0.0, 0.21)), mass=0.1),
        SceneObject(id="ball", kind="sphere", size=(0.02,), pose=Pose(xyz=(0.15, 0.25, 0.06)), mass=0.1),
        SceneObject(id="tray", kind="bin", size=(0.06, 0.06, 0.05), pose=Pose(xyz=(0.15, -0.25, 0.04)), mass=0.3),
    )
    task = Task.model_validate(
        {
            "name": "pillar",
            "prompt": "put the can on the pillar",
            "scene": Scene(objects=objects),
            "success": {"kind": "on", "object": "can", "target": "pillar"},
        }
    )
    with open_session(task) as session:
        yield session


def leaning(beyond: float) -> Pose:
    """The can on the pillar's edge, tilted by so many radians more than balances it there."""
    tilt = math.atan2(RADIUS - OVER, HALF) + beyond
    down = np.array([OVER - RADIUS, 0.0, HALF])
    c, s = math.cos(tilt), math.sin(tilt)
    middle = np.array([c * down[0] + s * down[2], 0.0, -s * down[0] + c * down[2]])
    x, _, z = np.array([0.15 + 0.02, 0.0, TOP]) + middle
    return Pose(xyz=(float(x), 0.0, float(z)), quat_xyzw=(0.0, math.sin(tilt / 2.0), 0.0, math.cos(tilt / 2.0)))


@pytest.mark.parametrize(("speed", "success"), [(0.0, True), (0.12, False)])
def test_a_can_that_topples_slowly_is_not_on_the_pillar(pillar: EmbeddedWorkcell, speed: float, success: bool) -> None:
    """Ten milliradians before its balance it falls back from rest, and over the edge from 0.7 degrees in 0.1 s."""
    pillar.reset(0)
    hand = Intervention(pillar.mujoco)
    hand.set_pose("can", leaning(-0.01))
    lever = math.hypot(RADIUS, HALF)
    hand.set_velocity("can", np.array([speed * lever, 0.0, 0.0]), np.array([0.0, speed, 0.0]))
    pillar.wait(0.01)
    now = pillar.truth()
    assert pillar.task.success.evaluate(pillar.start, now), "at the first look it is on the pillar"
    assert not rests_for_good(now, now)
    verdict = pillar.judge()
    assert verdict.success is success, verdict


def test_judging_moves_nothing(pillar: EmbeddedWorkcell) -> None:
    pillar.reset(0)
    before = pillar.simulation.snapshot()
    assert pillar.judge().success
    assert np.array_equal(pillar.simulation.snapshot(), before)


def finding(session: EmbeddedWorkcell, **fields: str) -> bool:
    parsed: Check = TypeAdapter(Criterion).validate_python(fields)
    return parsed.evaluate(session.start, session.truth()).holds


def test_what_leans_on_a_thing_is_not_on_it_nor_what_another_carries(pillar: EmbeddedWorkcell) -> None:
    pillar.reset(0)
    hand = Intervention(pillar.mujoco)
    # Lying on the tray's rim and on the table: neither in the tray nor on it.
    tilt = math.radians(60.0)
    lies = Pose(xyz=(0.15, -0.16, 0.072), quat_xyzw=(math.sin(tilt / 2.0), 0.0, 0.0, math.cos(tilt / 2.0)))
    hand.set_pose("can", lies)
    pillar.wait(1.5)
    assert not finding(pillar, kind="inside", object="can", target="tray")
    assert not finding(pillar, kind="on", object="can", target="tray")
    # In the tray, and as soon as nothing carries it there, not any more.
    hand.set_pose("ball", Pose(xyz=(0.15, -0.25, 0.0645)))
    pillar.wait(0.3)
    assert finding(pillar, kind="inside", object="ball", target="tray")
    hand.set_pose("ball", Pose(xyz=(0.15, -0.25, 0.075)))
    assert not finding(pillar, kind="inside", object="ball", target="tray")


def box(x: float, y: float, half: float = 1.0) -> Array:
    return np.array([(x - half, y - half), (x + half, y - half), (x + half, y + half), (x - half, y + half)])


def test_polygons_measure_as_geometry_says() -> None:
    square = outline(np.vstack([box(0.0, 0.0), [[0.0, 0.0], [1.0, 0.5]]]))
    assert len(square) == 4 and np.abs(square).min() == 1.0
    assert depth(square, np.array([0.25, 0.0])) == pytest.approx(0.75)
    assert depth(square, np.array([1.5, 0.0])) == pytest.approx(-0.5)
    assert separation(square, box(3.0, 0.5)) == pytest.approx(1.0)
    assert separation(square, box(4.0, 5.0)) == pytest.approx(math.hypot(2.0, 3.0))
    assert separation(square, box(1.5, 0.0)) == pytest.approx(-0.5)
    walls = [box(3.0 * math.cos(a), 3.0 * math.sin(a), 1.4) for a in np.arange(4) * math.pi / 2.0]
    assert surrounded(np.zeros(2), walls) is False, "the corners are open"
    corners = [box(x, y) for x in (-2.5, 2.5) for y in (-2.5, 2.5)]
    assert surrounded(np.zeros(2), [*walls, *corners])
    assert not surrounded(np.zeros(2), [*walls[1:], *corners]) and not surrounded(np.zeros(2), [])
    # From any place within, and with a thing behind a wall at any heading.
    for place in np.random.default_rng(0).uniform(-1.2, 1.2, (200, 2)):
        behind = box(*(9.0 * place / np.linalg.norm(place)), 0.1)
        assert surrounded(place, [*walls, *corners, behind]), place
        assert not surrounded(place, [*walls[1:], *corners, box(9.0, 0.0, 0.1)]), place


def test_a_copy_of_the_world_knows_what_was_felt() -> None:
    with open_session("tap_cube") as session:
        assert session.run().success
        felt = session.truth().objects["red_cube"].felt
        assert felt > 0.0 and session.judge().detail["felt_n"] == felt
