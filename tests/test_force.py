"""How hard the robot presses: the limits in the control loop, pushes that feel, what is said of them, the bench's columns."""

from collections.abc import Iterator
from dataclasses import replace

import mujoco
import numpy as np
import pytest
from support.behind import backend
from support.performing import bound

from robosandbox.driver import Capabilities
from robosandbox.driver.force import ForceGuard
from robosandbox.errors import LimitError, Phase
from robosandbox.evidence import LimitEvidence
from robosandbox.perception.sensed import SensedDriver
from robosandbox.sim.mujoco_backend import MuJoCoBackend
from robosandbox.skills.base import Skill
from robosandbox.skills.catalogue import load_skills
from robosandbox.skills.events import PhaseEntered
from robosandbox.skills.primitives.manipulator import Manipulator
from robosandbox.skills.primitives.pressing import StraightPath, _Push
from robosandbox.skills.primitives.sliding import slides_under
from robosandbox.skills.protocols import SkillContext
from robosandbox.skills.push import PushError, PushEvidence
from robosandbox.tasks.loader import find_task
from robosandbox.types import Array, Limits, Pose, Scene, SceneObject, SkillCall, SkillResult, Trajectory, force_limits
from robosandbox.workcell.embedded import EmbeddedWorkcell
from robosandbox.workcell.session import open_session
from robosandbox.world.operators import meant_by

SKILLS = {skill.name: skill for skill in load_skills()}
# m/s at which a hand that meets the table presses and does not knock.
SLOW = 0.005


def raw_force(sim: MuJoCoBackend, thing: str) -> Array:
    """Return the force of the robot on a thing, N in the world, shape (3,), from MuJoCo's contacts alone."""
    model, data, robot = sim.model, backend(sim)._live, sim.robot.bodies
    total, local = np.zeros(3), np.zeros(6)
    for k in range(data.ncon):
        first, second = (int(model.geom_bodyid[geom]) for geom in data.contact.geom[k])
        if (first in robot) == (second in robot):
            continue
        other = second if first in robot else first
        if sim.world.owners.get(other, sim.body_names[other]) == thing:
            mujoco.mj_contactForce(model, data, k, local)
            world = data.contact.frame[k].reshape(3, 3).T @ local[:3]
            total += world if first in robot else -world
    return total


class Peak:
    """The most that the robot presses a thing with while it is watched, N."""

    def __init__(self, sim: MuJoCoBackend, thing: str) -> None:
        self.force = 0.0
        self._sim, self._thing = sim, thing
        self.end = sim.subscribe(self._look)

    def _look(self) -> None:
        self.force = max(self.force, float(np.linalg.norm(raw_force(self._sim, self._thing))))


def scene(mass: float, *, beside: tuple[SceneObject, ...] = ()) -> Scene:
    """Return a scene with a cube of 40 mm and this mass, kg."""
    cube = SceneObject(id="cube", kind="box", size=(0.02, 0.02, 0.02), pose=Pose(xyz=(0.15, 0.0, 0.061)), mass=mass)
    return Scene(objects=(cube, *beside))


def way_down(session: EmbeddedWorkcell, above: float, depth: float) -> Trajectory:
    """Return a way of the closed hand straight down, from `above` to `depth` metres inside the table with its tips."""
    sim, ctx = session.driver, session.ctx
    seen = ctx.look()
    start, gripper = sim.state().tcp_pose, sim.arms["arm"].spec.gripper
    assert gripper is not None
    surface = seen.table_height + gripper.geometry.tip_depth
    kinematics, q, rows = ctx.planning(seen).kinematics(), sim.state().q, []
    for height in np.linspace(start.xyz[2], surface + above, 30):
        q = kinematics.descend(np.array([*start.xyz[:2], height]), start.rotation, q).q
    for height in np.linspace(surface + above, surface - depth, 20):
        q = kinematics.descend(np.array([*start.xyz[:2], height]), start.rotation, q).q
        rows.append(q)
    return Trajectory(q=np.array(rows), dt=(above + depth) / SLOW / len(rows))


@pytest.fixture(scope="module")
def worlds() -> Iterator[EmbeddedWorkcell]:
    with open_session(Scene(objects=()), what_if=False) as session:
        yield session


@pytest.fixture
def lowered(worlds: EmbeddedWorkcell) -> tuple[EmbeddedWorkcell, Trajectory]:
    """Return a robot whose closed hand is a millimetre above the table, and the way on into it."""
    worlds.reset()
    worlds.driver.hands["hand"].set_gripper(1.0)
    way = way_down(worlds, 0.001, 0.01)
    worlds.simulation.reset(q=way.q[0])
    worlds.ctx.permit(bound(SKILLS["home"], {}))
    return worlds, way


