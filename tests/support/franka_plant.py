"""A Franka controller on loopback that speaks libfranka's protocol, by franky-sim, with a task's world behind it.

    PYTHONPATH=tests python -m support.franka_plant FOLDER --host 127.0.5.1 [--task TASK] [--robot MODEL] [--seed N]

Protocol, joint control and the hand's commands are franky-sim's; the world with its contacts and cameras is this package's, which
franky-sim is told of as a simulator of its own. Added here is what franky-sim leaves out: the estimate of the force at the hand, the
reflex by the thresholds that the client has set, the user stop, and their recovery. Tests speak with it as hidden_plant.py says.
"""

from __future__ import annotations

import argparse
import contextlib
import signal
import threading
import time
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import franky_sim
import numpy as np
from franky_sim.base_simulator import InnerRobotState
from franky_sim.franka_robot_protocol import (
    AutomaticErrorRecoveryCommand,
    AutomaticErrorRecoveryStatus,
    MoveStatus,
    RobotCommand,
    RobotMode,
    SetCollisionBehaviorCommand,
    UDPCommand,
)
from franky_sim.franka_server import BaseCommand
from support import hidden_plant

from robosandbox.driver import HAND

# Seconds of a cycle of the controller, and of a step of the physics behind it.
_CYCLE = 0.001
# Cycles from one estimate of the force at the hand to the next.
_ESTIMATE = 10
# Where `cartesian_reflex` stands among the errors in a robot's state.
_CARTESIAN_REFLEX = 7
# Of its joints, N m/rad.
_STIFFNESS = (4500.0, 4500.0, 3500.0, 3500.0, 2000.0, 2000.0, 2000.0)
# libfranka's kCommandNotPossibleRejected of a setting, which franky-sim does not name.
_SETTING_NOT_POSSIBLE = 1
# Port of the tests' socket, beside the controller's 1337 and the hand's 1338.
_TESTS = 1339


class PlantRobot(franky_sim.BaseRobot):
    """The arm and the hand of the plant, by torques."""

    def __init__(self, sim: hidden_plant.PlantSim) -> None:
        # As stiff as franky-sim has it, and damped half as much, with which it trails half as far: a Franka hardly trails.
        super().__init__(kp=_STIFFNESS, kv=tuple(0.05 * each for each in _STIFFNESS))
        self.sim = sim
        model, arm, hand = sim.model, sim.world.robot, sim.world.world.grippers[HAND]
        # Its actuators are servos; the controller gives torques.
        model.actuator_gainprm[arm.actuator_ids] = 0.0
        model.actuator_biasprm[arm.actuator_ids] = 0.0
        model.opt.timestep = _CYCLE
        self.qpos, self.dofs = np.array(arm.qpos_indices), np.array(arm.dof_indices).reshape(-1)
        self.finger, self.spindle = hand.qpos_index, hand.actuator_ids[0]
        self.geometry = hand.geometry
        self.controls = np.array(sim.world.controls)
        self.hand_goal, self.hand_speed = self._get_hand_width(), 0.0
        self.hand_jams = False
        self.torques = np.zeros(7)
        # When a client commanded what.
        self.commands: list[tuple[float, ...]] = []

    def _get_state(self) -> InnerRobotState:
        data = self.sim.data
        return InnerRobotState(q=tuple(data.qpos[self.qpos]), dq=tuple(data.qvel[self.dofs]), tau_j=tuple(self.torques))

    def _torque_control(self, torques: np.ndarray) -> None:
        self.torques = torques
        self.sim.data.qfrc_applied[self.dofs] = torques

    def joint_position_control(self, target_q: Sequence[float], has_new_command: bool = True) -> None:
        # What holds it between motions is the controller's own.
        if has_new_command and self.server is not None and self.server.current_motion_id:
            self.commands.append((time.monotonic(), *map(float, target_q)))
        super().joint_position_control(target_q, has_new_command)

    def set_hand_goal(self, width: float, max_velocity: float, max_force: float) -> None:
        if not self.hand_jams:
            self.hand_goal, self.hand_speed = width, max_velocity
            # The spindle drives both fingers.
            self.sim.model.actuator_forcerange[self.spindle] = -2.0 * max_force, 2.0 * max_force

    def _get_hand_width(self) -> float:
        return float(self.geometry.aperture(self.sim.q(self.finger)))

    def step(self) -> None:
        goal = self.geometry.joint_for_aperture(self.hand_goal)
        most = self.hand_speed * _CYCLE / 2.0
        now = self.controls[self.spindle]
        self.controls[self.spindle] = now + min(max(goal - now, -most), most)
        self.sim.world.replay(self.controls)
        self._post_step()


