"""Task files in the forms of the seeds' own project: notes, bundled files, YCB objects, drawers, what was moved above."""

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
import yaml

from robosandbox.errors import InputError
from robosandbox.tasks.loader import load_task
from robosandbox.tasks.task import Task
from robosandbox.types import DetectedObject, Pose
from robosandbox.workcell.session import open_session
from robosandbox.world import relations

CUBE: dict[str, Any] = {"id": "cube", "kind": "box", "size": [0.015] * 3, "pose": {"xyz": [0.1, 0.0, 0.056]}}
BLOCK: dict[str, Any] = {"id": "block", "kind": "box", "size": [0.03] * 3, "pose": {"xyz": [0.1, 0.15, 0.071]}}
ABOVE = {"kind": "moved_above", "object": "cube", "target": "block"}
BUILTIN = {
    "robot_urdf": "@builtin:robots/franka_panda/panda.xml",
    "robot_config": "@builtin:robots/franka_panda/panda.robosandbox.yaml",
}
# A box of 4 x 6 x 8 cm.
MESH = "\n".join(
    [f"v {x} {y} {z}" for x in (-0.02, 0.02) for y in (-0.03, 0.03) for z in (-0.04, 0.04)]
    + ["f 1 2 4", "f 1 4 3", "f 5 7 8", "f 5 8 6", "f 1 5 6", "f 1 6 2", "f 3 4 8", "f 3 8 7", "f 1 3 7", "f 1 7 5"]
    + ["f 2 6 8", "f 2 8 4"]
)


def task(**changes: Any) -> dict[str, Any]:
    return {
        "name": "given",
        "prompt": "pick up the cube",
        "scene": {"objects": [CUBE]},
        "success": {"kind": "lifted", "object": "cube"},
        **changes,
    }


def written(folder: Path, **changes: Any) -> Path:
    path = folder / "given.yaml"
    path.write_text(yaml.safe_dump(task(**changes)))
    return path


@pytest.mark.parametrize("field", ["notes", "seed_note"])
def test_free_text_of_either_name_is_kept(field: str, tmp_path: Path) -> None:
    assert load_task(written(tmp_path, **{field: "Why: three\nlines of it."})).notes == "Why: three\nlines of it."


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"notes": "a", "seed_note": "b"}, "seed_note: is the same as notes, which is there too; keep one"),
        ({"notes": "a" * 10_001}, "notes: "),
        ({"seed_notes": "a"}, "unknown field 'seed_notes'; did you mean"),
        ({"supported_backends": ["mujoco"]}, "unknown field 'supported_backends'"),
        ({"success": {"kind": "all", "checks": []}}, "success.checks: "),
        ({"success": {**ABOVE, "target": "blok"}}, "success.target: 'blok' is no object"),
        ({"success": {**ABOVE, "target": "cube"}}, "success.target: 'cube' is named twice"),
        ({"success": {**ABOVE, "target": "block", "xy_tol": 0}}, "success.xy_tol: 0: must be greater than 0"),
        ({"success": {**ABOVE, "max_dz": 0.1}}, "success: unknown field 'max_dz'"),
    ],
)
def test_what_is_strict_stays_strict(changes: dict[str, Any], said: str, tmp_path: Path) -> None:
    with pytest.raises(InputError) as error:
        load_task(written(tmp_path, **{"scene": {"objects": [CUBE, BLOCK]}, **changes}))
    assert said in str(error.value) and str(error.value).startswith("given.yaml: ")


# Bundled files.


def test_bundled_robot_and_sidecar_are_found_wherever_the_task_lies(tmp_path: Path) -> None:
    loaded = load_task(written(tmp_path, scene={**BUILTIN, "objects": [CUBE]}))
    with open_session(loaded) as session:
        assert session.robot_name == "panda" and session.mujoco.robot.files is None
        episode = session.run()
        assert episode.success and session.judge().success, episode.final_detail


