"""Pegs, blocks with holes, and a perception that believes a block to be where it was."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path
from typing import Any
from unittest.mock import patch

import mujoco
import numpy as np

from robosandbox.driver import Driver, SafeDriver, Simulated
from robosandbox.drivers.hardware import Hardware
from robosandbox.errors import RoboSandboxError
from robosandbox.motion.planning_scene import PlanningScene
from robosandbox.perception.ground_truth import GroundTruthPerception
from robosandbox.sim.mujoco_backend import MuJoCoBackend
from robosandbox.sim.opening import require_mujoco
from robosandbox.types import DetectedObject, ObjectTruth, ObservedScene, Pose
from robosandbox.workcell.session import open_session

# Sides of the hole and the peg; a round peg goes into a ring of many.
SHAPES = {"square": 4, "round": 24, "hexagon": 6, "octagon": 8, "triangle": 3}
ACROSS, LENGTH, DEPTH, BASE, WALL = 0.02, 0.07, 0.03, 0.01, 0.025
MOST_OFF, MOST_TURNED = 0.003, math.radians(3.0)


class Mistaken(GroundTruthPerception):
    """Perception that believes a block to be where it was, whatever becomes of it."""

    believed: Pose | None = None

    def _looked_at(self, driver: Driver) -> Simulated:
        # What `hardware` hides is what a perception of its own would find out.
        return plant_of(driver)

    def planning(self, driver: Driver, seen: ObservedScene) -> PlanningScene:
        """Return the robot among what is believed, not in the model that is simulated."""
        told = self._looked_at(driver).scene
        return PlanningScene(self._believed(told, seen), seen, believed=lambda seen: self._believed(told, seen))

    def _detect(self, item: ObjectTruth) -> DetectedObject:
        seen = super()._detect(item)
        return replace(seen, pose=self.believed) if item.id == "block" and self.believed is not None else seen


def scene(shape: str, clearance: float) -> str:
    """Return a scene with a peg and a block with a hole (MJCF)."""
    sides = SHAPES[shape]
    inner = (ACROSS + clearance) / 2.0
    middle, half = inner + WALL / 2.0, (inner + WALL) * math.tan(math.pi / sides)
    walls = "".join(
        f'<geom type="box" size="{WALL / 2} {half:.5f} {DEPTH / 2}" euler="0 0 {math.degrees(angle):.3f}" '
        f'pos="{middle * math.cos(angle):.6f} {middle * math.sin(angle):.6f} {BASE + DEPTH / 2}"/>'
        for angle in (2.0 * math.pi * k / sides for k in range(sides))
    )
    corner, asset = ACROSS / 2.0 / math.cos(math.pi / sides), ""
    if shape == "round":
        peg = f'<geom type="cylinder" size="{ACROSS / 2} {LENGTH / 2}" mass="0.05"/>'
    elif shape == "square":
        peg = f'<geom type="box" size="{ACROSS / 2} {ACROSS / 2} {LENGTH / 2}" mass="0.05"/>'
    else:
        angles = [2.0 * math.pi * (k + 0.5) / sides for k in range(sides)]
        points = (
            f"{corner * math.cos(a):.6f} {corner * math.sin(a):.6f} {z}"
            for a in angles
            for z in (-LENGTH / 2, LENGTH / 2)
        )
        asset = f'<asset><mesh name="prism" vertex="{" ".join(points)}"/></asset>'
        peg = '<geom type="mesh" mesh="prism" mass="0.05"/>'
    wide = inner + WALL
    return f"""<mujoco model="pegs">
  <compiler angle="degree"/>
  <option cone="elliptic" impratio="10"/>
  {asset}
  <worldbody>
    <light pos="0 0 2"/>
    <geom name="floor" type="plane" size="2 2 0.1" pos="0 0 -0.75"/>
    <body name="table" pos="0.5 0 -0.02"><geom type="box" size="0.3 0.5 0.02"/></body>
    <body name="block" pos="0.5 0.15 0"><geom type="box" size="{wide} {wide} {BASE / 2}" pos="0 0 {BASE / 2}"/>{walls}</body>
    <body name="peg" pos="0.5 -0.15 {LENGTH / 2}"><freejoint/>{peg}</body>
  </worldbody>
</mujoco>"""


def plant_of(driver: Driver) -> MuJoCoBackend:
    """Return the simulation behind `mujoco`, or behind the wires of `hardware`."""
    behind = driver.behind if isinstance(driver, SafeDriver) else driver
    return behind.plant if isinstance(behind, Hardware) else require_mujoco(behind, "pegs are judged there")


def insert(file: Path, driver: str, seed: int) -> dict[str, Any]:
    """Put a peg into a hole that was moved; return what was said, what is so, and the largest force."""
    random = np.random.default_rng(seed)
    direction, off = random.uniform(0.0, 2.0 * math.pi), random.uniform(0.0, MOST_OFF)
    turned = random.uniform(-MOST_TURNED, MOST_TURNED)
    name, _, options = driver.partition(":")
    given = {key: value == "true" for key, _, value in (one.partition("=") for one in options.split(",") if one)}
    eyes = Mistaken()
    with (
        patch("robosandbox.workcell.session.make_perception", lambda *_: eyes),
        open_session(scene=file, driver=name, driver_options=given, seed=0) as cell,
    ):
        plant = plant_of(cell.driver)
        model = plant.world.model
        seen = eyes.perceive(cell.driver).find("block")
        eyes.believed = seen.pose
        block, turn = model.body("block").id, np.zeros(4)
        model.body_pos[block, :2] += off * np.array([math.cos(direction), math.sin(direction)])
        mujoco.mju_axisAngle2Quat(turn, np.array([0.0, 0.0, 1.0]), turned)
        mujoco.mju_mulQuat(model.body_quat[block], turn, model.body_quat[block].copy())
        forces = [0.0]

        def feel() -> None:
            pressed = plant.senses.forces("arm")
            forces.append(max((float(np.linalg.norm(force)) for force in pressed.values()), default=0.0))

        row: dict[str, Any] = {"off_mm": round(1e3 * off, 2), "turned_deg": round(math.degrees(turned), 2)}
        try:
            cell.do("pick", object="peg", to="block")
            began = cell.driver.time
            cell.driver.subscribe(feel)
            cell.do("insert", container="block")
            row["claimed"] = True
        except RoboSandboxError as error:
            row |= {"claimed": False, "said": str(error)[:160]}
        truth = plant.truth()
        peg, hole = truth.objects["peg"].pose, truth.objects["block"].pose
        row["in"] = (
            abs(peg.xyz[2] - LENGTH / 2.0 - hole.xyz[2] - BASE) < 0.003
            and math.dist(peg.xyz[:2], hole.xyz[:2]) < ACROSS / 2.0
            and truth.held is None
        )
        row["held"] = truth.held
        return row | {"seconds": round(cell.driver.time - began, 1), "force_n": round(max(forces), 1)}
