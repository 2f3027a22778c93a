"""What skills notice of what nobody told them: each by a change from outside at the moment that counts."""

import math
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from support.behind import backend
from support.listening import on_phases

from robosandbox.apps.bench.contact_monitor import ContactMonitor
from robosandbox.errors import CollisionError, GraspError, Phase, PlacementError, UnreachableError
from robosandbox.evidence import GraspEvidence, PlacementEvidence, TrackingEvidence
from robosandbox.sim.intervention import Intervention
from robosandbox.skills.primitives.gripping import needed_force
from robosandbox.skills.primitives.guarded import MetError, follow_free
from robosandbox.skills.primitives.manipulator import Manipulator, raised
from robosandbox.skills.push import PushError, PushEvidence
from robosandbox.types import Pose, Scene, SceneObject, SkillCall, Trajectory
from robosandbox.workcell.embedded import EmbeddedWorkcell
from robosandbox.workcell.session import open_session

CUBE = SceneObject(id="cube", kind="box", size=(0.012, 0.012, 0.03), pose=Pose(xyz=(0.15, 0.0, 0.0705)), mass=0.1)
OTHER = SceneObject(id="other", kind="box", size=(0.02, 0.02, 0.02), pose=Pose(xyz=(0.15, 0.2, 0.0605)), mass=0.1)
# Metres of one of the bundled hand's fingers along the way that it closes.
FINGER = 0.0234
PILLAR = SceneObject(id="pillar", kind="box", size=(0.03, 0.03, 0.05), pose=Pose(xyz=(0.15, -0.2, 0.0905)), mass=5.0)


@contextmanager
def world(*objects: SceneObject) -> Iterator[tuple[EmbeddedWorkcell, list[str]]]:
    """Open a world, and collect the phases that the arm enters."""
    with open_session(Scene(objects=objects), what_if=False) as session:
        phases: list[str] = []
        on_phases(session.ctx.events, phases.append)
        yield session, phases


def pick(session: EmbeddedWorkcell) -> None:
    session.agent.perform(SkillCall(skill="pick", arguments={"object": "cube"}))


def once_risen(session: EmbeddedWorkcell, height: float, do: Callable[[], None]) -> None:
    """Do something in the tick in which the cube has first risen so far, metres."""
    begin, done = session.simulation.truth().objects["cube"].pose.xyz[2], []

    def look() -> None:
        if not done and session.simulation.truth().objects["cube"].pose.xyz[2] - begin > height:
            done.append(True)
            do()

    session.driver.subscribe(look)


def test_fingers_that_close_on_nothing_do_not_rise() -> None:
    with world(CUBE) as (session, phases):
        hand, taken = Intervention(session.mujoco), []

        def take_away(phase: str) -> None:
            if phase == Phase.GRASP:
                taken.append(phase)
                x, y, z = hand.pose("cube").xyz
                hand.set_pose("cube", Pose(xyz=(x, y + (0.06 if len(taken) % 2 else -0.06), z)))

        on_phases(session.ctx.events, take_away)
        with pytest.raises(GraspError, match="closed on nothing") as caught:
            pick(session)
        assert isinstance(caught.value.evidence, GraspEvidence) and caught.value.evidence.reason == "missed"
        assert Phase.LIFT not in phases


def test_what_rises_beside_it_is_taken_for_wedged_and_the_lift_is_begun_anew() -> None:
    with world(CUBE, OTHER, PILLAR) as (session, phases):
        hand = Intervention(session.mujoco)
        once_risen(session, 0.03, lambda: hand.set_pose("other", Pose(xyz=(0.15, -0.2, 0.161))))
        pick(session)
        assert phases.count(Phase.GRASP) == 2 and session.mujoco.in_hands()["hand"] == "cube"


