"""Arms, hands and senses of a simulated cell, by name."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from robosandbox.driver import Guard
from robosandbox.sim.sensing import SensedSimulation
from robosandbox.types import ArmState, Array, GripperState, PictureWindow, RgbdFrame, Trajectory
from robosandbox.types.robot import GripperSpec, RobotSpec, hand_of


class SimulatedArm:
    """One arm of a simulation.

    Args:
        sim: Where it is.
        name: Its name.

    Attributes:
        name: Likewise.
    """

    def __init__(self, sim: SensedSimulation, name: str) -> None:
        self._sim = sim
        self.name: str = name

    @property
    def spec(self) -> RobotSpec:
        """Specification."""
        return self._sim.spec_of(self.name)

    def state(self) -> ArmState:
        """Return what its encoders read, and its gripper's."""
        return self._sim.arm_state(self.name)

    def follow(self, trajectory: Trajectory, guards: Sequence[Guard] = ()) -> None:
        """Follow a trajectory; return when its last row is commanded."""
        self._sim.follow(self.name, trajectory, guards)

    def trim(self, goal: Array, guards: Sequence[Guard] = ()) -> None:
        """Let one control tick pass with the commands shifted against what keeps the arm off `goal` (n,)."""
        self._sim.trim(self.name, goal, guards)

    def stop(self) -> None:
        """Command the arm to stay where it is."""
        self._sim.stop_arm(self.name)

    def servo_force(self, joint: int) -> tuple[float, float]:
        """Return what a joint's servo gives now and the most that it can, N m or N; infinite without a limit."""
        return self._sim.servo_force(self.name, joint)


class SimulatedHand:
    """One hand of a simulation.

    Args:
        sim: Where it is.
        arm: Name of the arm that carries it.

    Attributes:
        name: Its name.
        arm: Likewise.
    """

    def __init__(self, sim: SensedSimulation, arm: str) -> None:
        self._sim = sim
        self.name: str = hand_of(arm)
        self.arm: str = arm

    @property
    def spec(self) -> GripperSpec:
        """Specification."""
        spec = self._sim.spec_of(self.arm).gripper
        assert spec is not None
        return spec

    def state(self) -> GripperState:
        """Return the gripper's own readings."""
        state = self._sim.arm_state(self.arm).gripper
        assert state is not None
        return state

    def set_gripper(self, closed: float, force: float | None = None) -> None:
        """Command the gripper: 0 is the sidecar's open, 1 its closed, with `force` N or N m of its motors at most."""
        self._sim.set_gripper(self.name, closed, force)

    def grip_on(self, object_id: str | None) -> float:
        """Return with how much force each side presses on an object, N; None is whatever is there."""
        return self._sim.grip_on(self.name, object_id)


class SimulatedSenses:
    """Cameras and contacts of a simulation.

    Args:
        sim: Where they are.
    """

    def __init__(self, sim: SensedSimulation) -> None:
        self._sim = sim

    def capture(self, camera: str, window: PictureWindow | None = None) -> RgbdFrame:
        """Return what the sensor of a camera delivers now."""
        return self._sim.capture(camera, window)

    def strongest_contact(self, arm: str | None = None) -> tuple[float, str, str]:
        """Return the largest normal force between an arm and anything else, N, and the two bodies; 0 without one."""
        return self._sim.strongest_contact(arm)

    def contacts(self, arm: str | None = None) -> tuple[tuple[str, str], ...]:
        """Return the pairs (body of an arm, other body) that touch now."""
        return self._sim.contacts(arm)

    def forces(self, arm: str | None = None) -> Mapping[str, Array]:
        """Return the sum of what an arm presses and pulls each thing with, N in the world, shape (3,)."""
        return self._sim.forces(arm)

    def force_on(self, object_id: str | None, arm: str | None = None) -> Array:
        """Return the sum of what an arm presses and pulls an object with, N in the world, shape (3,); None is all."""
        return self._sim.force_on(object_id, arm)
