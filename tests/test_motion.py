import itertools
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace

import mujoco
import numpy as np
import pytest
from support.written_arms import written

from robosandbox.errors import CollisionError, UnreachableError
from robosandbox.motion.collision import CollisionChecker
from robosandbox.motion.ik import DLSMotionPlanner
from robosandbox.motion.planning_scene import PlanningScene
from robosandbox.motion.sampling import find_knots
from robosandbox.motion.timing import spline, time_path
from robosandbox.perception.ground_truth import GroundTruthPerception
from robosandbox.sim.mujoco_backend import MuJoCoBackend
from robosandbox.skills.primitives.manipulator import Manipulator
from robosandbox.types import Pose, Scene, SceneObject
from robosandbox.workcell.session import open_session

POST = SceneObject(id="post", kind="box", size=(0.03, 0.03, 0.2), pose=Pose(xyz=(0.15, 0.0, 0.241)), mass=2.0)


@pytest.fixture
def sim():
    with MuJoCoBackend() as backend:
        backend.load(Scene(objects=(POST,)))
        yield backend


@pytest.fixture
def planner(sim):
    planner = DLSMotionPlanner()
    eyes = GroundTruthPerception()
    planner.use(eyes.planning(sim, eyes.perceive(sim)), sim.arms["arm"].state())
    return planner


def down(x, y, z):
    return Pose.from_matrix(np.array([x, y, z]), np.diag([1.0, -1.0, -1.0]))


def test_ik_puts_the_tcp_on_the_target(sim, planner):
    for target in (down(0.2, 0.2, 0.2), down(0.1, -0.3, 0.1), down(0.3, 0.25, 0.4)):
        reached = planner.forward(planner.ik(target))
        assert np.linalg.norm(reached.position - target.position) < 1e-3
        assert np.trace(reached.rotation.T @ target.rotation) > 3.0 - 1e-4


def test_ik_of_random_reachable_poses_is_solved(sim, planner):
    rng = np.random.default_rng(3)
    for _ in range(100):
        planner.ik(planner.forward(rng.uniform(sim.robot.lower, sim.robot.upper)))


def test_unreachable_target_carries_its_evidence(planner):
    with pytest.raises(UnreachableError) as caught:
        planner.ik(down(1.5, 0.0, 0.2))
    evidence = caught.value.evidence
    assert evidence.position_error > 0.3
    assert np.linalg.norm(evidence.nearest.position - np.array([1.5, 0.0, 0.2])) == pytest.approx(
        evidence.position_error, abs=1e-6
    )


def test_line_is_straight_all_along(sim, planner):
    start = planner.ik(down(0.2, 0.25, 0.35))
    trajectory = planner.plan_line(start, down(0.2, 0.25, 0.15))
    points = np.array([planner.forward(q).position for q in trajectory.q])
    assert np.abs(points[:, :2] - [0.2, 0.25]).max() < 1e-3
    assert points[-1, 2] == pytest.approx(0.15, abs=1e-3)


def test_line_out_of_reach_is_not_shortened(planner):
    start = planner.ik(down(0.2, 0.25, 0.35))
    with pytest.raises(UnreachableError):
        planner.plan_line(start, down(1.2, 0.25, 0.35))


def test_line_through_an_object_names_the_pair(planner):
    start = planner.ik(down(0.15, 0.25, 0.3))
    with pytest.raises(CollisionError) as caught:
        planner.plan_line(start, down(0.15, -0.02, 0.3))
    assert caught.value.evidence.other == "post"


def test_a_robot_that_stands_nearer_than_the_clearance_may_leave_but_not_come_nearer(planner):
    checker = planner._planning.collisions(0.02)
    # Open fingers reach some 10 cm beside the TCP, and the post 3 cm.
    y = next(y for y in np.arange(0.2, 0.1, -0.002) if checker.touch(planner.ik(down(0.15, y, 0.3))))
    q, farther, nearer = (planner.ik(down(0.15, y + dy, 0.3)) for dy in (-0.005, 0.1, -0.012))
    near = checker.touch(q)
    assert near.other == "post" and -0.02 < near.depth < -0.01
    checker.stand(q)
    assert checker.first_touch(np.array([q, farther])) is None
    met = checker.first_touch(np.array([q, nearer]))
    assert met is not None and met[1].other == "post" and near.depth < met[1].depth < 0.0
    checker.stand(farther)
    assert checker.touch(q) == near


