"""Odd models and hand-written sidecars: what arms from elsewhere bring, on toys and on arms from wheels."""

import re
from pathlib import Path

import numpy as np
import pytest
import yaml
from support.written_arms import (
    SYMPTOMS,
    TOY_JOINTS,
    TOYS,
    fingers,
    sidecar,
    toy,
    written,
)

from robosandbox.apps.conformance.robot_check import check_robot
from robosandbox.apps.conformance.robot_trial import cube_task, work_point
from robosandbox.errors import InputError
from robosandbox.motion.collision import CollisionChecker
from robosandbox.robots import loader
from robosandbox.robots.importers.files import ModelFiles
from robosandbox.robots.importers.importing import import_model
from robosandbox.robots.infer.report import to_yaml
from robosandbox.robots.infer.sidecar import infer
from robosandbox.robots.loader import load_robot
from robosandbox.sim.mujoco_backend import MuJoCoBackend
from robosandbox.types import Randomize, Scene, matrix_from_quat_xyzw
from robosandbox.workcell.session import open_session


@pytest.mark.parametrize("name", ["toy", "toy_jaw", "so101", "ur5e"])
@pytest.mark.sample(every=4)
def test_arm_picks_with_a_sidecar_written_from_the_users_page(name, tmp_path):
    model, path = written(name, tmp_path)
    task = cube_task(model, path, work_point(load_robot(model, path)))
    task = task.model_copy(update={"randomize": Randomize(xy_jitter=0.02, yaw_jitter=np.pi)})
    with open_session(task) as session:
        for seed in range(3):
            session.reset(seed)
            episode = session.run()
            assert session.judge().success, (seed, episode.final_detail)


@pytest.mark.parametrize("name", ["so101", "ur5e"])
@pytest.mark.sample(every=2)
def test_a_force_is_pressed_with_by_soft_and_by_stiff_arms(name, tmp_path):
    model, path = written(name, tmp_path)
    with open_session(cube_task(model, path, work_point(load_robot(model, path))), what_if=False) as session:
        before = session.truth().objects["red_cube"].pose.position
        detail = session.do("press_down", object="red_cube", force=5.0, seconds=1.0).detail
        assert detail["force_n"] == pytest.approx(5.0, rel=0.05)
        assert 4.5 < detail["least_n"] <= detail["most_n"] < 5.5
        assert np.allclose(session.truth().objects["red_cube"].pose.position, before, atol=0.003)


@pytest.mark.parametrize("symptom", SYMPTOMS)
@pytest.mark.parametrize("name", ["toy", "toy_jaw"])
@pytest.mark.sample(every=4)
def test_check_names_the_field_for_each_symptom_on_small_arms(name, symptom, tmp_path):
    model, path = written(name, tmp_path)
    side = yaml.safe_load(path.read_text())
    field, change = SYMPTOMS[symptom]
    change(side)
    path.write_text(yaml.safe_dump(side))
    assert {item.field for item in check_robot(model, sidecar=path).checks if not item.ok} == {field}


@pytest.mark.parametrize("name", ["toy", "toy_jaw", "ur5e"])
@pytest.mark.sample(every=3)
def test_sound_sidecar_raises_no_alarm(name, tmp_path):
    model, path = written(name, tmp_path)
    report = check_robot(model, sidecar=path)
    assert report.ok, [item for item in report.checks if not item.ok]


def _changed(name, folder, *changes):
    text = (TOYS / name).read_text()
    for old, new in changes:
        assert old in text
        text = text.replace(old, new)
    (folder / name).write_text(text)
    return folder / name


def test_finger_servos_too_weak_to_hold_are_stiffened(tmp_path):
    weak = '<position name="ga" joint="g1" kp="60" kv="5" ctrlrange="0 .03"/><position joint="g2" kp="60" kv="5" ctrlrange="0 .03"/>'
    path = _changed(
        "toy_tendon.xml",
        tmp_path,
        ('<position name="g" tendon="t" kp="500" ctrlrange="0 .03" forcerange="-30 30"/>', weak),
        ('<tendon><fixed name="t"><joint joint="g1" coef=".5"/><joint joint="g2" coef=".5"/></fixed></tendon>', ""),
        ('<equality><joint joint1="g1" joint2="g2"/></equality>', ""),
    )
    assert sum("stiffened" in note for note in load_robot(path).notes) == 2
    report = check_robot(path)
    assert report.ok, [item for item in report.checks if not item.ok]


