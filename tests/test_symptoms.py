"""docs/troubleshooting.md tells what a wrong sidecar looks like: each row is broken on purpose and says what is written.

A row's last two cells hold, in backticks, what `run` and `robot check` print; the bench says the same as `run`.
"""

import re
import shutil
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import pytest
import yaml

from robosandbox.apps.cli import app
from robosandbox.apps.commands import bench
from robosandbox.apps.commands.console import run_app

ROOT = Path(__file__).resolve().parents[1]
PAGE = ROOT / "docs" / "troubleshooting.md"
PANDA = ROOT / "robots" / "franka_panda"
HEADER = "| what one sees | what was broken |"
NEAR, TOO_FAR = 0.15, 1.2

Change = Callable[[dict[str, Any]], object]


def _arm(**values: Any) -> Change:
    return lambda side: side["arm"].update(values)


def _tcp(*xyz: float) -> Change:
    return lambda side: side["ee_site"]["inject"].update(xyz=list(xyz))


def _base(*xyz: float) -> Change:
    return lambda side: side["base_pose"].update(xyz=list(xyz))


def _gripper(**values: Any) -> Change:
    return lambda side: side["gripper"].update(values)


def _skip(*lists: str) -> Change:
    return lambda side: [side["arm"][name].pop(3) for name in lists]


# What was broken, in the page's words: where the cube lies along x in metres, and the change to the Panda's sidecar.
BROKEN: Mapping[str, tuple[float, Change]] = {
    "`home_qpos` stretched out": (NEAR, _arm(home_qpos=[0, 0, 0, -0.07, 0, 1.57, -0.785])),
    "`ee_site` 60 mm to the side": (NEAR, _tcp(0, 0.06, 0.1034)),
    "`ee_site` 60 mm across": (NEAR, _tcp(0.06, 0, 0.1034)),
    "`ee_site` 30 mm to the side": (NEAR, _tcp(0, 0.03, 0.1034)),
    "`ee_site` 30 mm across": (NEAR, _tcp(0.03, 0, 0.1034)),
    "`ee_site` 30 mm beyond the fingertips": (NEAR, _tcp(0, 0, 0.1334)),
    "`ee_site` 600 mm beyond": (NEAR, _tcp(0, 0, 0.7)),
    "`ee_site` on the forearm": (NEAR, lambda side: side["ee_site"]["inject"].update(attach_body="link5")),
    "`base_pose` 250 mm too low": (NEAR, _base(-0.3, 0, -0.25)),
    "`joints`, `actuators`, `home_qpos` skip one": (NEAR, _skip("joints", "actuators", "home_qpos")),
    "`joints` alone skips one": (NEAR, _skip("joints")),
    "`base_pose` 2 m too far": (NEAR, _base(-2.3, 0, 0)),
    "nothing; the cube is 1.5 m away": (TOO_FAR, lambda side: None),
    "`primary_joint` the mimic one": (NEAR, _gripper(primary_joint="finger_joint2")),
    "`open_qpos`, `closed_qpos` swapped": (NEAR, _gripper(open_qpos=0.0, closed_qpos=0.04)),
    "`open_qpos` of the wrong sign": (NEAR, _gripper(open_qpos=-0.04)),
    "`home_qpos` folded into itself": (NEAR, _arm(home_qpos=[0, 1.7, 0, -3.0, 0, 0.0, 0])),
}


def _rows() -> dict[str, tuple[str, str]]:
    """Return the table's rows: what was broken -> what run says and what check says."""
    lines = PAGE.read_text(encoding="utf-8").splitlines()
    start = next(k for k, line in enumerate(lines) if line.startswith(HEADER))
    rows = {}
    for line in lines[start + 2 :]:
        if not line.startswith("|"):
            break
        _, broken, run, check = (cell.strip() for cell in line.strip("|").split("|"))
        rows[broken] = (run, check)
    return rows


def _said(capsys: pytest.CaptureFixture[str], call: Callable[[], int]) -> tuple[int, str]:
    code = call()
    out, err = capsys.readouterr()
    return code, out + err


def _lay_out(folder: Path, cube_x: float, change: Change) -> Path:
    shutil.copytree(PANDA, folder, dirs_exist_ok=True)
    path = folder / "panda.robosandbox.yaml"
    side = yaml.safe_load(path.read_text())
    change(side)
    path.write_text(yaml.safe_dump(side))
    cube = {
        "id": "red_cube",
        "kind": "box",
        "size": [0.015] * 3,
        "pose": {"xyz": [cube_x, 0.0, 0.055]},
        "rgba": [0.85, 0.2, 0.2, 1.0],
    }
    task = {
        "name": "pick_with_my_arm",
        "prompt": "pick up the red cube",
        "scene": {"robot_urdf": "panda.xml", "objects": [cube]},
        "success": {"kind": "lifted", "object": "red_cube"},
    }
    (folder / "task.yaml").write_text(yaml.safe_dump(task))
    return folder / "task.yaml"


def test_each_row_is_broken_here() -> None:
    assert set(_rows()) == set(BROKEN)


@pytest.mark.parametrize("broken", BROKEN)
@pytest.mark.sample(every=20)
def test_run_bench_and_check_say_what_the_page_says(
    broken: str, tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    task = _lay_out(tmp_path, *BROKEN[broken])
    told_run, told_check = (re.findall(r"`([^`]+)`", cell) for cell in _rows()[broken])
    assert told_run and told_check
    code, by_run = _said(capsys, lambda: run_app(app, "robo-sandbox", ["run", "--task", str(task)]))
    _, by_bench = _said(capsys, lambda: run_app(bench.app, "robo-sandbox-bench", ["--task-file", str(task)]))
    for told in told_run:
        assert told in by_run, by_run
        assert told in by_bench or (told == "done" and " OK " in by_bench), by_bench
    assert (code == 0) == (told_run == ["done"])
    _, by_check = _said(capsys, lambda: run_app(app, "robo-sandbox", ["robot", "check", "panda.xml"]))
    for told in told_check:
        assert told in by_check, by_check
    wrong = re.findall(r"\[change ([^]]+)\]", by_check)
    if wrong and code != 0:
        # The last words: the field that the check would have changed, its value, and the command.
        message = next(line for line in by_run.splitlines() if "shows more" in line)
        assert re.search(rf"{re.escape(wrong[0])} is .+; `robo-sandbox robot check panda\.xml` shows more$", message)
    elif not wrong:
        assert "robot check" not in by_run and "robosandbox.yaml" not in by_run
