"""The user's own pages, word for word: their programs, YAML, commands, printed lines and lists are true.

The pages are read when the tests run; only paths are replaced, by those of a copy of the bundled Panda.
"""

import ast
import os
import re
import shlex
import shutil
import subprocess
import sys
from collections.abc import Iterator
from functools import cache
from importlib import import_module
from pathlib import Path
from typing import Any

import pytest
import yaml
from support.seed_pages import (
    BRING,
    COMMAND,
    EACH_PAGE,
    PAGES,
    PANDA,
    ROOT,
    SEEDS,
    TUTORIAL,
    Page,
    own,
    sidecars,
    tasks,
)

from robosandbox.robots.sidecar import Sidecar
from robosandbox.sim.mujoco_backend import MuJoCoBackend
from robosandbox.tasks.loader import find_task
from robosandbox.tasks.task import Task
from robosandbox.types import Scene

PROGRAMS = {"robo-sandbox": "main", "robo-sandbox-bench": "bench_main"}


@pytest.fixture(scope="module")
def reader(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with the Panda as somebody's own robot, and a copy of the package that task files are dropped into."""
    folder = tmp_path_factory.mktemp("reader")
    shutil.copytree(PANDA, folder, dirs_exist_ok=True)
    shutil.copytree(ROOT / "src", folder / "src", ignore=shutil.ignore_patterns("__pycache__", "*.egg-info"))
    for page in PAGES:
        for text in tasks(page):
            name = yaml.safe_load(text)["name"]
            for place in (folder, folder / "src" / "robosandbox" / "tasks" / "definitions"):
                (place / f"{name}.yaml").write_text(own(text, folder))
    return folder


@cache
def run(line: str, folder: Path) -> subprocess.CompletedProcess[str]:
    """Run a command as the page's reader does, with the copied package; what it prints is kept for other tests."""
    words = shlex.split(line.removeprefix("uv run "))
    command = [sys.executable, "-c", f"from robosandbox.apps.cli import {PROGRAMS[words[0]]} as run; run()", *words[1:]]
    return _in(folder, command)


def _in(folder: Path, command: list[str]) -> subprocess.CompletedProcess[str]:
    variables = {**os.environ, "PYTHONPATH": str(folder / "src")}
    return subprocess.run(command, cwd=folder, capture_output=True, text=True, timeout=300, env=variables)


def test_pages_hold_what_is_tested_here() -> None:
    assert {page.name for page in PAGES} >= {"bring-your-own-robot", "custom-arm-tutorial"}
    assert (len(BRING.programs), len(TUTORIAL.programs)) == (1, 3)
    for page in PAGES:
        assert len(sidecars(page)) == 1 and len(tasks(page)) == 1 and len(page.outputs()) == 1, page.name
    assert len(_commands()) >= 3


# Programs.


@EACH_PAGE
def test_each_import_is_public_and_called_so(page: Page) -> None:
    for node in (node for text in page.programs for node in ast.walk(ast.parse(text))):
        if isinstance(node, ast.ImportFrom):
            for alias in node.names:
                found = getattr(import_module(str(node.module)), alias.name)
                assert found.__name__ == alias.name, f"{node.module}.{alias.name} is another name of {found.__name__}"


def test_program_in_python_builds_a_scene_that_loads(reader: Path) -> None:
    load = re.search(r"(\w+)\.load\(scene\)", BRING.text)
    assert load is not None
    module = next(m[1] for m in re.finditer(r"from (\S+) import (\w+)", TUTORIAL.programs[1]) if m[2] == load[1])
    namespace: dict[str, Any] = {}
    exec(own(BRING.programs[0], reader), namespace)
    exec(f"from {module} import {load[1]}\nsim = {load[1]}()\nsim.load(scene)", namespace)
    with namespace["sim"] as sim:
        assert isinstance(namespace["scene"], Scene) and sim.robot.name == "panda"
        assert [item.id for item in sim.scene.objects] == ["red_cube"]


def test_sidecar_beside_the_model_is_found(reader: Path) -> None:
    program = own(TUTORIAL.programs[0].replace("(...)", "()"), reader)
    named: dict[str, Any] = {}
    exec(program, named)
    left_out: dict[str, Any] = {}
    exec("\n".join(line for line in program.splitlines() if "robot_config=" not in line), left_out)
    assert "<stem>.robosandbox.yaml" in TUTORIAL.text and left_out["scene"].robot_config is None
    homes = []
    for namespace in (named, left_out):
        with MuJoCoBackend() as sim:
            sim.load(namespace["scene"])
            assert sim.robot.files is not None and sim.robot.files.sidecar == reader / "panda.robosandbox.yaml"
            homes.append(sim.robot.home_q.tolist())
    assert homes[0] == homes[1] == yaml.safe_load(sidecars(TUTORIAL)[0])["arm"]["home_qpos"]


def test_tutorial_prints_what_it_says(reader: Path) -> None:
    done = _in(reader, [sys.executable, "-c", own(TUTORIAL.programs[1], reader)])
    assert done.stdout.splitlines() == TUTORIAL.outputs()[0], done.stderr


class _OwnTask(ast.NodeTransformer):
    """Puts a loaded task's scene and prompt in place of those that a program writes out."""

    def visit_Assign(self, node: ast.Assign) -> ast.AST:
        if isinstance(node.targets[0], ast.Name) and node.targets[0].id == "scene":
            node.value = ast.parse("task.scene", mode="eval").body
        return self.generic_visit(node)

    def visit_Call(self, node: ast.Call) -> ast.AST:
        if isinstance(node.func, ast.Attribute) and node.func.attr == "run":
            node.args = [ast.parse("task.prompt", mode="eval").body]
        return self.generic_visit(node)


def test_loaded_task_runs_with_the_same_agent(reader: Path) -> None:
    assert "agent.run(task.prompt)" in TUTORIAL.programs[2]
    setup = ast.unparse(_OwnTask().visit(ast.parse(own(TUTORIAL.programs[1], reader))))
    head, _, main = setup.partition("if __name__")
    done = _in(reader, [sys.executable, "-c", f"{head}\n{TUTORIAL.programs[2]}\nif __name__{main}"])
    assert done.stdout.splitlines() == TUTORIAL.outputs()[0], done.stderr


# Commands.


def _commands() -> list[str]:
    return sorted({match.removeprefix("uv run ") for page in PAGES for match in COMMAND.findall(page.text)})


def _shape(lines: list[str]) -> list[str]:
    """Return lines with digits as 0, a number's width in the detail free: what stays is columns and formats."""
    shaped = []
    for line in lines:
        head, equals, detail = line.partition("=")
        shaped.append(re.sub(r"\d", "0", head) + equals + re.sub(r"\d+(?=\.)", "0", re.sub(r"\d", "0", detail)))
    return shaped


@pytest.mark.parametrize("command", [line for line in _commands() if line.startswith("robo-sandbox-bench")])
def test_bench_prints_the_table_as_shown(command: str, reader: Path) -> None:
    (shown,) = BRING.outputs()
    done = run(command, reader)
    printed = done.stdout.splitlines()
    assert printed[:2] == shown[:2], done.stderr
    if "pick_cube_franka" in command:
        assert done.returncode == 0
        assert _shape([line for line in printed if line]) == _shape(shown)
        (rise, least), (expected, needed) = (map(float, re.findall(r"=([\d.]+)", row[2])) for row in (printed, shown))
        # The height to which an arm lifts is its planner's own; the threshold is the task's.
        assert least == needed and rise == pytest.approx(expected, abs=20.0)
        assert printed[-1] == shown[-1]
    else:
        row, summary = printed[2], printed[-1]
        assert row.split()[:2] == [command.split("--tasks ")[1].split()[0], "0"], done.stderr
        assert re.search(r"OK +\d+\.\d +\d+ dz_mm=\d+\.\d{3}, min_mm=50\.000", row), row
        assert summary == "SUMMARY: 1/1 successful"


@EACH_PAGE
def test_task_dropped_into_the_definitions_runs_in_the_bench(page: Page, reader: Path) -> None:
    name = yaml.safe_load(tasks(page)[0])["name"]
    dropped = run(f"robo-sandbox-bench --tasks {name} --seeds 1", reader)
    alone = run(f"robo-sandbox-bench --task-file {name}.yaml", reader)
    rows = [re.sub(r" +\d+\.\d ", " ", done.stdout.splitlines()[2]) for done in (dropped, alone)]
    # The cube of the first page stands on the table's very edge: it falls, and is picked from the floor.
    assert rows[0] == rows[1] and re.match(rf"{name} .* OK ", rows[0]), dropped.stderr
    assert dropped.returncode == alone.returncode == 0


def test_viewer_command_takes_what_the_page_gives(reader: Path) -> None:
    (command,) = (line for line in _commands() if line.startswith("robo-sandbox viewer"))
    done = run(f"{command} --help", reader)
    assert done.returncode == 0 and "--task" in done.stdout, done.stderr
    assert find_task(command.split("--task ")[1]).name in command


# Sidecars and tasks.


@EACH_PAGE
def test_sidecar_loads_field_for_field(page: Page) -> None:
    (text,) = sidecars(page)
    shown, bundled = yaml.safe_load(text), yaml.safe_load((PANDA / "panda.robosandbox.yaml").read_text())
    loaded = Sidecar.model_validate(shown).model_dump(mode="json")
    assert list(_leaves(shown)), text
    for place, value in _leaves(shown):
        assert _at(loaded, place) == value, f"{'.'.join(place)} loads as {_at(loaded, place)}"
        assert _at(bundled, place) == value, f"{'.'.join(place)} is {_at(bundled, place)} in the bundled sidecar"


@EACH_PAGE
def test_task_loads_field_for_field(page: Page, reader: Path) -> None:
    (text,) = tasks(page)
    shown = yaml.safe_load(own(text, reader))
    loaded = Task.model_validate(shown).model_dump(mode="json")
    for place, value in _leaves(shown):
        assert _at(loaded, place) == value, ".".join(map(str, place))


def _leaves(data: Any, place: tuple[Any, ...] = ()) -> Iterator[tuple[tuple[Any, ...], Any]]:
    if isinstance(data, dict):
        for key, value in data.items():
            yield from _leaves(value, (*place, key))
    elif isinstance(data, list) and data and isinstance(data[0], dict):
        for key, value in enumerate(data):
            yield from _leaves(value, (*place, key))
    else:
        yield place, data


def _at(data: Any, place: tuple[Any, ...]) -> Any:
    for step in place:
        data = data[step]
    return data


def test_each_tip_and_symptom_has_its_rows_in_the_table() -> None:
    tips = [*BRING.after("Symptom Likely cause"), *TUTORIAL.after("Debugging tips")]
    page = (ROOT / "docs" / "troubleshooting.md").read_text(encoding="utf-8")
    table = page.partition("| what one sees | what was broken |")[2].partition("\n\n")[0]
    rows = {line.split("|")[1].strip() for line in table.splitlines()[2:]}
    assert len(tips) == 8
    for tip in tips:
        assert [row for row in rows if tip.strip(" •").startswith(row)], tip
    for row in rows:
        assert [tip for tip in tips if tip.strip(" •").startswith(row)], row


# A page that is no longer true is noticed: each test named here fails on pages with one word changed. Changes that are noticed
# by different tests are made together, since a run of the tests costs more than what they do.
FILES = [str(Path(__file__).with_name(name)) for name in ("test_seeds.py", "test_seed_fields.py")]
CHANGED = (
    {
        "import": ("import AnalyticTopDown", "import AnalyticTopDowns", "public_and_called_so", 1),
        "field of a sidecar": ("primary_joint: finger", "main_joint: finger", "sidecar_loads", 2),
        "field of a task": ("min_mm: 50", "min_millimetres: 50", "task_loads", 2),
        "listed field": ("• arm.joints —", "• arm.joint_names —", "list_of_fields", 1),
        "printed column": ("REPLANS DETAIL", "REPLANNED DETAIL", "table_as_shown and pick_cube_franka", 1),
        "option of a command": ("--task pick_cube_franka", "--tasks pick_cube_franka", "viewer_command", 1),
        "table of symptoms": ("Arm drives through the table", "Arm dives through the table", "each_tip", 1),
    },
    {
        "imported module": ("robosandbox.motion.ik", "robosandbox.motion.iks", "public_and_called_so", 1),
        "value of a sidecar": ("0.1034]", "0.1134]", "sidecar_loads", 2),
        "printed format": ("dz_mm=166.905", "dz_mm=166.9", "table_as_shown and pick_cube_franka", 1),
    },
    {"argument": ("n_waypoints=160", "n_way_points=160", "tutorial_prints", 1)},
    {"printed word": ("reason=plan_complete", "reason=complete", "tutorial_prints", 1)},
)


@pytest.mark.skipif("ROBOSANDBOX_SEEDS" in os.environ, reason="these pages are changed already")
@pytest.mark.parametrize("changes", CHANGED, ids=", ".join)
@pytest.mark.slow
def test_changed_page_is_noticed(changes: dict[str, tuple[str, str, str, int]], tmp_path: Path) -> None:
    for path in SEEDS.glob("*.txt"):
        text = path.read_text()
        for old, new, _, _ in changes.values():
            text = text.replace(old, new)
        (tmp_path / path.name).write_text(text)
    chosen = " or ".join(f"({expression})" for _, _, expression, _ in changes.values())
    command = [sys.executable, "-m", "pytest", "-q", "-p", "no:cacheprovider", "-rf", *FILES, "-k", chosen]
    variables = {**os.environ, "ROBOSANDBOX_SEEDS": str(tmp_path)}
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, timeout=300, env=variables)
    failed = [line for line in done.stdout.splitlines() if line.startswith("FAILED ")]
    for name, (_, _, expression, failures) in changes.items():
        noticed = [line for line in failed if all(word in line for word in expression.split(" and "))]
        assert len(noticed) == failures, (name, done.stdout)