class Controller(franky_sim.FrankaRobotServer):
    """The controller with its reflex and its user stop."""

    def __init__(self, robot: PlantRobot, host: str) -> None:
        self.mode: RobotMode | None = None
        self.force = np.zeros(3)
        self.thresholds = np.full(6, np.inf)
        self.over = 0
        super().__init__(robot, [host])
        self.init()

    def start_motion(self, *arguments: Any) -> None:
        """Begin a motion where the arm was commanded last, as a Franka does; franky-sim begins it where the arm has got to."""
        commanded = tuple(self.robot_state.q_d)
        super().start_motion(*arguments)
        self._FrankaRobotServer__current_control_command = UDPCommand(q_c=commanded)

    @property
    def robot_state(self) -> Any:
        state = super().robot_state.replace(O_F_ext_hat_K=(*self.force, 0.0, 0.0, 0.0))
        if self.mode is None:
            return state
        errors = tuple(self.mode is RobotMode.kReflex and index == _CARTESIAN_REFLEX for index in range(41))
        return state.replace(robot_mode=self.mode, errors=errors, reflex_reason=errors)

    def feel(self, force: np.ndarray) -> None:
        """Estimate the force at the hand, and stop where it has passed its threshold twice."""
        self.force = force
        self.over = self.over + 1 if (np.abs(force) > self.thresholds[:3]).any() else 0
        if self.over >= 2 and self.mode is None:
            self.abort(RobotMode.kReflex, MoveStatus.kReflexAborted)

    def abort(self, mode: RobotMode, status: MoveStatus) -> None:
        """End a motion in a mode in which nothing moves."""
        self.mode = mode
        if self.current_motion_id:
            BaseCommand.send_response(self._tcp_socket, RobotCommand.kMove, self.current_motion_id, status)
            self.reset_current_motion_id()
        self.stop_motion(send_preemption_signal=False)

    def shut_down(self) -> None:
        """Leave the network."""
        self.cleanup()
        for server in (self.gripper_server, self):
            server.reset_state()


def _recover(command: AutomaticErrorRecoveryCommand, server: Controller) -> None:
    if server.mode is RobotMode.kUserStopped:
        command.reply(AutomaticErrorRecoveryStatus.kCommandNotPossibleRejected)
        return
    server.mode, server.over = None, 0
    command.reply(AutomaticErrorRecoveryStatus.kSuccess)


def _set_thresholds(command: SetCollisionBehaviorCommand, server: Controller) -> None:
    if server.mode is not None:
        command.reply(_SETTING_NOT_POSSIBLE)
        return
    server.thresholds = np.array(command.upper_force_thresholds_nominal)
    command.reply(0)


# franky-sim says of both that it has done it, and does nothing.
AutomaticErrorRecoveryCommand.handle = _recover
SetCollisionBehaviorCommand.handle = _set_thresholds