@pytest.mark.parametrize(
    "name",
    [
        "@builtin:robots/franka_panda/pandas.xml",
        "@builtin:robots/../robots/franka_panda/panda.xml/..",
        "@builtin:robots/../../pyproject.toml",
        "@builtin:objects/mug.xml",
        "@builtin:",
    ],
)
@pytest.mark.parametrize("field", ["robot_urdf", "robot_config"])
def test_what_is_not_bundled_is_named_with_what_is(field: str, name: str, tmp_path: Path) -> None:
    with pytest.raises(InputError) as error:
        load_task(written(tmp_path, scene={**BUILTIN, field: name, "objects": [CUBE]}))
    assert str(error.value).startswith(f"given.yaml: scene.{field}: ") and "is not bundled" in str(error.value)
    assert "@builtin:robots/franka_panda/panda" in str(error.value)


# Objects of a YCB folder.


@pytest.fixture
def ycb(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    root = tmp_path / "ycb"
    for name in ("008_pudding_box/google_16k/nontextured.stl.obj", "009_gelatin_box/google_16k/textured.obj"):
        (root / name).parent.mkdir(parents=True)
        (root / name).write_text(MESH)
    described = root / "003_cracker_box"
    described.mkdir()
    (described / "cracker_visual.obj").write_text(MESH)
    (described / "cracker_hull_0.obj").write_text(MESH)
    notes = {
        "visual_mesh": "cracker_visual.obj",
        "collision_meshes": ["cracker_hull_0.obj"],
        "scale": 0.5,
        "mass": 0.08,
    }
    (described / "cracker.robosandbox.yaml").write_text(yaml.safe_dump({**notes, "friction": [1.5, 0.1, 0.01]}))
    monkeypatch.setenv("ROBOSANDBOX_YCB", str(root))
    yield root


def mesh(name: str, **changes: Any) -> dict[str, Any]:
    return {"id": "cube", "kind": "mesh", "mesh": f"@ycb:{name}", "pose": {"xyz": [0.1, 0.0, 0.09]}, **changes}


def test_object_is_described_beside_its_mesh_and_the_task_has_the_last_word(ycb: Path, tmp_path: Path) -> None:
    plain, said = (
        load_task(written(tmp_path, scene={"objects": [mesh("003_cracker_box", **more)]})).scene.objects[0]
        for more in ({}, {"mass": 0.03, "scale": 1.0})
    )
    assert plain.mesh == said.mesh == (ycb / "003_cracker_box" / "cracker_visual.obj").resolve()
    assert (plain.mass, plain.scale, said.mass, said.scale) == (0.08, 0.5, 0.03, 1.0)


def test_object_as_it_is_distributed_is_picked(ycb: Path, tmp_path: Path) -> None:
    with open_session(written(tmp_path, scene={"objects": [mesh("009_gelatin_box")]})) as session:
        assert session.simulation.truth().objects["cube"].size == pytest.approx((0.02, 0.03, 0.04), abs=1e-6)
        episode = session.run()
        assert session.judge().success, episode.final_detail


@pytest.mark.parametrize(
    ("name", "said"),
    [
        ("009_gelatine_box", "did you mean '009_gelatin_box'"),
        ("../ycb/009_gelatin_box", "is not in"),
        ("010_empty", "has no OBJ or STL file"),
        ("011_out", "visual_mesh: '../009_gelatin_box/google_16k/textured.obj' is not a file of this folder"),
        ("012_odd", "unknown field 'colour'"),
    ],
)
def test_wrong_object_is_one_line(name: str, said: str, ycb: Path, tmp_path: Path) -> None:
    notes = {"011_out": {"visual_mesh": "../009_gelatin_box/google_16k/textured.obj"}}
    notes["012_odd"] = {"visual_mesh": "a.obj", "colour": "red"}
    (ycb / "010_empty").mkdir()
    for folder, data in notes.items():
        (ycb / folder).mkdir()
        (ycb / folder / "x.robosandbox.yaml").write_text(yaml.safe_dump(data))
    with pytest.raises(InputError) as error:
        load_task(written(tmp_path, scene={"objects": [mesh(name)]}))
    assert said in str(error.value) and "\n" not in str(error.value)


def test_folder_that_is_not_given_is_asked_for(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("ROBOSANDBOX_YCB", raising=False)
    with pytest.raises(InputError, match=r"objects\[0\]\.mesh: '@ycb:025_mug' needs .* set ROBOSANDBOX_YCB"):
        load_task(written(tmp_path, scene={"objects": [mesh("025_mug")]}))


# Drawers.


def drawer(**changes: Any) -> dict[str, Any]:
    return {
        "id": "drawer_a",
        "kind": "drawer",
        "size": [0.15, 0.12, 0.05],
        "pose": {"xyz": [0.25, 0.0, 0.04]},
        **changes,
    }


def test_drawer_says_apart_how_far_it_opens_and_is_displaced_by_opening(tmp_path: Path) -> None:
    success = {"kind": "displaced", "object": "drawer_a", "direction": "back", "min_mm": 50}
    scene = {"objects": [drawer(drawer_max_open=0.1, mass=1.0)]}
    path = written(tmp_path, prompt="open the drawer_a", scene=scene, success=success)
    assert load_task(path).scene.objects[0].size == (0.15, 0.12, 0.05, 0.1)
    with open_session(path) as session:
        assert not session.judge().success
        episode = session.run()
        verdict = session.judge()
    assert verdict.success and verdict.detail["along_mm"] > 50.0, episode.final_detail


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"size": [0.15, 0.12, 0.05, 0.1], "drawer_max_open": 0.1}, "drawer_max_open: stands for max_open in size"),
        ({}, "size: a drawer takes [width, depth, height, max_open], got 3 numbers"),
        ({"drawer_max_open": "far"}, "size[3]: 'far': is not a number"),
        ({"kind": "bin", "drawer_max_open": 0.1}, "unknown field 'drawer_max_open'"),
    ],
)
def test_drawer_without_or_with_two_openings_is_refused(changes: dict[str, Any], said: str, tmp_path: Path) -> None:
    with pytest.raises(InputError) as error:
        load_task(written(tmp_path, scene={"objects": [CUBE, drawer(**changes)]}))
    assert said in str(error.value)


