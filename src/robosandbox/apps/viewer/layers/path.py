"""Layer with the path that the arm is about to take."""

from __future__ import annotations

import mujoco
import numpy as np

from robosandbox.agent.episode import Intended, SkillStarted
from robosandbox.apps.viewer.layers.layer import Layer
from robosandbox.apps.viewer.layers.trail import polyline
from robosandbox.apps.viewer.news import Idle, Loaded, News
from robosandbox.types import Trajectory

_MOST_POINTS = 80  # Number of points of a path that are drawn. Chosen.
_FIRST, _LAST = np.array([250, 190, 60]), np.array([226, 120, 10])


class PlannedPath(Layer):
    """Draws the TCP's way along the trajectory that is followed next."""

    title = "Planned path"
    hint = "Where the tool centre point is about to go"

    def hear(self, news: News) -> None:
        """Draw a trajectory that is announced, until the next one."""
        match news:
            case Intended(_, Trajectory() as trajectory) if self.shown:
                self._show(trajectory)
            case SkillStarted() | Idle() | Loaded():
                self.clear()
            case _:
                pass

    def _show(self, trajectory: Trajectory) -> None:
        model, robot = self.blueprint.model, self.blueprint.robot
        data = mujoco.MjData(model)
        rows = np.linspace(0, len(trajectory.q) - 1, min(len(trajectory.q), _MOST_POINTS)).round().astype(int)
        points = []
        for q in trajectory.q[rows]:
            data.qpos[robot.qpos_indices] = q
            mujoco.mj_kinematics(model, data)
            points.append(robot.tcp(data)[0])
        if len(points) > 1:
            self.keep("line", polyline(self, "line", np.array(points), _FIRST, _LAST, 4.0))
