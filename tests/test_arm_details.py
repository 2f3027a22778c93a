"""What a wrong sidecar's symptom is blamed on, and what models leave unsaid: small models, one point each."""

import re

import mujoco
import numpy as np
import pytest
import yaml
from support.written_arms import TOYS, jaw, toy

from robosandbox.apps.conformance.robot_check import check_robot
from robosandbox.errors import InputError
from robosandbox.motion.sampling import find_knots
from robosandbox.robots.importers.importing import import_model
from robosandbox.robots.importers.mount import mount
from robosandbox.robots.infer.report import to_yaml
from robosandbox.robots.infer.sidecar import infer
from robosandbox.robots.loader import load_robot
from robosandbox.robots.sidecar import GripperAttachment


def _check(name, side, folder):
    path = folder / "sidecar.yaml"
    path.write_text(yaml.safe_dump(side))
    return check_robot(TOYS / name, sidecar=path)


def _blamed(report):
    return {item.field for item in report.checks if not item.ok}


def _opens(side, share):
    gripper = side["gripper"]
    gripper["open_qpos"] = gripper["closed_qpos"] + share * (gripper["open_qpos"] - gripper["closed_qpos"])


CAUSES = {
    "home reaches into the table, base right": (
        "arm.home_qpos",
        lambda s: s["arm"].update(home_qpos=[0, 0.2, 1.4, 0.5, 0]),
    ),
    "the table lies behind the base": ("base_pose.xyz", lambda s: s["base_pose"].update(xyz=[0.6, 0, 0.04])),
    "opens less than the cube is wide": ("gripper.open_qpos", lambda s: _opens(s, 0.35)),
}


@pytest.mark.parametrize("cause", CAUSES)
@pytest.mark.sample(every=3)
def test_check_blames_the_field_that_the_trial_shows_to_be_wrong(cause, tmp_path):
    side = toy()
    field, change = CAUSES[cause]
    change(side)
    assert _blamed(_check("toy.urdf", side, tmp_path)) == {field}


def test_check_names_a_gripper_actuator_that_drives_the_arm(tmp_path):
    side = jaw()
    side["gripper"]["actuator"] = "roll"
    report = _check("toy_jaw.xml", side, tmp_path)
    assert _blamed(report) == {"gripper.actuator"}
    assert any("'roll' of the arm" in item.detail for item in report.checks)


def test_check_that_passes_names_no_field_in_its_document(tmp_path):
    side = toy()
    # Twenty millimetres behind the pads' middle, where some makers put it.
    side["ee_site"]["inject"]["xyz"] = [0.03, 0, 0]
    document = _check("toy.urdf", side, tmp_path).document()
    assert document["ok"]
    assert all(item["field"] is None for item in document["checks"])


def test_hinges_of_a_file_without_a_unit_are_radians_where_degrees_would_hardly_move(tmp_path):
    text = (TOYS / "toy_jaw.xml").read_text()
    assert 'angle="radian"' in text
    (tmp_path / "fragment.xml").write_text(text.replace('angle="radian"', ""))
    imported = import_model(tmp_path / "fragment.xml")
    assert any("taken as radians" in note for note in imported.notes)
    np.testing.assert_allclose(imported.spec.compile().joint("jaw").range, [-0.35, 1.2])
    (tmp_path / "degrees.xml").write_text(text.replace('angle="radian"', 'angle="degree"'))
    said = import_model(tmp_path / "degrees.xml")
    np.testing.assert_allclose(said.spec.compile().joint("jaw").range, np.radians([-0.35, 1.2]), atol=1e-6)


_FINGER = """
<body name="{name}" pos="0.06 {y} {z}">
  <joint name="{name}" type="slide" axis="0 {axis} 0" range="0 0.03"/>
  <geom type="box" size="0.03 0.004 0.006" pos="0.02 0 0"/>
</body>"""
_THREE = [("thumb", -0.034, 0.0, 1), ("index", 0.034, 0.02, -1), ("ring", 0.034, -0.02, -1)]


