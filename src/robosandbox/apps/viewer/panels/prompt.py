"""Panel for the prompt: the sentence that is carried out, its plan, and its outcome."""

from __future__ import annotations

import viser

from robosandbox.agent import episode as events
from robosandbox.apps.viewer import html
from robosandbox.apps.viewer.control import Control
from robosandbox.apps.viewer.news import Began, Came, Complaint, Doing, Idle, Loaded, News, Presence, Stopped, Went
from robosandbox.apps.viewer.outcome import STOPPED, Line, calls, told
from robosandbox.apps.viewer.panels.order_form import mood, order_form
from robosandbox.error_codes import ErrorCode

_SIGNS = {
    "waiting": ("·", "grey"),
    "running": ("▶", "blue"),
    "done": ("✓", "green"),
    "failed": ("✗", "red"),
    "stopped": ("■", "grey"),
}


class PromptPanel:
    """Says what is to be done, and shows the plan before and while it runs.

    Args:
        server: Where.
        control: Carries it out.
    """

    def __init__(self, server: viser.ViserServer, control: Control) -> None:
        self._control = control
        gui = server.gui
        self._form = gui.add_html(order_form(control.source.host.cell.task.prompt))
        self._mood = gui.add_html(mood(False))
        self._board = gui.add_html("")
        self._steps: list[tuple[str, str]] = []
        self._head = ""
        self._phase = ""
        self._away = ""
        self._said: list[Line] = []
        self._tried = False
        self._note = ""
        # What was said before, from the sentence that a question was asked about on, and the question that is open.
        self._before: list[str] = []
        self._question = ""
        self._draw()

    def hear(self, news: News) -> None:
        """Take news."""
        if self._take_of_operator(news) or self._take_of_episode(news):
            self._draw()

    def _take_of_operator(self, news: News) -> bool:
        """Take what the operator does; say whether it was that."""
        match news:
            case Began(doing, what):
                self._phase = ""
                if doing in (Doing.RUNNING, Doing.PLANNING, Doing.TRYING):
                    self._before = [*self._before, self._head, self._question] if self._question else []
                    self._question = ""
                    self._head, self._steps, self._note, self._tried = f"“{what}”", [], "", False
                self._said = self._asked()
            case Idle():
                self._phase = ""
            case Came():
                self._take_what_came(news)
                self._question = news.question.message if news.question else self._question
            case Stopped():
                self._said = [STOPPED]
            case Went(how):
                self._clear((how, "grey"))
            case Loaded():
                task = self._control.source.host.cell.task
                self._form.content = order_form(task.prompt)
                self._clear((f"loaded {task.name}", "grey"))
            case Presence(away):
                self._away = away
            case Complaint(message):
                if self._control.doing is Doing.NOTHING:
                    # It is about what was just asked for, and not about the order that is over.
                    self._steps, self._head, self._note = [], "", ""
                self._said = [*self._asked(), (message, "red")]
            case _:
                return False
        return True

    def _take_of_episode(self, news: News) -> bool:
        """Take what the robot does; say whether it was that."""
        match news:
            case events.Planned(plan, replan):
                self._steps, self._note = [(str(call), "waiting") for call in plan.steps], plan.note
                self._phase = "planned anew" if replan else "planned"
            case events.SkillStarted(call, index, _):
                self._steps[index] = (str(call), "running")
            case events.PhaseEntered(_, phase):
                self._phase = phase
            case events.SkillEnded(call, result):
                self._mark(str(call), "done")
                self._steps += [(effect, "waiting") for effect in result.side_effects]
            case events.SkillFailed(call, error):
                if error.code == ErrorCode.CANCELLED:
                    self._mark(str(call), "stopped")
                else:
                    self._mark(str(call), "failed")
                    self._said = [(f"{call} at {error.phase}: {error.message}", "red")]
            case _:
                return False
        return True

    def _asked(self) -> list[Line]:
        """Return the question that is open still, if one is."""
        return [(self._question, "amber")] if self._question else []

    def _clear(self, said: Line) -> None:
        self._steps, self._head, self._note, self._said = [], "", "", [said]
        self._before, self._question = [], ""

    def _take_what_came(self, came: Came) -> None:
        data, said = came.result.data, told(came)
        match came.order.name:
            case "plan":
                self._steps, self._note = [(call, "waiting") for call in calls(data)], data.get("note", "")
            case "simulate":
                self._tried = True
                for call in data.get("would_work", ()):
                    self._mark(call, "done", before="waiting")
                self._mark(data.get("would_fail", ""), "stopped" if STOPPED in said else "failed", before="waiting")
            case "judge":
                # After a prompt the verdict stands below what came of it.
                said = self._said + said
            case _:
                pass
        self._said = said

    def _mark(self, call: str, state: str, *, before: str = "running") -> None:
        for index, (what, was) in enumerate(self._steps):
            if was == before and what == call:
                self._steps[index] = (what, state)
                return

    def _draw(self) -> None:
        doing = self._control.doing
        style = mood(doing in (Doing.RUNNING, Doing.MOVING))
        if self._mood.content != style:
            self._mood.content = style
        lines = [html.line(self._away, "red", bold=True, mark="●")] if self._away else []
        if doing is not Doing.NOTHING:
            lines.append(html.line(f"{doing}{': ' + self._phase if self._phase else ''}", "blue", bold=True, mark="●"))
        elif not self._away:
            lines.append(html.line("ready", "grey", mark="●"))
        lines += [html.line(text, "grey") for text in self._before if text]
        if self._head:
            lines.append(html.line(self._head, bold=True))
        if self._steps:
            lines.append(html.heading("Tried on the twin" if self._tried else "Plan"))
            for what, state in self._steps:
                sign, colour = _SIGNS[state]
                lines.append(html.line(what, colour, bold=state == "running", mark=sign))
        if self._note:
            lines.append(html.line(self._note, "grey"))
        if self._said:
            lines += [html.heading("Outcome"), *(html.line(text, colour) for text, colour in self._said)]
        self._board.content = html.block(*lines)