# MuJoCo names a contact's box before its mesh and its cylinder before its box: the robot comes first, or second.
@pytest.mark.parametrize("task", ["put_in_bin", "pick_can"])
def test_forces_are_those_of_the_contacts_at_every_moment(task: str) -> None:
    with open_session(task, what_if=False) as session:
        sim, read, pressing = session.mujoco, 0, []

        def compare() -> None:
            nonlocal read
            if sim.forces():
                pressing[:] = [sim.snapshot()]
            for thing, force in sim.forces().items():
                assert force == pytest.approx(raw_force(sim, thing), abs=1e-6)
                read += 1

        sim.subscribe(compare)
        assert session.run().success and read > 50
        assert bool(sim.forces()) is (sim.in_hands()["hand"] is not None)
        sim.reset()
        sim.restore(pressing[0])
        assert sim.forces(), "what was read before a jump is not told after it"


@pytest.mark.parametrize(("meant", "limit"), [(frozenset[str](), 40.0), (frozenset({"table"}), 60.0)])
def test_the_arm_stops_before_it_presses_harder_than_allowed(
    lowered: tuple[EmbeddedWorkcell, Trajectory], meant: frozenset[str], limit: float
) -> None:
    session, way = lowered
    session.ctx.permit(bound(SKILLS["tap"], {"object": next(iter(meant), "nothing")}))
    session.ctx.enter(Phase.DESCEND)
    peak = Peak(session.mujoco, "table")
    with pytest.raises(LimitError, match=f"the robot presses on table .* allows {limit:g}") as caught:
        session.driver.arms["arm"].follow(way)
    session.driver.wait(0.3)
    peak.end()
    assert 0.5 * limit < peak.force < 1.1 * limit
    assert caught.value.evidence is not None and caught.value.evidence.met() == ("table",)
    assert caught.value.phase == Phase.DESCEND, "the arm had moved, so that another try begins from somewhere else"


def test_the_hand_may_leave_what_it_pressed_on_and_is_stopped_there_again(
    lowered: tuple[EmbeddedWorkcell, Trajectory],
) -> None:
    session, way = lowered
    peak = Peak(session.mujoco, "table")
    for _ in range(2):
        with pytest.raises(LimitError):
            session.driver.arms["arm"].follow(way)
        session.driver.arms["arm"].follow(Trajectory(q=np.array([session.driver.state().q, way.q[0]]), dt=0.3))
    peak.end()
    assert peak.force < 1.1 * 40.0


def test_a_force_that_was_told_of_is_told_of_again_where_it_grows(lowered: tuple[EmbeddedWorkcell, Trajectory]) -> None:
    session, way = lowered
    session.ctx.permit(bound(SKILLS["tap"], {"object": "table"}))
    guard, told = ForceGuard(session.driver, "arm", 60.0, 30.0), list[float]()

    def ask() -> None:
        if (error := guard()) is not None and isinstance(error.evidence, LimitEvidence):
            told.append(error.evidence.value)

    end = session.driver.subscribe(ask)
    with pytest.raises(LimitError, match="allows 60"):
        session.driver.arms["arm"].follow(way)
    end()
    assert len(told) >= 2 and told == sorted(told)


def test_the_hand_that_goes_on_into_what_it_pressed_on_is_stopped_again(
    lowered: tuple[EmbeddedWorkcell, Trajectory],
) -> None:
    session, way = lowered
    peak = Peak(session.mujoco, "table")
    with pytest.raises(LimitError):
        session.driver.arms["arm"].follow(way)
    with pytest.raises(LimitError, match="the robot presses on table"):
        session.driver.arms["arm"].follow(Trajectory(q=np.array([session.driver.state().q, way.q[-1]]), dt=2.0))
    peak.end()
    assert peak.force < 1.2 * 40.0
    assert raw_force(session.mujoco, "table")[2] < -10.0, "down, on the table"


def test_limits_add_up_to_the_least() -> None:
    assert force_limits(None, None) == (60.0, 40.0)
    assert force_limits(Limits(max_force_n=20.0), Limits(max_force_n=50.0)) == (20.0, 20.0)
    assert force_limits(Limits(max_unintended_force_n=90.0)) == (60.0, 60.0)


def push(session: EmbeddedWorkcell, direction: str) -> None:
    session.agent.perform(
        SkillCall(skill="push", arguments={"object": "cube", "direction": direction, "distance": 0.06})
    )


@pytest.mark.parametrize("direction", ["forward", "left"])
def test_a_heavy_thing_that_slides_is_pushed_within_the_limit(direction: str) -> None:
    with open_session(scene(1.0), what_if=False) as session:
        peak = Peak(session.mujoco, "cube")
        push(session, direction)
        assert 9.0 < peak.force < 60.0


