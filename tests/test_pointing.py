"""The perception that a model names, against a real HTTP server on this machine."""

import json
from pathlib import Path

import numpy as np
import pytest

from robosandbox.apps.cli import app
from robosandbox.apps.commands.console import run_app
from robosandbox.apps.conformance.openai_server import HttpAnswer, ScriptedServer, fails, says, tool_calls
from robosandbox.errors import PlannerAnswerError, PlannerUnavailableError
from robosandbox.perception.protocols import Perception
from robosandbox.plugins import load_plugin
from robosandbox.sim.mujoco_backend import MuJoCoBackend
from robosandbox.workcell.embedded import EmbeddedWorkcell
from robosandbox.workcell.session import open_session

SIZE = (640, 480)


@pytest.fixture(autouse=True)
def _no_settings_of_the_caller(monkeypatch: pytest.MonkeyPatch) -> None:
    for name in ("ROBOSANDBOX_VLM_MODEL", "ROBOSANDBOX_VLM_URL", "ROBOSANDBOX_VLM_CASSETTE", "OPENAI_BASE_URL"):
        monkeypatch.delenv(name, raising=False)
    for name in ("HTTP_PROXY", "http_proxy", "ALL_PROXY", "all_proxy"):
        monkeypatch.delenv(name, raising=False)
    monkeypatch.setenv("OPENAI_API_KEY", "sk-test")


def pixels() -> dict[str, tuple[float, float]]:
    """Where a perfect camera shows each object of the task."""
    with open_session("pick_from_three") as session:
        frame = session.driver.senses.capture("scene")
        lens, pose = frame.intrinsics, frame.pose_camera_in_world
        found = {}
        for name, item in session.simulation.truth().objects.items():
            local = pose.rotation.T @ (np.array(item.pose.xyz) - pose.position)
            found[name] = (local[0] / local[2] * lens.fx + lens.cx, local[1] / local[2] * lens.fy + lens.cy)
    return found


def points(*items: tuple[str, float, float]) -> HttpAnswer:
    return tool_calls(
        ("point", json.dumps({"objects": [{"name": n, "x": float(x), "y": float(y)} for n, x, y in items]}))
    )


def session_on(server: ScriptedServer | None, cassette: Path | None = None, **options: object) -> EmbeddedWorkcell:
    url = server.url if server is not None else "http://127.0.0.1:9/v1"
    given = {"model": "scripted", "base_url": url, "cassette": cassette, **options}
    return open_session(
        "pick_from_three", perception="vlm", perception_options=given, sensor="realsense", dialogue=False
    )


@pytest.mark.gl
def test_what_the_model_points_at_is_measured_by_depth_and_called_as_it_says():
    at = pixels()
    answer = points(("Apple", *at["red_cube"]), ("lime", *at["green_cube"]), ("ghost", 20, 460))
    with ScriptedServer(answer) as server, session_on(server) as session:
        assert isinstance(session.ctx.perception, Perception)
        scene = session.observe()
        truth = session.simulation.truth().objects
        assert {item.id for item in scene.objects} == {"apple", "lime", "blue_box_1"}
        for name, cube in (("apple", "red_cube"), ("lime", "green_cube")):
            place = scene.find(name).pose.position
            assert np.linalg.norm(place - np.array(truth[cube].pose.xyz)) < 0.004
        assert any("ghost" in note for note in scene.notes)
        # Nothing new is seen, so nobody is asked again.
        session.driver.wait(0.1)
        assert {item.id for item in session.observe().objects} == {"apple", "lime", "blue_box_1"}
        assert len(server.requests) == 1
        parts = server.requests[0]["messages"][-1]["content"]
        assert [part["type"] for part in parts] == ["text", "image_url"]
        assert "red_cube" not in json.dumps(parts[0])


@pytest.mark.gl
def test_a_thing_is_picked_by_the_models_name_without_the_simulated_truth(monkeypatch):
    at = pixels()

    def refuse(self, *args, **kwargs):
        raise AssertionError("the simulated state was read")

    with ScriptedServer(points(("apple", *at["red_cube"]))) as server, session_on(server) as session:
        with monkeypatch.context() as patch:
            for name in ("truth", "in_hands", "snapshot", "fork"):
                patch.setattr(MuJoCoBackend, name, refuse)
            episode = session.run("pick up the apple")
            held = session.observe().held
        assert episode.success and held == "apple"
        assert session.simulation.truth().held == "red_cube"


@pytest.mark.gl
def test_a_pixel_outside_of_the_picture_goes_back_to_the_model():
    at = pixels()
    answers = (points(("apple", 900, 10)), says("I see an apple."), points(("apple", *at["red_cube"])))
    with ScriptedServer(*answers) as server, session_on(server) as session:
        assert session.observe().find("apple") is not None
        assert "outside of the picture of 640 x 480" in json.dumps(server.requests[1]["messages"])
        assert "there is no JSON in it" in json.dumps(server.requests[2]["messages"])


@pytest.mark.gl
def test_answers_are_recorded_and_replayed_without_the_model(tmp_path):
    cassette = tmp_path / "points.jsonl"
    at = pixels()
    with ScriptedServer(points(("apple", *at["red_cube"]))) as server, session_on(server, cassette) as session:
        first = session.observe()
    assert "sk-test" not in cassette.read_text() and "base64" not in cassette.read_text()
    with session_on(None, cassette) as session:
        again = session.observe()
    assert [(a.id, a.pose.xyz) for a in first.objects] == [(a.id, a.pose.xyz) for a in again.objects]


@pytest.mark.gl
def test_a_model_that_does_not_answer_or_answers_nonsense_is_told():
    with (
        ScriptedServer(fails(503, "down")) as server,
        session_on(server, time_limit=0.3) as session,
        pytest.raises(PlannerUnavailableError),
    ):
        session.observe()
    nonsense = tool_calls(("point", '{"objects": [{"name": "", "x": "left"}]}'))
    with (
        ScriptedServer(*[nonsense] * 4) as server,
        session_on(server) as session,
        pytest.raises(PlannerAnswerError, match="no usable answer in 4 turns"),
    ):
        session.observe()


def test_vlm_is_installed_and_wants_a_model(capsys):
    assert load_plugin("perceptions", "vlm") is not None
    assert run_app(app, "robo-sandbox", ["look", "--perception", "vlm"]) == 2
    error = capsys.readouterr().err
    assert error.count("\n") == 1 and "ROBOSANDBOX_VLM_MODEL" in error


@pytest.mark.gl
def test_look_takes_the_model_from_options_or_the_environment(monkeypatch, capsys):
    at = pixels()
    arguments = ["look", "--task", "pick_from_three", "--perception", "vlm"]
    with ScriptedServer(*[points(("apple", *at["red_cube"]))] * 2) as server:
        assert run_app(app, "robo-sandbox", [*arguments, "--model", "scripted", "--base-url", server.url]) == 0
        assert "apple" in capsys.readouterr().out
        monkeypatch.setenv("ROBOSANDBOX_VLM_MODEL", "scripted")
        monkeypatch.setenv("ROBOSANDBOX_VLM_URL", server.url)
        assert run_app(app, "robo-sandbox", arguments) == 0
        assert "apple" in capsys.readouterr().out
