"""Previews on the twin, asking first, and the workspace that no planner can pass."""

import io
import json
from importlib import resources
from pathlib import Path

import numpy as np
import pytest

from robosandbox.agent.preview import preview
from robosandbox.apps.cli import app
from robosandbox.apps.commands.console import EXIT_DONE, EXIT_FAILED, EXIT_USAGE, run_app
from robosandbox.errors import ErrorCode, LimitError
from robosandbox.evidence import LimitEvidence
from robosandbox.tasks.loader import find_task
from robosandbox.tasks.task import Task
from robosandbox.types import Limits, Plan, Pose, SkillCall, Workspace
from robosandbox.workcell.embedded import EmbeddedWorkcell
from robosandbox.workcell.session import open_session


def sandbox(*arguments: str) -> int:
    return run_app(app, "robo-sandbox", arguments)


def plan(skill: str, **arguments: object) -> Plan:
    return Plan(steps=(SkillCall(skill=skill, arguments=dict(arguments)),))


def bounded(**bounds: tuple[float, float]) -> Task:
    limits = Limits(workspace=Workspace.model_validate(bounds))
    return find_task("put_in_bin").model_copy(update={"limits": limits})


def test_preview_says_what_happens_and_leaves_the_world_alone() -> None:
    with open_session("pick_cube_franka") as session:
        before = session.simulation.snapshot()
        tried = preview(session.ctx, plan("pick", object="red_cube"), session.agent.skills)
        assert tried.success and float(tried.steps[0][1].detail["dz_mm"]) > 50.0 and tried.seconds > 1.0
        np.testing.assert_array_equal(session.simulation.snapshot(), before)
        assert session.run().success


def test_preview_of_what_cannot_work_carries_the_error() -> None:
    with open_session("pick_cube_franka") as session:
        tried = preview(session.ctx, plan("pick", object="elephant"), session.agent.skills)
    assert not tried.success and tried.error is not None and tried.error.code == ErrorCode.OBJECT_NOT_FOUND


def test_dry_run_prints_plan_and_preview_and_moves_nothing(capsys: pytest.CaptureFixture[str]) -> None:
    assert sandbox("run", "--task", "put_in_bin", "--dry-run") == EXIT_DONE
    assert "place_in(container=grey_bin): would work" in capsys.readouterr().out
    assert sandbox("run", "--task", "put_in_bin", "--dry-run", "--json") == EXIT_DONE
    document = json.loads(capsys.readouterr().out)
    assert document["preview"]["success"] and [step["skill"] for step in document["plan"]] == ["pick", "place_in"]
    assert sandbox("run", "pick up the elephant", "--dry-run") == EXIT_FAILED
    assert capsys.readouterr().out.startswith("refused (object_not_found)")


