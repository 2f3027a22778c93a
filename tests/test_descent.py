"""Inverse kinematics in C takes the same steps as in NumPy, which does it where there is no C compiler."""

import os
import shutil
import subprocess
import sys
from pathlib import Path
from zipfile import ZipFile

import mujoco
import numpy as np
import pytest

from robosandbox.robots import compiled
from robosandbox.robots.chains import Tool
from robosandbox.robots.kinematics import Kinematics
from robosandbox.sim.mujoco_backend import MuJoCoBackend
from robosandbox.types import Scene

ROOT = Path(__file__).resolve().parents[1]
FOLDERS = [path for path in (ROOT / "src" / "robosandbox").iterdir() if path.is_symlink()]
BUILT = shutil.ignore_patterns("*.so", "*.pyd", "__pycache__", "*.egg-info")
# A slide and hinges off their bodies' origins, two joints on one body, one without limits, a fixed bend and a finger beside.
ODD_ARM = """
<mujoco><compiler angle="radian"/><worldbody>
  <body pos="0.1 -0.2 0.3" quat="0.9 0.1 0.3 0.2">
    <joint name="rail" type="slide" axis="1 0.5 0" limited="true" range="-0.4 0.4"/><geom size="0.02"/>
    <body pos="0 0 0.1"><joint name="a" axis="0 0 1" pos="0.02 0.01 0" ref="0.3" limited="true" range="-2 2"/>
      <joint name="b" axis="0 1 0.2" pos="0 0 0.03" limited="true" range="-1.5 1.5"/><geom size="0.02"/>
      <body pos="0.3 0 0.05" quat="0.7 0.1 0 0.7"><geom size="0.02"/>
        <body pos="0.1 0.1 0.2"><joint name="c" axis="1 0 0"/><geom size="0.02"/>
          <body pos="0 0 0.2"><joint name="d" axis="0 1 0" limited="true" range="-2 2"/><geom size="0.02"/>
            <body pos="0 0.02 0.15"><joint name="e" axis="0 0 1" limited="true" range="-2.5 2.5"/><geom size="0.02"/></body>
            <body pos="0 0.1 0"><joint name="finger" axis="0 1 0"/><geom size="0.02"/></body>
          </body></body></body></body></body>
</worldbody></mujoco>"""


def pair(model: mujoco.MjModel, joints: list[int], tool: Tool) -> tuple[Kinematics, Kinematics]:
    if compiled.library() is None:
        pytest.skip("there was no C compiler at the installation")
    return Kinematics(model, joints, tool), Kinematics(model, joints, tool, compiled=False)


def panda(count: int) -> tuple[Kinematics, Kinematics]:
    """Return the kinematics of the bundled arm's last joints, the others being held."""
    with MuJoCoBackend() as sim:
        sim.load(Scene())
        tool = Tool.at_site(sim.model, sim.robot.tcp_site, sim.robot.R_site_tcp)
        joints = sim.model.dof_jntid[sim.robot.dof_indices].tolist()
        return pair(sim.model, joints[len(joints) - count :], tool)