def test_strong_and_heavily_damped_jaw_is_limited_and_holds_still(tmp_path):
    servo = '<general joint="jaw" biastype="affine" gainprm="1000" biasprm="0 -1000 -100" ctrlrange="-.35 1.2" forcerange="-300 300"/>'
    path = _changed(
        "toy_jaw.xml",
        tmp_path,
        ('<motor joint="jaw" ctrlrange="-3 3"/>', servo),
        ('range="-0.35 1.2"', 'range="-0.35 1.2" armature="0" frictionloss="1"'),
    )
    report = check_robot(path)
    assert report.ok, [item for item in report.checks if not item.ok]


def test_closed_loop_of_a_gripper_leaves_the_arm_its_servos(tmp_path):
    rod = '<body name="rod"><joint name="loose" axis="0 0 1"/><geom type="sphere" size=".002" mass=".01"/></body></body>\n<body name="f2">'
    path = _changed(
        "toy_tendon.xml",
        tmp_path,
        ('</body>\n<body name="f2">', rod),
        ("<equality>", '<equality><connect body1="rod" body2="f2" anchor="0 0 0"/>'),
        ('<position joint="j1" kp="500" kv="20" forcerange="-50 50"/><position joint="j2" kp="500" kv="20"/>', ""),
    )
    driven = {actuator.target for actuator in import_model(path).spec.actuators}
    assert {"j1", "j2"} <= driven and "loose" not in driven


def test_driving_base_stands_still(tmp_path):
    head = "".join(
        f"""<link name="w{k}"/><joint name="wheel{k}" type="{kind}"><parent link="w{k}"/><child link="{child}"/>
        <axis xyz="{axis}"/><limit lower="-{far}" upper="{far}" effort="50" velocity="1"/></joint>"""
        for k, (kind, child, axis, far) in enumerate(
            [("prismatic", "w1", "1 0 0", 10), ("prismatic", "w2", "0 1 0", 10), ("revolute", "base", "0 0 1", 6.3)]
        )
    )
    path = _changed("toy.urdf", tmp_path, ("</robot>", head + "</robot>"))
    found = infer(path)
    assert found.sidecar.arm.joints == tuple(TOY_JOINTS)
    assert any("held still: wheel0, wheel1, wheel2" in note for note in found.notes)


def test_file_address_may_be_relative_and_not_lead_out(tmp_path):
    (tmp_path / "arm" / "parts").mkdir(parents=True)
    (tmp_path / "arm" / "parts" / "a.stl").write_bytes(b"x")
    (tmp_path / "b.stl").write_bytes(b"x")
    files = ModelFiles.of(tmp_path / "arm" / "toy.urdf")
    assert files.find("file://parts/a.stl", "mesh").name == "a.stl"
    with pytest.raises(Exception, match="leads outside"):
        files.find("file://../b.stl", "mesh")


def test_capsules_and_odd_colours_do_not_keep_a_urdf_from_loading(tmp_path):
    path = _changed(
        "toy.urdf",
        tmp_path,
        ('<cylinder radius="0.03" length="0.15"/>', '<capsule radius="0.03" length="0.09"/>'),
        ("<visual>", '<visual><material name="m"><color rgba="0.1 0.1 0.1 0 1"/></material>'),
    )
    imported = import_model(path)
    assert imported.spec.body("l1").geoms[0].size[1] == pytest.approx(0.075)
    assert any("capsules" in note for note in imported.notes) and any("colours" in note for note in imported.notes)


def test_shapes_of_no_size_are_left_out(tmp_path):
    path = _changed(
        "toy.urdf", tmp_path, ('<visual><geometry><box size="0.1 0.1 0.1"/>', '<visual><geometry><box size="0 0 0"/>')
    )
    assert "1 shapes of no size are left out" in import_model(path).notes
    flat = _changed("toy.urdf", tmp_path, ('<box size="0.15 0.04 0.04"/>', '<box size="0.15 0 0.04"/>'))
    with pytest.raises(InputError, match=r"link 'l2'.*must be greater than 0"):
        import_model(flat)


def test_joints_go_no_farther_than_their_servos_can_be_told(tmp_path):
    narrow = ('<position joint="j4" kp="200" kv="5"/>', '<position joint="j4" kp="200" kv="5" ctrlrange="-1.5 1.4"/>')
    turn = (
        '<position name="a5" joint="j5" kp="100" kv="2"/>',
        '<position name="a5" joint="j5" kp="100" kv="2" ctrlrange="-3 3"/>',
    )
    robot = load_robot(_changed("toy_tendon.xml", tmp_path, narrow, turn))
    with MuJoCoBackend() as sim:
        sim.load(Scene(robot_urdf=robot.path))
        assert sim.robot.lower[3:] == pytest.approx([-1.5, -3.0]) and sim.robot.upper[3:] == pytest.approx([1.4, 3.0])
        assert sim.robot.lower[1] == pytest.approx(-2.0)