def _three_fingers(folder, tendons=""):
    """Write the jaw's arm with two fingers that close on a thumb between them."""
    text = (TOYS / "toy_jaw.xml").read_text()
    begin, end = text.index('<geom type="box" size="0.035 0.004 0.01" pos="0.07'), text.index("</body>")
    end += len("</body>")
    fingers = "".join(_FINGER.format(name=n, y=y, z=z, axis=axis) for n, y, z, axis in _THREE)
    text = text[:begin] + '<geom type="box" size="0.005 0.04 0.03" pos="0.035 0 0"/>' + fingers + text[end:]
    text = text.replace('<motor joint="jaw"', '<motor joint="thumb"')
    others = "" if tendons else '<motor joint="index" ctrlrange="-10 10"/><motor joint="ring" ctrlrange="-10 10"/>'
    text = text.replace("</actuator>", f"{others}</actuator>{tendons}")
    path = folder / "three.xml"
    path.write_text(text)
    return path


def test_tcp_of_three_fingers_lies_between_the_one_and_the_two(tmp_path):
    inject = infer(_three_fingers(tmp_path)).sidecar.ee_site.inject
    assert inject.attach_body == "hand"
    np.testing.assert_allclose(inject.xyz[1:], [0.0, 0.0], atol=0.003)
    assert 0.06 < inject.xyz[0] < 0.11


def test_joint_that_a_tendon_of_set_length_moves_gets_no_servo(tmp_path):
    tied = "".join(
        f'<fixed name="{name}"><joint joint="thumb" coef="1"/><joint joint="{name}" coef="-1"/></fixed>'
        for name in ("index", "ring")
    )
    held = "".join(f'<tendon tendon1="{name}"/>' for name in ("index", "ring"))
    path = _three_fingers(tmp_path, f"<tendon>{tied}</tendon><equality>{held}</equality>")
    model = import_model(path).spec.compile()
    driven = {model.joint(int(model.actuator_trnid[a, 0])).name for a in range(model.nu)}
    assert "thumb" in driven
    assert not driven & {"index", "ring"}
    assert (model.eq_type == mujoco.mjtEq.mjEQ_TENDON.value).sum() == 2


def test_way_is_found_for_joints_without_limits():
    unlimited = np.full(2, np.inf)
    start, goal = np.array([-0.8, 0.0]), np.array([0.8, 0.0])

    def is_free(q: np.ndarray, other: np.ndarray) -> bool:
        return bool(np.hypot(*np.linspace(q, other, 50).T).min() > 0.4)

    knots = find_knots(is_free, start, goal, -unlimited, unlimited)
    assert knots is not None
    np.testing.assert_allclose(knots[[0, -1]], [start, goal])


_GRIPPER = """
<mujoco model="g"><compiler angle="radian"/><worldbody><body name="base"><geom type="box" size="0.02 0.02 0.01"/>
<body name="f1" pos="0 -0.03 0.03"><joint name="f1" type="slide" axis="0 1 0" range="0 0.02"/>
<geom type="box" size="0.008 0.004 0.05"/></body>
<body name="f2" pos="0 0.03 0.03"><joint name="f2" type="slide" axis="0 -1 0" range="0 0.02"/>
<geom type="box" size="0.008 0.004 0.05"/></body></body></worldbody></mujoco>"""


@pytest.mark.parametrize(("back", "touching"), [(0.05, True), (-0.10, False)])
def test_gripper_mounted_into_its_wrist_may_touch_it_and_no_other_may(back, touching, tmp_path):
    (tmp_path / "gripper.xml").write_text(_GRIPPER)
    imported = import_model(TOYS / "toy_jaw.xml")
    attachment = GripperAttachment(
        model=tmp_path / "gripper.xml", to_body="hand", xyz=(-back, 0, 0), quat_xyzw=(0, 0.70710678, 0, 0.70710678)
    )
    mount(imported, attachment, tmp_path / "gripper.xml")
    pairs = {frozenset((item.bodyname1, item.bodyname2)) for item in imported.spec.excludes}
    assert (frozenset(("gripper/f1", "wrist")) in pairs) == touching
    assert any("mounted into its arm" in note for note in imported.notes) == touching


def _bare_arm(folder):
    """Write the jaw's arm without its jaw."""
    text = (TOYS / "toy_jaw.xml").read_text()
    begin, end = text.index('<body name="jaw"'), text.index("</body>") + len("</body>")
    path = folder / "bare.xml"
    path.write_text(re.sub(r'<motor joint="jaw"[^>]*>', "", text[:begin] + text[end:]))
    return path


