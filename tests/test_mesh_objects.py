"""Objects from mesh files: their hull or their convex pieces collide."""

from dataclasses import replace
from itertools import product
from pathlib import Path

import numpy as np
import pytest

from robosandbox.errors import GraspError, InputError
from robosandbox.grasp.closing import Closings
from robosandbox.grasp.surface import Surface
from robosandbox.motion.beliefs import DeclaredProperties, believed_scene
from robosandbox.perception.known_meshes import fit_mesh, known_mesh
from robosandbox.shapes.mesh_file import mesh_bounds, mesh_pieces, mesh_volume
from robosandbox.shapes.polyhedron import PolyhedronHull
from robosandbox.sim.mujoco_backend import MuJoCoBackend
from robosandbox.types import DetectedObject, Pose, Scene, SceneObject, SkillCall, matrix_from_rotation_vector
from robosandbox.workcell.session import open_session

trimesh = pytest.importorskip("trimesh")

# A ring as of a napkin, metres: its wall fits between the fingers, its outside does not.
INNER, OUTER, HEIGHT = 0.042, 0.05, 0.05


@pytest.fixture(scope="module")
def ring(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("meshes") / "ring.stl"
    trimesh.creation.annulus(r_min=INNER, r_max=OUTER, height=HEIGHT, sections=32).export(path)
    return path


@pytest.fixture(scope="module")
def angle(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """An L of millimetres: two boxes that share a face."""
    path = tmp_path_factory.mktemp("meshes") / "angle.obj"
    outline = [(0, 0), (80, 0), (80, 20), (20, 20), (20, 60), (0, 60)]
    lines = [f"v {x} {y} {z}" for z in (0, 20) for x, y in outline]
    sides = [(k, (k + 1) % 6, (k + 1) % 6 + 6, k + 6) for k in range(6)]
    floor = [(0, 3, 2, 1), (0, 5, 4, 3)]
    faces = [*sides, *floor, *(tuple(k + 6 for k in reversed(face)) for face in floor)]
    path.write_text("\n".join([*lines, *("f " + " ".join(str(k + 1) for k in face) for face in faces)]) + "\n")
    return path


def thing(mesh: Path, **fields: object) -> SceneObject:
    place = {"id": "it", "pose": Pose(xyz=(0.15, 0.0, 0.04 + HEIGHT / 2.0))}
    return SceneObject.model_validate({**place, "kind": "mesh", "mesh": mesh, **fields})


def test_a_polyhedron_has_the_measures_of_the_box_that_its_points_span() -> None:
    x, y, z = half = (0.01, 0.02, 0.03)
    hull = PolyhedronHull(tuple((a, b, c) for a in (-x, x) for b in (-y, y) for c in (-z, z)))
    assert np.allclose(hull.half_extents, half)
    assert hull.volume == pytest.approx(8.0 * x * y * z)
    expected = sorted(0.6 / 3.0 * np.array([y * y + z * z, x * x + z * z, x * x + y * y]))
    assert hull.inertia(0.6) == pytest.approx(expected)
    assert hull.support(np.eye(3)) == pytest.approx(half)


def test_a_hull_is_one_piece_and_a_decomposition_leaves_the_corner_free(angle: Path) -> None:
    hull = mesh_pieces(angle, 0.001, 0.1, decomposed=False, of="it")
    cut = mesh_pieces(angle, 0.001, 0.1, decomposed=True, of="it")
    assert len(hull) == 1 and len(cut) >= 2
    assert sum(piece.mass for piece in cut) == pytest.approx(0.1)
    solid = mesh_volume(angle, 0.001, of="it")
    assert solid == pytest.approx(0.02 * (0.08 * 0.02 + 0.02 * 0.04), rel=1e-4)
    assert hull[0].hull.volume > 1.3 * solid
    # V-HACD works on voxels and its pieces overlap a little.
    assert sum(piece.hull.volume for piece in cut) == pytest.approx(solid, rel=0.1)


def test_pieces_are_the_same_with_the_cache_and_without(
    angle: Path, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    from robosandbox.shapes import mesh_file

    found = []
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    for off in ("", "", "1"):
        monkeypatch.setenv("ROBOSANDBOX_NO_CACHE", off)
        mesh_file._forms.cache_clear()
        found.append(mesh_pieces(angle, 0.001, 0.1, decomposed=True, of="it"))
    assert found[0] == found[1] == found[2]
    assert len(list((tmp_path / "robosandbox").glob("convex-parts-*"))) == 1


@pytest.mark.parametrize(("collision", "falls"), [("hull", False), ("coacd", True)])
def test_a_ball_falls_into_a_ring_that_is_cut_and_lies_on_one_that_is_not(
    ring: Path, collision: str, falls: bool
) -> None:
    ball = SceneObject(id="ball", kind="sphere", size=(0.015,), pose=Pose(xyz=(0.15, 0.0, 0.04 + HEIGHT + 0.016)))
    with MuJoCoBackend() as sim:
        sim.load(Scene(objects=(thing(ring, collision=collision), ball)))
        sim.wait(0.5)
        height = sim.truth().objects["ball"].pose.xyz[2] - 0.04
    assert (height < 0.02) is falls


def test_a_flat_file_is_refused_by_its_object(tmp_path: Path) -> None:
    path = tmp_path / "flat.obj"
    path.write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nv 1 1 0\nf 1 2 3\nf 2 4 3\n")
    with pytest.raises(InputError, match=r"objects\[it\]\.mesh: .*flat\.obj"):
        mesh_pieces(path, 0.1, 0.1, decomposed=True, of="it")


def test_a_ring_is_picked_by_its_wall_if_cut_and_is_too_wide_if_not(ring: Path) -> None:
    hull, cut = (Scene(objects=(thing(ring, collision=way, mass=0.05),)) for way in ("hull", "coacd"))
    with open_session(cut, what_if=False) as session:
        session.agent.perform(SkillCall(skill="pick", arguments={"object": "it"}))
        truth = session.simulation.truth()
        assert truth.held == "it" and truth.objects["it"].pose.xyz[2] > 0.1
        tcp = session.driver.state().tcp_pose.position
        # In the wall's frame the fingertips are at its radius, not over its middle.
        off = (tcp - truth.objects["it"].pose.position) @ truth.objects["it"].pose.rotation
        assert float(np.hypot(*off[:2])) == pytest.approx((INNER + OUTER) / 2.0, abs=0.006)
    with open_session(hull, what_if=False) as session, pytest.raises(GraspError, match="gripper opens to"):
        session.agent.perform(SkillCall(skill="pick", arguments={"object": "it"}))


@pytest.mark.parametrize(
    ("fields", "mass"),
    [({}, 0.048), ({"density": 500.0}, 0.024), ({"mass": 0.2}, 0.2)],
    ids=["water", "density", "mass"],
)
def test_a_mesh_weighs_its_density_times_its_volume_where_no_mass_is_given(
    angle: Path, fields: dict[str, float], mass: float
) -> None:
    # 48 cubic centimetres.
    with MuJoCoBackend() as sim:
        sim.load(Scene(objects=(thing(angle, scale=0.001, collision="coacd", **fields),)))
        assert sim.model.body("object/it").mass[0] == pytest.approx(mass, rel=1e-3)
        assert sim.scene.objects[0].mass == pytest.approx(mass, rel=1e-3)


def test_a_seen_mesh_is_believed_to_weigh_what_the_task_says(ring: Path) -> None:
    seen = DetectedObject(
        id="it",
        kind="mesh",
        size=(OUTER, OUTER, HEIGHT / 2.0),
        colour="red",
        rgba=(1.0, 0.0, 0.0, 1.0),
        pose=Pose(xyz=(0.1, 0.0, 0.06)),
    )
    (made,) = believed_scene(Scene(), [seen], {"it": DeclaredProperties(mesh=ring, mass=0.2)}).objects
    assert made.mesh == ring and made.mass == 0.2


def cuboid(low: tuple[float, float, float], high: tuple[float, float, float], first: int) -> list[str]:
    """Return the lines of an OBJ file's box whose first vertex has a number."""
    corners = [
        (x, y, z)
        for z in (low[2], high[2])
        for x, y in ((low[0], low[1]), (high[0], low[1]), high[:2], (low[0], high[1]))
    ]
    sides = [(k, (k + 1) % 4, (k + 1) % 4 + 4, k + 4) for k in range(4)]
    faces = [*sides, (3, 2, 1, 0), (4, 5, 6, 7)]
    return [*(f"v {x} {y} {z}" for x, y, z in corners), *("f " + " ".join(str(k + first) for k in f) for f in faces)]


@pytest.fixture(scope="module")
def table_of_boxes(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A board of 12 x 9 cm on a post in its middle, millimetres, each a group of its file."""
    path = tmp_path_factory.mktemp("meshes") / "board.obj"
    post, board = cuboid((-12, -12, 0), (12, 12, 60), 1), cuboid((-60, -45, 60), (60, 45, 72), 9)
    path.write_text("\n".join(["o post", *post, "o board", *board]) + "\n")
    return path


def test_all_groups_of_an_obj_file_are_read_and_convex_ones_are_its_pieces(table_of_boxes: Path) -> None:
    low, high = mesh_bounds(table_of_boxes, 0.001, of="it")
    assert high - low == pytest.approx([0.12, 0.09, 0.072])
    volumes = [0.024 * 0.024 * 0.06, 0.12 * 0.09 * 0.012]
    assert mesh_volume(table_of_boxes, 0.001, of="it") == pytest.approx(sum(volumes))
    cut = mesh_pieces(table_of_boxes, 0.001, 0.1, decomposed=True, of="it")
    assert [piece.hull.volume for piece in cut] == pytest.approx(volumes)
    (hull,) = mesh_pieces(table_of_boxes, 0.001, 0.1, decomposed=False, of="it")
    assert hull.hull.volume > 1.5 * sum(volumes)


def test_closing_lines_join_points_of_the_outside_through_what_is_between(table_of_boxes: Path) -> None:
    corners = [
        np.array(piece.centre) + piece.hull.corners
        for piece in mesh_pieces(table_of_boxes, 0.001, 0.1, decomposed=True, of="it")
        if isinstance(piece.hull, PolyhedronHull)
    ]
    surface = Surface(Pose(xyz=(0.1, 0.0, 0.1)), corners)
    points, normals = surface.points
    assert not surface.covers(points + 1e-4 * normals).any() and surface.covers(points - 1e-4 * normals).all()
    middles, closings, widths = surface.lines
    ends = middles[:, None] + np.stack([-closings, closings], axis=1) * (widths / 2.0)[:, None, None]
    for end, way in ((ends[:, 1], closings), (ends[:, 0], -closings)):
        assert surface.covers(end - 1e-4 * way).all() and not surface.covers(end + 1e-4 * way).any()
    # Across the post, the board, and up through both.
    assert {round(1e3 * width) for width in widths} >= {12, 24, 72, 90, 120}


@pytest.mark.parametrize("tip", [0.0, np.pi], ids=["post_below", "post_above"])
def test_what_is_wider_than_the_hand_is_held_where_it_is_thin(table_of_boxes: Path, tip: float) -> None:
    pose = Pose(xyz=(0.15, 0.0, 0.04 + 0.0365), quat_xyzw=(np.sin(tip / 2.0), 0.0, 0.0, np.cos(tip / 2.0)))
    board = thing(table_of_boxes, scale=0.001, collision="coacd", mass=0.1, pose=pose)
    with open_session(Scene(objects=(board,)), what_if=False) as session:
        grasps = list(session.ctx.grasp.candidates(session.observe().objects[0], session.observe(), session.driver.arms["arm"].spec,
            pieces=session.ctx.planning(session.observe()).pieces("it")))  # fmt: skip
        assert grasps and {round(1e3 * grasp.width) for grasp in grasps} <= {12, 24}
        session.agent.perform(SkillCall(skill="pick", arguments={"object": "it"}))
        assert session.simulation.truth().held == "it"


@pytest.mark.parametrize(("gap", "held"), [(0.0014, True), (0.0018, False)])
def test_a_wall_of_2_mm_is_held_where_closed_fingers_still_press_on_it(gap: float, held: bool) -> None:
    with open_session(Scene(), what_if=False) as session:
        gripper = session.driver.arms["arm"].spec.gripper
    assert gripper is not None
    geometry = replace(gripper.geometry, min_aperture=gap)
    corners = np.array([*product((-0.06, 0.06), (-0.001, 0.001), (-0.04, 0.04))])
    wall = Surface(Pose(xyz=(0.4, 0.0, 0.1)), [corners])
    tiers = Closings("it", wall, geometry, lambda grasp: True).tiers()
    widths = [grasp.width for tier in tiers for grasp in tier]
    assert bool(widths) == held
    assert widths == pytest.approx([0.002] * len(widths))


@pytest.mark.parametrize(("tilt", "upright"), [(0.0, False), (14.0, True), (35.0, False)])
def test_a_wall_that_leans_within_friction_is_held_by_an_upright_hand_as_well(tilt: float, upright: bool) -> None:
    with open_session(Scene(), what_if=False) as session:
        gripper = session.driver.arms["arm"].spec.gripper
    assert gripper is not None
    corners = np.array([*product((-0.02, 0.02), (-0.004, 0.004), (-0.03, 0.03))])
    half = np.radians(tilt) / 2.0
    wall = Surface(Pose(xyz=(0.4, 0.0, 0.1), quat_xyzw=(np.sin(half), 0.0, 0.0, np.cos(half))), [corners])
    found = [grasp for tier in Closings("it", wall, gripper.geometry, lambda grasp: True).tiers() for grasp in tier]
    straight = [grasp.tcp_pose.rotation for grasp in found if grasp.how == "upright"]
    assert bool(straight) == upright
    assert all(rotation[2, 2] == pytest.approx(-1.0) for rotation in straight)


def test_no_tip_presses_on_the_flat_rim_of_a_plate() -> None:
    with open_session(Scene(), what_if=False) as session:
        gripper = session.driver.arms["arm"].spec.gripper
    assert gripper is not None
    # Nine boards that rise outwards by 20 degrees around a disc, as a plate is cut into convex pieces.
    edge = [(0.0407, 0.0061, 0.013), (0.0423, 0.0, 0.013), (0.0711, 0.0189, 0.025), (0.0732, 0.0127, 0.025)]
    board = np.array([(r, side * half, z) for r, z, half in edge for side in (-1.0, 1.0)])
    turns = [matrix_from_rotation_vector(np.array([0.0, 0.0, turn])) for turn in np.arange(9) * 2.0 * np.pi / 9]
    disc = np.array([*product((-0.03, 0.03), (-0.03, 0.03), (0.0026, 0.0085))])
    plate = Surface(Pose(xyz=(0.4, 0.0, 0.1)), [disc, *(board @ turn.T for turn in turns)])
    found = [grasp for tier in Closings("it", plate, gripper.geometry, lambda grasp: True).tiers() for grasp in tier]
    assert not [grasp for grasp in found if grasp.how == "upright"]


def test_how_a_mesh_lies_is_found_from_points_of_its_surface(angle: Path) -> None:
    mesh = known_mesh(angle, 0.001)
    turn = matrix_from_rotation_vector(np.array([0.0, 0.0, 0.7])) @ matrix_from_rotation_vector(
        np.array([1.5708, 0.0, 0.0])
    )
    low = float((mesh.corners @ turn.T)[:, 2].min())
    place = np.array([0.12, -0.08, 0.04 - low])
    # What cameras over it and before it see.
    seen = (mesh.points @ turn.T)[(mesh.normals @ turn.T)[:, 2] > 0.5] + place
    front = (mesh.points @ turn.T)[(mesh.normals @ turn.T)[:, 0] < -0.5] + place
    found = fit_mesh(mesh, np.concatenate([seen, front])[::7], (), 0.04)
    assert found.explains
    assert found.pose.position == pytest.approx(place, abs=0.001)
    assert np.trace(found.pose.rotation.T @ turn) == pytest.approx(3.0, abs=0.001)
    # Points of a ball are none of it.
    ball = 0.03 * mesh.normals + place
    assert not fit_mesh(mesh, ball[::7], (), 0.04).explains


def test_a_known_mesh_is_seen_as_it_lies_and_picked_where_it_is_thin(table_of_boxes: Path) -> None:
    board = thing(table_of_boxes, scale=0.001, collision="coacd", mass=0.1, rgba=(0.85, 0.1, 0.1, 1.0),
        pose=Pose(xyz=(0.15, 0.0, 0.04 + 0.0365), quat_xyzw=(1.0, 0.0, 0.0, 0.0)))  # fmt: skip
    with open_session(Scene(objects=(board,)), perception="rgbd", what_if=False) as session:
        (seen,) = session.observe().objects
        truth = session.simulation.truth().objects["it"].pose
        assert seen.kind == "mesh"
        assert seen.pose.position == pytest.approx(truth.position, abs=0.002)
        session.agent.perform(SkillCall(skill="pick", arguments={"object": "it"}))
        assert session.simulation.truth().held == "it"