@pytest.mark.parametrize(("answer", "code", "said"), [("y\n", EXIT_DONE, "done: "), ("n\n", EXIT_FAILED, "declined: ")])
def test_confirm_shows_the_preview_and_asks(
    answer: str, code: int, said: str, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr("sys.stdin", io.StringIO(answer))
    assert sandbox("run", "--task", "pick_cube_franka", "--confirm") == code
    out, err = capsys.readouterr()
    assert out.startswith(said) and "pick(object=red_cube): would work" in err and "carry it out?" in err


def test_confirm_without_an_answer_moves_nothing(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr("sys.stdin", io.StringIO(""))
    assert sandbox("run", "--task", "pick_cube_franka", "--confirm", "--json") == EXIT_FAILED
    document = json.loads(capsys.readouterr().out)
    assert document["final_reason"] == "declined" and document["steps"] == [] and document["sim_secs"] < 1.0


def test_confirm_with_the_prompt_from_stdin_is_refused(capsys: pytest.CaptureFixture[str]) -> None:
    assert sandbox("run", "-", "--confirm") == EXIT_USAGE
    assert "--confirm" in capsys.readouterr().err


def still(session: EmbeddedWorkcell, call: SkillCall) -> LimitError:
    """Return the error of a call, having checked that nothing has moved."""
    before = session.simulation.snapshot()
    with pytest.raises(LimitError) as caught:
        session.agent.perform(call)
    np.testing.assert_array_equal(session.simulation.snapshot(), before)
    return caught.value


@pytest.mark.parametrize(
    "call",
    [
        SkillCall(skill="place_at", arguments={"x": 0.1, "y": 0.3}),
        SkillCall(skill="pick", arguments={"object": "grey_bin"}),
        SkillCall(skill="push", arguments={"object": "red_cube", "direction": "left", "distance": 0.4}),
    ],
)
def test_a_call_that_leads_outside_the_workspace_moves_nothing(call: SkillCall) -> None:
    with open_session(bounded(y=(-0.3, 0.1))) as session:
        error = still(session, call)
    assert isinstance(error.evidence, LimitEvidence) and (error.evidence.low, error.evidence.high) == (-0.3, 0.1)
    assert "limits.workspace" in error.message


def test_a_limit_holds_whoever_calls_the_skill() -> None:
    with open_session(bounded(y=(-0.3, 0.1))) as session:
        before = session.simulation.snapshot()
        with pytest.raises(LimitError):
            session.agent.perform(SkillCall(skill="pick", arguments={"object": "grey_bin"}))
        np.testing.assert_array_equal(session.simulation.snapshot(), before)


def test_the_arm_stops_at_the_border_whatever_is_planned() -> None:
    """The bin's place is allowed, but the way there is over the ceiling of the workspace."""
    with open_session(bounded(z=(0.0, 0.3))) as session:
        height = session.driver.state().tcp_pose.xyz[2]
        assert height > 0.31, "home is above the ceiling, where the arm may only go down"
        heights: list[float] = []
        session.driver.subscribe(lambda: heights.append(session.driver.state().tcp_pose.xyz[2]))
        assert session.run("pick up the red cube").success
        rising = session.run("go home")
        assert rising.error is not None and rising.error.code == ErrorCode.LIMIT
        lowest = int(np.argmin(heights))
        assert max(heights[lowest:]) < 0.32


def test_limits_of_the_sidecar_hold_in_every_task(tmp_path: Path) -> None:
    bundled = Path(str(resources.files("robosandbox.robots") / "franka_panda"))
    for file in bundled.iterdir():
        if file.is_file():
            (tmp_path / file.name).write_bytes(file.read_bytes())
    sidecar = tmp_path / "panda.robosandbox.yaml"
    # Half of what a cube of 50 g weighs.
    sidecar.write_text(sidecar.read_text() + "\nlimits: {max_force_n: 0.25}\n")
    with open_session("pick_cube_franka", robot=tmp_path / "panda.xml", what_if=False) as session:
        episode = session.run()
    assert episode.error is not None and episode.error.code == ErrorCode.LIMIT
    assert isinstance(episode.error.evidence, LimitEvidence) and episode.error.evidence.high == 0.25


def test_limits_that_limit_nothing_are_refused() -> None:
    with pytest.raises(ValueError, match="limits nothing"):
        Limits()


def test_without_limits_the_same_plan_works() -> None:
    with open_session("put_in_bin") as session:
        assert session.run().success


def test_the_task_file_takes_limits() -> None:
    task = bounded(x=(-0.2, 0.5))
    assert Task.model_validate(task.model_dump(mode="json")).limits == task.limits
    with pytest.raises(ValueError, match="is empty"):
        Workspace(x=(0.5, 0.1))


def test_a_planned_place_outside_is_refused_in_the_episode() -> None:
    with open_session(bounded(y=(-0.3, 0.1))) as session:
        start = Pose(xyz=session.start.objects["red_cube"].pose.xyz)
        episode = session.run("put the red cube in the bin")
        assert not episode.success and episode.error is not None and episode.error.code == ErrorCode.LIMIT
        assert start.xyz[1] < 0.1
