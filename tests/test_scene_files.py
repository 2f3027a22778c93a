"""Scenes from files: what an MJCF has in it, what its sidecar says, and what the robot does there."""

import json
import re
from dataclasses import replace
from pathlib import Path

import mujoco
import numpy as np
import pytest

from robosandbox.agent.episode import Episode
from robosandbox.apps.commands.world import open_here
from robosandbox.errors import CollisionError, InputError, LimitError
from robosandbox.shapes.body import Piece
from robosandbox.shapes.compound import Geometry, kind_of
from robosandbox.shapes.hull import BoxHull
from robosandbox.shapes.registry import shape_of
from robosandbox.sim.opening import open_mujoco
from robosandbox.sim.populated import populated
from robosandbox.sim.scene_check import check_scene
from robosandbox.sim.scene_file import read_scene_file
from robosandbox.sim.scene_report import to_yaml
from robosandbox.sim.scene_sidecar import sidecar_path
from robosandbox.skills.primitives.manipulator import Manipulator, moved
from robosandbox.skills.primitives.part_ways import PartWay, _faces
from robosandbox.skills.primitives.parts import follow_way
from robosandbox.skills.primitives.stillness import Stillness
from robosandbox.tasks.judge.checks import Closed
from robosandbox.tasks.loader import load_task
from robosandbox.types import ObservedScene, Plan, Pose, Scene, SceneObject
from robosandbox.workcell.embedded import EmbeddedWorkcell
from robosandbox.workcell.options import WorkcellOptions
from robosandbox.workcell.session import open_workcell
from robosandbox.world.contracts import find, lookup
from robosandbox.world.covered import ways_out
from robosandbox.world.effects import with_objects
from robosandbox.world.facts import fact
from robosandbox.world.parts import at_value, lever, open_share, open_value, shut_value
from robosandbox.world.placement_sampling import at_its_height, levelled, resting_pose, separately, tried_on_table
from robosandbox.world.predicate import View
from robosandbox.world.relations import bottom, centre, top

RACK = Path(__file__).parents[1] / "examples" / "scenes" / "rack.xml"
STOVE = Path(__file__).parents[1] / "examples" / "scenes" / "stove.xml"
CABINET = Path(__file__).parents[1] / "examples" / "scenes" / "cabinet.xml"
MICROWAVE = Path(__file__).parents[1] / "examples" / "scenes" / "microwave.urdf"
KITCHEN = Path(__file__).parents[1] / "examples" / "scenes" / "kitchen.xml"

# A room of somebody else: his own arm, a tilted block, a stool, things that are nowhere near a table.
ROOM = """
<mujoco>
  <option timestep="0.004" cone="pyramidal"/>
  <default><geom contype="0" conaffinity="0"/><default class="solid"><geom contype="1" conaffinity="1"/></default></default>
  <worldbody>
    <geom class="solid" type="plane" size="3 3 0.1"/>
    <body name="bench" pos="-1 2 0.3"><geom class="solid" type="box" size="0.5 0.3 0.02"/></body>
    <body name="red block" pos="-1 2.1 0.345"><freejoint/><geom class="solid" type="box" size="0.02 0.02 0.025" rgba="0.9 0.1 0.1 1"/></body>
    <body name="ghost" pos="-1 1.9 0.5"><freejoint/><geom type="sphere" size="0.02" mass="0.1"/></body>
    <body name="their_arm" pos="-1.4 2 0.32">
      {links}
    </body>
  </worldbody>
  <actuator>{motors}</actuator>
  <keyframe><key name="start" qpos="-1.05 2.05 0.345 1 0 0 0  -1 1.9 0.5 1 0 0 0  0 0 0 0 0"/></keyframe>
</mujoco>
"""


def _room(folder: Path, sidecar: str = "") -> Path:
    links, motors = "", ""
    for number in range(5):
        axis = "0 0 1" if number == 0 else "0 1 0"
        links += (
            f'<body name="link{number}" pos="0 0 0.1"><joint name="j{number}" axis="{axis}"/>'
            '<geom class="solid" type="capsule" size="0.03 0.03"/>'
        )
        motors += f'<motor joint="j{number}"/>'
    path = folder / "room.xml"
    path.write_text(ROOM.format(links=links + "</body>" * 5, motors=motors))
    if sidecar:
        sidecar_path(path).write_text(sidecar)
    return path


@pytest.mark.parametrize(
    ("kind", "size", "found"),
    [
        ("cup", (0.034, 0.09), "vessel"),
        ("bowl", (0.06, 0.05), "vessel"),
        ("bin", (0.08, 0.06, 0.07), "vessel"),
        ("plate", (0.08, 0.018), "dish"),
        ("tray", (0.10, 0.08, 0.02), "dish"),
        ("block_l", (0.05, 0.04, 0.02, 0.03), "solid"),
    ],
)
def test_pieces_alone_tell_the_hollow_of_each_kind(kind: str, size: tuple[float, ...], found: str) -> None:
    item = SceneObject(id="it", kind=kind, size=size, pose=Pose(xyz=(0.0, 0.0, 0.1)))
    pieces = item.shape.bodies(item)[0].pieces
    assert kind_of(pieces) == found
    known, measured = shape_of(kind).room(size), Geometry(pieces).hollow
    if known is None or measured is None:
        assert known is measured is None
        return
    assert measured.is_round == known.is_round
    assert np.abs(measured.half - known.half).max() < 0.003
    assert measured.floor == pytest.approx(known.floor, abs=1e-3)
    assert measured.rim == pytest.approx(known.rim, abs=1e-3)


def test_a_handle_does_not_move_the_middle_of_a_mug() -> None:
    mug = next(item for item in read_scene_file(KITCHEN).objects if item.id == "red_mug")
    assert mug.geometry is not None
    hollow = mug.geometry.hollow
    assert hollow is not None and hollow.is_round
    assert mug.geometry.box[0][0] > 0.01
    assert np.abs(hollow.middle).max() < 0.001
    assert hollow.half[0] == pytest.approx(0.034, abs=0.002)


def test_shelf_boards_are_level_faces_with_their_headroom() -> None:
    boards = tuple(Piece(hull=BoxHull((0.2, 0.1, 0.005)), centre=(0.0, 0.0, z)) for z in (0.0, 0.15, 0.30))
    faces = Geometry(boards, "fixture").surfaces
    assert [round(face.height, 3) for face in faces] == [0.305, 0.155, 0.005]
    assert np.isinf(faces[0].headroom)
    assert faces[1].headroom == pytest.approx(0.14, abs=1e-6)
    assert all(face.half_width == pytest.approx(0.1, abs=0.005) for face in faces)