def test_a_robot_that_leaves_what_it_touches_may_touch_it_no_deeper(planner):
    checker = planner._planning.collisions(0.001)
    y = next(
        y
        for y in np.arange(0.2, 0.1, -0.002)
        if (met := checker.touch(planner.ik(down(0.15, y, 0.3)))) and met.depth > 0.0
    )
    q, farther, deeper = (planner.ik(down(0.15, y + dy, 0.3)) for dy in (0.0, 0.1, -0.03))
    checker.stand(q)
    assert checker.touch(q) is not None
    checker.stay_in_touch()
    assert checker.first_touch(np.array([q, farther])) is None
    met = checker.first_touch(np.array([q, deeper]))
    assert met is not None and met[1].other == "post"
    checker.stay_in_touch(False)
    assert checker.touch(q) is not None


def test_joint_move_goes_round_an_object(sim, planner):
    start, goal = planner.ik(down(0.15, 0.25, 0.3)), planner.ik(down(0.15, -0.25, 0.3))
    trajectory = planner.plan_joints(start, goal)
    assert all(planner.touch(q) is None for q in trajectory.q[::5])


def test_trajectory_keeps_velocity_and_acceleration_limits():
    rng = np.random.default_rng(0)
    velocity, acceleration = np.array([2.0, 1.0, 0.5]), np.array([10.0, 5.0, 3.0])
    for knots in (rng.uniform(-1, 1, (2, 3)), np.cumsum(rng.uniform(-0.1, 0.1, (8, 3)), axis=0)):
        dt = 0.005
        q = time_path(spline(knots, 101), velocity, acceleration, dt).q
        qd = np.diff(q, axis=0) / dt
        assert (np.abs(qd) <= velocity * 1.01).all()
        smoothed = (qd[10:] - qd[:-10]) / (10 * dt)
        assert (np.abs(smoothed) <= acceleration * 1.05).all()
        assert q[0] == pytest.approx(knots[0])
        assert q[-1] == pytest.approx(knots[-1])


def test_spline_runs_through_its_knots():
    knots = np.array([[0.0, 0.0], [1.0, 0.5], [2.0, -0.5]])
    samples = spline(knots, 2001)
    for knot in knots:
        assert np.linalg.norm(samples - knot, axis=1).min() < 2e-3


def test_sampling_finds_the_gap_in_a_wall_and_the_same_way_again():
    def free(q, other):
        return all(clear(q + t * (other - q)) for t in np.linspace(0.0, 1.0, 50))

    def clear(q):
        return abs(q[0]) > 0.1 or abs(q[1] - 0.8) < 0.1

    low, high = -np.ones(2), np.ones(2)
    start, goal = np.array([-0.8, -0.8]), np.array([0.8, -0.8])
    first, second = (find_knots(free, start, goal, low, high) for _ in range(2))
    assert first is not None and np.array_equal(first, second)
    assert np.array_equal(first[0], start) and np.array_equal(first[-1], goal)
    assert all(free(a, b) for a, b in itertools.pairwise(first))
    # Through the gap's lower edge twice and along the wall: 2 * hypot(0.7, 1.5) + 0.2.
    assert np.linalg.norm(np.diff(first, axis=0), axis=1).sum() < 1.1 * 3.52
    # From either end the first is the start.
    back = find_knots(free, goal, start, low, high)
    assert back is not None and np.array_equal(back[0], goal) and np.array_equal(back[-1], start)


def test_sampling_gives_up_where_there_is_no_way():
    asked = 0

    def free(q, other):
        nonlocal asked
        asked += 1
        return q[0] * other[0] > 0.0

    low, high = -np.ones(2), np.ones(2)
    assert find_knots(free, low, high, low, high, ways=200) is None
    assert asked < 300


def test_sampling_ends_early_where_an_end_is_enclosed_and_goes_on_where_it_is_not():
    asked = 0

    def free(q, other):
        nonlocal asked
        asked += 1
        # Nothing leaves the small square around the goal.
        return (np.abs(q - 0.9).max() < 0.05) == (np.abs(other - 0.9).max() < 0.05)

    low, high = -np.ones(2), np.ones(2)
    assert find_knots(free, low, np.full(2, 0.9), low, high, ways=4000) is None
    assert asked < 2000


def test_nothing_is_stepped_over_between_two_waypoints(sim, planner):
    # Two configurations left and right of the post, and nothing said about the way between them.
    path = np.array([planner.ik(down(0.15, -0.2, 0.3)), planner.ik(down(0.15, 0.2, 0.3))])
    assert not planner.touch(path[0]) and not planner.touch(path[1])
    assert planner._collision(path) is not None