# Moved above.


def thing(at: tuple[float, float, float], half: float = 0.02) -> DetectedObject:
    grey = (0.5, 0.5, 0.5, 1.0)
    return DetectedObject(id="it", kind="box", size=(half,) * 3, colour="", rgba=grey, pose=Pose(xyz=at))


@pytest.mark.parametrize(
    ("at", "within", "rise", "holds"),
    [
        ((0.0, 0.0, 0.051), None, None, True),
        ((0.0, 0.0, 0.049), None, None, False),
        ((0.049, 0.049, 0.3), None, None, True),
        ((0.051, 0.0, 0.3), None, None, False),
        ((0.09, 0.0, 0.3), 0.1, None, True),
        ((0.08, 0.08, 0.3), 0.1, None, False),
        ((0.0, 0.0, 0.02), None, 0.01, True),
        ((0.0, 0.0, 0.005), None, 0.01, False),
        ((0.0, 0.0, -0.3), 0.1, 0.01, False),
    ],
)
def test_above_is_over_the_outline_and_the_top_or_as_far_as_is_said(
    at: tuple[float, float, float], within: float | None, rise: float | None, holds: bool
) -> None:
    found = relations.above(thing(at), thing((0.0, 0.0, 0.0), half=0.05), within=within, rise=rise)
    assert found.holds is holds, found.detail


@pytest.mark.parametrize("limits", [{}, {"xy_tol": 0.06, "min_dz": 0.008}])
def test_stacked_object_was_moved_above(limits: dict[str, float], tmp_path: Path) -> None:
    given = task(prompt="put the cube on the block", scene={"objects": [CUBE, BLOCK]}, success={**ABOVE, **limits})
    with open_session(Task.model_validate(given)) as session:
        assert not session.judge().success
        episode = session.run()
        assert session.judge().success, episode.final_detail


def test_what_is_above_from_the_start_was_not_moved_there() -> None:
    on_block = {**CUBE, "pose": {"xyz": [0.1, 0.15, 0.117]}}
    with open_session(Task.model_validate(task(scene={"objects": [on_block, BLOCK]}, success=ABOVE))) as session:
        verdict = session.judge()
    assert not verdict.success and verdict.detail["above_at_start"] == 1.0