def test_what_stands_in_a_cupboard_stands_on_the_table_that_bears_it(tmp_path: Path) -> None:
    path = tmp_path / "room.xml"
    cube = '<body name="c{0}" pos="{1} 0 {2}"><freejoint/><geom type="box" size=".02 .02 .02" mass=".05"/></body>'
    cupboard = "".join(
        f'<geom type="box" size="{size}" pos="{pos}"/>'
        for size, pos in ((".15 .1 .005", "0 0 .155"), (".15 .1 .005", "0 0 .295"), (".15 .005 .15", "0 .1 .15"))
    )
    path.write_text(
        '<mujoco><worldbody><geom type="plane" size="2 2 .1"/>'
        '<body name="table" pos="0 0 .5"><geom type="box" size=".6 .4 .02"/></body>'
        f'<body name="cupboard" pos=".3 0 .52">{cupboard}</body>'
        + cube.format(1, 0.25, 0.701)
        + cube.format(2, 0.35, 0.701)
        + cube.format(3, -0.3, 0.541)
        + "</worldbody></mujoco>"
    )
    file = read_scene_file(path)
    assert file.table.body == "table" and file.table.why == "3 of 3 things stand on it"
    assert "cupboard" in {item.id for item in file.objects}


def test_the_kitchen_is_things_fixtures_and_parts() -> None:
    file = read_scene_file(KITCHEN)
    assert {item.id: item.kind for item in file.objects} == {
        "red_mug": "vessel",
        "box": "box",
        "cupboard": "cupboard",
        "cupboard.door": "part",
        "shelf": "fixture",
        "bell": "fixture",
        "bell.button": "part",
    }
    assert file.table.body == "table" and file.table.height == pytest.approx(0.74)
    door = next(item for item in file.objects if item.id == "cupboard.door")
    assert door.geometry is not None and door.geometry.joint is not None
    assert door.geometry.joint.kind == "hinge" and door.geometry.joint.low == pytest.approx(np.radians(-100.0))


def test_the_file_is_simulated_as_it_is() -> None:
    own = mujoco.MjModel.from_xml_path(str(KITCHEN))
    sim = open_mujoco(Scene(world=KITCHEN))
    try:
        model = sim.model
        for field in ("timestep", "impratio", "cone", "integrator", "noslip_iterations", "enableflags"):
            assert getattr(model.opt, field) == getattr(own.opt, field), field
        for body in range(1, own.nbody):
            name = own.body(body).name
            assert model.body(name).mass == pytest.approx(own.body(name).mass)
        for geom in range(own.ngeom):
            name = own.geom(geom).name
            if name:
                assert np.array_equal(model.geom(name).friction, own.geom(geom).friction)
        assert "doorway" in sim.cameras
        assert model.nlight == own.nlight
        # The keyframe is there, with the robot at home in it.
        key = mujoco.MjData(model)
        mujoco.mj_resetDataKeyframe(model, key, model.key("tidy").id)
        mujoco.mj_kinematics(model, key)
        assert np.allclose(key.body("red_mug").xpos, (0.50, 0.02, 0.741))
        assert np.allclose(key.qpos[sim.robot.qpos_indices], sim.robot.home_q)
    finally:
        sim.close()


def test_an_arm_in_the_file_is_left_out_for_the_scenes_robot(tmp_path: Path) -> None:
    file = read_scene_file(_room(tmp_path))
    assert list(file.left_out) == ["their_arm"]
    assert "5 driven hinges" in file.left_out["their_arm"]
    assert [item.id for item in file.objects] == ["red_block"]
    assert any("ghost" in note for note in file.notes)
    sim = open_mujoco(Scene(world=file.path))
    try:
        assert "link0" in sim.body_names and not any("their_arm" in name for name in sim.body_names)
        assert sim.model.opt.cone == mujoco.mjtCone.mjCONE_PYRAMIDAL.value
        truth = sim.truth().objects["red_block"]
        assert truth.contacts == ("table",)
        # Commands come at a whole multiple of the file's time step.
        assert sim.control_timestep == pytest.approx(0.008)
        # The table is far from the world's middle: the base goes with it.
        assert np.hypot(*(sim.arms["arm"].spec.base_position[:2] - [-1.0, 2.0])) < 0.6
    finally:
        sim.close()


def test_an_arm_that_is_led_by_its_hand_is_left_out_with_what_leads_it(tmp_path: Path) -> None:
    links = "".join(f'<body name="l{k}" pos="0 0 .1"><joint axis="0 1 0"/><geom size=".02"/>' for k in range(4))
    path = tmp_path / "led.xml"
    path.write_text(
        '<mujoco><worldbody><body name="board"><geom type="box" size=".5 .5 .02"/></body>'
        f'<body name="base" pos="0 0 .1">{links}{"</body>" * 4}</body><body name="lead" mocap="true"/></worldbody>'
        '<equality><weld body1="lead" body2="l3"/></equality></mujoco>'
    )
    file = read_scene_file(path)
    assert file.left_out.keys() == {"base", "lead"}
    assert [item.id for item in file.objects] == []
    assert file.table.body == "board"


@pytest.mark.parametrize("hinges, stays", [(3, True), (4, False), (7, False)])
def test_hinges_on_hinges_without_motors_are_an_arm_and_no_parts(tmp_path: Path, hinges: int, stays: bool) -> None:
    links = "".join(
        f'<link name="l{k}"><inertial><mass value="1"/><inertia ixx=".1" ixy="0" ixz="0" iyy=".1" iyz="0" izz=".1"/></inertial>'
        '<collision><geometry><box size=".05 .05 .1"/></geometry></collision></link>'
        for k in range(hinges + 1)
    )
    joints = "".join(
        f'<joint name="j{k}" type="revolute"><parent link="l{k}"/><child link="l{k + 1}"/><origin xyz="0 0 .1"/>'
        '<axis xyz="0 1 0"/><limit lower="-1" upper="1" effort="9" velocity="9"/></joint>'
        for k in range(hinges)
    )
    path = tmp_path / "alone.urdf"
    path.write_text(f'<robot name="alone">{links}{joints}</robot>')
    file = read_scene_file(path)
    assert bool(file.left_out) != stays
    assert any(item.geometry and item.geometry.joint for item in file.objects) == stays