def test_what_slid_down_between_the_fingers_is_not_lifted() -> None:
    tall = CUBE.model_copy(update={"size": (0.012, 0.012, 0.08), "pose": Pose(xyz=(0.15, 0.0, 0.1205))})
    with world(tall) as (session, phases):
        hand = Intervention(session.mujoco)

        def slide() -> None:
            x, y, z = hand.pose("cube").xyz
            hand.set_pose("cube", Pose(xyz=(x, y, z - 0.1), quat_xyzw=hand.pose("cube").quat_xyzw))

        once_risen(session, 0.12, slide)
        pick(session)
        assert phases.count(Phase.GRASP) == 2 and session.mujoco.in_hands()["hand"] == "cube"


def test_a_hand_that_is_leant_on_at_the_top_puts_back_what_it_holds_and_takes_it_anew() -> None:
    plank = SceneObject(id="plank", kind="box", size=(0.01, 0.05, 0.2), pose=Pose(xyz=(0.4, 0.25, 0.2405)), mass=4.0)
    with world(CUBE, plank) as (session, phases):
        hand, leant = Intervention(session.mujoco), []

        def lean() -> None:
            tilt = 0.25
            height = 0.0405 + 0.2 * math.cos(tilt) + 0.01 * math.sin(tilt)
            for x in np.arange(0.3, 0.2, -0.001) if not leant else ():
                turn = (0.0, -math.sin(tilt / 2), 0.0, math.cos(tilt / 2))
                hand.set_pose("plank", Pose(xyz=(float(x), 0.0, height), quat_xyzw=turn))
                if "plank" in session.driver.senses.forces():
                    break
            leant.append(True)

        in_phase(session, Phase.SETTLE, lean)
        in_phase(session, Phase.LOWER, lambda: hand.set_pose("plank", Pose(xyz=(0.4, 0.25, 0.2405))))
        pick(session)
        assert phases.count(Phase.GRASP) == 2 and session.mujoco.in_hands()["hand"] == "cube"


def test_what_tips_in_the_hand_so_that_its_end_hangs_down_is_taken_anew() -> None:
    bar = CUBE.model_copy(update={"size": (0.14, 0.012, 0.008), "pose": Pose(xyz=(0.15, 0.0, 0.0485))})
    with world(bar) as (session, phases):
        hand, tipped = Intervention(session.mujoco), []

        def tip() -> None:
            if not tipped:
                tipped.append(True)
                turn = math.radians(42.0)
                pose = Pose(xyz=hand.pose("cube").xyz, quat_xyzw=(0.0, math.sin(turn / 2), 0.0, math.cos(turn / 2)))
                hand.set_pose("cube", pose)

        in_phase(session, Phase.SETTLE, tip)
        pick(session)
        assert phases.count(Phase.GRASP) == 2 and session.mujoco.in_hands()["hand"] == "cube"


def test_what_is_held_and_still_stands_is_lifted_by_another_pick() -> None:
    with world(CUBE) as (session, phases):
        pick(session)
        down = raised(session.driver.state().tcp_pose, -0.16)
        motion = session.ctx.motion
        motion.allow("table")
        session.driver.arms["arm"].follow(motion.plan_line(session.driver.state().q, down, speed=0.3))
        session.driver.wait(0.5)
        before = session.simulation.truth().objects["cube"].pose.xyz[2]
        pick(session)
        assert session.simulation.truth().objects["cube"].pose.xyz[2] - before > 0.1
        assert phases.count(Phase.GRASP) == 1


def test_what_slips_out_of_a_grip_by_its_weight_is_taken_again_as_hard_as_can_be() -> None:
    def grip(friction: float, grasps: int) -> float:
        with world(CUBE) as (session, phases):
            hand = Intervention(session.mujoco)
            session.mujoco.model.geom_friction[hand.geoms("cube"), 0] = friction
            session.mujoco.model.geom_priority[hand.geoms("cube")] = session.mujoco.model.geom_priority.max() + 1
            pick(session)
            assert phases.count(Phase.GRASP) == grasps and session.mujoco.in_hands()["hand"] == "cube"
            return session.driver.hands["hand"].grip_on("cube")

    assert grip(0.02, grasps=2) > 2.0 * grip(1.0, grasps=1)


