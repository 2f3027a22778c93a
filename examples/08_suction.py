"""A suction cup in the place of the Panda's hand: the model is written, its sidecar inferred, a box moved.

python examples/08_suction.py
"""

from __future__ import annotations

import math
import tempfile
from pathlib import Path

import mujoco

from robosandbox import open_session
from robosandbox.robots.infer.report import to_yaml
from robosandbox.robots.infer.sidecar import infer
from robosandbox.robots.locate import resolve_robot
from robosandbox.tasks.task import Task

# A cup of 30 mm that sucks with 60 kPa: 42 N. MuJoCo's adhesion pulls along every contact of the body; the lip is a ring of
# balls, so that a flat face meets it all round.
RADIUS, FORCE, LIP = 0.014, 42.0, 0.001
BALLS = 12


def write_arm(folder: Path) -> Path:
    """Write the bundled Panda with a cup in place of its hand, and what is inferred of it; return the model's path."""
    spec = mujoco.MjSpec.from_file(str(resolve_robot(None)))
    spec.modelname = "panda_with_cup"
    for equality in list(spec.equalities):
        spec.delete(equality)
    spec.delete(spec.actuator("actuator8"))
    for exclude in [item for item in spec.excludes if "finger" in item.bodyname1 + item.bodyname2]:
        spec.delete(exclude)
    spec.delete(spec.body("hand"))
    add_cup(spec, spec.body("link7"), height=0.107)
    model = folder / "panda_with_cup.xml"
    spec.compile()
    model.write_text(spec.to_xml(), encoding="utf-8")
    model.with_name("panda_with_cup.robosandbox.yaml").write_text(to_yaml(infer(model)), encoding="utf-8")
    return model


def add_cup(spec: mujoco.MjSpec, link: mujoco.MjsBody, *, height: float) -> None:
    """Put a cup on a link, `height` metres along its z axis, and the adhesion that lets it stick."""
    cup = link.add_body(name="cup", pos=[0.0, 0.0, height], gravcomp=1.0)
    cylinder, ball = mujoco.mjtGeom.mjGEOM_CYLINDER, mujoco.mjtGeom.mjGEOM_SPHERE
    cup.add_geom(name="stem", type=cylinder, fromto=[0, 0, 0, 0, 0, 0.06], size=[0.012, 0, 0], mass=0.1, group=3)
    cup.add_geom(name="bell", type=cylinder, fromto=[0, 0, 0.06, 0, 0, 0.069], size=[RADIUS, 0, 0], mass=0.05, group=3)
    for k in range(BALLS):
        angle = 2.0 * math.pi * k / BALLS
        place = [RADIUS * math.cos(angle), RADIUS * math.sin(angle), 0.07 - LIP]
        cup.add_geom(
            name=f"lip{k}", type=ball, pos=place, size=[LIP, 0, 0], mass=0.001, condim=4, friction=[1, 0.02, 0.001]
        )
    suck = spec.add_actuator(name="suck", trntype=mujoco.mjtTrn.mjTRN_BODY, target="cup")
    suck.gainprm[0] = FORCE
    suck.ctrllimited, suck.ctrlrange = mujoco.mjtLimited.mjLIMITED_TRUE, [0.0, 1.0]


def main() -> None:
    with tempfile.TemporaryDirectory() as folder:
        model = write_arm(Path(folder))
        print(model.with_name("panda_with_cup.robosandbox.yaml").read_text(encoding="utf-8"))
        box = {"id": "blue_box", "kind": "box", "size": [0.03, 0.02, 0.02], "mass": 0.15, "rgba": [0.2, 0.3, 0.9, 1.0]}
        can = {"id": "red_can", "kind": "cylinder", "size": [0.033, 0.05], "mass": 0.2, "rgba": [0.85, 0.2, 0.2, 1.0]}
        objects = [
            {**box, "pose": {"xyz": [0.1, -0.1, 0.061]}},
            {**can, "pose": {"xyz": [0.15, 0.12, 0.091]}},
        ]
        task = {
            "name": "suction",
            "prompt": "put the blue box on the red can",
            "scene": {"robot_urdf": str(model), "objects": objects},
            "success": {"kind": "on", "object": "blue_box", "target": "red_can"},
        }
        with open_session(Task.model_validate(task)) as session:
            episode = session.run()
            print(f"{episode.final_detail} success={session.judge().success}")


if __name__ == "__main__":
    main()