def test_legs_without_motors_are_no_parts_and_folding_doors_are(tmp_path: Path) -> None:
    def on_trunk(pairs: int) -> str:
        pair = '<body name="{n}a" pos="{x} 0 0"><joint axis="0 1 0"/><geom type="box" size=".02 .02 .05"/><body name="{n}b" pos="0 0 -.1"><joint axis="0 1 0"/><geom type="box" size=".02 .02 .05"/></body></body>'
        legs = "".join(pair.format(n=f"leg{k}", x=0.2 * k) for k in range(pairs))
        return f'<mujoco><worldbody><body name="trunk" pos="0 0 1"><geom type="box" size=".5 .1 .02"/>{legs}</body></worldbody></mujoco>'

    for pairs, stays in ((2, True), (4, False)):
        path = tmp_path / f"{pairs}.xml"
        path.write_text(on_trunk(pairs))
        file = read_scene_file(path)
        assert bool(file.left_out) != stays
        assert sum(bool(item.geometry and item.geometry.joint) for item in file.objects) == (2 * pairs if stays else 0)


def test_a_sidecar_says_what_the_file_does_not(tmp_path: Path) -> None:
    said = """
robot_base: [-1.4, 2.0, 0.32, 0.0]
leave_out: [ghost]
keyframe: start
objects:
  red block: {id: brick, rgba: [0.1, 0.2, 0.9, 1.0]}
"""
    scene = populated(Scene(world=_room(tmp_path, said)))
    (brick,) = scene.objects
    assert (brick.id, brick.rgba) == ("brick", (0.1, 0.2, 0.9, 1.0))
    assert scene.robot_base == (-1.4, 2.0, 0.32, 0.0)
    assert brick.pose.xyz[:2] == pytest.approx((-1.05, 2.05))


@pytest.mark.parametrize(
    ("said", "error"),
    [
        ("leave_out: [red_block]", "leave_out: 'red_block' is no body of room.xml; did you mean 'red block'?"),
        ("keyframe: begin", "keyframe: 'begin' is none of room.xml, which has start"),
        ("table: red block", "table: 'red block' has no level face"),
    ],
)
def test_a_sidecar_that_does_not_fit_is_told_by_its_field(tmp_path: Path, said: str, error: str) -> None:
    with pytest.raises(InputError, match=r"room\.robosandbox\.yaml") as told:
        read_scene_file(_room(tmp_path, said))
    assert error in str(told.value)


def test_an_inferred_sidecar_changes_nothing(tmp_path: Path) -> None:
    path = tmp_path / "kitchen.xml"
    path.write_bytes(KITCHEN.read_bytes())
    before = populated(Scene(world=path))
    assert before.robot_base is not None
    sidecar_path(path).write_text(to_yaml(read_scene_file(path), before.robot_base, "as found"))
    after = populated(Scene(world=path))
    assert after.objects == before.objects
    assert (after.table_area, after.table_height) == (before.table_area, before.table_height)
    assert after.robot_base == pytest.approx(before.robot_base)


def test_the_check_finds_what_was_made_wrong(tmp_path: Path) -> None:
    text = KITCHEN.read_text()
    text = text.replace('name="box" pos="0.56 0.24 0.771"', 'name="box" pos="0.56 0.24 0.95"')
    text = text.replace('name="red_mug" pos="0.52 -0.10 0.741"', 'name="red_mug" pos="0.52 -0.10 0.735"')
    text = text.replace('range="-100 0" damping', 'range="-0.001 0" damping')
    text = text.replace('density="600"', 'density="60000"')
    path = tmp_path / "wrong.xml"
    path.write_text(text)
    wrong = {(item.name, item.detail) for item in check_scene(Scene(world=path)) if not item.ok}
    told = "\n".join(detail for _, detail in wrong)
    assert "red_mug starts 5.0 mm inside table" in told
    assert "box starts in the air: it falls by 180 mm" in told
    assert "60000 kg/m^3" in told
    assert "cupboard.door (hinge) does not move" in told


def test_the_kitchen_is_sound() -> None:
    assert [item.detail for item in check_scene(Scene(world=KITCHEN)) if not item.ok] == []


