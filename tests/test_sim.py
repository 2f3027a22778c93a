import mujoco
import numpy as np
import pytest

from robosandbox.apps.conformance import check_driver
from robosandbox.errors import InputError, RenderingError
from robosandbox.robots.chains import Chains
from robosandbox.robots.loader import load_robot
from robosandbox.sim.mujoco_backend import MuJoCoBackend
from robosandbox.types import Pose, Scene, SceneObject


def box(name="cube", at=(0.15, 0.0, 0.06), half=0.012, mass=0.05):
    return SceneObject(id=name, kind="box", size=(half,) * 3, pose=Pose(xyz=at), mass=mass)


@pytest.fixture
def sim():
    with MuJoCoBackend() as backend:
        backend.load(Scene(objects=(box(),)))
        yield backend


def test_backend_keeps_the_sim_promises(sim):
    check_driver(sim, pictures=False)


def test_objects_have_settled_after_reset(sim):
    cube = sim.truth().objects["cube"]
    assert cube.pose.xyz[2] == pytest.approx(0.052, abs=3e-4)
    assert np.abs(cube.linear_velocity).max() < 0.005
    assert set(cube.contacts) == {"table"}


def test_reset_repeats_to_the_last_bit(sim):
    first = sim.snapshot()
    sim.wait(0.3)
    sim.reset()
    assert (sim.snapshot() == first).all()


def test_fork_leaves_the_world_alone(sim):
    before = sim.snapshot()
    other = sim.fork()
    other.set_gripper("hand", 1.0)
    other.wait(0.5)
    assert (sim.snapshot() == before).all()


@pytest.mark.parametrize(
    "kind, size, other",
    [
        ("box", (0.01, 0.02, 0.03), (0.02, 0.01, 0.015)),
        ("sphere", (0.02,), (0.03,)),
        ("cylinder", (0.02, 0.03), (0.01, 0.05)),
        ("capsule", (0.02, 0.03), (0.015, 0.04)),
    ],
)
def test_new_numbers_equal_a_new_model(kind, size, other):
    def scene(size, mass):
        return Scene(objects=(SceneObject(id="a", kind=kind, size=size, pose=Pose(xyz=(0.2, 0, 0.15)), mass=mass),))

    with MuJoCoBackend() as written, MuJoCoBackend() as built:
        written.load(scene(size, 0.05))
        written.reset(scene(other, 0.08))
        built.load(scene(other, 0.08))
        assert written.compilations == 1
        for field in ("geom_size", "geom_aabb", "geom_rbound", "body_mass", "body_inertia", "body_invweight0"):
            assert np.allclose(getattr(written.model, field), getattr(built.model, field), rtol=1e-6, atol=1e-9), field
        assert np.allclose(written.snapshot(), built.snapshot(), atol=1e-6)


def test_table_height_moves_the_table():
    with MuJoCoBackend() as sim:
        sim.load(Scene(table_height=0.1, objects=(box(at=(0.15, 0.0, 0.115)),)))
        assert sim.truth().objects["cube"].pose.xyz[2] == pytest.approx(0.112, abs=5e-4)


@pytest.mark.parametrize(
    "objects, said",
    [
        ((box(at=(0.15, 0.0, 0.045)),), "inside 'table'"),
        ((box("a"), box("b", at=(0.155, 0.0, 0.06))), "inside 'b'"),
    ],
)
def test_start_inside_something_is_refused(objects, said):
    with MuJoCoBackend() as sim, pytest.raises(InputError, match=said):
        sim.load(Scene(objects=objects))


def test_closed_means_the_sidecars_closed(sim):
    for closed, width in ((1.0, 0.0), (0.0, 0.08), (0.5, 0.04)):
        sim.hands["hand"].set_gripper(closed)
        sim.wait(1.5)
        assert sim.state().gripper.width == pytest.approx(width, abs=1e-3)


def test_gripper_geometry_is_the_pandas():
    robot = load_robot()
    geometry = robot.gripper.geometry
    assert geometry.max_aperture == pytest.approx(0.08, abs=5e-4)
    assert np.allclose(np.abs(robot.R_site_tcp[:, 2]), [0, 0, 1])
    assert np.allclose(np.abs(robot.R_site_tcp[:, 1]), [0, 1, 0])


def test_held_cube_creeps_less_than_a_millimetre_a_minute():
    from robosandbox.workcell.session import open_session

    with open_session("pick_cube_franka") as session:
        assert session.run().success

        def offset():
            tcp = session.driver.state().tcp_pose
            return tcp.inverse() @ session.simulation.truth().objects["red_cube"].pose

        before = offset()
        session.driver.wait(60.0)
        assert np.linalg.norm(offset().position - before.position) < 1e-3


def test_missing_gl_is_one_line_with_the_remedy(sim, monkeypatch):
    monkeypatch.setattr(
        "robosandbox.sim.rendering._context_class", lambda backend: (_ for _ in ()).throw(ImportError("x"))
    )
    with pytest.raises(RenderingError, match="apt-get install"):
        sim.state(cameras=("scene",))


@pytest.mark.gl
def test_cameras_see_the_scene(sim):
    try:
        images = sim.state(cameras=("scene", "top", "wrist")).images
    except RenderingError as error:
        pytest.skip(str(error))
    assert {image.shape for image in images.values()} == {(240, 320, 3)}
    assert all(image.std() > 5.0 for image in images.values())


