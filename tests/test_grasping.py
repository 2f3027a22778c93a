"""Grasps and placements on real physics: one of each kind, alone and between neighbours."""

import math
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from itertools import islice
from pathlib import Path

import numpy as np
import pytest
from support.listening import on_phases

from robosandbox.apps.bench.bench import run_bench
from robosandbox.errors import CollisionError, GraspError, Phase
from robosandbox.evidence import CollisionEvidence, GraspEvidence
from robosandbox.grasp.analytic import AnalyticTopDown
from robosandbox.grasp.hand import FRICTION
from robosandbox.skills.primitives.carrying import MOST_TILT
from robosandbox.skills.primitives.grasping import plan_grasp
from robosandbox.skills.primitives.gripping import landing, needed_force
from robosandbox.skills.primitives.lifting import free_of_others
from robosandbox.skills.primitives.manipulator import Manipulator
from robosandbox.skills.primitives.nudging import ways_off
from robosandbox.tasks.loader import bundled_tasks, find_task
from robosandbox.types import DetectedObject, Pose, Scene, SceneObject, SkillCall, Timing
from robosandbox.workcell.embedded import EmbeddedWorkcell
from robosandbox.workcell.session import open_session
from robosandbox.world.relations import inside, on_top

LYING = (0.0, math.sqrt(0.5), 0.0, math.sqrt(0.5))
ON_EDGE = (math.sqrt(0.5), 0.0, 0.0, math.sqrt(0.5))


def thing(
    name: str,
    kind: str,
    size: Sequence[float],
    xyz: tuple[float, float, float],
    quat: tuple[float, float, float, float] = (0.0, 0.0, 0.0, 1.0),
    **more: object,
) -> SceneObject:
    fields = {"id": name, "kind": kind, "size": size, "pose": Pose(xyz=xyz, quat_xyzw=quat), "mass": 0.1, **more}
    return SceneObject.model_validate(fields)


@contextmanager
def world(*objects: SceneObject) -> Iterator[EmbeddedWorkcell]:
    with open_session(Scene(objects=objects), what_if=False) as session:
        yield session


def do(session: EmbeddedWorkcell, skill: str, **arguments: object) -> None:
    session.agent.perform(SkillCall(skill=skill, arguments=dict(arguments)))


def seen(session: EmbeddedWorkcell, name: str) -> DetectedObject:
    found = session.observe().find(name)
    assert found is not None
    return found


@pytest.fixture
def wedge(tmp_path: Path) -> Path:
    """A mesh that is no box: a prism with a five-cornered end."""
    angles = [2.0 * math.pi * k / 5 for k in range(5)]
    ends = [(0.02 * math.cos(a), 0.02 * math.sin(a), z) for z in (-0.03, 0.03) for a in angles]
    sides = [(k + 1, (k + 1) % 5 + 1, k + 6) for k in range(5)] + [
        ((k + 1) % 5 + 1, (k + 1) % 5 + 6, k + 6) for k in range(5)
    ]
    caps = [(1, k + 2, k + 1) for k in range(1, 4)] + [(6, k + 6, k + 7) for k in range(1, 4)]
    lines = [f"v {x} {y} {z}" for x, y, z in ends] + [f"f {a} {b} {c}" for a, b, c in sides + caps]
    path = tmp_path / "prism.obj"
    path.write_text("\n".join(lines) + "\n")
    return path


@pytest.mark.parametrize(
    "item",
    [
        thing("it", "cylinder", (0.02, 0.04), (0.15, 0.0, 0.061), LYING),
        thing("it", "cylinder", (0.03, 0.012), (0.15, 0.0, 0.071), ON_EDGE),
        thing("it", "capsule", (0.015, 0.03), (0.15, 0.0, 0.056), LYING),
        thing("it", "box", (0.015, 0.10, 0.02), (0.15, 0.0, 0.061)),
        thing("it", "box", (0.02, 0.02, 0.08), (0.15, 0.0, 0.121)),
        thing("it", "bowl", (0.06, 0.05), (0.15, 0.0, 0.042)),
        thing("it", "cup", (0.045, 0.09), (0.15, 0.0, 0.042)),
        thing("it", "bin", (0.07, 0.05, 0.05), (0.15, 0.0, 0.042)),
    ],
    ids=["lying can", "disc on its edge", "capsule", "long block", "tall block", "bowl", "mug", "bin"],
)
def test_everything_of_a_size_is_held_and_lifted(item: SceneObject) -> None:
    with world(item) as session:
        do(session, "pick", object="it")
        now = seen(session, "it")
        assert now.pose.xyz[2] - item.pose.xyz[2] > 0.1 and session.simulation.truth().held == "it"