def test_mimic_that_leads_outside_its_own_limits_is_turned(tmp_path):
    path = _changed("toy.urdf", tmp_path, ('<mimic joint="g1"/>', '<mimic joint="g1" multiplier="-1"/>'))
    assert any("its sign is turned" in note for note in import_model(path).notes)
    assert infer(path).sidecar.gripper.open_qpos == pytest.approx(0.03)


def test_shipped_sidecar_that_does_not_fit_gives_way_to_inference(monkeypatch, caplog):
    wrong = infer(TOYS / "toy.urdf").sidecar
    gripper = wrong.gripper.model_copy(update={"open_qpos": 3.0})
    wrong = wrong.model_copy(update={"gripper": gripper})
    monkeypatch.setattr(loader, "known_sidecar", lambda imported: (Path("toy.robosandbox.yaml"), wrong))
    loader._load.cache_clear()
    with caplog.at_level("WARNING", "robosandbox"):
        robot = load_robot(TOYS / "toy.urdf")
    loader._load.cache_clear()
    assert robot.sidecar.gripper.open_qpos == pytest.approx(0.03)
    assert any("does not fit it" in record.message for record in caplog.records)


def test_fingers_whose_frame_lies_between_them_point_away_from_the_palm(tmp_path):
    between = (
        '<link name="grip"/><joint name="mount" type="fixed"><parent link="hand"/><child link="grip"/>'
        '<origin xyz="0.04 0 0"/></joint></robot>'
    )
    path = _changed(
        "toy.urdf",
        tmp_path,
        ('<parent link="hand"/><child link="f', '<parent link="grip"/><child link="f'),
        ('<origin xyz="0.04 0.005 0"/>', '<origin xyz="-0.002 0.005 0"/>'),
        ('<origin xyz="0.04 -0.005 0"/>', '<origin xyz="-0.002 -0.005 0"/>'),
        ("</robot>", between),
    )
    found = infer(path).sidecar.ee_site.inject
    assert matrix_from_quat_xyzw(found.quat_xyzw)[:, 2] == pytest.approx([1.0, 0.0, 0.0], abs=1e-6)
    config = tmp_path / "written.yaml"
    home = [0, -0.6, 1.2, 0.9, 0]
    config.write_text(
        yaml.safe_dump(sidecar(TOY_JOINTS, home, fingers(["g1", "g2"], 0.03, 0), "grip", [0, 0, 0], [-0.2, 0, 0.04]))
    )
    assert load_robot(path, config).R_site_tcp[:, 2] == pytest.approx([1.0, 0.0, 0.0], abs=1e-6)


_CLAW = """<mujoco model="claw"><compiler angle="radian"/><worldbody><body name="palm"><geom type="box" size=".05 .03 .01"/>
<body name="left" pos="0 .045 .01"><joint name="l" axis="1 0 0" range="0 .6"/><geom type="box" pos="0 0 .04" size=".01 .004 .04"/></body>
<body name="right" pos="0 -.045 .01"><joint name="r" axis="-1 0 0" range="0 .6"/><geom type="box" pos="0 0 .04" size=".01 .004 .04"/></body>
</body></worldbody><equality><joint joint1="l" joint2="r"/></equality>
<actuator><position name="claw" joint="l" kp="20" kv="1" ctrlrange="0 .6" forcerange="-4 4"/></actuator></mujoco>"""


def _claw(folder):
    """Write a gripper of two hinged fingers; return the toy arm without its own."""
    (folder / "claw.xml").write_text(_CLAW)
    text = (TOYS / "toy_tendon.xml").read_text()
    bare = re.sub(r'<body name="f[12]">.*?</body>\n', "", text)
    for part in (
        r"<tendon>.*?</tendon>",
        r"<equality>.*?</equality>",
        r'<position name="g" .*?/>',
        r"<keyframe>.*?</keyframe>",
    ):
        bare = re.sub(part, "", bare, flags=re.DOTALL)
    return bare


@pytest.mark.parametrize(("turn", "by_site"), [("", False), (' euler="0 1.5708 0"', True)])
def test_gripper_is_mounted_by_a_tool_frame_only_where_that_points_outward(tmp_path, turn, by_site):
    path = tmp_path / "toy_tendon.xml"
    bare = _claw(tmp_path)
    path.write_text(
        bare.replace('<site name="tcp" pos=".06 0 0"/>', f'<site name="attachment_site" pos=".015 0 0"{turn}/>')
    )
    found = infer(path, gripper=tmp_path / "claw.xml")
    attach = found.sidecar.gripper.attach
    assert (attach.to_site == "attachment_site") == by_site
    config = tmp_path / "toy.yaml"
    config.write_text(to_yaml(found, tmp_path))
    robot = load_robot(path, config)
    assert robot.gripper is not None