def test_what_slides_in_the_eased_grip_at_rest_is_held_as_hard_as_can_be() -> None:
    def grip(slide: float) -> float:
        with world(CUBE) as (session, phases):
            hand, slid = Intervention(session.mujoco), []

            def lower() -> None:
                if not slid:
                    slid.append(True)
                    x, y, z = hand.pose("cube").xyz
                    hand.set_pose("cube", Pose(xyz=(x, y, z - slide), quat_xyzw=hand.pose("cube").quat_xyzw))

            in_phase(session, Phase.SETTLE, lower)
            pick(session)
            assert phases.count(Phase.GRASP) == 1 and session.mujoco.in_hands()["hand"] == "cube"
            return session.driver.hands["hand"].grip_on("cube")

    assert grip(0.004) > 2.0 * grip(0.0)


def test_a_hand_that_cannot_rise_from_what_it_put_down_leaves_as_it_came(monkeypatch: pytest.MonkeyPatch) -> None:
    rise = Manipulator.rise

    def short(self: Manipulator, height: float, phase: str, **others: Any) -> float:
        if phase == Phase.RETREAT:
            raise UnreachableError("straight up is out of reach")
        return rise(self, height, phase, **others)

    with world(CUBE) as (session, _):
        pick(session)
        monkeypatch.setattr(Manipulator, "rise", short)
        session.agent.perform(SkillCall(skill="place_at", arguments={"x": 0.2, "y": 0.1}))
        over = session.state().tcp_pose.xyz[2] - session.truth().objects["cube"].pose.xyz[2]
        assert over > 0.03 and not session.driver.senses.forces()


def test_what_a_load_has_shown_is_said_where_no_other_grasp_is_left() -> None:
    post = CUBE.model_copy(update={"mass": 200.0})
    # Where fingers come, once one grasp has failed, walls stand on all sides.
    walls = [
        SceneObject(
            id=f"wall_{x}_{y}",
            kind="box",
            size=(0.004, 0.012, 0.03) if x else (0.012, 0.004, 0.03),
            pose=Pose(xyz=(0.15 + 0.2 * x, 0.2 * y, 0.0705)),
            mass=0.1,
        )
        for x, y in ((1, 0), (-1, 0), (0, 1), (0, -1))
    ]
    with world(post, *walls) as (session, phases):
        hand = Intervention(session.mujoco)

        def close_in() -> None:
            for x, y in ((1, 0), (-1, 0), (0, 1), (0, -1)):
                hand.set_pose(f"wall_{x}_{y}", Pose(xyz=(0.15 + 0.017 * x, 0.017 * y, 0.0705)))

        in_phase(session, Phase.RETREAT, close_in)
        with pytest.raises(GraspError, match="it is fixed where it is") as caught:
            pick(session)
        assert isinstance(caught.value.evidence, GraspEvidence) and caught.value.evidence.reason == "immovable"
        assert np.isfinite(caught.value.evidence.pull or np.nan) and phases.count(Phase.GRASP) == 1


def test_a_hand_on_its_free_way_stops_at_what_it_meets_long_before_the_limit() -> None:
    with world(OTHER, PILLAR) as (session, _):
        arm, hand = Manipulator(session.ctx), Intervention(session.mujoco)
        arm.use(arm.start)
        arm.motion.allow("table")
        down = np.diag([1.0, -1.0, -1.0])
        above, there = (Pose.from_matrix(np.array([0.15, 0.0, z]), down) for z in (0.22, 0.10))
        arm.follow(arm.motion.plan_joints(arm.q, arm.motion.ik(above), speed=0.5), Phase.APPROACH)
        way = arm.motion.plan_line(arm.q, there, speed=0.05)
        # Unseen, in the way.
        hand.set_pose("pillar", Pose(xyz=(0.15, 0.0, 0.0905)))
        with pytest.raises(MetError, match="met pillar on its way") as met:
            follow_free(arm, way, Phase.DESCEND)
        assert isinstance(met.value.evidence, TrackingEvidence) and met.value.evidence.contact_force < 30.0