def test_a_thin_wall_is_not_stepped_over_wherever_the_way_begins() -> None:
    sheet = SceneObject(id="sheet", kind="box", size=(0.1, 0.001, 0.15), pose=Pose(xyz=(0.15, 0.0, 0.191)), mass=2.0)
    with open_session(Scene(objects=(sheet,))) as session:
        motion = DLSMotionPlanner()
        motion.use(session.ctx.planning(session.observe()), session.ctx.arm.state())
        for away in np.arange(0.09, 0.19, 0.01):
            path = np.array([motion.ik(down(0.15, -away, 0.3)), motion.ik(down(0.15, 0.1, 0.3))])
            assert not motion.touch(path[0]) and not motion.touch(path[1])
            assert motion._collision(path) is not None, away


def test_a_walk_along_a_face_that_it_almost_touches_looks_every_millimetre_and_no_more_often(sim, monkeypatch) -> None:
    planner, eyes = DLSMotionPlanner(clearance=0.0), GroundTruthPerception()
    planner.use(eyes.planning(sim, eyes.perceive(sim)), sim.arms["arm"].state())
    touching, free = 0.0, 0.25
    while free - touching > 1e-5:
        middle = (touching + free) / 2.0
        if planner.touch(planner.ik(down(0.15, -middle, 0.3))):
            touching = middle
        else:
            free = middle
    start = planner.ik(down(0.15, -free - 0.0001, 0.3))
    looks, examine = [], CollisionChecker._examine
    monkeypatch.setattr(CollisionChecker, "_examine", lambda self, q: looks.append(1) or examine(self, q))
    path = planner.plan_line(start, down(0.15, -free - 0.0001, 0.35)).q
    # No point of the robot is farther from an axis than it can reach.
    turned = np.abs(np.diff(path, axis=0)).sum() * 1.2
    assert len(looks) <= turned / 0.001 + 10


def test_what_the_arm_touches_of_itself_is_what_mujoco_finds() -> None:
    with open_session(Scene(objects=())) as session:
        sim, rng, folded = session.mujoco, np.random.default_rng(0), 0
        robot, model = sim.robot, sim.model
        checker, data = CollisionChecker(model, robot, sim.body_names), mujoco.MjData(model)
        checker.allow([body for body in range(model.nbody) if body not in robot.bodies])
        assert robot.gripper is not None
        for _ in range(300):
            q = rng.uniform(robot.lower, robot.upper)
            data.qpos[:] = model.qpos0
            data.qpos[robot.qpos_indices] = q
            mujoco.mj_forward(model, data)
            own = False
            for contact in data.contact:
                first, second = (int(model.geom_bodyid[geom]) for geom in contact.geom)
                fingers = {first, second} <= set(robot.gripper.bodies)
                own |= contact.dist < 0.0 and {first, second} <= set(robot.bodies) and not fingers
            found = checker.touch(q)
            assert (found is not None and found.own) is bool(own)
            folded += bool(own)
        assert 10 < folded < 290


def test_fingers_that_press_on_each_other_do_not_touch_the_robot(tmp_path) -> None:
    model, config = written("toy", tmp_path)
    with MuJoCoBackend() as sim:
        sim.load(Scene(robot_urdf=str(model), robot_config=str(config)))
        checker = CollisionChecker(sim.model, sim.robot, sim.body_names)
        checker.allow([body for body in range(sim.model.nbody) if body not in sim.robot.bodies])
        # Half a millimetre into one another, as contacts yield.
        checker.data.qpos[sim.robot.gripper.joint_indices] = sim.robot.gripper.geometry.closed_joint - 0.00025
        assert checker.touch(sim.robot.home_q) is None


def test_no_point_of_the_robot_moves_farther_than_its_joints_turn_times_their_levers(sim) -> None:
    rng, data = np.random.default_rng(0), mujoco.MjData(sim.model)
    checker = CollisionChecker(sim.model, sim.robot, sim.body_names)
    geoms = [g for g in range(sim.model.ngeom) if int(sim.model.geom_bodyid[g]) in sim.robot.bodies]

    def places(q):
        data.qpos[sim.robot.qpos_indices] = q
        mujoco.mj_kinematics(sim.model, data)
        return data.geom_xpos[geoms].copy()

    stretched = np.zeros(sim.robot.n)
    for start in (stretched, *rng.uniform(sim.robot.lower, sim.robot.upper, (50, sim.robot.n))):
        for joint in range(sim.robot.n):
            turn = np.zeros(sim.robot.n)
            turn[joint] = 0.01
            moved = np.linalg.norm(places(start + turn) - places(start), axis=1).max()
            assert moved <= 0.01 * checker._levers[joint]


