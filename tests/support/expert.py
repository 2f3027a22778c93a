"""A scripted expert in place of a model: it acts call by call over HTTP, by the grammar's plan, evidence and repairs.

```python
with open_session(task, planner="openai", planner_options={..., "mode": "act", "base_url": server.url}) as session:
    expert.meet(session)
    session.run()
```
It shows what the loop around a model is worth: where the expert fails and the grammar's own agent does not, the loop lost something.
"""

from __future__ import annotations

import json
from collections import deque
from collections.abc import Mapping
from typing import Any

from robosandbox.agent.planner import StubPlanner
from robosandbox.agent.protocols import Attempt
from robosandbox.apps.conformance.openai_server import HttpAnswer, fails, tool_calls
from robosandbox.errors import Failure
from robosandbox.types import Plan, SkillCall
from robosandbox.workcell.embedded import EmbeddedWorkcell
from robosandbox.world.operators import Operator


class Expert:
    """Answers a `ScriptedServer`'s requests; the world stands still while it is asked."""

    def __init__(self) -> None:
        self._session: EmbeddedWorkcell | None = None

    def meet(self, session: EmbeddedWorkcell, prompt: str | None = None) -> None:
        """Take the session whose model it is, and what will be said there: the task's prompt where left out."""
        self._session = session
        self._prompt = session.task.prompt if prompt is None else prompt
        skills: list[Operator] = [*session.skills]
        self._planner = StubPlanner(skills)
        self._left: deque[SkillCall] = deque()
        self._done: list[SkillCall] = []
        self._attempts: list[Attempt] = []
        self._moved = False

    def __call__(self, body: dict[str, Any]) -> HttpAnswer:
        """Return the next call; a request for JSON by a schema is refused, since results of native calls alone are read."""
        if "response_format" in body:
            return fails(400, "response_format is not supported")
        newest = body["messages"][-1]
        told = json.loads(newest["content"]) if newest["role"] == "tool" else None
        if told is None:
            return self._planned()
        if told["ok"]:
            self._done.append(self._left.popleft())
            self._moved = True
            return self._next()
        return self._after(told)

    def _after(self, told: Mapping[str, Any]) -> HttpAnswer:
        """Return the first call of a new plan, now that a call has failed or was turned down."""
        if "error" not in told or not isinstance(told["error"], dict):
            return _refuse("impossible", json.dumps(told)[:300])
        failed = self._left.popleft() if self._left else self._done[-1]
        by_words = {str(call): call for call in (*self._done, *self._left, failed)}
        remaining = tuple(by_words[text] for text in told.get("not_begun", ()) if text in by_words)
        done = tuple(self._done)
        if str(failed) != told.get("failed", str(failed)):
            # Something that an earlier call brought about was undone.
            failed, done = by_words[told["failed"]], ()
        error = Failure.model_validate(told["error"])
        attempt = Attempt(completed=done, failed=failed, error=error, remaining=(*remaining, *self._left))
        self._attempts.append(attempt)
        return self._planned()

    def _planned(self) -> HttpAnswer:
        assert self._session is not None
        plan = self._planner.plan(self._prompt, self._session.observe(), tuple(self._attempts))
        if not isinstance(plan, Plan):
            return _refuse(plan.code.value, plan.message)
        self._left, self._done = deque(plan.steps), []
        return self._next()

    def _next(self) -> HttpAnswer:
        if self._left:
            return tool_calls((self._left[0].skill, json.dumps(dict(self._left[0].arguments))))
        return tool_calls(
            ("finish", json.dumps({"summary": "That is done.", "holds": [] if self._moved else ["at_home"]}))
        )


def _refuse(code: str, message: str) -> HttpAnswer:
    return tool_calls(("refuse", json.dumps({"code": code, "message": message})))