def test_what_does_not_slide_is_left_with_the_force_as_evidence() -> None:
    wall = SceneObject(id="wall", kind="box", size=(0.03, 0.08, 0.01), pose=Pose(xyz=(0.23, 0.0, 0.051)), mass=200.0)
    with open_session(scene(0.1, beside=(wall,)), what_if=False) as session:
        peak, began = Peak(session.mujoco, "cube"), session.driver.time
        with pytest.raises(
            PushError, match=r"it resists .* N, and limits.max_force_n allows 60; wall is in its way"
        ) as caught:
            push(session, "forward")
        evidence = caught.value.evidence
        assert isinstance(evidence, PushEvidence) and evidence.reason == "resisted" and evidence.blocking == ("wall",)
        assert evidence.force is not None and 0.7 * 60.0 < evidence.force <= peak.force + 0.01
        assert peak.force < 1.1 * 60.0
        assert session.driver.time - began < 18.0, (
            "not until the time of the whole way, 300 s for each metre, has passed"
        )
        session.agent.perform(SkillCall(skill="home", arguments={}))


@pytest.mark.gl
def test_a_hand_that_feels_nothing_stops_where_it_does_not_get_on() -> None:
    wall = SceneObject(id="wall", kind="box", size=(0.03, 0.08, 0.01), pose=Pose(xyz=(0.23, 0.0, 0.051)), mass=200.0)
    with open_session(scene(0.1, beside=(wall,)), driver="hardware", perception="rgbd", what_if=False) as session:
        with pytest.raises(
            PushError, match="the hand does not get on, and this arm feels no force: wall is in its way"
        ) as caught:
            push(session, "forward")
        evidence = caught.value.evidence
        assert isinstance(evidence, PushEvidence) and evidence.reason == "resisted" and evidence.force is None
    with open_session(scene(0.1), driver="hardware", perception="rgbd", what_if=False) as session:
        push(session, "forward")


def test_servos_that_give_all_are_not_wound_up_by_a_push() -> None:
    with open_session(scene(3.0), what_if=False) as session:
        plant = session.mujoco
        motors = plant.robot.actuator_ids

        def weaken(event: object) -> None:
            if isinstance(event, PhaseEntered) and event.phase == Phase.PUSH:
                plant.model.actuator_forcelimited[motors], plant.model.actuator_forcerange[motors] = 1, (-5.0, 5.0)

        session.ctx.events.subscribe(weaken)
        before, ahead = session.truth().objects["cube"].pose.position, [0.0]

        def look() -> None:
            sent, joints = plant._live.ctrl[motors], plant._live.qpos[plant.robot.qpos_indices]
            ahead.append(float(np.abs(sent - joints).max()))

        session.driver.subscribe(look)
        with pytest.raises(PushError, match=r"the servo of \S+ gives no more; carry it") as caught:
            push(session, "forward")
        evidence = caught.value.evidence
        assert isinstance(evidence, PushEvidence) and evidence.reason == "resisted" and evidence.spent
        # Integral action alone may shift a command by 0.3 rad, and what the hand trails by comes on top of that.
        assert max(ahead) < 0.25
        assert np.linalg.norm(session.truth().objects["cube"].pose.position - before) < 0.01


def test_a_robots_own_limit_is_kept_in_a_push() -> None:
    task = find_task("push_left").model_copy(update={"limits": Limits(max_force_n=20.0), "scene": scene(3.0)})
    with open_session(task, what_if=False) as session:
        peak = Peak(session.mujoco, "cube")
        with pytest.raises(PushError, match=r"limits\.max_force_n allows 20"):
            push(session, "left")
        assert 5.0 < peak.force < 1.1 * 20.0


class WristOnly(SensedDriver):
    """A world whose robot feels at its wrist alone."""

    @property
    def capabilities(self) -> Capabilities:
        return replace(super().capabilities, contact=None)


def test_a_wrench_at_the_wrist_keeps_the_limit_on_what_is_to_be_moved() -> None:
    with open_session("pick_cube_franka", what_if=False) as session:
        # The cube weighs 0.49 N.
        light, heavy = (ForceGuard(WristOnly(session.driver), "arm", limit, 0.1) for limit in (0.6, 0.4))
        assert light() is None and heavy() is None
        session.agent.perform(SkillCall(skill="pick", arguments={"object": "red_cube"}))
        assert [light() for _ in range(3)] == [None] * 3
        told = [heavy() for _ in range(4)]
        assert [isinstance(error, LimitError) for error in told] == [False, True, False, False]