@pytest.fixture(scope="module")
def task_file(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("tasks") / "kitchen_shelf.yaml"
    path.write_text(
        f"""
name: kitchen_shelf
prompt: "put the box on the shelf"
scene: {{world: {KITCHEN}}}
success: {{kind: "on", object: box, target: shelf}}
"""
    )
    return path


@pytest.mark.parametrize("seed", [0, 3])
def test_the_box_goes_on_the_shelf_as_the_simulated_state_says(task_file: Path, seed: int) -> None:
    with open_workcell(WorkcellOptions(task=load_task(task_file), seed=seed)) as cell:
        episode = cell.run("put the box on the shelf")
        assert episode.success, episode.final_detail
        assert cell.judge().success
        box = cell.simulation.truth().objects["box"]
        assert box.pose.xyz[2] == pytest.approx(0.74 + 0.139 + 0.03, abs=0.002)
        assert "shelf" in box.contacts


def test_the_red_mug_is_picked_up_by_its_words() -> None:
    with open_here(WorkcellOptions(scene=KITCHEN)) as cell:
        before = cell.simulation.truth().objects["red_mug"].pose.xyz[2]
        episode = cell.run("pick up the red mug")
        assert episode.success, episode.final_detail
        now = cell.simulation.truth()
        assert now.held == "red_mug"
        assert now.objects["red_mug"].pose.xyz[2] - before > 0.05


@pytest.mark.parametrize(
    ("prompt", "error"),
    [
        ("pick up the shelf", "shelf is a fixture, which stays where it is"),
        ("push the cupboard forward", "cupboard is a fixture and cannot be pushed along"),
        ("pick up the blue mug", "no blue mug"),
    ],
)
def test_what_cannot_be_is_refused_with_its_cause(prompt: str, error: str) -> None:
    with open_here(WorkcellOptions(scene=KITCHEN)) as cell:
        episode = cell.run(prompt)
        assert not episode.success
        assert error in episode.final_detail


def test_several_things_find_room_on_one_shelf() -> None:
    with open_here(WorkcellOptions(scene=KITCHEN)) as cell:
        episode = cell.run("put everything on the shelf")
        assert episode.success, episode.final_detail
        now = cell.simulation.truth()
        assert all("shelf" in now.objects[name].contacts for name in ("box", "red_mug"))


def test_two_things_as_large_share_a_face_whose_middle_leaves_no_room_for_the_second(tmp_path: Path) -> None:
    box = '<freejoint/><geom type="box" size="0.025 0.05 0.03" mass="0.05"/></body>'
    world = tmp_path / "two.xml"
    world.write_text(
        f"""<mujoco><worldbody><geom type="plane" size="2 2 0.1"/>
        <body name="table" pos="0.2 0 0.2"><geom type="box" size="0.4 0.4 0.02"/></body>
        <body name="stove" pos="0.28 -0.15 0.23"><geom type="box" size="0.065 0.065 0.01"/></body>
        <body name="box_1" pos="0.25 0.06 0.251">{box}
        <body name="box_2" pos="0.25 0.2 0.251">{box}
        </worldbody></mujoco>"""
    )
    with open_here(WorkcellOptions(scene=world)) as cell:
        episode = cell.run("on(box_1, stove), on(box_2, stove)")
        assert episode.success, episode.final_detail
        now = cell.simulation.truth().objects
        assert all("stove" in now[name].contacts for name in ("box_1", "box_2"))
        assert all(now[name].pose.position[2] > 0.265 for name in ("box_1", "box_2"))


def test_a_recorded_episode_in_a_file_is_replayed(tmp_path: Path, task_file: Path) -> None:
    from typer.testing import CliRunner

    from robosandbox.apps.cli import app

    runner = CliRunner()
    done = runner.invoke(app, ["run", "--task", str(task_file), "--record", str(tmp_path / "runs"), "--json"])
    assert json.loads(done.stdout)["judged"]["success"], done.output
    (episode,) = (tmp_path / "runs").iterdir()
    again = runner.invoke(app, ["replay", str(episode)])
    assert "judged a success, recorded as a success" in again.output


def test_a_robot_base_is_of_scenes_from_files_alone() -> None:
    with pytest.raises(InputError, match="--robot-base: is for scenes from files"):
        open_here(WorkcellOptions(robot_base=(0.0, 0.0, 0.0, 0.0)))


def _watched(cell: EmbeddedWorkcell, prompt: str, name: str) -> tuple[Episode, list[float]]:
    """Return an episode, and the values of a part's joint at every tick."""
    seen: list[float] = []
    end = cell.driver.subscribe(
        lambda: seen.append(cell.simulation.truth(for_judging=False).objects[name].opening or 0.0)
    )
    try:
        return cell.run(prompt), seen
    finally:
        end()


def test_a_cupboards_door_is_opened_by_its_handle_and_pushed_shut() -> None:
    with open_here(WorkcellOptions(scene=KITCHEN)) as cell:
        opened, angles = _watched(cell, "open the cupboard", "cupboard.door")
        assert opened.success, opened.final_detail
        assert np.degrees(angles[-1]) < -70.0
        shut, angles = _watched(cell, "close it again", "cupboard.door")
        assert shut.success, shut.final_detail
        assert abs(np.degrees(angles[-1])) < 5.0


@pytest.mark.parametrize(
    ("scene", "said"),
    [
        (
            KITCHEN,
            {
                "open the door of the cupboard": ["cupboard.door"],
                "open the door on the cupboard": ["cupboard.door"],
                "press the button of the bell": ["bell.button"],
                "open the door of the shelf": [],
            },
        ),
        (STOVE, {"turn on the knob of the stove": ["stove.knob"]}),
        (
            CABINET,
            {
                "open the drawer of the cabinet": [],
                "open the upper drawer of the cabinet": ["cabinet.top"],
                "open the lowest drawer": ["cabinet.bottom"],
                "open both drawers of the cabinet": ["cabinet.top", "cabinet.bottom"],
            },
        ),
    ],
)
def test_a_part_is_named_by_what_it_is_on_and_how_high(scene: Path, said: dict[str, list[str]]) -> None:
    with open_here(WorkcellOptions(scene=scene)) as cell:
        plans = {prompt: cell.plan(prompt) for prompt in said}
    told = {
        prompt: [step.arguments["part"] for step in plan.steps] if isinstance(plan, Plan) else []
        for prompt, plan in plans.items()
    }
    assert told == said


def test_a_urdf_stands_on_a_floor_and_something_is_shut_in_it(tmp_path: Path) -> None:
    file = read_scene_file(MICROWAVE)
    assert [item.id for item in file.objects] == ["microwave", "microwave.door"]
    assert file.table.body == "floor"
    lowest = [
        item.pose.xyz[2] + float((item.geometry.outer @ item.pose.rotation[2]).min())
        for item in file.objects
        if item.geometry
    ]
    assert min(lowest) == pytest.approx(0.0, abs=1e-6)
    path = tmp_path / "heated.yaml"
    cube = "{id: red_cube, kind: box, size: [0.02, 0.02, 0.02], rgba: [0.9, 0.1, 0.1, 1.0], mass: 0.05, pose: {xyz: [-0.35, -0.35, 0.021]}}"
    goal = "inside(red_cube, microwave), closed(microwave.door)"
    path.write_text(f'name: heated\ngoal: "{goal}"\nscene: {{world: {MICROWAVE}, objects: [{cube}]}}\n')
    with open_workcell(WorkcellOptions(task=load_task(path))) as cell:
        episode = cell.run("put the red cube in the microwave and close it")
        assert episode.success, episode.final_detail
        assert cell.judge().success


def test_an_mjcf_of_one_thing_stands_on_a_floor_and_weighs_what_collides(tmp_path: Path) -> None:
    path = tmp_path / "chest.xml"
    box = '<geom type="box" size="{}" pos="{}" mass="1"/>'
    path.write_text(
        '<mujoco><compiler inertiagrouprange="4 4"/><worldbody><body><body name="object">'
        + box.format("0.2 0.2 0.1", "0 0 0.3")
        + '<body name="lid"><joint axis="0 1 0" pos="0.2 0 0.4" range="0 1.5"/>'
        + box.format("0.2 0.2 0.01", "0 0 0.41")
        + "</body></body></body></worldbody></mujoco>"
    )
    file = read_scene_file(path)
    assert [item.id for item in file.objects] == ["chest", "chest.lid"]
    assert file.objects[0].pose.xyz[2] == pytest.approx(-0.2)
    assert file.objects[1].mass == pytest.approx(1.0)
    assert "weigh" in file.notes[0]


def test_on_bare_ground_the_robot_stands_where_things_are_in_reach(tmp_path: Path) -> None:
    path = tmp_path / "ground.xml"
    cube = '<body name="red_cube" pos="1.4 0.1 0.02"><freejoint/><geom type="box" size="0.02 0.02 0.02" rgba="0.9 0.1 0.1 1"/></body>'
    path.write_text(f'<mujoco><worldbody><geom type="plane" size="3 3 0.1"/>{cube}</worldbody></mujoco>')
    with open_here(WorkcellOptions(scene=path)) as cell:
        assert cell.run("pick up the red cube").success


def test_a_part_that_runs_on_at_an_even_speed_is_not_still() -> None:
    with open_here(WorkcellOptions(scene=KITCHEN)) as cell:
        shut = cell.observe()
    door = shut.find("cupboard.door")
    assert door is not None

    def open_by(degrees: float) -> ObservedScene:
        moved = replace(door, opening=np.radians(-degrees))
        return replace(shut, objects=tuple(moved if item.id == door.id else item for item in shut.objects))

    runs, rests = (Stillness(shut, (door.id,)) for _ in range(2))
    assert [runs.seen(open_by(degrees)) for degrees in (1.0, 2.0, 3.0)] == [False] * 3
    assert rests.seen(shut)


def test_what_was_written_is_not_made_again_where_the_arm_does_not_get() -> None:
    with open_here(WorkcellOptions(scene=KITCHEN)) as cell:
        episode = cell.run("move_to(x=3.0, y=0.0, z=1.0)")
        assert not episode.success
        assert episode.replans <= 1
        assert "3.000" in episode.final_detail


def test_what_is_too_high_for_a_level_is_laid_on_its_side_there(tmp_path: Path) -> None:
    boards = "".join(
        f'<geom type="box" pos="{at}" size="{size}"/>'
        for at, size in (
            ("0.05 0 -0.06", "0.05 0.15 0.06"),
            ("0 0 0.006", "0.11 0.18 0.006"),
            ("0 0 0.15", "0.11 0.18 0.006"),
            ("0 0.18 0.08", "0.11 0.006 0.08"),
            ("0 -0.18 0.08", "0.11 0.006 0.08"),
            ("0.11 0 0.08", "0.006 0.18 0.08"),
        )
    )
    (tmp_path / "books.xml").write_text(
        '<mujoco><option timestep="0.002" integrator="implicitfast" cone="elliptic" impratio="10"/><worldbody>'
        '<geom type="plane" size="3 3 0.1"/><body name="desk" pos="0.5 0 0"><geom type="box" pos="0 0 0.38" size="0.5 0.7 0.02"/></body>'
        f'<body name="rack" pos="0.75 0.1 0.52">{boards}</body>'
        '<body name="book" pos="0.40 -0.15 0.486"><freejoint/>'
        '<geom type="box" size="0.06 0.017 0.085" mass="0.2" rgba="0.8 0.1 0.1 1" friction="0.9 0.01 0.001"/></body>'
        "</worldbody></mujoco>"
    )
    path = tmp_path / "shelved.yaml"
    path.write_text('name: shelved\ngoal: "inside(book, rack)"\nscene: {world: books.xml}\n')
    with open_workcell(WorkcellOptions(task=load_task(path))) as cell:
        episode = cell.run("put the book in the rack")
        assert episode.success, episode.final_detail
        assert cell.judge().success
        assert abs(cell.simulation.truth().objects["book"].pose.rotation[2, 2]) < 0.1


def test_a_button_goes_in_and_springs_back() -> None:
    with open_here(WorkcellOptions(scene=KITCHEN)) as cell:
        episode, ways = _watched(cell, "press the button", "bell.button")
        assert episode.success, episode.final_detail
        assert max(ways) > 0.007
        assert ways[-1] < 0.003


def test_a_button_is_pressed_as_hard_as_is_asked_or_not_at_all() -> None:
    with open_here(WorkcellOptions(scene=KITCHEN)) as cell:
        done = cell.do("press", part="bell.button", force=25.0)
        assert 0.9 * 25.0 <= done.detail["force_n"] < 1.3 * 25.0
        with pytest.raises(LimitError, match="may press with 60 N at most"):
            cell.do("press", part="bell.button", force=80.0)


@pytest.mark.parametrize("goal", ["pressed(bell.button)", "on(box, shelf), pressed(bell.button)"])
def test_what_nobody_sees_afterwards_is_no_goal_that_holds_already(goal: str) -> None:
    with open_here(WorkcellOptions(scene=KITCHEN)) as cell:
        episode = cell.achieve(goal)
        assert not episode.success and not episode.steps
        assert "ask for what does it: press(part=bell.button)" in episode.final_detail


def test_a_locked_door_is_told_of_as_such(tmp_path: Path) -> None:
    path = tmp_path / "kitchen.xml"
    lock = '<equality><joint joint1="cupboard_hinge" polycoef="0 0 0 0 0" solref="0.005 1"/></equality>'
    path.write_text(KITCHEN.read_text().replace("<keyframe>", lock + "<keyframe>"))
    with open_here(WorkcellOptions(scene=path, max_replans=0)) as cell:
        episode = cell.run("open the cupboard")
        assert not episode.success
        assert re.search(r"cupboard\.door is locked: pulled with \d+ N it is 0 deg open", episode.final_detail)


def test_a_hand_that_meets_what_a_door_is_on_does_not_call_the_door_locked() -> None:
    with open_here(WorkcellOptions(scene=KITCHEN)) as cell:
        scene = cell.observe()
        door, cupboard = scene.find("cupboard.door"), scene.find("cupboard")
        assert door is not None and cupboard is not None
        cell.do("close_gripper")
        cell.do("move_to", x=0.95, y=-0.05, z=top(cupboard) + 0.03)
        arm = Manipulator(cell.ctx)
        arm.motion.allow("cupboard")
        here = arm.state.tcp_pose
        below = moved(here, np.array([0.0, 0.0, -0.05]))
        down = arm.motion.plan_line(arm.q, below, speed=0.1)
        way = PartWay(
            grasp=None,
            approach=down,
            descent=down,
            poses=(here, below),
            steps=(down,),
            values=(0.0, -0.5),
            ends_at_stop=False,
        )
        with pytest.raises(CollisionError, match=r"met cupboard on its way, with \d+ N, and not cupboard.door"):
            follow_way(arm, door, way, 20.0)


def test_what_stands_where_a_door_goes_is_put_aside_first(tmp_path: Path) -> None:
    path = tmp_path / "kitchen.xml"
    path.write_text(KITCHEN.read_text().replace('name="box" pos="0.56 0.24 0.771"', 'name="box" pos="0.66 0.00 0.771"'))
    with open_here(WorkcellOptions(scene=path, robot_base=(0.264, 0.05, 0.74, 0.0))) as cell:
        episode = cell.run("open the cupboard")
        assert episode.success, episode.final_detail
        now = cell.simulation.truth().objects
        assert np.degrees(now["cupboard.door"].opening or 0.0) < -70.0
        assert "pick" in [event.call.skill for event in episode.steps]


def test_a_goal_with_a_door_is_judged_on_the_simulated_state(tmp_path: Path) -> None:
    path = tmp_path / "kitchen_door.yaml"
    path.write_text(
        f"""
name: kitchen_door
goal: "open(cupboard.door), on(box, shelf)"
scene: {{world: {KITCHEN}}}
"""
    )
    with open_workcell(WorkcellOptions(task=load_task(path))) as cell:
        assert not cell.judge().success
        episode = cell.run(cell.task.prompt)
        assert episode.success, episode.final_detail
        verdict = cell.judge()
        assert verdict.success, verdict.detail
        assert verdict.detail["open(cupboard.door).open_share"] > 0.8


def test_a_cavity_that_is_open_to_one_side_makes_a_cupboard() -> None:
    kinds = {item.id: item for item in read_scene_file(RACK).objects}
    assert {name: kinds[name].kind for name in ("rack", "slot", "stand")} == {
        "rack": "cupboard",
        "slot": "cupboard",
        "stand": "fixture",
    }
    geometry = kinds["rack"].geometry
    assert geometry is not None and geometry.cavity is not None
    assert geometry.cavity.headroom == pytest.approx(0.232, abs=1e-3)
    assert geometry.cavity.ways_out.tolist() == [[-1.0, 0.0]]


def test_a_can_goes_into_a_rack_from_the_side_as_the_simulated_state_says(tmp_path: Path) -> None:
    path = tmp_path / "away.yaml"
    path.write_text(f'name: away\ngoal: "inside(can, rack)"\nscene: {{world: {RACK}}}\n')
    with open_workcell(WorkcellOptions(task=load_task(path))) as cell:
        assert not cell.judge().success
        episode, forces = _pressed_on(cell, "put the can in the rack", "rack")
        assert episode.success, episode.final_detail
        verdict = cell.judge()
        assert verdict.success, verdict.detail
        assert max(forces, default=0.0) < 5.0
        # Its top is covered, and a hand that lifted it there would meet that.
        episode, forces = _pressed_on(cell, "put the can on the table", "rack")
        assert episode.success, episode.final_detail
        assert not cell.judge().success
        assert max(forces, default=0.0) < 5.0


def test_the_middle_of_a_mug_with_its_handle_is_put_to_a_point_however_it_is_turned() -> None:
    with open_here(WorkcellOptions(scene=KITCHEN)) as cell:
        seen = cell.observe()
    mug, point = seen.find("red_mug"), np.array([0.2, 0.0])
    assert mug is not None and np.linalg.norm(centre(mug)[:2] - mug.pose.position[:2]) > 0.008
    move = lookup(fact("at", "red_mug", *point)).effect
    assert move is not None
    placed = move(seen, "red_mug", *point).find("red_mug")
    assert placed is not None and centre(placed)[:2] == pytest.approx(point, abs=1e-6)
    ((spot, _),) = tried_on_table(seen, mug, [point])
    for yaw in spot.yaws:
        there = replace(mug, pose=resting_pose(mug, spot, spot.rotation(levelled(mug), yaw)))
        assert centre(there)[:2] == pytest.approx(point, abs=1e-6)


def test_a_thing_in_a_rack_comes_out_level_by_the_side_that_is_open() -> None:
    with open_here(WorkcellOptions(scene=RACK)) as cell:
        seen = cell.observe()
    can, rack = seen.find("can"), seen.find("rack")
    assert can is not None and rack is not None and rack.geometry is not None and rack.geometry.cavity is not None
    assert ways_out(can, seen.objects, 0.3) == []
    floor = rack.pose.position[2] + rack.geometry.cavity.height
    x, y = rack.pose.position[:2] + rack.geometry.cavity.middle
    there = replace(can, pose=Pose(xyz=(x, y, can.pose.position[2] - bottom(can) + floor)))
    (way,) = ways_out(there, seen.objects, 0.3)
    assert way / np.linalg.norm(way) == pytest.approx(rack.pose.rotation[:, 0] * -1.0, abs=1e-3)
    assert 0.1 < np.linalg.norm(way) < 0.3


def test_a_thing_whose_geometry_is_in_a_welded_body_is_held(tmp_path: Path) -> None:
    """A free body that stands for a group of others has neither mass nor geometry of its own."""
    world = tmp_path / "welded.xml"
    world.write_text(
        """<mujoco><worldbody><geom type="plane" size="2 2 0.1"/>
        <body name="table" pos="0.2 0 0.2"><geom type="box" size="0.4 0.4 0.02"/></body>
        <body name="bottle" pos="0.25 0.1 0.28"><freejoint/>
          <body name="bottle_parts"><geom type="box" size="0.02 0.015 0.06" mass="0.02"/></body></body>
        </worldbody></mujoco>"""
    )
    with open_here(WorkcellOptions(scene=world)) as cell:
        cell.do("pick", object="bottle")
        assert cell.observe().held == "bottle"
        cell.do("place_at", x=0.2, y=-0.1)
        assert np.linalg.norm(cell.simulation.truth().objects["bottle"].pose.position[:2] - (0.2, -0.1)) < 0.015


def test_a_die_is_taken_so_that_the_hand_fits_into_a_low_slot(tmp_path: Path) -> None:
    """From above it would not: it is taken from the side, where a carton stands, which is put aside for it."""
    path = tmp_path / "away.yaml"
    path.write_text(f'name: away\ngoal: "inside(die, slot)"\nscene: {{world: {RACK}}}\n')
    with open_workcell(WorkcellOptions(task=load_task(path), what_if=False)) as cell:
        episode, forces = _pressed_on(cell, "put the die in the slot", "slot")
        assert episode.success, episode.final_detail
        assert cell.judge().success
        assert max(forces, default=0.0) < 5.0


def test_where_there_is_no_room_for_a_thing_nothing_is_put_in(tmp_path: Path) -> None:
    lower = tmp_path / "rack.xml"
    lower.write_text(
        RACK.read_text().replace('pos="0 0 0.09" size="0.10 0.12 0.006"', 'pos="0 0 0.073" size="0.10 0.12 0.006"')
    )
    with open_here(WorkcellOptions(scene=lower, max_replans=0)) as cell:
        episode, forces = _pressed_on(cell, "put the die in the slot", "slot")
        assert not episode.success
        assert "no room for die in slot" in episode.final_detail
        assert max(forces, default=0.0) == 0.0


def test_the_mug_is_put_into_the_cupboard_and_the_door_is_shut(tmp_path: Path) -> None:
    path = tmp_path / "kitchen_away.yaml"
    path.write_text(
        f"""
name: kitchen_away
goal: "inside(red_mug, cupboard), closed(cupboard.door)"
scene: {{world: {KITCHEN}}}
"""
    )
    with open_workcell(WorkcellOptions(task=load_task(path))) as cell:
        episode = cell.run("put the red mug in the cupboard and close it")
        assert episode.success, episode.final_detail
        verdict = cell.judge()
        assert verdict.success, verdict.detail


def test_a_thing_is_taken_for_the_place_that_was_said_of_what_has_two() -> None:
    with open_here(WorkcellOptions(scene=KITCHEN)) as cell:
        within, above = (cell.plan(f"put the red mug {where} the cupboard") for where in ("in", "on top of"))
    assert isinstance(within, Plan)
    assert isinstance(above, Plan)
    assert within.steps[1].arguments == {"object": "red_mug", "to": "cupboard"}
    assert above.steps[0].arguments == {"object": "red_mug", "to": "cupboard", "on": True}


def _pressed_on(cell: EmbeddedWorkcell, prompt: str, name: str) -> tuple[Episode, list[float]]:
    """Return what came of a sentence, and what the robot pressed on an object with at each tick, N."""
    forces: list[float] = []
    end = cell.driver.subscribe(
        lambda: forces.append(float(np.linalg.norm(cell.driver.senses.forces().get(name, np.zeros(3)))))
    )
    try:
        return cell.run(prompt), forces
    finally:
        end()


def test_a_knob_is_turned_on_halfway_and_off_and_a_lever_too(tmp_path: Path) -> None:
    path = tmp_path / "stove.yaml"
    path.write_text(
        f'name: stove\ngoal: "turned_to(stove.knob, 0.5), turned_to(wall.lever, 1.0)"\nscene: {{world: {STOVE}}}\n'
    )
    with open_workcell(WorkcellOptions(task=load_task(path))) as cell:
        assert not cell.judge().success
        for prompt, knob, lever in (
            ("turn the stove on", 120.0, 0.0),
            ("turn on the stove halfway", 60.0, 0.0),
            ("turn the lever on", 60.0, 70.0),
        ):
            episode = cell.run(prompt)
            assert episode.success, episode.final_detail
            now = cell.simulation.truth().objects
            assert np.degrees(now["stove.knob"].opening or 0.0) == pytest.approx(knob, abs=12.0)
            assert np.degrees(now["wall.lever"].opening or 0.0) == pytest.approx(lever, abs=7.0)
        verdict = cell.judge()
        assert verdict.success, verdict.detail
        episode = cell.run("turn off the stove and turn the lever off")
        assert episode.success, episode.final_detail
        assert not cell.judge().success


def test_a_knob_that_is_stuck_is_told_of(tmp_path: Path) -> None:
    path = tmp_path / "stove.xml"
    lock = '<equality><joint joint1="knob" polycoef="0 0 0 0 0" solref="0.005 1"/></equality>'
    path.write_text(STOVE.read_text().replace("</worldbody>", f"</worldbody>{lock}"))
    with open_here(WorkcellOptions(scene=path, max_replans=0)) as cell:
        episode = cell.run("turn the stove on")
        assert not episode.success
        assert "stove.knob" in episode.final_detail
        assert abs(np.degrees(cell.simulation.truth().objects["stove.knob"].opening or 0.0)) < 5.0


def test_a_bar_with_16_mm_behind_it_is_held_by_the_tips_of_the_fingers() -> None:
    with open_here(WorkcellOptions(scene=CABINET)) as cell:
        episode, ways = _watched(cell, "open the top drawer of the cabinet", "cabinet.top")
        assert episode.success, episode.final_detail
        assert ways[-1] > 0.12
        episode, ways = _watched(cell, "close it", "cabinet.top")
        assert episode.success, episode.final_detail
        assert abs(ways[-1]) < 0.008


GLIDING = """
<mujoco>
  <worldbody>
    <geom type="plane" size="2 2 0.1"/>
    <body name="table" pos="0.4 0 0.2"><geom type="box" size="0.4 0.5 0.2"/></body>
    <body name="net" pos="0.5 0.2 0.4">
      <geom type="box" pos="0 0.07 0.06" size="0.07 0.005 0.06"/>
      <geom type="box" pos="0 0.02 0.12" size="0.07 0.055 0.004"/>
    </body>
    <body name="channel" pos="0.5 -0.1 0.415">
      <body name="puck">
        <joint name="puck_x" type="slide" axis="1 0 0" range="-0.2 0.2" damping="1"/>
        <joint name="puck_y" type="slide" axis="0 1 0" range="-0.3 0.3" damping="1"/>
        <geom type="box" size="0.05 0.05 0.015" mass="0.05"/>
      </body>
    </body>
  </worldbody>
</mujoco>
"""


@pytest.mark.parametrize(("timestep", "method"), [(0.002, "EULER"), (0.005, "IMPLICITFAST")])
def test_a_file_of_eulers_method_is_stepped_implicitly_where_servos_would_oscillate(
    tmp_path: Path, timestep: float, method: str
) -> None:
    path = tmp_path / "room.xml"
    path.write_text(GLIDING.replace("<worldbody>", f'<option timestep="{timestep}"/><worldbody>'))
    driver = open_mujoco(Scene(world=path, robot_base=(0.0, 0.0, 0.4, 0.0)))
    assert driver.world.model.opt.integrator == getattr(mujoco.mjtIntegrator, f"mjINT_{method}")


def test_what_glides_on_two_slides_is_a_thing_that_is_pushed_to_a_point(tmp_path: Path) -> None:
    path = tmp_path / "room.xml"
    path.write_text(GLIDING)
    file = read_scene_file(path)
    puck = next(item for item in file.objects if item.id == "puck")
    assert puck.kind == "box" and not puck.is_fixed
    with open_here(WorkcellOptions(scene=path, robot_base=(0.0, 0.0, 0.4, 0.0))) as cell:
        cell.do("push_to", object="puck", x=0.52, y=0.05)
        x, y, _ = cell.truth().objects["puck"].pose.xyz
        assert np.hypot(x - 0.52, y - 0.05) < 0.015


BESET = """
<mujoco>
  <worldbody>
    <geom type="plane" size="2 2 0.1"/>
    <body name="table" pos="0.4 0 0.2"><geom type="box" size="0.4 0.5 0.2"/></body>
    <body name="post" pos="0.4 0 0.42"><geom type="box" size="0.02 0.02 0.02"/></body>
    <body name="wall" pos="0.28 0 0.42"><geom type="box" size="0.01 0.25 0.02"/></body>
    <body name="slab" pos="0.4 -0.2 0.415"><freejoint/><geom type="box" size="0.05 0.05 0.015" mass="0.2"/></body>
    <body name="die" pos="0.54 0.02 0.415"><freejoint/><geom type="box" size="0.015 0.015 0.015" mass="0.02"/></body>
  </worldbody>
</mujoco>
"""


def test_what_is_loose_is_cleared_from_the_one_way_that_nothing_fixed_bars(tmp_path: Path) -> None:
    """A slab too wide to be taken: straight on stands a post, on one side a wall, and a die in the way around."""
    path = tmp_path / "room.xml"
    path.write_text(BESET)
    with open_here(WorkcellOptions(scene=path, robot_base=(0.0, 0.0, 0.4, 0.0))) as cell:
        episode = cell.run("at(slab, 0.4, 0.2)")
        assert episode.success, episode.final_detail
        x, y, _ = cell.truth().objects["slab"].pose.xyz
        assert np.hypot(x - 0.4, y - 0.2) < 0.015
        assert {step.call.skill for step in episode.steps[:-1]} & {"stack", "place_at"}


def test_what_is_pushed_has_room_under_what_is_over_it(tmp_path: Path) -> None:
    path = tmp_path / "room.xml"
    path.write_text(GLIDING)
    with open_here(WorkcellOptions(scene=path, robot_base=(0.0, 0.0, 0.4, 0.0))) as cell:
        scene = cell.observe()
        puck, net = (next(item for item in scene.objects if item.id == name) for name in ("puck", "net"))
        wall, roof = separately(net)
        assert at_its_height(puck, net) == (wall,)
        assert bottom(roof) > top(puck)


def test_a_drawer_that_is_open_in_part_is_opened_to_its_end_where_that_is_asked() -> None:
    with open_here(WorkcellOptions(scene=CABINET)) as cell:
        cell.do("open", part="cabinet.top", share=0.6)
        cell.do("open", part="cabinet.top", share=1.0)
        opening = cell.simulation.truth().objects["cabinet.top"].opening
        assert opening == pytest.approx(0.16, abs=0.008)


def test_a_keyframe_of_the_sidecar_opens_doors_and_moves_things(tmp_path: Path) -> None:
    path = tmp_path / "kitchen.xml"
    path.write_text(KITCHEN.read_text().replace('qpos="0 0  0.50 0.02', 'qpos="-0.8 0  0.50 0.04'))
    sidecar_path(path).write_text("keyframe: tidy\n")
    with open_here(WorkcellOptions(scene=path, robot_base=(0.264, 0.05, 0.74, 0.0))) as cell:
        before = cell.simulation.truth().objects
        assert before["cupboard.door"].opening == pytest.approx(-0.8, abs=0.01)
        assert before["red_mug"].pose.xyz[1] == pytest.approx(0.04, abs=0.002)
        assert cell.run("close the cupboard").success
        assert abs(cell.simulation.truth().objects["cupboard.door"].opening or 0.0) < np.radians(3.0)
        cell.reset()
        assert cell.simulation.truth().objects["cupboard.door"].opening == pytest.approx(-0.8, abs=0.01)


def test_a_cabinet_is_in_none_of_its_drawers() -> None:
    with open_here(WorkcellOptions(scene=CABINET)) as cell:
        plan = cell.plan("on(can, cabinet)")
        assert isinstance(plan, Plan)
        assert "open" not in {call.skill for call in plan.steps}


def test_what_stands_in_a_drawer_goes_with_it_as_it_is_pushed_shut(tmp_path: Path) -> None:
    path = tmp_path / "cabinet.xml"
    full = '<keyframe><key name="full" qpos="0 0.16 0.60 0 0.4685 1 0 0 0"/></keyframe>'
    path.write_text(CABINET.read_text().replace("</worldbody>", f"</worldbody>{full}"))
    sidecar_path(path).write_text("keyframe: full\n")
    with open_here(WorkcellOptions(scene=path)) as cell:
        # A hand that took the can for one that stays there would keep off the face, and press from above.
        episode = cell.run("close the bottom drawer")
        assert episode.success, episode.final_detail
        assert not episode.attempts
        assert cell.simulation.truth().objects["cabinet.bottom"].opening == pytest.approx(0.0, abs=0.003)


@pytest.mark.parametrize(("edge", "holds"), [(0.002, True), (0.006, False)])
def test_a_door_is_closed_where_its_edge_is_3_mm_from_shut(edge: float, holds: bool) -> None:
    with open_here(WorkcellOptions(scene=KITCHEN)) as cell:
        door = cell.observe().find("cupboard.door")
        assert door is not None
        shares = edge / (lever(door) * abs(open_value(door) - shut_value(door)))
        scene = with_objects(cell.observe(), [at_value(door, open_value(door, shares))])
        assert find(fact("closed", "cupboard.door"), View.of(scene)).holds is holds


def test_a_drawer_whose_whole_way_is_2_mm_is_open_and_not_closed_at_its_end(tmp_path: Path) -> None:
    path = tmp_path / "cabinet.xml"
    path.write_text(CABINET.read_text().replace('range="0 0.16"', 'range="0 0.002"'))
    with open_here(WorkcellOptions(scene=path)) as cell:
        part = cell.observe().find("cabinet.top")
        assert part is not None
        for share in (0.0, 1.0):
            scene = with_objects(cell.observe(), [at_value(part, open_value(part, share))])
            assert find(fact("closed", part.id), View.of(scene)).holds is (share == 0.0)
            assert find(fact("open", part.id), View.of(scene)).holds is (share == 1.0)
            start = cell.simulation.truth()
            now = replace(
                start, objects={**start.objects, part.id: replace(start.objects[part.id], opening=0.002 * share)}
            )
            assert Closed(kind="closed", object=part.id).evaluate(start, now).holds is (share == 0.0)


@pytest.mark.parametrize("low", [0.0, -0.01])
def test_a_drawer_is_pressed_home_where_it_is_shut_as_at_the_end_of_its_range(tmp_path: Path, low: float) -> None:
    path = tmp_path / "cabinet.xml"
    path.write_text(CABINET.read_text().replace('range="0 0.16"', f'range="{low} 0.16"'))
    with open_here(WorkcellOptions(scene=path)) as cell:
        cell.do("open", part="cabinet.top", share=0.6)
        closed = cell.do("close", part="cabinet.top")
        part = cell.observe().find("cabinet.top")
        assert part is not None and shut_value(part) == 0.0 and abs(open_share(part)) < 0.01
        # 2 mm beyond, by the servos' stiffness; farther the hand would press with 80 to 120 N.
        assert 15.0 < closed.detail["force_n"] < 40.0


def test_a_face_is_pushed_at_several_heights_with_each_direction_of_the_hand() -> None:
    with open_here(WorkcellOptions(scene=CABINET)) as cell:
        cell.do("open", part="cabinet.top", share=1.0)
        arm = Manipulator(cell.ctx)
        places = [face.tcp for face in _faces(arm, arm.find("cabinet.top"), 0.0, arm.geometry.min_aperture)]
        levels: dict[tuple[float, ...], set[float]] = {}
        for pose in places:
            levels.setdefault(tuple(pose.rotation.round(1).ravel()), set()).add(round(pose.xyz[2], 3))
        # Between a thing that stands before it and what is over it there may be room for a hand at one height alone.
        assert min(len(heights) for heights in levels.values()) > 1
        assert len(places) == len({(pose.xyz, pose.quat_xyzw) for pose in places})
