"""Recorded beliefs of a workcell that nobody simulates: sensor values and object poses after each control tick."""

from __future__ import annotations

import itertools

import numpy as np

from robosandbox.motion.carried import SinceLook
from robosandbox.motion.twin import standing
from robosandbox.sim.objects.standing import stand
from robosandbox.sim.step_recorder import StepColumns, column_of
from robosandbox.sim.world import World
from robosandbox.types import Array, Pose
from robosandbox.workcell.embedded import EmbeddedWorkcell

# Where a model has to put a thing of which nothing was seen yet: metres under the floor, out of every picture. Chosen.
_NOWHERE = Pose(xyz=(0.0, 0.0, -10.0))


class BeliefRecorder:
    """Takes down joints, tool, gripper and believed poses of a driver without a model, in the columns of a simulated world.

    Args:
        host: The workcell.
        world: The model of its task, in which `qpos` is.
        capacity: Rows that it can hold between two calls of `take`.

    Attributes:
        rows: How many it holds.
        capacity: How many it can hold.
    """

    def __init__(self, host: EmbeddedWorkcell, world: World, capacity: int) -> None:
        self.capacity = capacity
        self._host = host
        self._world = world
        self._since_look = SinceLook()
        self._said: list[tuple[int, str, str]] = [(0, "", "")]
        self._rows: list[dict[str, Array]] = []

    @property
    def rows(self) -> int:
        """Number of rows held."""
        return len(self._rows)

    def enter(self, skill: str, phase: str) -> None:
        """Have the rows that follow name a skill and its phase."""
        self._said.append((self.rows, skill, phase))

    def add(self) -> None:
        """Take down the state as it is now."""
        arms, seen = self._host.driver.state().arms, self._host.ctx.seen
        believed = self._since_look.objects(seen, arms) if seen is not None else ()
        known = {item.id: item for item in believed}
        objects = [
            [*known[name].pose.xyz, *known[name].pose.quat_xyzw] if name in known else [np.nan] * 7
            for name in self._world.object_bodies
        ]
        qpos = standing(self._world, believed, arms)
        for name, bodies in self._world.parts.items():
            if name not in known:
                stand(self._world.model, qpos, int(bodies[0]), _NOWHERE)
        row = {
            "time": np.array([max(state.time for state in arms.values())]),
            "objects": np.array(objects, dtype=float).ravel(),
            "qpos": qpos,
        }
        for name, state in arms.items():
            own = {
                "q": state.q,
                "qd": state.qd,
                "tcp_pose": np.array([*state.tcp_pose.xyz, *state.tcp_pose.quat_xyzw]),
            }
            gripper = state.gripper
            if gripper is not None:
                force = np.nan if gripper.force is None else gripper.force
                own["gripper"] = np.array([gripper.joint, gripper.width, gripper.closed, force])
                if gripper.commanded is not None:
                    own["action_gripper"] = np.array([gripper.commanded])
            row |= {column_of(name, column): values for column, values in own.items()}
        self._rows.append(row)

    def take(self) -> StepColumns:
        """Return the rows as columns and start over."""
        rows, skills, phases = self.rows, list[str](), list[str]()
        for (begin, skill, phase), (end, *_) in itertools.pairwise([*self._said, (rows, "", "")]):
            skills += [skill] * (end - begin)
            phases += [phase] * (end - begin)
        first = self._rows[0] if self._rows else {}
        fixed = {name: np.stack([row[name] for row in self._rows]) for name in first if first[name].size}
        self.clear()
        return StepColumns(fixed, {}, skills, phases)

    def clear(self) -> None:
        """Forget all rows."""
        _, skill, phase = self._said[-1]
        self._said = [(0, skill, phase)]
        self._rows = []
