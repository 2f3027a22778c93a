"""Tags on objects: what a scene may say of them, what they change of its physics, and what perception makes of them."""

from dataclasses import replace

import cv2
import numpy as np
import pytest
from pydantic import ValidationError

from robosandbox.apps.cli import app
from robosandbox.apps.commands.console import run_app
from robosandbox.perception.factory import Setup
from robosandbox.perception.naming import Declared, names_for
from robosandbox.perception.rgbd import RgbdPerception
from robosandbox.perception.tags import Tag, _read, _square, merged
from robosandbox.perception.visualize import draw
from robosandbox.sim.mujoco_backend import MuJoCoBackend
from robosandbox.sim.objects import PREFIX
from robosandbox.sim.sensors import find_sensor
from robosandbox.tags import BORDERED, TAG_CELLS, TAG_FAMILY
from robosandbox.types import Pose, Scene, SceneObject

RED = (0.85, 0.2, 0.2, 1.0)
PLACES = {"first": (0.05, -0.2), "second": (0.2, 0.22), "third": (0.3, -0.12)}


def cube(name, tag, at, *, half=0.025, rgba=RED, yaw=0.4):
    turn = (0.0, 0.0, float(np.sin(yaw / 2.0)), float(np.cos(yaw / 2.0)))
    pose = Pose(xyz=(*at, 0.0401 + half), quat_xyzw=turn)
    return SceneObject(id=name, kind="box", size=(half,) * 3, pose=pose, rgba=rgba, tag=tag)


def three_cubes(tags=(7, 21, 300), **given):
    return Scene(
        objects=tuple(cube(name, tag, at, **given) for (name, at), tag in zip(PLACES.items(), tags, strict=True))
    )


@pytest.mark.parametrize(
    "given, said",
    [
        (
            {"kind": "sphere", "size": (0.03,), "tag": 1},
            "a sphere has no flat face upward; give it to a box or cylinder",
        ),
        ({"kind": "bin", "size": (0.05, 0.05, 0.04), "tag": 1}, "a bin has no flat face upward"),
        ({"tag": 587}, "less than 587"),
        ({"tag": -1}, "greater than or equal to 0"),
        ({"tag": 1, "tag_size": 0.05}, "at most 0.04"),
        ({"tag_size": 0.02}, "there is no tag"),
        ({"kind": "cylinder", "size": (0.02, 0.05), "tag": 1, "tag_size": 0.025}, "a face of 0.0282843 m"),
    ],
)
def test_a_tag_that_cannot_be_there_is_refused(given, said):
    fields = {"id": "thing", "kind": "box", "size": (0.025,) * 3, "pose": Pose(xyz=(0.1, 0.0, 0.1)), **given}
    with pytest.raises(ValidationError, match=said):
        SceneObject(**fields)


def test_two_objects_with_one_number_are_refused():
    with pytest.raises(ValidationError, match=r"second\.tag: 7 is on 'first' already"):
        three_cubes((7, 7, 3))


def test_a_tag_takes_less_than_its_face():
    item = cube("first", 7, (0.1, 0.0))
    assert 0.02 < BORDERED * item.tag_edge < 0.05


def untagged(scene):
    return scene.model_copy(update={"objects": tuple(item.model_copy(update={"tag": None}) for item in scene.objects)})


def test_a_tag_changes_nothing_of_the_physics():
    states = []
    for scene in (three_cubes(), untagged(three_cubes())):
        with MuJoCoBackend() as sim:
            sim.load(scene)
            data = sim._live
            data.joint(PREFIX + "first").qvel[:] = [0.4, 0.9, 1.5, 3.0, 9.0, 2.0]
            sim.wait(0.6)
            states.append((sim.model.body_mass.copy(), sim.model.body_inertia.copy(), sim._live.qpos.copy()))
    for tagged, plain in zip(*states, strict=True):
        assert np.array_equal(tagged, plain)


def test_a_tag_keeps_its_colours_and_its_place_when_an_object_changes():
    scene = three_cubes()
    green = scene.model_copy(
        update={"objects": tuple(item.model_copy(update={"rgba": (0.0, 1.0, 0.0, 1.0)}) for item in scene.objects)}
    )
    larger = three_cubes(half=0.03)
    with MuJoCoBackend() as sim:
        sim.load(scene)
        sim.reset(green)
        tag = sim.model.geom(PREFIX + "first/tag")
        assert np.ptp(sim.model.geom_rgba[tag.id][:3]) == 0.0
        assert np.allclose(sim.model.geom_rgba[tag.id - 1], (0.0, 1.0, 0.0, 1.0))
        sim.reset(larger)
        assert sim.model.geom(PREFIX + "first/tag").pos[2] > 0.03