def test_what_is_held_off_its_middle_asks_for_a_firmer_grip() -> None:
    with world(CUBE) as (session, _):
        arm = Manipulator(session.ctx)
        at, tcp = arm.find("cube"), session.driver.state().tcp_pose
        along = tcp.rotation[:, 0]

        def needed(off: float) -> float:
            held = replace(at, pose=Pose.from_matrix(tcp.position + off * along, tcp.rotation))
            return needed_force(arm, held, 0.1)

        assert needed(0.0) >= 0.1 * 9.81 and needed(0.05) > 3.0 * needed(0.0)


def in_phase(session: EmbeddedWorkcell, phase: str, do: Callable[[], None]) -> None:
    """Do something whenever the arm enters a phase."""
    on_phases(session.ctx.events, lambda entered: do() if entered == phase else None)


def test_what_moves_on_after_it_was_let_go_is_not_placed() -> None:
    with world(CUBE) as (session, _):
        hand = Intervention(session.mujoco)
        pick(session)
        in_phase(session, Phase.RETREAT, lambda: hand.set_pose("cube", Pose(xyz=(0.25, 0.2, 0.0705))))
        with pytest.raises(PlacementError, match="is not where it was placed") as caught:
            session.agent.perform(SkillCall(skill="place_at", arguments={"x": 0.15, "y": -0.15}))
        assert isinstance(caught.value.evidence, PlacementEvidence) and caught.value.evidence.reason == "missed"


def test_what_stays_between_fingers_that_do_not_open_is_not_placed() -> None:
    # So deep that what is carried up again is still in it: nothing but the hold tells.
    deep = SceneObject(id="bin", kind="bin", size=(0.14, 0.14, 0.14), pose=Pose(xyz=(0.15, -0.25, 0.0405)), mass=2.0)
    with world(CUBE, deep) as (session, _):
        pick(session)
        sim = session.driver
        in_phase(session, Phase.RELEASE, lambda: sim.subscribe(lambda: sim.hands["hand"].set_gripper(1.0)))
        with pytest.raises(PlacementError, match="stuck") as caught:
            session.agent.perform(SkillCall(skill="place_in", arguments={"container": "bin"}))
        assert isinstance(caught.value.evidence, PlacementEvidence) and caught.value.evidence.reason == "stuck"


def test_what_stands_on_its_rim_is_watched_until_it_falls() -> None:
    can = SceneObject(id="can", kind="cylinder", size=(0.02, 0.05), pose=Pose(xyz=(0.15, 0.0, 0.0905)), mass=0.1)
    with world(can) as (session, _):
        hand, fallen = Intervention(session.mujoco), []
        session.agent.perform(SkillCall(skill="pick", arguments={"object": "can"}))
        # On its rim, past its balance by so little that two looks see it stand still.
        tilt = math.atan2(0.02, 0.05) + 0.01
        height = 0.04 + 0.05 * math.cos(tilt) + 0.02 * math.sin(tilt)

        def lean() -> None:
            if not fallen:
                fallen.append(True)
                turn = (0.0, math.sin(tilt / 2), 0.0, math.cos(tilt / 2))
                hand.set_pose("can", Pose(xyz=(0.15, -0.15, height), quat_xyzw=turn))

        in_phase(session, Phase.SETTLE, lean)
        with pytest.raises(PlacementError, match=r"toppled|missed"):
            session.agent.perform(SkillCall(skill="place_at", arguments={"x": 0.15, "y": -0.15}))


def shaft(room: float) -> list[SceneObject]:
    """Return eight walls around a place for the closed fingers and the cube between them, and so much more room, metres."""
    inner, thick = 0.012 + FINGER + 0.0025 + room, 0.004
    headings = [k * math.pi / 4 for k in range(8)]
    return [
        SceneObject(
            id=f"wall_{k}",
            kind="box",
            size=(thick, inner * math.tan(math.pi / 8) - 0.0005, 0.02),
            pose=Pose(
                xyz=(0.15 + (inner + thick) * math.cos(yaw), -0.2 + (inner + thick) * math.sin(yaw), 0.0605),
                quat_xyzw=(0.0, 0.0, math.sin(yaw / 2), math.cos(yaw / 2)),
            ),
            mass=1.0,
        )
        for k, yaw in enumerate(headings)
    ]