class FrankaPlant(hidden_plant.PlantServer):
    """The plant, its controller and the socket of tests, in one loop."""

    def __init__(self, host: str, task: str, robot: str | None, seed: int) -> None:
        super().__init__(hidden_plant.PlantSim.of(task, robot, seed, 2.0 * _CYCLE), (host, _TESTS))
        self.host = host
        self.robot = PlantRobot(self.sim)
        self.controller: Controller | None = Controller(self.robot, host)
        self.held = self.robot.inner_state.q
        self.cycles = 0

    def run(self) -> None:
        """Run a cycle each millisecond; what a busy computer is late by is lost, as a burst would be to a client."""
        due = time.monotonic()
        while True:
            self.answer(self.ready(max(0.0, due - time.monotonic())))
            if time.monotonic() >= due:
                self.cycle()
                due = max(due + _CYCLE, time.monotonic())

    def cycle(self) -> None:
        controller, self.cycles = self.controller, self.cycles + 1
        if controller is None:
            # Its brakes hold it.
            self.robot.joint_position_control(self.held, has_new_command=False)
            self.robot.step()
        else:
            controller.process_commands()
            self.robot.step()
            if self.cycles % _ESTIMATE == 0:
                controller.feel(sum(self.sim.world.forces().values(), np.zeros(3)))
            controller.send_state()
        self.watch()

    def do_controller(self, on: bool) -> None:
        """Switch the controller off or on; the arm stays where it is."""
        if self.controller is not None:
            self.held = tuple(self.controller.robot_state.q_d)
            self.controller.shut_down()
        self.controller = Controller(self.robot, self.host) if on else None

    def do_mode(self, name: str | None) -> None:
        """Have the user stop pressed (kUserStopped) or the reflex act (kReflex), or neither."""
        assert self.controller is not None
        self.controller.mode = None
        if name is not None:
            mode = RobotMode[name]
            reflex = mode is RobotMode.kReflex
            self.controller.abort(mode, MoveStatus.kReflexAborted if reflex else MoveStatus.kEmergencyAborted)

    def do_jam(self, jams: bool) -> None:
        """Have the hand ignore what it is told, and never answer."""
        self.robot.hand_jams = jams
        assert self.controller is not None
        server = self.controller.gripper_server
        server._check_motion_state = (lambda: None) if jams else type(server)._check_motion_state.__get__(server)

    def do_thresholds(self) -> np.ndarray:
        """Forces and torques from which the reflex stops the arm, N and N m, shape (6,)."""
        assert self.controller is not None
        return self.controller.thresholds

    def do_commands(self) -> np.ndarray:
        """Rows of seconds by the monotonic clock and a configuration: all that a client commanded."""
        return np.array(self.robot.commands).reshape(-1, 8)

    def do_q(self) -> tuple[float, ...]:
        """Joint positions of the arm, rad, shape (7,)."""
        return self.robot.inner_state.q


class Plant(hidden_plant.Plant):
    """A test's end of the socket.

    Args:
        host: Address of the controller.
        process: Of the plant, to freeze it with; None where nobody is to.
    """

    def __init__(self, host: str, process: Any = None) -> None:
        super().__init__((host, _TESTS))
        self.host, self._process = host, process

    @contextlib.contextmanager
    def frozen(self, after: float = 0.0) -> Iterator[None]:
        """Stop the whole plant, world and controller, from so many seconds on as long as this lasts."""
        stop = threading.Timer(after, self._process.send_signal, [signal.SIGSTOP])
        stop.start()
        try:
            yield
        finally:
            stop.join()
            self._process.send_signal(signal.SIGCONT)


class PlantCameras(hidden_plant.PlantCameras):
    """Cameras of the plant, for the option `cameras=support.franka_plant:PlantCameras`."""

    def __init__(self, driver: Any) -> None:
        super().__init__(driver, Plant(driver.host))


@contextlib.contextmanager
def controlled(folder: Path, host: str, *arguments: str) -> Iterator[Plant]:
    """Run a controller with a world behind it."""
    with hidden_plant.running("support.franka_plant", folder, "--host", host, *arguments) as process:
        yield Plant(host, process)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--host", default="127.0.5.1")
    parser.add_argument("--task", default="pick_cube_franka")
    parser.add_argument("--robot")
    parser.add_argument("--seed", type=int, default=0)
    options = parser.parse_args()
    plant = FrankaPlant(options.host, options.task, options.robot, options.seed)
    (options.folder / "ready").touch()
    plant.run()


if __name__ == "__main__":
    main()