@pytest.mark.parametrize("turn", range(4))
def test_a_blurred_tag_is_read_with_its_corners_from_its_upper_left(turn):
    dictionary = cv2.aruco.getPredefinedDictionary(getattr(cv2.aruco, TAG_FAMILY))
    rng = np.random.default_rng(turn)
    for number in rng.integers(0, 587, 20):
        picture = np.pad(cv2.aruco.generateImageMarker(dictionary, int(number), TAG_CELLS), 4, constant_values=255)
        small = cv2.resize(
            np.kron(picture, np.ones((4, 4), np.uint8)), None, fx=0.4, fy=0.4, interpolation=cv2.INTER_AREA
        )
        drawn = cv2.resize(np.rot90(small, turn).copy(), None, fx=3.0, fy=3.0, interpolation=cv2.INTER_CUBIC)
        middle = (drawn.shape[0] - 1) / 2.0
        half = TAG_CELLS * 4 * 0.4 * 3.0 / 2.0
        square = _square(np.array([middle, middle]), half, 0.0)
        read, corners = _read(drawn, square)
        assert read == number
        # Turned counter-clockwise, what was the upper left goes down first.
        assert np.allclose(corners[0], square[-turn % 4])


def test_what_is_no_tag_is_not_read():
    rng = np.random.default_rng(0)
    for _ in range(200):
        drawn = cv2.GaussianBlur(rng.integers(0, 256, (80, 80), dtype=np.uint8), (0, 0), 2.0)
        assert _read(drawn, _square(np.array([40.0, 40.0]), 25.0, 0.0))[0] is None


def test_of_several_views_of_a_tag_the_largest_is_kept_and_what_was_not_read_there_is_left_out():
    square = np.array([[0.0, 0.0, 0.1], [0.03, 0.0, 0.1], [0.03, -0.03, 0.1], [0.0, -0.03, 0.1]])
    tags = [Tag(None, square, "top", 30.0), Tag(5, square, "wrist", 20.0), Tag(5, square + 0.001, "scene", 12.0)]
    assert [(tag.number, tag.camera) for tag in merged(tags)] == [(5, "wrist")]


def test_a_thing_with_a_number_is_not_called_by_the_description_of_another():
    described = [Declared(id=f"toy_{tag}", kind="box", size=(0.02,) * 3, rgb=RED[:3], tag=tag) for tag in (3, 4)]
    seen = [("box", (0.02,) * 3, np.array(RED[:3]))] * 2
    assert names_for(seen, described, (), [4, 9]) == ["toy_4", None]
    assert set(names_for(seen, described, (), [None, None])) == {"toy_3", "toy_4"}


class Looking:
    """A sim whose objects can be moved unseen, and eyes that are told of other objects if need be."""

    def __init__(self, scene, told=None, sensor="realsense"):
        self.sim = MuJoCoBackend(sensor=replace(find_sensor(sensor), seed=1))
        self.sim.load(scene)
        self.eyes = RgbdPerception(setup=Setup.of(told or scene))

    def place(self, name, at):
        self.sim._live.joint(PREFIX + name).qpos[:2] = at
        self.sim._live.joint(PREFIX + name).qvel[:] = 0.0

    def seen(self):
        self.sim.wait(0.3)
        return {item.id: item for item in self.eyes.perceive(self.sim).objects}

    def truth(self):
        return {name: item.pose.position for name, item in self.sim.truth().objects.items()}

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.sim.close()


def assert_right(looking, tags):
    seen, true = looking.seen(), looking.truth()
    assert seen.keys() == tags.keys()
    for name, tag in tags.items():
        assert np.linalg.norm(seen[name].pose.position - true[name]) < 0.006
        assert seen[name].tag == tag
        assert np.abs(np.array(seen[name].size) - 0.025).max() < 0.003


TAGS = {"first": 7, "second": 21, "third": 300}


@pytest.mark.gl
@pytest.mark.parametrize("sensor", ["realsense", "rough"])
def test_cubes_that_look_the_same_are_told_apart_by_their_tags(sensor):
    with Looking(three_cubes(), sensor=sensor) as looking:
        seen, true = looking.seen(), looking.truth()
    assert {name: item.tag for name, item in seen.items()} == TAGS
    assert all(np.linalg.norm(seen[name].pose.position - true[name]) < 0.012 for name in TAGS)


@pytest.mark.gl
def test_cubes_that_change_places_unseen_keep_their_names():
    with Looking(three_cubes()) as looking:
        assert_right(looking, TAGS)
        for name, other in zip(PLACES, (*list(PLACES)[1:], next(iter(PLACES))), strict=True):
            looking.place(name, PLACES[other])
        assert_right(looking, TAGS)