def test_nothing_is_lowered_where_the_fingers_could_not_let_go() -> None:
    # A shaft into which the hand goes closed on the cube, and in which no finger has the room to open.
    with world(CUBE, *shaft(0.0)) as (session, phases):
        pick(session)
        with pytest.raises(CollisionError):
            session.agent.perform(SkillCall(skill="place_at", arguments={"x": 0.15, "y": -0.2}))
        assert Phase.LOWER not in phases and session.mujoco.in_hands()["hand"] == "cube"
    with world(CUBE, *shaft(0.012)) as (session, _):
        pick(session)
        session.agent.perform(SkillCall(skill="place_at", arguments={"x": 0.15, "y": -0.2}))
        assert session.mujoco.in_hands()["hand"] is None


def test_what_stands_askew_is_watched_until_it_falls() -> None:
    can = SceneObject(id="can", kind="cylinder", size=(0.02, 0.05), pose=Pose(xyz=(0.15, 0.0, 0.0905)), mass=0.1)
    with world(can, PILLAR) as (session, _):
        hand = Intervention(session.mujoco)
        session.agent.perform(SkillCall(skill="pick", arguments={"object": "can"}))

        # Its middle is 2 mm from the pillar's edge and 10 mrad short of its balance there: it begins to fall slowly.
        tilt, fallen = math.atan2(0.002, 0.05) - 0.01, []
        middle = np.array([0.18, -0.2, 0.1405]) + [
            0.05 * math.sin(tilt) - 0.002 * math.cos(tilt),
            0.0,
            0.05 * math.cos(tilt) + 0.002 * math.sin(tilt),
        ]
        turn = (0.0, math.sin(tilt / 2), 0.0, math.cos(tilt / 2))

        def lean() -> None:
            if not fallen:
                fallen.append(True)
                hand.set_pose("can", Pose(xyz=tuple(middle.tolist()), quat_xyzw=turn))
                hand.set_velocity("can", np.array([0.12 * 0.054, 0.0, 0.0]), np.array([0.0, 0.12, 0.0]))

        in_phase(session, Phase.SETTLE, lean)
        with pytest.raises(PlacementError, match=r"toppled|missed"):
            session.agent.perform(SkillCall(skill="place_on", arguments={"target": "pillar"}))


def test_what_stands_near_an_edge_is_looked_at_again_a_second_later() -> None:
    can = SceneObject(id="can", kind="cylinder", size=(0.02, 0.05), pose=Pose(xyz=(0.15, 0.0, 0.0905)), mass=0.1)
    with world(can, PILLAR) as (session, _):
        hand = Intervention(session.mujoco)
        session.agent.perform(SkillCall(skill="pick", arguments={"object": "can"}))
        # Upright, its middle 2 mm within the pillar's top; then it goes over all the same.
        poses = [Pose(xyz=(0.178, -0.2, 0.1905)), Pose(xyz=(0.25, -0.2, 0.0905))]
        times: list[float] = []

        def change() -> None:
            if poses:
                times.append(session.driver.time)
                hand.set_pose("can", poses.pop(0))

        in_phase(session, Phase.SETTLE, change)
        with pytest.raises(PlacementError, match="missed") as caught:
            session.agent.perform(SkillCall(skill="place_on", arguments={"target": "pillar"}))
        assert caught.value.phase == Phase.VERIFY and session.driver.time - times[0] > 1.0


def test_what_slides_on_when_it_was_pushed_has_gone_too_far() -> None:
    with world(OTHER) as (session, _):
        hand = Intervention(session.mujoco)
        in_phase(session, Phase.RETREAT, lambda: hand.set_pose("other", Pose(xyz=(0.15, 0.0, 0.0605))))
        with pytest.raises(PushError, match="look again") as caught:
            session.agent.perform(
                SkillCall(skill="push", arguments={"object": "other", "direction": "right", "distance": 0.05})
            )
        assert isinstance(caught.value.evidence, PushEvidence) and caught.value.evidence.along > 0.15


