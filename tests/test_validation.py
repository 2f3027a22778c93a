"""Bad YAML and bad values: one line each, naming the file, the field, the value and the remedy."""

from pathlib import Path

import pytest
from hypothesis import given, strategies as st

from robosandbox.errors import InputError
from robosandbox.tasks.loader import load_task
from robosandbox.tasks.task import Task
from robosandbox.validation import did_you_mean, parse_yaml, validate

TASK = """\
name: t
prompt: "pick up the red cube"
scene:
  objects:
    - id: red_cube
      kind: box
      size: [0.02, 0.02, 0.02]
      pose:
        xyz: [0.1, 0.0, 0.07]
      mass: 0.05
    - id: tray
      kind: bin
      size: [0.06, 0.06, 0.05]
      pose:
        xyz: [0.1, 0.2, 0.045]
success:
  kind: lifted
  object: red_cube
  min_mm: 50
"""

MISTAKES = [
    ("", "scene: [", "not YAML or flow", ["line"]),
    ("prompt:", "name: u\nprompt:", "a key that stands twice", ["line 2", "'name' stands twice"]),
    ('prompt: "pick up the red cube"\n', "", "a missing field", ["prompt: is missing"]),
    ("success:", "randomise: {}\nsuccess:", "an unknown field", ["'randomise'", "did you mean 'randomize'"]),
    ("mass: 0.05", "mas: 0.05", "an unknown field deeper", ["scene.objects[0]", "'mas'", "did you mean 'mass'"]),
    (
        "xyz: [0.1, 0.0, 0.07]",
        "xyz: [0.1, 0.0, 0.07]\n        yaw: 1",
        "one deeper still",
        ["scene.objects[0].pose", "'yaw'"],
    ),
    ("min_mm: 50", "min_m: 50", "one in the criterion", ["success", "'min_m'", "did you mean 'min_mm'"]),
    ("      pose:\n        xyz: [0.1, 0.0, 0.07]\n", "", "a missing pose", ["scene.objects[0].pose: is missing"]),
    ("mass: 0.05", "mass: .nan", "a NaN mass", ["scene.objects[0].mass: nan", "finite"]),
    ("mass: 0.05", "mass: 0", "a zero mass", ["scene.objects[0].mass: 0 is outside", "to 1000 kg"]),
    ("mass: 0.05", "mass: heavy", "a mass in words", ["scene.objects[0].mass: 'heavy'", "not a number"]),
    (
        "[0.02, 0.02, 0.02]",
        "[0.02, -1, 0.02]",
        "a negative size",
        ["scene.objects[0].size[1]: -1 is outside", "to 10 m"],
    ),
    ("[0.02, 0.02, 0.02]", "[.inf, 0.02, 0.02]", "an infinite size", ["scene.objects[0].size[0]: inf", "finite"]),
    (
        "[0.02, 0.02, 0.02]",
        "[20, 20, 20]",
        "sizes in millimetres",
        ["size[0]: 20 is outside", "are these millimetres?"],
    ),
    ("[0.02, 0.02, 0.02]", "[0.02]", "too few sizes", ["scene.objects[0].size", "half_x, half_y, half_z"]),
    ("0.07]", "0.07]\n        quat_xyzw: [0, 0, 0, 0]", "a zero quaternion", ["pose.quat_xyzw", "[0, 0, 0, 1]"]),
    ("id: tray", "id: red_cube", "a duplicate id", ["scene.objects", "'red_cube'", "distinct"]),
    ("kind: box", "kind: bx", "an unknown kind", ["scene.objects[0].kind: 'bx'", "did you mean 'box'"]),
    (
        "object: red_cube",
        "object: red_cub",
        "an unknown object",
        ["success.object: 'red_cub'", "did you mean 'red_cube'"],
    ),
    ("kind: lifted", "kind: lited", "an unknown check", ["success.kind: 'lited'", "did you mean 'lifted'"]),
    ("kind: lifted\n  ", "", "a check without kind", ["success.kind: is missing", "lifted"]),
    ("lifted\n  object: red_cube\n  min_mm: 50", "all\n  checks: []", "an empty all", ["success.checks", "0 entries"]),
    ("lifted\n  object: red_cube\n  min_mm: 50", "any\n  checks: []", "an empty any", ["success.checks", "0 entries"]),
    (
        "lifted\n  object: red_cube\n  min_mm: 50",
        "inside\n  object: tray\n  target: red_cube",
        "something inside a cube",
        ["success.target: 'red_cube' is a box", "bin"],
    ),
    (
        "lifted\n  object: red_cube\n  min_mm: 50",
        "not\n  check: {kind: any, checks: [{kind: lifted, object: x}]}",
        "an unknown object deep inside",
        ["success.check.checks[0].object: 'x'"],
    ),
    (
        "lifted\n  object: red_cube\n  min_mm: 50",
        "all\n  checks: [{kind: lifted, object: red_cube, min_mm: 5cm}]",
        "a number with a unit, deep inside",
        ["success.checks[0].min_mm: '5cm': is not a number"],
    ),
    (
        "lifted\n  object: red_cube\n  min_mm: 50",
        "on\n  object: tray\n  target: tray",
        "on itself",
        ["success.target: 'tray'"],
    ),
    ("success:", "randomize: {xy_jitter: 0}\nsuccess:", "seeds that are all alike", ["randomize", "xy_jitter"]),
    (
        "success:",
        "randomize: {yaw_jitter: 9}\nsuccess:",
        "more than a full turn",
        ["randomize.yaw_jitter: 9", "at most"],
    ),
    ("kind: box", "kind: mesh\n      mesh: gone.stl", "a size for a mesh", ["scene.objects[0].size", "no size"]),
    (
        "kind: box\n      size: [0.02, 0.02, 0.02]",
        "kind: mesh\n      mesh: gone.stl",
        "a missing mesh file",
        ["scene.objects[0].mesh: 'gone.stl'", "not a file"],
    ),
    (
        "scene:",
        "scene:\n  robot_urdf: ur5.urdf",
        "a missing robot file",
        ["scene.robot_urdf: 'ur5.urdf'", "not a file"],
    ),
    ("  objects:", "  table_height: 9\n  objects:", "a table too high", ["scene.table_height: 9", "at most 2"]),
    ('"pick up the red cube"', '""', "an empty prompt", ["prompt"]),
]