@pytest.mark.gl
def test_a_number_that_nobody_described_is_no_described_thing_and_becomes_part_of_a_name():
    with Looking(three_cubes((7, 21, 99)), three_cubes()) as looking:
        seen = looking.seen()
    assert set(seen) == {"first", "second", "red_box_tag_99"}
    assert seen["red_box_tag_99"].tag == 99


@pytest.mark.gl
def test_a_number_that_is_read_late_settles_what_looks_had_guessed():
    scene = three_cubes()
    with Looking(untagged(scene), scene) as looking:
        guessed = looking.seen()
        assert set(guessed) == set(TAGS) and all(item.tag is None for item in guessed.values())
        # From now on the same world shows its tags: the numbers go to other things than were guessed.
        names = list(TAGS)
        wrong = {name: names[(names.index(_at(guessed[name], looking.truth())) + 1) % 3] for name in names}
        with MuJoCoBackend(sensor=find_sensor("realsense")) as other:
            other.load(
                scene.model_copy(
                    update={
                        "objects": tuple(
                            item.model_copy(update={"tag": TAGS[next(n for n, at in wrong.items() if at == item.id)]})
                            for item in scene.objects
                        )
                    }
                )
            )
            eyes = looking.eyes
            eyes.look([other.capture(camera) for camera in other.cameras])
            eyes._update(other)
        assert {track.id: _at(track.detected(), looking.truth()) for track in eyes.tracks} == wrong


def _at(item, true):
    return min(true, key=lambda name: np.linalg.norm(true[name] - item.pose.position))


@pytest.mark.gl
@pytest.mark.parametrize("rgba", [RED, (0.2, 0.3, 0.85, 1.0), (0.95, 0.85, 0.15, 1.0), (0.5, 0.5, 0.5, 1.0)])
@pytest.mark.sample(every=4)
def test_a_tag_does_not_change_what_else_is_seen(rgba):
    looks = []
    for scene in (three_cubes(rgba=rgba, half=0.02), untagged(three_cubes(rgba=rgba, half=0.02))):
        with Looking(scene) as looking:
            looks.append(sorted(looking.seen().values(), key=lambda item: item.pose.xyz))
    for tagged, plain in zip(*looks, strict=True):
        assert tagged.colour == plain.colour and tagged.kind == plain.kind
        assert np.abs(np.subtract(tagged.size, plain.size)).max() < 0.0025
        assert np.linalg.norm(tagged.pose.position - plain.pose.position) < 0.002


@pytest.mark.gl
def test_a_standing_cylinder_may_have_one():
    can = SceneObject(
        id="can", kind="cylinder", size=(0.032, 0.04), pose=Pose(xyz=(0.15, -0.2, 0.0801)), rgba=RED, tag=11
    )
    with Looking(Scene(objects=(can,))) as looking:
        seen = looking.seen()["can"]
    assert seen.tag == 11 and seen.kind == "cylinder" and seen.colour == "red"


@pytest.mark.gl
def test_where_no_tag_is_described_none_is_looked_for():
    with Looking(three_cubes(), untagged(three_cubes())) as looking:
        looking.seen()
        assert not looking.eyes.tags


TASK = """
name: tagged
prompt: "pick up the left cube"
scene:
  objects:
    - {id: mine, kind: box, size: [0.025, 0.025, 0.025], pose: {xyz: [0.1, 0.2, 0.066]}, rgba: [0.85, 0.2, 0.2, 1], tag: 7}
    - {id: yours, kind: box, size: [0.025, 0.025, 0.025], pose: {xyz: [0.1, -0.2, 0.066]}, rgba: [0.85, 0.2, 0.2, 1], tag: 8}
success: {kind: lifted, object: mine, min_mm: 50}
"""


@pytest.mark.gl
def test_look_tells_and_draws_tags(tmp_path, capsys):
    task, picture = tmp_path / "tagged.yaml", tmp_path / "seen.png"
    task.write_text(TASK)
    assert run_app(app, "robo-sandbox", ["look", "--task", str(task), "--picture", str(picture)]) == 0
    assert ", tag 7" in capsys.readouterr().out
    assert run_app(app, "robo-sandbox", ["look", "--task", str(task), "--json"]) == 0
    assert '"tag": 8' in capsys.readouterr().out
    assert cv2.imread(str(picture)) is not None


@pytest.mark.gl
def test_tags_are_drawn_into_the_picture():
    with Looking(three_cubes()) as looking:
        looking.seen()
        eyes = looking.eyes
        drawn, without = (draw(eyes.frames, eyes.things, eyes.tracks, tags) for tags in (eyes.tags, ()))
    assert len(eyes.tags) == 3
    assert (drawn != without).any(axis=2).sum() > 100
