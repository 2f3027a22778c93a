"""The programs: exit codes, one-line errors, one JSON document on stdout."""

import io
import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

from robosandbox.apps.cli import app
from robosandbox.apps.commands import bench
from robosandbox.apps.commands.console import EXIT_DONE, EXIT_FAILED, EXIT_UNAVAILABLE, EXIT_USAGE, run_app
from robosandbox.suggestions import did_you_mean
from robosandbox.tasks.loader import bundled_tasks

TUTORIAL = """\
name: pick_cube_myarm
prompt: "pick up the red cube"
scene:
  robot_urdf: "{model}"
  robot_config: "{sidecar}"
  objects:
    - id: red_cube
      kind: box
      size: [0.012, 0.012, 0.012]
      pose:
        xyz: [0.4, 0.0, 0.06]
      rgba: [0.85, 0.2, 0.2, 1.0]
      mass: 0.05
success:
  kind: lifted
  object: red_cube
  min_mm: 50
"""


def sandbox(*arguments: str) -> int:
    return run_app(app, "robo-sandbox", arguments)


def run_bench(*arguments: str) -> int:
    return run_app(bench.app, "robo-sandbox-bench", bench.split_lists(arguments))


@pytest.mark.parametrize(
    ("arguments", "named"),
    [
        (["run"], ["prompt: is missing", "--task"]),
        (["run", " "], ["prompt: is empty"]),
        (["run", "x" * 10_000_000], ["prompt", "10,000,000 characters", "a sentence or two"]),
        (["run", "go home", "--task", "pick_cube_frank"], ["'pick_cube_frank'", "did you mean 'pick_cube_franka'"]),
        (["run", "go home", "--robot", "franka"], ["robot_urdf", "'franka'", "did you mean 'franka_panda'"]),
        (["run", "go home", "--planner", "stubb"], ["'stubb'", "did you mean 'stub'"]),
        (["run", "go home", "--perception", "truth"], ["'truth'", "ground_truth"]),
        (["run", "go home", "--seed", "-1"], ["--seed: -1", "0 or more"]),
        (["run", "go home", "--seed", "x"], ["--seed", "got 'x'", "robo-sandbox run --help"]),
        (["run", "go home", "--sede", "1"], ["--sede", "robo-sandbox run --help"]),
        (["run", "go", "home"], ["the prompt ends after 'go'", "in quotes", "robo-sandbox run --help"]),
        (["run", "go home", "--seed"], ["--seed", "robo-sandbox run --help"]),
        (["tasks", "show", "home", "stack_two"], ["stack_two", "robo-sandbox tasks show --help"]),
        (["run", "go home", "--task", "nope"], ["no task 'nope'"]),
        (["look", "--picture", "seen.txt"], ["'seen.txt' does not end in .png"]),
        (["look", "--picture", "gone/seen.png"], ["no folder 'gone'"]),
        (["plam", "go home"], ["'plam'", "plan"]),
        (["tasks", "show", "stack_tow"], ["did you mean 'stack_two'"]),
        (["tasks", "show", "gone.yaml"], ["gone.yaml: no such file"]),
        (["plan", "--steps", "gone.json"], ["--steps: gone.json: No such file or directory; give a file"]),
        (["plan", "x", "--planner", "openai", "--model", "m", "--model-limits", "x.yaml"], ["x.yaml: no such file"]),
    ],
)
def test_wrong_input_is_one_line_and_exit_2(
    arguments: list[str], named: list[str], capsys: pytest.CaptureFixture[str]
) -> None:
    assert sandbox(*arguments) == EXIT_USAGE
    out, err = capsys.readouterr()
    assert out == "" and err.count("\n") == 1 and len(err) < 500 and "Traceback" not in err
    assert [part for part in named if part not in err] == [], err


@pytest.mark.parametrize(
    ("arguments", "named"),
    [
        (["--seeds", "0"], ["--seeds: 0", "1 or more"]),
        (["--seeds", "x"], ["--seeds"]),
        (["--jobs", "0"], ["--jobs: 0"]),
        (["--max-replans", "-1"], ["--max-replans: -1"]),
        (["--tasks", "pick_cube_frank"], ["did you mean 'pick_cube_franka'"]),
        (["--tasks", "t.yaml"], ["t.yaml: no such file"]),
        (["pick_cube_frank"], ["did you mean 'pick_cube_franka'"]),
        (["home", "--json", "--seeds", "1"], ["--json", "takes a file", "'--seeds' is an option"]),
        (["home", "--json", "rows", "--resume", "./rows"], ["--json: 'rows' is the file of --resume"]),
        (["--tasks", "home", "--json", "/no/such/folder/x.json"], ["--json", "does not exist"]),
        (["--tasks", "home", "--planner", "oracle"], ["'oracle'", "stub"]),
        (["--task-file", "gone.yaml"], ["gone.yaml: no such file"]),
    ],
)
def test_wrong_input_to_the_bench_is_one_line_and_exit_2(
    arguments: list[str], named: list[str], capsys: pytest.CaptureFixture[str]
) -> None:
    assert run_bench(*arguments) == EXIT_USAGE
    out, err = capsys.readouterr()
    assert out == "" and err.count("\n") == 1
    assert [part for part in named if part not in err] == [], err