@pytest.mark.parametrize(
    ("old", "new", "named"), [(old, new, named) for old, new, _, named in MISTAKES], ids=[m[2] for m in MISTAKES]
)
def test_one_line_names_file_field_value_and_remedy(tmp_path: Path, old: str, new: str, named: list[str]) -> None:
    path = tmp_path / "my_task.yaml"
    path.write_text(TASK.replace(old, new, 1) if old else new)
    with pytest.raises(InputError) as caught:
        load_task(path)
    message = str(caught.value)
    assert message.startswith("my_task.yaml") and "\n" not in message and len(message) < 300
    assert [part for part in named if part not in message] == [], message


def test_the_task_without_mistakes_loads(tmp_path: Path) -> None:
    (tmp_path / "t.yaml").write_text(TASK)
    assert load_task(tmp_path / "t.yaml").name == "t"


@pytest.mark.parametrize(
    ("content", "says"),
    [
        (b"\xff\xfe", "UTF-8"),
        (b"", "is empty"),
        (b"- 1\n", "mapping"),
        (b"[" * 9999, "nested"),
        (b"x" * 2_000_000, "MB"),
    ],
)
def test_a_file_that_is_no_task_is_refused(tmp_path: Path, content: bytes, says: str) -> None:
    path = tmp_path / "t.yaml"
    path.write_bytes(content)
    with pytest.raises(InputError, match=says):
        load_task(path)


def test_a_missing_file_suggests_its_neighbour(tmp_path: Path) -> None:
    (tmp_path / "pick.yaml").write_text(TASK)
    with pytest.raises(InputError, match=r"did you mean 'pick\.yaml'"):
        load_task(tmp_path / "pik.yaml")
    with pytest.raises(InputError, match=r"no such file$"):
        load_task(tmp_path / "xylophone.yaml")


def test_the_name_that_differs_by_a_gap_alone_comes_first() -> None:
    assert did_you_mean("joint_4", ["joint1", "joint2", "joint4"]).startswith("; did you mean 'joint4'")


def test_on_is_a_word_and_1e_3_a_number() -> None:
    assert parse_yaml("{a: on, b: 1e-3, c: no, d: true, e: 010}", "f") == {
        **{"a": "on", "b": 0.001, "c": "no"},
        **{"d": True, "e": 10.0},
    }


def test_far_names_are_not_suggested() -> None:
    assert did_you_mean("zzzz", ["pick", "place"]) == ""


@given(st.text(max_size=200))
def test_any_text_is_read_or_refused_in_one_line(text: str) -> None:
    try:
        validate(parse_yaml(text, "f.yaml"), Task, source="f.yaml")
    except InputError as error:
        assert "\n" not in str(error)


_JSON = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=8),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.text(max_size=8), inner, max_size=3),
    max_leaves=8,
)


@given(
    st.fixed_dictionaries(
        {},
        optional={
            "name": _JSON,
            "prompt": _JSON,
            "scene": st.fixed_dictionaries({"objects": st.lists(_JSON, max_size=2)}) | _JSON,
            "success": st.fixed_dictionaries({"kind": st.sampled_from(["all", "not", "on"]), "checks": _JSON}) | _JSON,
            "randomize": _JSON,
        },
    )
)
def test_any_data_is_read_or_refused_in_one_line(data: dict[str, object]) -> None:
    try:
        validate(data, Task, source="f.yaml")
    except InputError as error:
        assert "\n" not in str(error) and "pydantic" not in str(error)