def test_what_is_held_is_carried_along_and_touches_with_it() -> None:
    bar = SceneObject(id="bar", kind="box", size=(0.01, 0.15, 0.01), pose=Pose(xyz=(0.4, -0.4, 0.0505)), mass=0.1)
    with open_session(Scene(objects=(POST, bar))) as session:
        sim = session.mujoco
        checker = CollisionChecker(sim.model, sim.robot, sim.body_names)
        for item in (POST, bar):
            checker.place(sim.object_bodies[item.id], item.pose)
        motion = DLSMotionPlanner()
        motion.use(session.ctx.planning(session.observe()), sim.arms["arm"].state())
        q = motion.ik(down(0.15, 0.16, 0.3))
        assert checker.touch(q) is None
        checker.hold(sim.object_bodies["bar"], Pose(xyz=(0.0, 0.0, 0.0)))
        touch = checker.touch(q)
        assert touch is not None and touch.other == sim.body_names[sim.object_bodies["post"]]
        checker.hold(None)
        checker.place(sim.object_bodies["bar"], bar.pose)
        assert checker.touch(q) is None


def test_cans_are_seen_as_near_as_they_are() -> None:
    """The checker against exact distances, of every link to a can, in configurations around it."""
    can = SceneObject(id="can", kind="cylinder", size=(0.028, 0.044), pose=Pose(xyz=(0.18, 0.06, 0.085)))
    with open_session(Scene(objects=(can,))) as session:
        sim, rng = session.mujoco, np.random.default_rng(0)
        checker = CollisionChecker(sim.model, sim.robot, sim.body_names)
        checker.place(sim.object_bodies["can"], can.pose)
        checker.allow([sim.model.body("table").id, sim.model.body("floor").id])
        solid = [g for g in range(sim.model.ngeom) if sim.model.geom_contype[g]]
        links = [g for g in solid if int(sim.model.geom_bodyid[g]) in sim.robot.bodies]
        (target,) = (g for g in solid if int(sim.model.geom_bodyid[g]) == sim.object_bodies["can"])
        motion = DLSMotionPlanner()
        motion.use(session.ctx.planning(session.observe()), sim.arms["arm"].state())
        close = 0
        for _ in range(250):
            yaw, bearing, away = rng.uniform(-np.pi, np.pi), rng.uniform(-np.pi, np.pi), rng.uniform(0.05, 0.13)
            c, s = np.cos(yaw), np.sin(yaw)
            rotation = np.array([[c, s, 0.0], [s, -c, 0.0], [0.0, 0.0, -1.0]])
            place = [0.18 + away * np.cos(bearing), 0.06 + away * np.sin(bearing), rng.uniform(0.05, 0.09)]
            q = motion.ik(Pose.from_matrix(np.array(place), rotation))
            touch = checker.touch(q)
            exact = min(mujoco.mj_geomDistance(checker.model, checker.data, g, target, 0.1, None) for g in links)
            assert (touch is not None) or exact > checker.clearance - 1e-4
            close += exact < 0.02
        assert close > 30


@contextmanager
def beside_a_bin() -> Iterator[tuple[PlanningScene, DLSMotionPlanner]]:
    bin_ = SceneObject(id="bin", kind="bin", size=(0.09, 0.09, 0.06), pose=Pose(xyz=(0.15, 0.0, 0.042)), mass=0.6)
    with MuJoCoBackend() as sim:
        sim.load(Scene(objects=(bin_,)))
        eyes = GroundTruthPerception()
        planning = eyes.planning(sim, eyes.perceive(sim))
        planner = DLSMotionPlanner()
        planner.use(planning, sim.arms["arm"].state())
        yield planning, planner


def test_searching_in_trees_of_boxes_leaves_out_nothing_that_is_near():
    """A bin's walls and a finger's parts beside each other, with MuJoCo's search in trees and without."""
    with beside_a_bin() as (planning, planner):
        searched, every = planning.collisions(0.002), planning.collisions(0.002)
        every.model.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_MIDPHASE.value
        near = 0
        for x, height in itertools.product(np.linspace(0.0, 0.3, 13), (0.108, 0.112, 0.118, 0.124)):
            q = planner.ik(down(float(x), 0.0, float(height)))
            touch, gap = every._examine(q)
            assert searched._examine(q) == (touch, gap)
            near += touch is None and gap < 0.018
        assert near >= 6