def test_a_mesh_is_held_across_its_faces(wedge: Path) -> None:
    with world(thing("it", "mesh", (), (0.15, 0.0, 0.071), mesh=wedge)) as session:
        do(session, "pick", object="it")
        assert session.simulation.truth().held == "it"


def test_fingers_choose_the_side_that_neighbours_leave_free() -> None:
    """Walls 14 mm from the cube on two sides: of its four straight grasps two have room, and nothing else moves."""
    walls = [thing(f"wall{y}", "box", (0.05, 0.015, 0.035), (0.15, y, 0.076), mass=0.05) for y in (-0.049, 0.049)]
    with world(thing("it", "box", (0.02,) * 3, (0.15, 0.0, 0.061)), *walls) as session:
        before = [seen(session, wall.id).pose for wall in walls]
        do(session, "pick", object="it")
        for wall, pose in zip(walls, before, strict=True):
            assert np.linalg.norm(seen(session, wall.id).pose.position - pose.position) < 0.001


def test_what_has_no_room_is_refused_with_the_neighbour_named() -> None:
    sides = [(0.046, 0.0), (-0.046, 0.0), (0.0, 0.046), (0.0, -0.046)]
    walls = [
        thing(f"wall{k}", "box", (0.02, 0.02, 0.05), (0.15 + x, y, 0.091), mass=1.0) for k, (x, y) in enumerate(sides)
    ]
    with (
        world(thing("it", "box", (0.02,) * 3, (0.15, 0.0, 0.061)), *walls) as session,
        pytest.raises((CollisionError, GraspError), match="wall"),
    ):
        do(session, "pick", object="it")


def test_candidates_come_lazily_and_the_plain_ones_first() -> None:
    with world(thing("it", "box", (0.02, 0.03, 0.02), (0.15, 0.0, 0.061))) as session:
        scene, robot = session.observe(), session.mujoco.robot
        first = list(islice(AnalyticTopDown().candidates(seen(session, "it"), scene, robot), 4))
        assert {grasp.how for grasp in first} == {"top-down"}
        every = {grasp.how for grasp in AnalyticTopDown().candidates(seen(session, "it"), scene, robot)}
        assert {"top-down", "angled", "side"} <= every


def test_the_grip_is_as_firm_as_the_load_asks_for() -> None:
    forces = []
    for mass in (0.05, 0.4):
        with world(thing("it", "cylinder", (0.025, 0.035), (0.15, 0.0, 0.077), mass=mass)) as session:
            do(session, "pick", object="it")
            arm = Manipulator(session.ctx)
            force = session.driver.hands["hand"].grip_on("it")
            assert force > 0.8 * needed_force(arm, seen(session, "it"), mass)
            forces.append(force)
    assert forces[1] > 1.5 * forces[0]


def test_no_hand_leans_so_far_that_its_pads_slide_off_the_faces() -> None:
    with world(thing("it", "box", (0.02, 0.011, 0.016), (0.055, 0.125, 0.057))) as session:
        robot, scene = session.driver.arms["arm"].spec, session.observe()
        found = list(AnalyticTopDown().candidates(seen(session, "it"), scene, robot))
    # The box stands along the world's axes: the largest component of a closing line is the cosine to a face's normal.
    askew = [math.acos(min(1.0, float(np.abs(grasp.tcp_pose.rotation[:, 1]).max()))) for grasp in found]
    tilts = [math.degrees(math.acos(min(1.0, -float(grasp.tcp_pose.rotation[2, 2])))) for grasp in found]
    assert max(askew) <= math.atan(FRICTION) + 1e-9
    assert max(askew) > math.radians(14.0), "hands that lean within it are kept"
    assert max(tilt for grasp, tilt in zip(found, tilts, strict=True) if grasp.how == "angled") > 44.0


