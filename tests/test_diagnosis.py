"""A failure on an arm with a sidecar of its own names what is wrong with the sidecar, and nothing where it is sound."""

import re

import numpy as np
import pytest
import yaml
from support.written_arms import SYMPTOMS, beside, written

from robosandbox.apps.conformance.robot_trial import cube_task, work_point
from robosandbox.errors import InputError
from robosandbox.robots.check.diagnosis import _static_checks
from robosandbox.robots.loader import load_robot
from robosandbox.types import Pose, Scene
from robosandbox.workcell.session import open_session


def _run(model, path, task):
    """Return what came of a task on an arm with this sidecar, as an episode's or a loader's last words."""
    try:
        with open_session(task, what_if=False, max_replans=0) as session:
            return session.run().final_detail
    except InputError as error:
        return str(error)


# The jaw of this toy is so broad that it holds the cube beside its middle as well: nothing fails, and nothing is said.
HARMLESS = {("toy_jaw", "nothing grasped: TCP beside the fingers")}


@pytest.mark.parametrize(
    ("name", "symptom"),
    [
        (name, symptom)
        for name in ("toy", "toy_jaw", "ur5e")
        for symptom in SYMPTOMS
        if symptom != "bad home" and (name, symptom) not in HARMLESS
    ],
)
@pytest.mark.sample(every=7)
def test_failure_ends_in_the_field_that_is_wrong_its_value_and_the_command(name, symptom, tmp_path):
    model, path = written(name, tmp_path)
    task = cube_task(model, path, work_point(load_robot(model, path)))
    side = yaml.safe_load(path.read_text())
    field, change = SYMPTOMS[symptom]
    change(side)
    broken = tmp_path / "broken.robosandbox.yaml"
    broken.write_text(yaml.safe_dump(side))
    task = task.model_copy(update={"scene": task.scene.model_copy(update={"robot_config": broken})})
    said = _run(model, broken, task)
    command = rf"`robo-sandbox robot check \S*{model.name} --sidecar \S*broken\.robosandbox\.yaml` shows more"
    assert re.search(rf"broken\.robosandbox\.yaml: {re.escape(field)} is .+; {command}$", said), said


@pytest.mark.parametrize("name", ["toy", pytest.param("ur5e", marks=pytest.mark.slow)])
def test_sound_sidecar_is_not_blamed_for_what_has_another_cause(name, tmp_path):
    model, path = written(name, tmp_path)
    robot = load_robot(model, path)
    at = work_point(robot)
    fits = cube_task(model, path, at)
    cube = fits.scene.objects[0]
    wide = (0.6 * robot.gripper.geometry.max_aperture + 0.01,) * 3
    away = np.array(cube.pose.xyz)
    away[:2] = robot.base_pose.position[:2] + 3.0 * robot.workspace.far * np.array([0.0, 1.0])
    others = {
        "out of reach": cube.model_copy(update={"pose": Pose(xyz=tuple(away))}),
        "too wide": cube.model_copy(update={"size": wide, "pose": Pose(xyz=(*at, 0.041 + wide[2]))}),
        "too heavy": cube.model_copy(update={"mass": 40.0}),
    }
    for cause, changed in others.items():
        task = fits.model_copy(update={"scene": fits.scene.model_copy(update={"objects": (changed,)})})
        with open_session(task, what_if=False, max_replans=0) as session:
            episode = session.run()
            assert session.mujoco.robot.files is not None
        assert not episode.success, cause
        assert "robosandbox.yaml" not in episode.final_detail, (cause, episode.final_detail)


def test_static_checks_are_made_once_and_not_for_a_bundled_or_inferred_robot(tmp_path):
    model, path = written("toy", tmp_path)
    beside(side := yaml.safe_load(path.read_text()))
    path.write_text(yaml.safe_dump(side))
    with open_session(cube_task(model, path, (0.0, 0.0)), what_if=False, max_replans=0) as session:
        before = _static_checks.cache_info().misses
        session.run("pick up the red cube")
        session.run("pick up the red cube")
        assert _static_checks.cache_info().misses == before + 1
    far = cube_task(None, None, (0.4, 0.0)).scene.objects[0].model_copy(update={"pose": Pose(xyz=(-0.3, 0.45, 0.055))})
    for robot in (None, model):
        before = _static_checks.cache_info().misses
        with open_session(Scene(robot_urdf=robot, objects=(far,)), what_if=False, max_replans=0) as session:
            assert session.mujoco.robot.files is None
            session.run("pick up the red cube")
        assert _static_checks.cache_info().misses == before