def sidecar(tmp_path, **changes):
    import yaml

    robot = load_robot()
    (tmp_path / "panda.xml").write_text(robot.path.read_text())
    content = yaml.safe_load(robot.path.with_suffix(".robosandbox.yaml").read_text())
    for key, value in changes.items():
        section, _, field = key.partition("__")
        if value is None:
            content[section].pop(field)
        else:
            content[section][field] = value
    path = tmp_path / "panda.robosandbox.yaml"
    path.write_text(yaml.safe_dump(content))
    return tmp_path / "panda.xml"


@pytest.mark.parametrize(
    "changes, said",
    [
        (
            {"arm__joints": ["joint1", "joint2", "joint3", "joint4", "joint5", "joint6", "joint77"]},
            "arm.joints.6.*'joint7'",
        ),
        ({"arm__joints": ["joint1", "joint1", "joint3", "joint4", "joint5", "joint6", "joint7"]}, "listed twice"),
        ({"arm__actuators": [f"actuator{i}" for i in (1, 2, 3, 4, 5, 6, 9)]}, "arm.actuators.6.*actuator"),
        ({"arm__actuators": [f"actuator{i}" for i in (2, 1, 3, 4, 5, 6, 7)]}, "drives 'joint2', not 'joint1'"),
        ({"arm__home_qpos": [0.0] * 6}, "home_qpos"),
        ({"arm__home_qpos": [0, 0, 0, float("nan"), 0, 1.57, 0]}, "home_qpos"),
        ({"arm__home_qpos": [0, 0, 0, 1.0, 0, 1.57, 0]}, r"home_qpos.3.*outside the limits of 'joint4'"),
        ({"gripper__closed_qpos": 0.04}, "equals open_qpos"),
        ({"gripper__open_qpos": 0.08}, "open_qpos.*0.08 is outside"),
        ({"gripper__primary_joint": "finger"}, "primary_joint"),
        ({"gripper__actuator": "actuator7"}, "gripper"),
        ({"ee_site__inject": {"attach_body": "hnad", "xyz": [0, 0, 0.1]}}, "attach_body 'hnad'.*'hand'"),
        ({"ee_site__inject": {"attach_body": "hand", "xyz": [0, 0, 0.1], "quat_xyzw": [0, 0, 0, 0]}}, "quat_xyzw"),
        ({"arm__home": [0.0]}, "home"),
    ],
)
def test_wrong_sidecars_are_one_line_each(tmp_path, changes, said):
    with pytest.raises(InputError, match=said) as caught:
        load_robot(sidecar(tmp_path, **changes))
    assert "\n" not in str(caught.value)
    assert "panda.robosandbox.yaml" in str(caught.value)


def test_broken_model_file_is_one_line(tmp_path):
    path = sidecar(tmp_path)
    path.write_text("<mujoco><worldbody><geom type='mesh' mesh='gone'/></worldbody></mujoco>")
    with pytest.raises(InputError, match=r"panda\.xml") as caught:
        load_robot(path)
    assert "\n" not in str(caught.value)


def test_two_loads_give_the_same_bytes():
    states = []
    for _ in range(2):
        with MuJoCoBackend() as sim:
            sim.load(Scene(objects=(box(),)))
            sim.wait(0.2)
            states.append(sim.snapshot())
    assert (states[0] == states[1]).all()
    assert mujoco.mj_versionString()


def test_an_arm_without_gravity_compensation_in_its_file_carries_itself(tmp_path):
    path = sidecar(tmp_path)
    path.write_text(path.read_text().replace('gravcomp="1"', ""))
    with MuJoCoBackend() as sim:
        sim.load(Scene(robot_urdf=path))
        sim.wait(1.0)
        assert np.abs(sim.state().q - sim.robot.home_q).max() < 1e-3


EVERY_JOINT = """
<mujoco><worldbody>
  <body name="a" pos="0.1 0.2 0.3" quat="0.8 0.1 0.5 0.3">
    <joint type="hinge" axis="0.2 1 0.4" pos="0.05 -0.1 0.02" ref="0.3"/><geom size="0.01"/>
    <body name="b" pos="0 0 0.2"><joint type="slide" axis="1 0 1" ref="0.1"/><geom size="0.01"/>
      <body name="c" pos="0.1 0 0"><joint type="slide" axis="0 1 0"/><joint type="ball" pos="0 0.1 0"/><geom size="0.01"/>
        <body name="d" quat="0 0 1 0"><geom size="0.01"/></body>
      </body>
    </body>
  </body>
  <body name="e" pos="1 0 0"><freejoint/><geom size="0.01"/></body>
</worldbody></mujoco>
"""


def test_chains_of_all_joints_go_where_mujocos_kinematics_goes():
    model = mujoco.MjModel.from_xml_string(EVERY_JOINT)
    data = mujoco.MjData(model)
    configurations = np.random.default_rng(0).normal(size=(20, model.nq))
    bodies = [model.body(name).id for name in "dabe"]
    positions, quats = Chains(model, bodies).poses(configurations)
    for row, qpos in enumerate(configurations):
        data.qpos[:] = qpos
        mujoco.mj_kinematics(model, data)
        assert np.allclose(positions[row], data.xpos[bodies], atol=1e-12)
        assert np.allclose(quats[row], data.xquat[bodies][:, [1, 2, 3, 0]], atol=1e-12)