def test_what_is_held_hard_comes_down_slower_in_proportion() -> None:
    with world(thing("it", "cylinder", (0.025, 0.035), (0.15, 0.0, 0.077))) as session:
        do(session, "pick", object="it")
        arm, lower = Manipulator(session.ctx), session.ctx.tempo.lower
        assert isinstance(lower, Timing)
        assert 2.0 * session.driver.hands["hand"].grip_on("it") < session.ctx.max_force_n
        assert landing(arm, seen(session, "it"), lower) == lower
        arm.close()
        passed_on = 2.0 * session.driver.hands["hand"].grip_on("it")
        assert passed_on > session.ctx.max_force_n
        slower = landing(arm, seen(session, "it"), lower)
        assert slower.arrival == pytest.approx(lower.arrival * session.ctx.max_force_n / passed_on)


def test_a_full_bin_is_filled_without_touching_it() -> None:
    """Five things in a bin of 14 cm: each finds its own room, and the hand keeps off the walls."""
    things = [thing(f"cube{k}", "box", (0.017,) * 3, (0.05 + 0.06 * k, -0.15, 0.058)) for k in range(5)]
    bin_ = thing("bin", "bin", (0.07, 0.07, 0.05), (0.15, 0.15, 0.042), mass=0.3)
    with world(*things, bin_) as session:
        before = seen(session, "bin").pose.position
        for item in things:
            do(session, "pick", object=item.id)
            do(session, "place_in", container="bin")
        assert all(inside(seen(session, item.id), seen(session, "bin")).holds for item in things)
        assert np.linalg.norm(seen(session, "bin").pose.position - before) < 0.001


def test_a_cup_with_something_in_it_is_carried_level() -> None:
    cup = thing("cup", "cup", (0.028, 0.06), (0.05, -0.25, 0.042))
    ball = thing("ball", "sphere", (0.012,), (0.05, -0.25, 0.06), mass=0.01)
    block = thing("block", "box", (0.05, 0.05, 0.02), (0.2, 0.25, 0.061), mass=0.5)
    with world(cup, ball, block) as session:
        do(session, "pick", object="cup")
        leans: list[float] = []
        session.driver.subscribe(
            lambda: leans.append(float(np.arccos(np.clip(seen(session, "cup").pose.rotation[2, 2], -1.0, 1.0))))
        )
        do(session, "place_on", target="block")
        assert on_top(seen(session, "cup"), seen(session, "block")).holds
        assert inside(seen(session, "ball"), seen(session, "cup")).holds
        assert max(leans) <= MOST_TILT + np.radians(2.0)


# The fewest objects first: of a sampled family the first member always runs.
CLUTTER = sorted(
    (name for name in bundled_tasks() if find_task(name).suite == "clutter"),
    key=lambda name: len(find_task(name).scene.objects),
)


@pytest.mark.parametrize("name", CLUTTER)
@pytest.mark.sample(every=6)
def test_each_clutter_task_succeeds_as_claimed_and_touches_nothing_else(name: str) -> None:
    (row,) = run_bench([find_task(name)], 1)
    assert row.success and row.claimed, row.detail
    assert row.touched == () and row.worst_force_n == 0.0


def test_fingers_do_not_close_on_a_wall_between_them_and_the_object() -> None:
    # The hand would open around both, and a finger outside the plate would close on it.
    cube = thing("cube", "box", (0.012, 0.03, 0.02), (0.15, 0.0, 0.0605))
    plates = [thing(f"plate_{s}", "box", (0.002, 0.05, 0.022), (0.15 + s * 0.018, 0.0, 0.0625)) for s in (-1, 1)]
    with world(cube, *plates) as session:
        arm = Manipulator(session.ctx)
        plan = plan_grasp(arm, arm.find("cube"), arm.start)
        closing = plan.grasp.tcp_pose.rotation[:, 1]
        assert abs(float(closing[0])) < 0.1, "along the plates is the only way in"
    wide = thing("cube", "box", (0.012, 0.045, 0.02), (0.15, 0.0, 0.0605))
    with world(wide, *plates) as session:
        arm = Manipulator(session.ctx)
        with pytest.raises(CollisionError):
            plan_grasp(arm, arm.find("cube"), arm.start)


