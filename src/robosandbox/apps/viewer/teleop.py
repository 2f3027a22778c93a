"""Teleoperation of a workcell in this process: the TCP is jogged, and objects are placed elsewhere where they are simulated."""

from __future__ import annotations

from collections.abc import Callable

import mujoco
import numpy as np

from robosandbox.errors import InputError
from robosandbox.sim.mujoco_backend import MuJoCoBackend
from robosandbox.sim.opening import require_mujoco
from robosandbox.sim.saved_state import continue_from, take_state
from robosandbox.sim.sleep_timer import moving_count
from robosandbox.types import Pose
from robosandbox.workcell.embedded import EmbeddedWorkcell

_JOG_SPEED = 0.35  # Share of the arm's speed at which it is jogged. Chosen.
_ARRIVAL = 0.06  # Simulated seconds to come to rest after a step. Chosen.
# Simulated seconds that a gripper gets to open or close. Chosen: servos of real grippers take about one.
_GRIP_SECONDS = 0.8
_FALL_SECONDS = 3.0  # Simulated seconds after which a thing that still moves is left. Chosen.
_LOOK_SECONDS = 0.05  # Simulated seconds between looks at it. Chosen.
_STILL = 0.005  # Speed, m/s, of a thing that lies still. Chosen.
_INSIDE = 0.001  # Metres of overlap that are no touch. Chosen.


class EmbeddedTeleop:
    """Moves a session's arm, and the things of a simulated world; for the world's thread.

    Args:
        session: The loaded task.
        shown: Called when something was put elsewhere without time passing.
    """

    def __init__(self, session: EmbeddedWorkcell, shown: Callable[[], None]) -> None:
        self._session = session
        self._driver = session.driver
        self._shown = shown

    def place(self, object_id: str, pose: Pose) -> None:
        """Put an object somewhere, at rest.

        Raises:
            InputError: It would be inside something; it then stays where it was.
            UnsupportedError: The world is none that can be changed by hand.
        """
        sim = self._simulation
        model = sim.model
        body = sim.object_bodies[object_id]
        scratch = mujoco.MjData(model)
        continue_from(model, scratch, sim.snapshot())
        q, v = int(model.jnt_qposadr[model.body_jntadr[body]]), int(model.body_dofadr[body])
        x, y, z, w = pose.quat_xyzw
        scratch.qpos[q : q + 7] = [*pose.xyz, w, x, y, z]
        scratch.qvel[v : v + 6] = 0.0
        # Wakes it, and what it touched or touches now.
        mujoco.mj_fwdPosition(model, scratch)
        scratch.tree_asleep[scratch.tree_asleep < 0] = moving_count(model)
        for contact in scratch.contact[: scratch.ncon]:
            pair = [int(model.geom_bodyid[geom]) for geom in contact.geom]
            if body in pair and contact.dist < -_INSIDE:
                other = sim.body_names[pair[0] if pair[1] == body else pair[1]]
                raise InputError(f"{object_id} would be {-contact.dist * 1000:.1f} mm inside {other}; put it elsewhere")
        sim.restore(take_state(model, scratch))
        self._shown()

    def let_go(self) -> None:
        """Let time pass until all objects lie still, for a few seconds at most."""
        sim = self._simulation
        give_up = sim.time + _FALL_SECONDS
        with self._session.ctx.goal():
            while sim.time < give_up:
                self._driver.wait(_LOOK_SECONDS)
                speeds = [np.abs(item.linear_velocity).max() for item in sim.truth().objects.values()]
                if max(speeds, default=0.0) < _STILL:
                    return

    def jog(self, change: Pose) -> None:
        """Move the TCP: `change.xyz` in the world, `change`'s rotation about the TCP's own axes.

        Raises:
            SkillError: It is out of reach, something is in the way, or a limit forbids it.
        """
        ctx, driver = self._session.ctx, self._driver
        scene = ctx.look()
        arm = driver.arms[ctx.arm.name]
        ctx.motion.use(ctx.planning(scene), arm.state(), held=scene.held)
        ctx.motion.allow(*self._touched(scene.held))
        seen = arm.state()
        goal = Pose.from_matrix(seen.tcp_pose.position + change.position, seen.tcp_pose.rotation @ change.rotation)
        with ctx.goal():
            arm.follow(ctx.motion.plan_line(seen.q, goal, speed=_JOG_SPEED))
            driver.wait(_ARRIVAL)

    def grip(self, closed: bool) -> None:
        """Close or open the gripper.

        Raises:
            InputError: The robot has none.
        """
        ctx = self._session.ctx
        if ctx.hand is None:
            raise InputError(f"{ctx.arm.spec.name} has no gripper")
        self._driver.hands[ctx.hand.name].set_gripper(1.0 if closed else 0.0)
        with self._session.ctx.goal():
            self._driver.wait(_GRIP_SECONDS)

    @property
    def _simulation(self) -> MuJoCoBackend:
        return require_mujoco(self._driver, "things are put elsewhere in it by hand")

    def _touched(self, held: str | None) -> set[str]:
        """Return what is known to be touched already, which must not keep the arm from moving on, or away."""
        driver = self._driver
        touched = {held} if held is not None else set()
        if driver.capabilities.contact == "named":
            touched |= {other for _, other in driver.senses.contacts(self._session.ctx.arm.name)}
        if held is not None and driver.simulation is not None:
            touched |= set(driver.simulation.truth().objects[held].contacts)
        return touched