@pytest.mark.parametrize("group", [[], ["tasks"], ["runs"], ["export"], ["robot"]], ids=" ".join)
def test_a_group_of_commands_by_itself_lists_them(group: list[str], capsys: pytest.CaptureFixture[str]) -> None:
    assert sandbox(*group) == EXIT_DONE
    out, err = capsys.readouterr()
    assert "Commands:" in out and err == ""


def test_ctrl_c_is_told_in_a_line(capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch) -> None:
    def interrupted() -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr("robosandbox.tasks.bundled.task_entries", interrupted)
    assert sandbox("tasks", "list") == 130
    assert capsys.readouterr() == ("", "robo-sandbox: interrupted\n")


@pytest.mark.parametrize("arguments", [["--robot=~/arm.urdf"], ["--robot", "~/arm.urdf"]], ids=["joined", "apart"])
def test_a_tilde_that_the_shell_left_is_the_home_folder(
    arguments: list[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setenv("HOME", str(tmp_path))
    assert sandbox("run", "go home", *arguments) == EXIT_USAGE
    assert f"'{tmp_path}/arm.urdf' is neither a file" in capsys.readouterr().err


def test_a_name_with_nothing_near_gets_no_suggestion() -> None:
    assert did_you_mean("foo", ["hardware", "mujoco"]) == "" == did_you_mean("nope", ["open_drawer"])
    assert did_you_mean("pick_three", ["pick_cube_franka", "pick_cube_scrambled", "pick_from_three"]).startswith(
        "; did you mean 'pick_from_three'"
    )


def test_ten_megabytes_on_stdin_are_refused(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(sys, "stdin", io.StringIO("pick " * 2_000_000))
    assert sandbox("run", "-") == EXIT_USAGE
    assert "more than 4,000 characters" in capsys.readouterr().err


def test_run_prints_one_json_document_and_tells_phases_on_stderr(capsys: pytest.CaptureFixture[str]) -> None:
    assert sandbox("run", "--task", "pick_cube_franka", "--json") == EXIT_DONE
    out, err = capsys.readouterr()
    document = json.loads(out)
    assert document["success"] and document["judged"]["success"] and document["final_reason"] == "plan_complete"
    assert "pick(object=red_cube)" in err and "grasp" in err


def test_run_reads_the_prompt_from_stdin(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    monkeypatch.setattr(sys, "stdin", io.StringIO("go home\n"))
    assert sandbox("run", "-") == EXIT_DONE
    assert capsys.readouterr().out.startswith("done: home()")


def test_refused_prompt_is_exit_1_with_the_reason(capsys: pytest.CaptureFixture[str]) -> None:
    assert sandbox("run", "pick up the purple elephant") == EXIT_FAILED
    assert capsys.readouterr().out.startswith("refused: ")


def test_plan_prints_calls_and_moves_nothing(capsys: pytest.CaptureFixture[str]) -> None:
    assert sandbox("plan", "pick up the red cube", "--task", "pick_cube_franka") == EXIT_DONE
    assert capsys.readouterr().out == "1. pick(object=red_cube)\n"
    assert sandbox("plan", "pick up the elephant", "--json") == EXIT_FAILED
    document = json.loads(capsys.readouterr().out)
    assert document["plan"] is None and document["refusal"]["code"] == "object_not_found"


def test_plan_as_json_has_a_plan_or_a_refusal_and_nothing_else(capsys: pytest.CaptureFixture[str]) -> None:
    assert sandbox("plan", "pick up the red cube", "--task", "pick_cube_franka", "--json") == EXIT_DONE
    steps = [{"skill": "pick", "arguments": {"object": "red_cube"}}]
    assert json.loads(capsys.readouterr().out) == {
        "plan": steps,
        "answer": "",
        "then": "",
        "note": "",
        "refusal": None,
        "model_usage": None,
    }
    assert sandbox("plan", "pick up the elephant", "--task", "pick_cube_franka", "--json") == EXIT_FAILED
    document = json.loads(capsys.readouterr().out)
    assert document.keys() == {"plan", "answer", "then", "note", "refusal", "model_usage"}
    assert document["refusal"].keys() == {"code", "message", "candidates", "sure"}


def test_tasks_list_names_all_thirteen(capsys: pytest.CaptureFixture[str]) -> None:
    assert sandbox("tasks", "list", "--json") == EXIT_DONE
    assert [item["name"] for item in json.loads(capsys.readouterr().out)] == list(bundled_tasks())
    assert len(bundled_tasks()) >= 13


def test_what_tasks_show_prints_is_a_task_file(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert sandbox("tasks", "show", "home") == EXIT_DONE
    shown = capsys.readouterr().out
    (tmp_path / "home.yaml").write_text(shown)
    assert sandbox("tasks", "show", str(tmp_path / "home.yaml")) == EXIT_DONE
    assert capsys.readouterr().out == shown


def test_bench_of_the_readme_prints_table_and_summary(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    rows = tmp_path / "rows.json"
    assert run_bench("--tasks", "pick_cube_franka", "--seeds", "1", "--json", str(rows)) == EXIT_DONE
    lines = capsys.readouterr().out.splitlines()
    assert lines[0] == "TASK               SEED  RESULT   SECS  REPLANS DETAIL" and lines[1] == "-" * 72
    assert lines[2].startswith("pick_cube_franka   0     OK   ") and "dz_mm=" in lines[2]
    assert lines[3:] == ["", "SUMMARY: 1/1 successful"]
    (row,) = json.loads(rows.read_text())
    assert row["success"] and row["claimed"] and row["assists"] == [] and row["versions"]["mujoco"]


def test_the_bench_takes_tasks_without_an_option(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    own = tmp_path / "my_home.yaml"
    own.write_text(bundled_tasks()["home"].read_text().replace("name: home", "name: my_home"))
    assert run_bench("home", str(own)) == EXIT_DONE
    assert [line.split()[0] for line in capsys.readouterr().out.splitlines()[2:4]] == ["home", "my_home"]
    assert run_bench("--tasks", str(own)) == EXIT_DONE
    assert "SUMMARY: 1/1 successful" in capsys.readouterr().out


def test_bench_writes_rows_to_stdout_and_the_table_to_stderr(capsys: pytest.CaptureFixture[str]) -> None:
    assert run_bench("--tasks", "home", "--json", "-") == EXIT_DONE
    out, err = capsys.readouterr()
    assert [row["task"] for row in json.loads(out)] == ["home"] and "SUMMARY" in err


def test_tutorial_yaml_runs_with_paths_relative_to_it(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    from robosandbox.robots.loader import resolve_robot

    panda = resolve_robot(None)
    (tmp_path / "my_arm.xml").write_text(panda.read_text())
    (tmp_path / "my_arm.robosandbox.yaml").write_text((panda.parent / f"{panda.stem}.robosandbox.yaml").read_text())
    task = tmp_path / "pick_cube_myarm.yaml"
    task.write_text(TUTORIAL.format(model="my_arm.xml", sidecar="my_arm.robosandbox.yaml"))
    assert run_bench("--task-file", str(task)) == EXIT_DONE
    assert "SUMMARY: 1/1 successful" in capsys.readouterr().out


def test_a_file_dropped_into_the_definitions_is_benched(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    bundled = bundled_tasks()["pick_cube_franka"].read_text()
    (tmp_path / "my_pick.yaml").write_text(bundled.replace("pick_cube_franka", "my_pick"))
    monkeypatch.setattr("robosandbox.tasks.bundled.definitions_folder", lambda: tmp_path)
    assert run_bench("--tasks", "my_pick") == EXIT_DONE
    assert "my_pick " in capsys.readouterr().out


def test_a_scene_that_cannot_start_is_one_line_with_the_task(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    text = bundled_tasks()["pick_cube_franka"].read_text()
    (tmp_path / "sunk.yaml").write_text(text.replace("pick_cube_franka", "sunk").replace("0.06]", "0.03]"))
    assert run_bench("--task-file", str(tmp_path / "sunk.yaml")) == EXIT_USAGE
    out, err = capsys.readouterr()
    assert out == "" and err.count("\n") == 1 and "sunk: " in err and "red_cube" in err and "'table'" in err


def test_help_needs_no_physics() -> None:
    code = (
        "import sys; sys.argv = ['robo-sandbox', '--help']\n"
        "from robosandbox.apps.cli import main\n"
        "try:\n    main()\nexcept SystemExit as end:\n    assert end.code == 0\n"
        "heavy = {'mujoco', 'cv2', 'yourdfpy', 'trimesh', 'zenoh'} & set(sys.modules)\n"
        "assert not heavy, heavy\n"
    )
    subprocess.run([sys.executable, "-c", code], check=True, capture_output=True)


def test_a_renderer_that_mujoco_does_not_load_with_is_one_line_with_the_remedy() -> None:
    code = "import sys; sys.argv = ['robo-sandbox', 'robot', 'check', 'nothing.xml']; from robosandbox.apps.cli import main; main()"
    result = subprocess.run(
        [sys.executable, "-c", code], env={**os.environ, "MUJOCO_GL": "bogus"}, capture_output=True, text=True
    )
    assert result.returncode == EXIT_UNAVAILABLE
    assert result.stderr.count("\n") == 1
    assert "MUJOCO_GL=bogus" in result.stderr
    assert "unset it" in result.stderr


def test_a_mesh_name_that_no_file_system_takes_is_one_line(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    model = tmp_path / "arm.xml"
    model.write_text(
        f'<mujoco><compiler meshdir="assets"/><asset><mesh name="m" file="{"a" * 3000}.stl"/></asset>'
        '<worldbody><body><joint axis="0 0 1"/><geom type="mesh" mesh="m"/></body></worldbody></mujoco>'
    )
    assert sandbox("robot", "infer", str(model)) == EXIT_USAGE
    assert capsys.readouterr().err.count("\n") == 1