def test_gripper_of_a_file_that_closes_on_nothing_is_refused_by_name(tmp_path):
    (tmp_path / "along.xml").write_text(re.sub('axis="0 -?1 0"', 'axis="0 0 1"', _GRIPPER))
    with pytest.raises(InputError, match=r"along\.xml: .*is no gripper that could be measured"):
        infer(_bare_arm(tmp_path), gripper=tmp_path / "along.xml")


def test_fingers_that_start_locked_into_each_other_are_measured_all_the_same(tmp_path):
    locked = _GRIPPER.replace('pos="0 -0.03 0.03"', 'pos="0 0.003 0.03"').replace(
        'pos="0 0.03 0.03"', 'pos="0 -0.003 0.03"'
    )
    locked = locked.replace('axis="0 1 0"', 'axis="0 -2 0"').replace('axis="0 -1 0"', 'axis="0 1 0"')
    (tmp_path / "locked.xml").write_text(locked.replace('range="0 0.02"', 'range="0 0.04"'))
    gripper = infer(_bare_arm(tmp_path), gripper=tmp_path / "locked.xml").sidecar.gripper
    assert gripper.open_qpos == pytest.approx(0.04, abs=0.002)
    assert gripper.closed_qpos < 0.012


def _spun(folder):
    """Return the toy with a propeller that turns without end where its fingers are, and a picture that is not there."""
    text = (TOYS / "toy.urdf").read_text()
    propeller = (
        '<link name="prop"><visual><geometry><mesh filename="prop.stl"/></geometry></visual>'
        '<collision><geometry><sphere radius="0.01"/></geometry></collision></link>'
        '<joint name="gripper" type="continuous"><parent link="hand"/><child link="prop"/><origin xyz="-0.02 0 0"/>'
        '<axis xyz="1 0 0"/><limit effort="1" velocity="3"/></joint>'
    )
    path = folder / "spun.urdf"
    path.write_text(text.replace("</robot>", f"{propeller}</robot>"))
    return path


def test_what_spins_without_end_is_no_finger_and_a_picture_that_is_not_there_a_note(tmp_path):
    found = infer(_spun(tmp_path))
    assert found.sidecar.gripper is not None and found.sidecar.gripper.joints == ("g1", "g2")
    assert "link 'prop': its visual mesh 'prop.stl' is not there: not drawn" in found.notes


def test_a_mesh_that_is_collided_with_has_to_be_there(tmp_path):
    def model(collides):
        path = tmp_path / "arm.xml"
        drawn = f'<geom type="mesh" mesh="plate" contype="{collides}" conaffinity="0"/>'
        text = (TOYS / "toy_jaw.xml").read_text()
        text = text.replace("<worldbody>", '<asset><mesh name="plate" file="plate.stl"/></asset><worldbody>', 1)
        body = re.search(r"<body [^>]*>", text)
        path.write_text(text[: body.end()] + drawn + text[body.end() :])
        return path

    assert "the visual mesh 'plate.stl' is not there: not drawn" in import_model(model(0)).notes
    with pytest.raises(InputError, match=r"no file 'plate.stl'"):
        import_model(model(1))


@pytest.mark.parametrize("name", ["toy.urdf", "toy_jaw.xml", "toy_tendon.xml"])
def test_loading_measures_the_gripper_that_inference_told_of(name, tmp_path):
    found = infer(TOYS / name)
    path = tmp_path / "sidecar.yaml"
    path.write_text(to_yaml(found))
    robot = load_robot(TOYS / name, path)
    widest = f"{1000 * robot.gripper.geometry.max_aperture:.0f} mm"
    assert found.findings["gripper.open_qpos"].evidence == f"driven over its range, its pads are {widest} apart there"
    assert found.findings["gripper"].evidence.endswith(f"opens to {widest}")
    assert (robot.sidecar.gripper.open_qpos, robot.sidecar.gripper.closed_qpos) == (
        found.sidecar.gripper.open_qpos,
        found.sidecar.gripper.closed_qpos,
    )


def test_check_says_what_inference_saw_of_a_gripper(tmp_path):
    side = yaml.safe_load(to_yaml(infer(TOYS / "toy.urdf")))
    side["gripper"]["closed_qpos"] = side["gripper"]["open_qpos"] * 0.6
    report = _check("toy.urdf", side, tmp_path)
    said = next(item.detail for item in report.checks if item.field == "gripper.closed_qpos" and not item.ok)
    assert "does not close: it would at" in said and "its pads are" in said