def test_what_a_call_means_to_press_follows_from_its_contract() -> None:
    def meant(skill: str, held: str | None = None, **arguments: object) -> set[str]:
        return set(meant_by(bound(SKILLS[skill], arguments), held))

    assert meant("pick", object="cube") == {"cube"} == meant("tap", object="cube")
    assert meant("push", object="cube", direction="left", distance=0.1) == {"cube"}
    assert (
        meant("place_in", "cube", container="bin")
        == {"cube"}
        == meant("place_beside", "cube", target="bin", side="left")
    )
    assert meant("stack", object="cube", target="block") == {"cube"}
    assert meant("open_drawer", drawer="drawer") == {"drawer"} and meant("home") == set()
    assert set(meant_by(bound(Unsaid(), {"thing": "cube"}), None)) == {"cube"}, "nothing is known of it"


class Unsaid(Skill):
    """A skill that promises nothing."""

    name = "of_somebody_else"

    def run(self, ctx: SkillContext, *, thing: str) -> SkillResult:
        """Do something with a thing."""
        del ctx, thing
        return SkillResult(skill=self.name)


def bin_beside(mass: float) -> Scene:
    cube = SceneObject(id="cube", kind="box", size=(0.02, 0.02, 0.02), pose=Pose(xyz=(0.15, 0.25, 0.061)), mass=0.05)
    vessel = SceneObject(id="bin", kind="bin", size=(0.06, 0.06, 0.06), pose=Pose(xyz=(0.15, 0.0, 0.0405)), mass=mass)
    return Scene(objects=(cube, vessel))


def test_what_is_to_stay_slides_under_its_weight_times_friction_and_what_is_named_is_free_to_go() -> None:
    with open_session(bin_beside(1.0), what_if=False) as session:
        ctx, seen = session.ctx, session.observe()
        assert slides_under(ctx.planning, seen, ("cube",)) == pytest.approx({"bin": 0.5 * 9.81}, rel=0.01)
        assert slides_under(ctx.planning, seen, ("cube", "bin")) == {}
    with open_session("open_drawer", what_if=False) as session:
        assert set(slides_under(session.ctx.planning, session.observe(), ())) == {"drawer"}, "not what is picked up"


def test_a_shove_of_what_is_to_stay_stops_the_arm_before_it_slides() -> None:
    with open_session(bin_beside(1.0), what_if=False) as session:
        sim, motion = session.driver, session.ctx.motion
        motion.use(session.ctx.planning(session.observe()), sim.arms["arm"].state())
        motion.allow("bin")
        down = np.diag([1.0, -1.0, -1.0])
        begin, end = (Pose.from_matrix(np.array([0.15, y, 0.08]), down) for y in (-0.12, -0.04))
        sim.hands["hand"].set_gripper(1.0)
        sim.arms["arm"].follow(motion.plan_joints(sim.state().q, motion.ik(begin), speed=0.3))
        at = np.array(session.observe().find("bin").pose.xyz)  # type: ignore[union-attr]
        session.ctx.permit(bound(SKILLS["pick"], {"object": "cube"}))
        with pytest.raises(LimitError, match=r"slides under 4\.9"):
            sim.arms["arm"].follow(motion.plan_line(sim.state().q, end, speed=0.05))
        sim.wait(0.5)
        assert np.linalg.norm(np.array(session.observe().find("bin").pose.xyz) - at) < 0.002  # type: ignore[union-attr]
        session.ctx.permit(bound(SKILLS["home"], {}))
        session.agent.perform(SkillCall(skill="home"))


# Of the bundled arm, folded so far near its base that a joint goes 34 rad for a metre upwards.
_FOLDED = np.array([-0.8516, 0.02, 1.265, -2.899, -0.0815, 2.904, 1.278])


def test_a_pushing_hand_goes_to_another_place_and_height_within_the_joints_accelerations() -> None:
    with open_session("push_left") as session:
        arm = Manipulator(session.ctx)
        arm.use(arm.look())
        arm.send(arm.motion.plan_joints(arm.q, _FOLDED, speed=0.3))
        pose = arm.motion.forward(arm.q)
        way = arm.motion.plan_line(arm.q, Pose.from_matrix(pose.position + [0.03, 0.0, 0.0], pose.rotation))
        push = _Push(arm, StraightPath.of(arm, way), "red_cube", 60.0, 0.1)
        for place, lift in ((push.way.length, 0.0), (0.0, 0.0), (push.way.length, 0.03), (0.0, 0.03)):
            push._place, push._lift = place, lift
            with pytest.raises(LimitError, match="nothing has moved"):
                arm.trim(push.way.at(place, lift))
            for _ in range(800):
                push._advance(0.0)
            assert push._sent == pytest.approx((place, lift), abs=1e-6)
            commanded = arm.motion.forward(push._rows[-1])
            assert commanded.position == pytest.approx(pose.position + [place, 0.0, lift], abs=1e-4)
