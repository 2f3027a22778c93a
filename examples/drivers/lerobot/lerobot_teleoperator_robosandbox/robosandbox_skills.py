"""LeRobot's teleoperator `robosandbox_skills`: the commands of skills that carry a sentence out in a twin, as a leader's."""

from __future__ import annotations

import logging
import time
from typing import Any

import numpy as np
from lerobot.lerobot_types import RobotAction
from lerobot.teleoperators import Teleoperator
from lerobot.utils.decorators import check_if_already_connected, check_if_not_connected
from lerobot_robot_robosandbox.robosandbox import Robosandbox
from numpy.typing import NDArray
from robosandbox_lerobot.cell import Numbers, arm_of

from lerobot_teleoperator_robosandbox.config_robosandbox_skills import RobosandboxSkillsConfig
from robosandbox.errors import InputError, RoboSandboxError
from robosandbox.sim.step_recorder import column_of
from robosandbox.workcell.embedded import EmbeddedWorkcell
from robosandbox.workcell.session import open_session

_log = logging.getLogger(__name__)
# Number of layouts in a row that the skills may fail in before nobody is helped by another.
_DRAWS = 20
# Seconds that a sentence may take.
_LONGEST = 120
# Actions by which LeRobot's loops may end late, one each and one for the first picture: sooner no episode begins.
_LATE = 3


class RobosandboxSkills(Teleoperator):
    """Skills as a person who leads: what they do in a twin of the robot's world is done with the robot.

    Only what succeeds in the twin is shown; a layout in which it does not is passed over.
    """

    config_class = RobosandboxSkillsConfig
    name = "robosandbox_skills"

    def __init__(self, config: RobosandboxSkillsConfig) -> None:
        super().__init__(config)
        self.config = config
        self._twin: EmbeddedWorkcell | None = None
        self._seed = 0
        # What is shown, an action a row, and how many were; when the episode began, and whether the next one is waited for.
        self._rows: NDArray[np.float32] = np.empty((0, 0), np.float32)
        self._shown = 0
        self._began: float | None = None
        self._waits = False

    @property
    def _robot(self) -> Robosandbox:
        """The robot, which LeRobot may make after this; raises ValueError where there is none."""
        known, robot_id = Robosandbox.known, self.config.robot_id
        if robot_id not in known:
            ids = ", ".join(str(each) for each in known) or "none"
            raise ValueError(f"robot_id {robot_id} is no robot of type robosandbox in this process; there is {ids}")
        return known[robot_id]

    @property
    def _numbers(self) -> Numbers:
        own = self._robot.config
        return Numbers(arm_of(own.task, own.robot))

    @property
    def action_features(self) -> dict[str, type]:
        """As the robot's."""
        return dict.fromkeys(self._numbers.keys, float)

    @property
    def feedback_features(self) -> dict[str, type]:
        """None: it feels nothing."""
        return {}

    @property
    def is_connected(self) -> bool:
        """True while the twin is open."""
        return self._twin is not None

    @property
    def is_calibrated(self) -> bool:
        """True."""
        return True

    def calibrate(self) -> None:
        """Do nothing."""

    def configure(self) -> None:
        """Do nothing."""

    def send_feedback(self, feedback: dict[str, Any]) -> None:
        """Do nothing."""

    @check_if_already_connected
    def connect(self, calibrate: bool = True) -> None:
        """Open the twin, and carry the sentence out in it for the first time."""
        del calibrate
        own = self._robot.config
        self._twin = open_session(own.task, robot=own.robot)
        self._seed = own.seed
        self._prepare()
        # The robot, which LeRobot connects after this, begins there.
        own.seed = self._seed

    @check_if_not_connected
    def get_action(self) -> RobotAction:
        """Return what the twin's arm was commanded next; what it was at last, once that is over."""
        now, config = time.perf_counter(), self.config
        if self._began is None:
            self._began = now
        if config.episode_time_s is not None:
            passed = now - self._began - config.episode_time_s
            if not self._waits and passed >= 0.5 * config.reset_time_s:
                self._seed += 1
                self._prepare()
                self._robot.begin(self._seed)
                self._waits = True
            elif self._waits and passed >= config.reset_time_s + _LATE / self._robot.config.fps:
                self._began, self._shown, self._waits = now, 0, False
        row = self._rows[0 if self._waits else min(self._shown, len(self._rows) - 1)]
        self._shown += not self._waits
        return dict(zip(self.action_features, row.tolist(), strict=True))

    @check_if_not_connected
    def disconnect(self) -> None:
        """Free the twin."""
        assert self._twin is not None
        self._twin.close()
        self._twin = None

    def _prepare(self) -> None:
        """Carry the sentence out in the twin, from this layout on in the first in which it succeeds; raises RuntimeError."""
        assert self._twin is not None
        for seed in range(self._seed, self._seed + _DRAWS):
            try:
                rows = self._rehearsed(self._twin, seed)
            except RoboSandboxError as error:
                _log.warning("layout %d is passed over: %s", seed, error)
                continue
            self._seed, self._rows = seed, rows
            return
        raise RuntimeError(f"the skills succeed in none of the layouts {self._seed} to {self._seed + _DRAWS - 1}")

    def _rehearsed(self, twin: EmbeddedWorkcell, seed: int) -> NDArray[np.float32]:
        """Return what the arm of the twin was commanded at each action's time; raises RoboSandboxError where it did not succeed."""
        fps = self._robot.config.fps
        twin.reset(seed)
        driver, log, began = twin.driver, twin.mujoco.log(_LONGEST * fps), twin.driver.time

        def note() -> None:
            # Half a control tick before its time is nearer to it than the tick after.
            if driver.time - began > log.rows / fps - 0.5 * driver.control_timestep:
                if log.rows == log.capacity:
                    raise InputError(f"it takes more than {_LONGEST} s")
                log.add()

        note()
        end = driver.subscribe(note)
        try:
            result = twin.run(self.config.sentence)
        finally:
            end()
        if not result.success or (self.config.sentence is None and not twin.judge().success):
            raise InputError(f"{result.final_detail or 'it is judged not to have succeeded'}")
        rows, (name,) = log.take().fixed, twin.driver.arms
        gripper = rows.get(column_of(name, "action_gripper"))
        # The first row is of before anything was commanded.
        return np.array(
            [
                self._numbers.told(q.tolist(), None if gripper is None else float(gripper[row, 0]))
                for row, q in enumerate(rows[column_of(name, "action_q")])
            ][1:]
        )