def test_what_is_carried_against_something_counts_as_touching_it() -> None:
    with world(CUBE, OTHER) as (session, _):
        monitor, hand = ContactMonitor(session.mujoco, session.agent.skills), Intervention(session.mujoco)
        call = SkillCall(skill="pick", arguments={"object": "cube"})
        monitor.begin(call)

        def lift() -> None:
            x, y, z = hand.pose("cube").xyz
            hand.set_pose("other", Pose(xyz=(x, y, z - 0.0495)))

        once_risen(session, 0.1, lambda: session.driver.subscribe(lift))
        with pytest.raises(GraspError, match="other came up together with cube"):
            session.agent.perform(call)
        assert "cube on other" in monitor.touched and monitor.worst_force > 0.0


def test_a_hand_on_the_destination_of_what_it_carries_counts_as_touching_it() -> None:
    with world(CUBE, OTHER) as (session, _):
        pick(session)
        monitor, hand = ContactMonitor(session.mujoco, session.agent.skills), Intervention(session.mujoco)
        monitor.begin(SkillCall(skill="place_on", arguments={"target": "other"}))
        session.driver.wait(session.driver.control_timestep)
        assert not monitor.touched
        # From above, away from the cube between the fingers.
        x, y, z = session.driver.state().tcp_pose.xyz
        hand.set_pose("other", Pose(xyz=(x, y, z + 0.12)))
        session.driver.wait(session.driver.control_timestep)
        assert any(pair.endswith(" on other") and not pair.startswith("cube ") for pair in monitor.touched)
        assert monitor.worst_force > 0.0


def swing(q: np.ndarray, goal: np.ndarray) -> Trajectory:
    """A way that begins and ends at rest."""
    share = 0.5 - 0.5 * np.cos(np.linspace(0.0, np.pi, 120))[:, None]
    return Trajectory(q=q + share * (goal - q), dt=0.01)


def test_an_arm_that_is_stopped_stays_where_it_was_stopped() -> None:
    with world(CUBE) as (session, _):
        sim, stopped = session.driver, list[np.ndarray]()
        goal = sim.state().q + 0.5
        way = swing(sim.state().q, goal)

        def guard() -> Exception | None:
            if sim.state().q[0] < goal[0] - 0.25:
                return None
            stopped.append(sim.state().q)
            return LookupError("that is far enough")

        with pytest.raises(LookupError):
            sim.arms["arm"].follow(way, guards=(guard,))
        sim.wait(0.5)
        assert np.abs(sim.state().q - stopped[0]).max() < 0.001 and len(stopped) == 1


def test_an_arm_whose_watcher_fails_stays_where_it_was() -> None:
    with world(CUBE) as (session, _):
        sim, at = session.driver, list[np.ndarray]()
        goal = sim.state().q + 0.5
        way = swing(sim.state().q, goal)

        def watch() -> None:
            if not at and sim.state().q[0] > goal[0] - 0.25:
                at.append(sim.state().q)
                raise KeyboardInterrupt

        end = sim.subscribe(watch)
        with pytest.raises(KeyboardInterrupt):
            sim.arms["arm"].follow(way)
        end()
        sim.wait(0.5)
        assert np.abs(sim.state().q - at[0]).max() < 0.015


def test_an_arm_that_is_stopped_while_it_arrives_does_not_go_on_to_its_goal() -> None:
    with world(CUBE) as (session, _):
        # Commanded at once, so that all of the way is left when the command was given, which only the driver behind takes.
        sim = backend(session.driver)
        begin = sim.state().q
        sim.arms["arm"].follow(Trajectory(q=np.array([begin, begin + 0.3]), dt=0.01))
        with pytest.raises(LookupError):
            sim.wait(0.5, guards=(lambda: LookupError("hold"),))
        sim.wait(1.0)
        assert np.abs(sim.state().q - begin).max() < 0.15