def odd_arm(names: str) -> tuple[Kinematics, Kinematics]:
    model = mujoco.MjModel.from_xml_string(ODD_ARM)
    turn = np.array([[0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [1.0, 0.0, 0.0]])
    tool = Tool(int(model.jnt_bodyid[model.joint("e").id]), np.array([0.01, 0.02, 0.1]), turn)
    return pair(model, [model.joint(name).id for name in names.split()], tool)


ARMS = {
    "seven joints": lambda: panda(7),
    "six joints": lambda: panda(6),
    "five joints": lambda: panda(5),
    "four joints": lambda: panda(4),
    "a rail and odd anchors": lambda: odd_arm("rail a b c d e"),
    "another order, and a joint that does not move the tool": lambda: odd_arm("c finger a rail b d e"),
}


@pytest.mark.parametrize("arm", ARMS)
@pytest.mark.parametrize("free_turn", [False, True])
def test_both_descend_to_the_same_configuration(arm: str, free_turn: bool) -> None:
    fast, plain = ARMS[arm]()
    assert fast.is_compiled and not plain.is_compiled
    rng = np.random.default_rng(0)
    low, high = np.maximum(plain.lower, -np.pi), np.minimum(plain.upper, np.pi)
    solved = apart = 0
    for _ in range(100):
        position, rotation = (each.copy() for each in plain.forward(rng.uniform(low, high)))
        # Every fifth is too far off.
        position += rng.choice([0.0, 0.0, 0.0, 0.0, 2.0])
        orientation = rotation[:, 2] if free_turn else rotation
        seed = rng.uniform(low - 0.1, high + 0.1)
        found, expected = (each.descend(position, orientation, seed) for each in (fast, plain))
        solved += expected.solved
        same = found.solved == expected.solved and np.allclose(found.q, expected.q, rtol=0.0, atol=1e-6)
        apart += not same
        reached, turned = plain.forward(found.q)
        assert np.linalg.norm(position - reached) == pytest.approx(found.position_error, abs=1e-9)
        if not free_turn:
            cosine = np.clip((np.trace(turned.T @ rotation) - 1.0) / 2.0, -1.0, 1.0)
            assert np.arccos(cosine) == pytest.approx(found.orientation_error, abs=1e-6)
        assert (found.q >= plain.lower).all() and (found.q <= plain.upper).all()
    # A descent that wanders makes much of rounding.
    assert solved >= 20 and apart <= 3


def test_random_poses_are_solved_by_both() -> None:
    fast, plain = panda(7)
    rng = np.random.default_rng(1)
    home = np.array([0.0, 0.0, 0.0, -1.57079, 0.0, 1.57079, -0.7853])
    for _ in range(200):
        position, rotation = (each.copy() for each in plain.forward(rng.uniform(plain.lower, plain.upper)))
        assert fast.solve(position, rotation, home).solved
    assert plain.solve(position, rotation, home).solved


@pytest.mark.filterwarnings("ignore:overflow")
def test_an_arm_of_lengths_beyond_all_measure_ends_in_no_solution() -> None:
    model = mujoco.MjModel.from_xml_string(
        '<mujoco><worldbody><body><joint axis="0 0 1"/><geom size="0.1"/></body></worldbody></mujoco>'
    )
    tool = Tool(1, np.array([1e200, 0.0, 0.0]), np.eye(3))
    for each in pair(model, [0], tool):
        assert not each.descend(np.zeros(3), np.eye(3), np.zeros(1)).solved


def test_without_a_library_numpy_descends(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(compiled, "EXTENSION_SUFFIXES", [".nothing"])
    compiled.library.cache_clear()
    try:
        assert compiled.library() is None
        with MuJoCoBackend() as sim:
            sim.load(Scene())
            assert not Kinematics.of(sim.model, sim.robot).is_compiled
    finally:
        monkeypatch.undo()
        compiled.library.cache_clear()


@pytest.mark.slow
def test_a_machine_without_a_compiler_builds_a_wheel_all_the_same(tmp_path: Path) -> None:
    source = tmp_path / "source"
    for name in ("src", *(link.name for link in FOLDERS)):
        shutil.copytree(ROOT / name, source / name, symlinks=True, ignore=BUILT)
    for name in ("pyproject.toml", "README.md", "LICENSE"):
        shutil.copyfile(ROOT / name, source / name)
    command = [sys.executable, "-m", "build", "--wheel", "--outdir", str(tmp_path), str(source)]
    done = subprocess.run(command, env={**os.environ, "CC": "no-such-compiler"}, capture_output=True, text=True)
    assert done.returncode == 0, done.stdout + done.stderr
    (wheel,) = tmp_path.glob("*.whl")
    held = ZipFile(wheel).namelist()
    assert "robosandbox/robots/compiled.py" in held
    assert not [name for name in held if name.startswith("robosandbox/robots/_descent")]
