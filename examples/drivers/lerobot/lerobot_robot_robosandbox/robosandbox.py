"""LeRobot's robot `robosandbox`: a simulated arm that moves within its limits by an action's period, as LeRobot paces it."""

from __future__ import annotations

import logging
import time
from typing import Any, ClassVar
from weakref import WeakValueDictionary

from lerobot.lerobot_types import RobotAction, RobotObservation
from lerobot.robots import Robot
from lerobot.utils.decorators import check_if_already_connected, check_if_not_connected
from robosandbox_lerobot.cell import Cell, Numbers, arm_of

from lerobot_robot_robosandbox.config_robosandbox import RobosandboxConfig

_log = logging.getLogger(__name__)
# Seconds of actions after which their rate on the wall's clock is looked at, and the share by which it may be off what was said.
_LOOKED_AT, _OFF = 2.0, 0.2


class Robosandbox(Robot):
    """A task's arm, in degrees, its gripper from 0 (closed) to 100 (open)."""

    config_class = RobosandboxConfig
    name = "robosandbox"
    # Those of this process by their ids: a teleoperator acts in the world of one.
    known: ClassVar[WeakValueDictionary[str | None, Robosandbox]] = WeakValueDictionary()

    def __init__(self, config: RobosandboxConfig) -> None:
        super().__init__(config)
        self.config = config
        self.cameras = {name: name for name in config.views}
        self._keys = Numbers(arm_of(config.task, config.robot)).keys
        self._cell: Cell | None = None
        self._seen: dict[str, Any] = {}
        self._acted = False
        # How many actions came, and when the first of them did.
        self._count, self._began = 0, 0.0
        self.known[config.id] = self

    @property
    def action_features(self) -> dict[str, type]:
        """A number by joint, and the gripper's."""
        return dict.fromkeys(self._keys, float)

    @property
    def observation_features(self) -> dict[str, Any]:
        """The same, and pictures (height, width, 3)."""
        size = (self.config.height, self.config.width, 3)
        return {**self.action_features, **dict.fromkeys(self.cameras, size)}

    @property
    def is_connected(self) -> bool:
        """True while its world is open."""
        return self._cell is not None

    @property
    def is_calibrated(self) -> bool:
        """True: a simulated arm is."""
        return True

    def calibrate(self) -> None:
        """Do nothing."""

    def configure(self) -> None:
        """Do nothing."""

    @check_if_already_connected
    def connect(self, calibrate: bool = True) -> None:
        """Open its world."""
        del calibrate
        config = self.config
        self._cell = Cell(
            config.task,
            robot=config.robot,
            cameras=config.views,
            fps=config.fps,
            height=config.height,
            width=config.width,
        )
        self.begin(config.seed)

    @check_if_not_connected
    def begin(self, seed: int) -> None:
        """Tell how the layout before has ended, and start over with another."""
        assert self._cell is not None
        self._tell()
        self._seen, _ = self._cell.reset(options={"layout": seed})

    @check_if_not_connected
    def get_observation(self) -> RobotObservation:
        """Return joints and pictures as the last action left them."""
        numbers = zip(self._keys, self._seen["agent_pos"].tolist(), strict=True)
        return {**dict(numbers), **self._seen.get("pixels", {})}

    @check_if_not_connected
    def send_action(self, action: RobotAction) -> RobotAction:
        """Let an action's period pass with the arm on its way to where the action has it; return where it was sent.

        That is short of the action where the arm's limits are. Where a limit of the task is passed, it holds, and the log says which.
        """
        assert self._cell is not None
        wanted = [float(action[key]) for key in self._keys]
        self._acted = True
        self._pace()
        self._seen, _, _, _, info = self._cell.step(wanted)
        if "stopped" in info:
            _log.warning("%s", info["stopped"])
        return dict(zip(self._keys, self._cell.commanded().tolist(), strict=True))

    @check_if_not_connected
    def disconnect(self) -> None:
        """Tell how it has ended, and free its world."""
        assert self._cell is not None
        self._tell()
        self._cell.close()
        self._cell = None

    def _pace(self) -> None:
        """Tell once where actions come at another rate than the simulation takes them for."""
        fps, now = self.config.fps, time.perf_counter()
        if self._count == 0:
            self._began = now
        elif self._count == round(_LOOKED_AT * fps):
            rate = self._count / (now - self._began)
            if abs(rate / fps - 1.0) > _OFF:
                _log.warning(
                    "%.0f actions a second come, and fps is %d: simulated time passes %.1f times as fast as the clock's",
                    rate,
                    fps,
                    rate / fps,
                )
        self._count += 1

    def _tell(self) -> None:
        """Put into the log whether the task has succeeded, judged on the simulated state, if anything was done for it."""
        assert self._cell is not None
        if self._acted:
            session = self._cell.inner.session
            _log.info("layout %d: %s", session.seed, "succeeded" if session.judge().success else "not succeeded")
        self._acted = False
