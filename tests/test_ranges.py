"""Values that no table-top scene has are refused with their field and the valid range, before anything is allocated."""

import os
import struct
import subprocess
import sys
import zlib
from pathlib import Path
from typing import Any

import pytest

from robosandbox.errors import InputError
from robosandbox.robots.loader import load_robot
from robosandbox.tasks.task import Task
from robosandbox.validation import validate

BOX: dict[str, Any] = {
    "id": "cube",
    "kind": "box",
    "size": [0.02, 0.02, 0.02],
    "pose": {"xyz": [0.1, 0.0, 0.065]},
    "mass": 0.05,
}


def refusal(change: dict[str, Any], **more: Any) -> str:
    task = {
        "name": "t",
        "prompt": "go home",
        "scene": {"objects": [{**BOX, **change}]},
        "success": {"kind": "at_home"},
        **more,
    }
    with pytest.raises(InputError) as refused:
        validate(task, Task, source="document")
    return str(refused.value)


@pytest.mark.parametrize(
    ("change", "field", "unit"),
    [
        ({"mass": 1e300}, "mass: 1e+300", "1e-06 to 1000 kg"),
        ({"mass": 1e-300}, "mass: 1e-300", "1e-06 to 1000 kg"),
        ({"size": [1e9, 0.02, 0.02]}, "size[0]: 1e+09", "0.0001 to 10 m"),
        ({"size": [0.02, 0.02, 1e-9]}, "size[2]: 1e-09", "0.0001 to 10 m"),
        ({"pose": {"xyz": [0.1, 1e308, 0.0]}}, "pose.xyz[1]: 1e+308", "-100 to 100 m"),
        ({"scale": 1e30}, "scale: 1e+30", "1e-06 to 1000 m per unit"),
        ({"tag": 3, "tag_size": 1e20}, "tag_size: 1e+20", "0.0001 to 10 m"),
        ({"randomize": {"xy_jitter": 1e200}}, "randomize.xy_jitter: 1e+200", "0 to 10 m"),
        ({"randomize": {"q_jitter": 1e200}}, "randomize.q_jitter: 1e+200", "0 to 6.3 rad"),
        ({"randomize": {"area": [[0, 1e99], [0, 1]]}}, "randomize.area[0][1]: 1e+99", "-100 to 100 m"),
    ],
)
def test_absurd_value_is_refused_with_its_field_and_the_range(change: dict[str, Any], field: str, unit: str) -> None:
    said = refusal(change)
    assert f"scene.objects[0].{field} is outside {unit}" in said and "\n" not in said


def test_value_at_the_end_of_its_range_is_taken() -> None:
    task = {"name": "t", "prompt": "go home", "success": {"kind": "at_home"}}
    for change in ({"mass": 1000.0}, {"mass": 1e-6}, {"size": [10.0, 1e-4, 1e-4]}, {"pose": {"xyz": [-100, 100, 0]}}):
        validate({**task, "scene": {"objects": [{**BOX, **change}]}}, Task, source="document")


ARM = """<mujoco><asset>{asset}</asset>{size}<worldbody><body name="a"><joint name="j" range="-1 1" limited="true"/>
<geom size="{radius}" mass="{mass}"/></body></worldbody></mujoco>"""


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"asset": '<hfield name="h" nrow="60000" ncol="60000" size="1 1 1 1"/>'}, r"hfield .*3\.6e\+09 is outside"),
        ({"asset": '<texture name="t" type="2d" builtin="flat" width="60000" height="60000"/>'}, "texture .*pixels"),
        ({"asset": '<texture name="t" type="2d" file="bomb.png"/>'}, "60000 x 60000 is outside"),
        ({"size": '<size memory="900G"/>'}, "size memory='900G'>.*bytes"),
        ({"size": '<size njmax="2000000000"/>'}, "size njmax=.*rows"),
        ({"mass": "1e300"}, r"body 'a': its mass 1e\+300 is outside 0 to 10000 kg"),
        ({"radius": "1e9"}, r"its size 1e\+09 is outside 0 to 10000 m"),
    ],
)
def test_robot_that_would_take_all_memory_or_no_physics_is_refused(
    tmp_path: Path, change: dict[str, str], said: str
) -> None:
    header = struct.pack(">IIBBBBB", 60000, 60000, 8, 2, 0, 0, 0)
    chunk = struct.pack(">I", 13) + b"IHDR" + header + struct.pack(">I", zlib.crc32(b"IHDR" + header))
    (tmp_path / "bomb.png").write_bytes(b"\x89PNG\r\n\x1a\n" + chunk)
    file = tmp_path / "arm.xml"
    file.write_text(ARM.format(**{"asset": "", "size": "", "radius": "0.05", "mass": "1", **change}))
    with pytest.raises(InputError, match=said) as refused:
        load_robot(file)
    assert "\n" not in str(refused.value)


_DIVERGE = """
import logging, sys
logging.basicConfig(stream=sys.stdout, format="%(name)s: %(message)s")
from robosandbox.sim.mujoco_backend import MuJoCoBackend
from robosandbox.types import Scene
sim = MuJoCoBackend()
sim.load(Scene())
sim._live.qvel[:] = 1e300
sim.wait()
"""


def test_mujoco_writes_no_log_file_and_its_warnings_are_in_ours(tmp_path: Path) -> None:
    done = subprocess.run(
        [sys.executable, "-c", _DIVERGE], cwd=tmp_path, capture_output=True, text=True, timeout=200, env={**os.environ}
    )
    assert done.returncode == 0, done.stderr
    assert "robosandbox.mujoco: " in done.stdout and "QVEL" in done.stdout
    assert list(tmp_path.iterdir()) == []
