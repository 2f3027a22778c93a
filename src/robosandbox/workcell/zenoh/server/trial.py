"""Skill calls tried out on the twin of the served world, which is left alone."""

from __future__ import annotations

from robosandbox.agent.tools import simulated
from robosandbox.types import Plan
from robosandbox.workcell.embedded import EmbeddedWorkcell
from robosandbox.workcell.zenoh.messages import Simulate, Trial
from robosandbox.workcell.zenoh.server.changes import WorldChanges
from robosandbox.workcell.zenoh.server.requests import Request


def on_simulate(request: Request, served: EmbeddedWorkcell, changes: WorldChanges) -> None:
    """Answer with what came of the calls, once the world's thread has tried them; `clock` gives it up.

    Raises:
        InvalidMessageError: The message is wrong.
        BusyError: A goal runs, or a change of the world.
    """
    message = request.message(Simulate)

    def simulate() -> Trial:
        agent = served.agent
        result = simulated(agent.ctx, Plan(steps=message.steps), agent.skills, tick=changes.check)
        # A trial that was given up has ended in an error of its own, which is none of the plan's.
        changes.check()
        return Trial(result=result)

    changes.begin("simulate", request, simulate)