def test_tip_depth_covers_fingers_that_are_longest_when_open(tmp_path):
    path = tmp_path / "toy_tendon.xml"
    path.write_text(_claw(tmp_path).replace('<site name="tcp" pos=".06 0 0"/>', ""))
    found = infer(path, gripper=tmp_path / "claw.xml")
    config = tmp_path / "toy.yaml"
    config.write_text(to_yaml(found, tmp_path))
    robot = load_robot(path, config)
    tcp = found.sidecar.ee_site.inject.xyz[2]
    # Straight fingers end 90 mm beyond the palm's frame; bent inward they end before that.
    assert robot.gripper.geometry.tip_depth == pytest.approx(0.09 - tcp, abs=0.002)


@pytest.mark.parametrize("folder", ["meshes", "assets", "secrets"])
def test_what_liesbeside_the_models_folder_is_read_from_a_search_path_alone(tmp_path, folder):
    (tmp_path / "v1").mkdir()
    (tmp_path / folder).mkdir()
    (tmp_path / folder / "a.stl").write_bytes(b"x")
    model = tmp_path / "v1" / "robot.xml"
    with pytest.raises(InputError, match=r"leads outside .*--package-path"):
        ModelFiles.of(model).find("a.stl", "mesh", folder=f"../{folder}")
    found = ModelFiles.of(model, [tmp_path]).find("a.stl", "mesh", folder=f"../{folder}")
    assert found.resolve() == (tmp_path / folder / "a.stl").resolve()


@pytest.mark.parametrize(
    ("field", "xyz"), [("ee_site", [0.1, 1e9, 0.0]), ("ee_site", [0.0, 0.0, 103.4]), ("base_pose", [-300.0, 0.0, 40.0])]
)
def test_lengths_that_cannot_be_metres_are_named(tmp_path, field, xyz):
    side = toy()
    if field == "ee_site":
        side["ee_site"]["inject"]["xyz"] = xyz
    else:
        side["base_pose"]["xyz"] = xyz
    path = tmp_path / "toy.robosandbox.yaml"
    path.write_text(yaml.safe_dump(side))
    with pytest.raises(InputError, match=rf"toy\.robosandbox\.yaml: {field}.*xyz: .* m away; it is in metres"):
        load_robot(TOYS / "toy.urdf", path)


def test_link_that_is_a_world_away_is_named(tmp_path):
    path = _changed(
        "toy_jaw.xml", tmp_path, ('<body name="lower" pos="0 0 0.16">', '<body name="lower" pos="1e9 0 0.16">')
    )
    with pytest.raises(InputError, match=r"toy_jaw\.xml: body 'lower': is 1e\+09 m away"):
        load_robot(path)


def test_reach_leaves_out_where_the_arm_would_touch_its_own_foot_with_a_sidecar_too(tmp_path):
    drum = '<collision><origin xyz="0 0 -0.01"/><geometry><cylinder radius="0.14" length="0.08"/></geometry></collision></link>'
    path = _changed(
        "toy.urdf", tmp_path, ('</collision></link>\n<link name="l1">', "</collision>" + drum + '\n<link name="l1">')
    )
    found = infer(path)
    config = tmp_path / "toy.yaml"
    config.write_text(to_yaml(found, tmp_path))
    bare = load_robot(TOYS / "toy.urdf").workspace
    given = load_robot(path, config).workspace
    assert bare.near < 0.12 < given.near == pytest.approx(found.workspace.near, abs=0.03)


def test_last_link_that_is_only_drawn_still_pushes(tmp_path):
    bare = re.sub(
        r'<link name="f[12]">.*?</link>\n|<joint name="g[12]".*?</joint>\n', "", (TOYS / "toy.urdf").read_text()
    )
    hand = '<link name="hand"><collision><geometry><box size="0.03 0.1 0.03"/></geometry></collision></link>'
    assert hand in bare
    path = tmp_path / "toy.urdf"
    path.write_text(bare.replace(hand, hand.replace("collision", "visual")))
    report = check_robot(path)
    assert report.ok, [item for item in report.checks if not item.ok]
    assert next(item for item in report.checks if item.name == "push").ok


def test_closed_fingers_that_touch_each_other_are_no_obstacle(tmp_path):
    # Slides that close beyond the point where the pads meet.
    path = _changed("toy_tendon.xml", tmp_path, ('range="0 .03"', 'range="-.004 .03"'))
    with MuJoCoBackend() as sim:
        sim.load(Scene(robot_urdf=path))
        checker = CollisionChecker(sim.model, sim.robot, [str(b) for b in range(sim.model.nbody)])
        checker.set_gripper(-0.002)
        checker.data.qpos[sim.robot.gripper.joint_indices] = -0.002
        assert checker.touch(sim.robot.home_q) is None