def test_what_lies_in_the_corner_of_a_bin_is_refused_without_touching_the_bin() -> None:
    bin_ = thing("bin", "bin", (0.07, 0.07, 0.08), (0.15, 0.0, 0.04), mass=0.3)
    box = thing("red_box", "box", (0.013, 0.016, 0.017), (0.205, 0.052, 0.0615))
    with world(bin_, box) as session:
        before = seen(session, "bin").pose
        with pytest.raises(CollisionError) as refused:
            do(session, "pick", object="red_box")
        assert refused.value.phase == Phase.PLAN and seen(session, "bin").pose == before


def test_a_hand_around_a_thing_and_a_wall_does_not_hold_the_thing() -> None:
    cube = thing("cube", "box", (0.012, 0.012, 0.02), (0.15, 0.0, 0.0605))
    plate = thing("plate", "box", (0.012, 0.004, 0.02), (0.15, 0.017, 0.0605))
    with world(cube, plate) as session:
        arm = Manipulator(session.ctx)
        arm.use(arm.start)
        arm.motion.allow("cube", "plate", "table")
        down = np.diag([1.0, -1.0, -1.0])
        above, there = (Pose.from_matrix(np.array([0.15, 0.004, z]), down) for z in (0.15, 0.06))
        way = arm.motion.plan_joints(arm.q, arm.motion.ik(above), speed=0.5)
        arm.follow(way, Phase.APPROACH)
        arm.follow(arm.motion.plan_line(arm.q, there, speed=0.3), Phase.DESCEND)
        arm.hand.set_gripper(1.0, 20.0)
        arm.wait_for_fingers()
        target = arm.find("cube")
        with pytest.raises(GraspError) as wedged:
            free_of_others(arm, target, arm.start, 0.024, 0.0)
        evidence = wedged.value.evidence
        assert isinstance(evidence, GraspEvidence) and evidence.reason == "wedged" and evidence.touching == ("plate",)
        plate_alone = arm.look()
        arm.open()
        free_of_others(arm, target, plate_alone, 0.024, 0.0)


def test_what_lies_at_the_walls_of_a_bin_is_dragged_off_them_by_its_top_and_picked() -> None:
    bin_ = thing("bin", "bin", (0.085, 0.1, 0.05), (0.15, 0.0, 0.04), mass=0.3)
    ball = thing("red_ball", "sphere", (0.022,), (0.15 + 0.06, 0.075, 0.0665))
    with world(bin_, ball) as session:
        before = seen(session, "bin").pose.position
        pressed: list[float] = []
        session.driver.subscribe(lambda: pressed.append(float(np.linalg.norm(session.driver.senses.force_on("bin")))))
        phases: list[str] = []
        on_phases(session.ctx.events, phases.append)
        do(session, "pick", object="red_ball")
        assert Phase.PUSH in phases, "without a nudge there is no room for a finger"
        assert np.linalg.norm(seen(session, "bin").pose.position - before) < 0.001 and max(pressed) < 1.0


def test_ways_off_walls_leave_room_for_a_finger() -> None:
    bin_ = thing("bin", "bin", (0.085, 0.1, 0.05), (0.15, 0.0, 0.04), mass=0.3)
    box = thing("red_box", "box", (0.02, 0.015, 0.02), (0.15 + 0.062, 0.0, 0.0645))
    with world(bin_, box) as session:
        arm = Manipulator(session.ctx)
        (away,) = ways_off(arm.find("red_box"), arm.start, 0.03)
        assert away == pytest.approx([-0.027, 0.0, 0.0], abs=1e-3)
        assert list(ways_off(arm.find("red_box"), arm.start, 0.002)) == []


def test_the_failure_that_is_told_names_what_can_be_put_aside_before_what_is_fixed() -> None:
    with world(thing("it", "box", (0.02,) * 3, (0.15, 0.0, 0.061))) as session:
        arm = Manipulator(session.ctx)
        met = {
            other: CollisionError(
                f"the hand would touch {other}",
                phase=Phase.PLAN,
                evidence=CollisionEvidence(body="hand", other=other, waypoint=1, waypoints=1, depth=0.01),
            )
            for other in ("table", "it")
        }
        assert arm.clearest(list(met.values())).message == met["it"].message
        assert arm.clearest([met["table"]]).message == met["table"].message