def test_a_way_close_over_a_wall_is_narrow_though_nothing_is_touched():
    """A finger's parts pass 5 mm over a bin's wall: MuJoCo's search in trees of boxes left that out."""
    with beside_a_bin() as (planning, planner):
        checker = planning.collisions(0.002)

        def over(height):
            points = ((0.15, 0.2), (0.10, height), (0.06, height), (0.02, height), (-0.05, 0.2))
            ways = [planner.ik(down(x, 0.0, z), planner._robot.home_q) for x, z in points]
            return np.concatenate([np.linspace(one, other, 20) for one, other in itertools.pairwise(ways)])

        low, high = over(0.117), over(0.16)
        assert checker.first_touch(low) is None and checker.is_narrow(low, 0.008)
        assert checker.first_touch(high) is None and not checker.is_narrow(high, 0.008)


def test_a_way_with_room_goes_before_one_that_grazes(sim, planner):
    """Past the post's top: a straight way 4 mm over it is free, and one that leaves more room is taken."""
    beside = [planner.ik(down(0.15, y, 0.441 + 0.016), planner._robot.home_q) for y in (-0.25, 0.25)]
    straight = np.linspace(*beside, 60)
    checker = planner._collisions
    assert checker.first_touch(straight) is None or checker.is_narrow(straight, 0.008)
    way = planner.plan_joints(*beside, speed=0.5)
    assert checker.first_touch(way.q) is None and not checker.is_narrow(way.q, 0.008)


def test_a_corner_is_rounded_only_where_there_is_room(sim, planner) -> None:
    """Towards the post and aside before it: half a millimetre off it, a curve through the corner would swing into it."""
    start = planner.ik(down(0.15, -0.25, 0.3))
    slowest = {}
    for nearest in (-0.15, -0.1355):
        corner, end = down(0.15, nearest, 0.3), down(0.35, nearest, 0.3)
        lines = planner._line_path(start, corner)
        lines = np.concatenate([lines, planner._line_path(lines[-1], end)[1:]])
        rounded = planner._timed(lines, 0.5)
        way = planner.plan_through(start, [corner, end], speed=0.5)
        assert planner._collisions.first_touch(way.q) is None
        assert (planner._collisions.first_touch(rounded.q) is None) is (nearest == -0.15)
        speed = np.abs(np.diff(way.q, axis=0)).max(axis=1) / way.dt
        within = len(speed) // 8
        slowest[nearest] = speed[within:-within].min()
    assert slowest[-0.1355] < 0.2 * slowest[-0.15]


def test_what_the_hand_alone_may_touch_no_link_before_it_may() -> None:
    with open_session(Scene()) as session:
        q = session.mujoco.robot.home_q
        motion = DLSMotionPlanner()
        motion.use(session.ctx.planning(session.observe()), session.mujoco.arms["arm"].state())
        model, data = session.mujoco.model, mujoco.MjData(session.mujoco.model)
        data.qpos[session.mujoco.robot.qpos_indices] = q
        mujoco.mj_kinematics(model, data)
        forearm = next(g for g in range(model.ngeom) if model.body(model.geom_bodyid[g]).name == "robot/link4")
        elbow_at, tcp = tuple(data.geom_xpos[forearm].tolist()), motion.forward(q).xyz
    block = SceneObject(id="block", kind="box", size=(0.05, 0.05, 0.05), pose=Pose(xyz=(0.3, 0.3, 0.1)), mass=0.1)
    with open_session(Scene(objects=(block,))) as session:
        seen = session.observe()
        for place, by_hand in ((tcp, True), (elbow_at, False)):
            there = replace(seen.objects[0], pose=Pose(xyz=place))
            planning = session.ctx.planning(replace(seen, objects=(there,)))
            motion.use(planning, session.mujoco.arms["arm"].state())
            assert motion.touch(q) is not None
            motion.allow("block")
            assert motion.touch(q) is None
            motion.allow(by_hand=("block",))
            assert (motion.touch(q) is None) is by_hand


def test_fingers_are_apart_before_the_hand_goes_a_way_that_closed_ones_would_meet() -> None:
    low = SceneObject(id="low", kind="cylinder", size=(0.012, 0.05), pose=Pose(xyz=(0.15, 0.1, 0.09)))
    with open_session(Scene(objects=(low,))) as session:
        arm = Manipulator(session.ctx)
        arm.open(0.0)
        arm.use(arm.look())
        arm.motion.open_to(0.08)
        over = arm.motion.plan_joints(arm.q, arm.motion.ik(down(0.15, 0.1, 0.25)))
        arm.follow(over, "approach")
        way = arm.motion.plan_line(arm.q, down(0.15, 0.1, 0.11))
        arm.open_for(way, 0.08)
        assert arm.gripper.width > 0.075
