"""Contacts in a simulated world: the pairs that touch, and their forces."""

from __future__ import annotations

from collections.abc import Iterable

import mujoco
import numpy as np
from numpy.typing import NDArray

from robosandbox.robots.robot import Gripper, Robot
from robosandbox.sim.suction import is_sucking, pulls, seal
from robosandbox.sim.world import World
from robosandbox.types import Touch
from robosandbox.types.robot import hand_of


class Contacts:
    """The contacts of one moment.

    Args:
        world: The scene.
        data: Its state, contacts included.
        only: Which of them count for `touching` and `on_objects`, shape (k,); all when left out.
    """

    def __init__(self, world: World, data: mujoco.MjData, only: NDArray[np.intp] | None = None) -> None:
        self._world = world
        self._data = data
        self._only = only
        self._pulls = pulls(world, data)

    def by_object(self) -> tuple[dict[str, set[str]], dict[str, str | None]]:
        """Return what each object touches, and by hand which object both its sides touch, or its cup has sucked on to.

        The sides are looked for on the object's own body and what is welded to it: a drawer whose grip is held is not held itself.
        """
        world, pairs = self._world, self._pairs()
        held = {hand_of(name): self._held(robot, pairs) for name, robot in world.robots.items() if robot.gripper}
        return self.touching(), held

    def _held(self, robot: Robot, pairs: set[tuple[int, int]]) -> str | None:
        gripper = robot.gripper
        assert gripper is not None
        sides: dict[int, set[int]] = {}
        welded = self._world.model.body_weldid
        for first, second in pairs:
            for body, other in ((first, second), (second, first)):
                for side, bodies in enumerate(gripper.finger_bodies):
                    if other in bodies:
                        # A free body of a file may have its geometry in a body that is welded to it.
                        sides.setdefault(int(welded[body]) or body, set()).add(side)
        needed = 2
        if gripper.geometry.cup is not None:
            sealed = (seal(self._world, robot, self._data) or 0.0) >= gripper.geometry.seal
            needed = 1 if sealed and is_sucking(gripper, self._data) else 2
        held = (item for item, body in self._world.object_bodies.items() if len(sides.get(body, ())) == needed)
        return next((item for item in held if item not in self._world.fixed), None)

    def touching(self) -> dict[str, set[str]]:
        """Return what each object touches."""
        owners = self._world.owners
        found: dict[str, set[str]] = {}
        for first, second in self._pairs():
            for body, other in ((first, second), (second, first)):
                name = owners.get(body)
                if name is not None and owners.get(other) != name:
                    found.setdefault(name, set()).add(self._word(other))
        return found

    def on_objects(self) -> dict[str, list[Touch]]:
        """Return the contacts of each object that carry force; beads against beads are left out."""
        world, data = self._world, self._data
        touches: dict[str, list[Touch]] = {name: [] for name in world.parts}
        local = np.zeros(6)
        for index in range(data.ncon) if self._only is None else self._only.tolist():
            contact = data.contact[index]
            first, second = (int(world.model.geom_bodyid[geom]) for geom in contact.geom)
            names = world.owners.get(first), world.owners.get(second)
            if names[0] == names[1]:
                continue
            mujoco.mj_contactForce(world.model, data, index, local)
            if not local[0] > 0.0:
                continue
            local[0] -= self._pull(index)
            # The contact frame's first axis points from its first geom to its second, and so does the force on the second.
            force = contact.frame.reshape(3, 3).T @ local[:3]
            x, y, z = (float(c) for c in contact.pos)
            for name, other, sign in ((names[0], second, -1.0), (names[1], first, 1.0)):
                if name is not None:
                    a, b, c = (float(value) for value in sign * force)
                    touches[name].append(Touch(other=self._word(other), point=(x, y, z), force=(a, b, c)))
        return touches

    def _word(self, body: int) -> str:
        world = self._world
        return "robot" if body in world.robot_bodies else world.owners.get(body, world.names[body])

    def of_arm(self, arm: str | None) -> tuple[tuple[str, str], ...]:
        """Return the pairs (body of an arm, other body) that touch, without the arm's own; of any arm where none is named."""
        world = self._world
        pairs = set()
        for first, second in self._pairs():
            owners = world.arm_of_body(first), world.arm_of_body(second)
            if owners[0] == owners[1] or (arm is not None and arm not in owners):
                continue
            ours = owners[0] is not None if arm is None else owners[0] == arm
            inner, outer = (first, second) if ours else (second, first)
            pairs.add((world.names[inner], world.names[outer]))
        return tuple(sorted(pairs))

    def strongest(self, arm: str | None) -> tuple[float, str, str]:
        """Return the largest normal force between an arm and anything else, N, and the two bodies; 0 without one."""
        world, data = self._world, self._data
        strongest = (0.0, "", "")
        force = np.zeros(6)
        for index, inner, outer in self._with_robot(arm):
            mujoco.mj_contactForce(world.model, data, index, force)
            pressed = float(force[0]) - self._pull(index)
            if pressed > strongest[0]:
                strongest = (pressed, world.names[inner], world.names[outer])
        return strongest

    def _pull(self, index: int) -> float:
        """Return how hard a suction cup pulls at a contact against what it is said to press with, N."""
        return 0.0 if self._pulls is None else float(self._pulls[index])

    def of_robot(self) -> list[tuple[float, int, int]]:
        """Return normal force, N, and body ids of every contact of the robot, those with itself included."""
        model, data, bodies = self._world.model, self._data, self._world.robot_bodies
        found, force = [], np.zeros(6)
        for index in range(data.ncon):
            first, second = (int(model.geom_bodyid[geom]) for geom in data.contact.geom[index])
            if first in bodies or second in bodies:
                mujoco.mj_contactForce(model, data, index, force)
                found.append((float(force[0]) - self._pull(index), first, second))
        return found

    def _is(self, body: int, name: str | None) -> bool:
        """Tell whether a body is of the named object, or of any where there is no name."""
        owner = self._world.owners.get(body)
        return owner is not None if name is None else owner == name

    def grip_on(self, gripper: Gripper, name: str | None) -> float:
        """Return with how much force each side of a gripper presses on an object, or on any, N: half the sum of both."""
        world, data = self._world, self._data
        fingers = gripper.finger_bodies[0] | gripper.finger_bodies[1]
        total, local = 0.0, np.zeros(6)
        for index, inner, outer in self._with_robot(None):
            if inner in fingers and self._is(outer, name):
                mujoco.mj_contactForce(world.model, data, index, local)
                total += float(local[0])
        return total / (2.0 if gripper.finger_bodies[1] else 1.0)

    def around(self, carried: Iterable[str]) -> list[tuple[str, str, float]]:
        """Return the contacts of each robot, and of objects that count as theirs, with anything else, other robots included.

        Args:
            carried: Ids of those objects: what they touch is listed, how robots hold them is not.

        Returns:
            (link or carried object, what it touches, normal force in N), a pair once per contact point.
        """
        world, data = self._world, self._data
        if not data.ncon:
            return []
        names = set(carried)
        ours = np.zeros(world.model.nbody, dtype=bool)
        ours[list(world.robot_bodies)] = True
        ours[[body for body, name in world.owners.items() if name in names]] = True
        bodies = world.model.geom_bodyid[data.contact.geom]
        mine, arms = ours[bodies], world.arm_of_geom[data.contact.geom]
        of_two_arms = (arms >= 0).all(axis=1) & (arms[:, 0] != arms[:, 1])
        found = []
        force = np.zeros(6)
        for index in np.flatnonzero(((mine[:, 0] != mine[:, 1]) | of_two_arms) & (data.contact.dist < 0.0)):
            mujoco.mj_contactForce(world.model, data, int(index), force)
            inner, outer = (int(body) for body in (bodies[index] if mine[index, 0] else bodies[index][::-1]))
            found.append(
                (
                    world.owners.get(inner, world.names[inner]),
                    world.owners.get(outer, world.names[outer]),
                    float(force[0]) - self._pull(int(index)),
                )
            )
        return found

    def _with_robot(self, arm: str | None) -> list[tuple[int, int, int]]:
        """Return (index, body of the arm, other body) of the contacts between an arm, or any, and anything else."""
        world, data = self._world, self._data
        if not data.ncon:
            return []
        geoms = data.contact.geom
        owners = world.arm_of_geom if arm is None else world.geoms_of(arm).astype(np.int8) - 1
        first, second = owners[geoms].T
        # Asked at every tick of a guarded motion, and most contacts are of things that stand on the table.
        (indices,) = (first != second).nonzero()
        bodies = world.model.geom_bodyid[geoms[indices]].tolist()
        return [
            (index, a, b) if owner >= 0 else (index, b, a)
            for index, owner, (a, b) in zip(indices.tolist(), first[indices].tolist(), bodies, strict=True)
        ]

    def _pairs(self) -> set[tuple[int, int]]:
        data = self._data
        if not data.ncon:
            return set()
        touching = data.contact.geom[data.contact.dist < 0.0]
        if self._only is not None:
            touching = data.contact.geom[self._only][data.contact.dist[self._only] < 0.0]
        return {(a, b) for a, b in self._world.model.geom_bodyid[touching].tolist()}
