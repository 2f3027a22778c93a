"""Panel for the prompt: the sentence that is carried out, its plan, and its outcome."""

from __future__ import annotations

import viser

from robosandbox.agent import episode as events
from robosandbox.apps.viewer import html, operator
from robosandbox.apps.viewer.operator import Doing, News, Operator
from robosandbox.apps.viewer.panels.order_form import mood, order_form
from robosandbox.types import Plan, Refusal, SkillCall

_SIGNS = {"waiting": ("·", "grey"), "running": ("▶", "blue"), "done": ("✓", "green"), "failed": ("✗", "red")}


class PromptPanel:
    """Says what is to be done, and shows the plan before and while it runs.

    Args:
        server: Where.
        control: Carries it out.
    """

    def __init__(self, server: viser.ViserServer, control: Operator) -> None:
        self._control = control
        gui = server.gui
        self._form = gui.add_html(order_form(control.source.workcell.task.prompt))
        self._mood = gui.add_html(mood(False))
        self._board = gui.add_html("")
        self._steps: list[tuple[str, str]] = []
        self._head = ""
        self._phase = ""
        self._away = ""
        self._said: tuple[str, str] | None = None
        self._draw()

    def hear(self, news: News) -> None:
        """Take news."""
        if self._take_of_operator(news) or self._take_of_episode(news):
            self._draw()

    def _take_of_operator(self, news: News) -> bool:
        """Take what the operator does; say whether it was that."""
        match news:
            case operator.Began(doing, what):
                self._phase, self._said = "", None
                if doing in (Doing.RUNNING, Doing.PLANNING):
                    self._head, self._steps = what, []
            case operator.Idle():
                self._phase = ""
            case operator.Answered(_, answer):
                self._answer(answer)
            case operator.Finished(episode, verdict):
                self._said = _outcome(episode, verdict)
            case operator.Went(how):
                self._steps, self._head, self._said = [], "", (how, "grey")
            case operator.Loaded():
                task = self._control.source.workcell.task
                self._form.content = order_form(task.prompt)
                self._steps, self._head, self._said = [], "", (f"loaded {task.name}", "grey")
            case operator.Presence(away):
                self._away = away
            case operator.Complaint(message):
                if self._control.doing is Doing.NOTHING:
                    # It is about what was just asked for, and not about the order that is over.
                    self._steps, self._head = [], ""
                self._said = (message, "red")
            case _:
                return False
        return True

    def _take_of_episode(self, news: News) -> bool:
        """Take what the robot does; say whether it was that."""
        match news:
            case events.Planned(plan, replan):
                self._answer(plan)
                self._phase = "planned anew" if replan else "planned"
            case events.SkillStarted(call, index, _):
                self._steps[index] = (str(call), "running")
            case events.PhaseEntered(_, phase):
                self._phase = phase
            case events.SkillEnded(call, result):
                self._mark(call, "done")
                self._steps += [(effect, "waiting") for effect in result.side_effects]
            case events.SkillFailed(call, error):
                self._mark(call, "failed")
                self._said = (f"{call} at {error.phase}: {error.message}", "red")
            case _:
                return False
        return True

    def _answer(self, answer: Plan | Refusal) -> None:
        if isinstance(answer, Refusal):
            self._steps, self._said = [], (f"refused ({answer.code}): {answer.message}", "amber")
        else:
            self._steps = [(str(call), "waiting") for call in answer.steps]

    def _mark(self, call: SkillCall, state: str) -> None:
        for index, (what, was) in enumerate(self._steps):
            if was == "running" and what == str(call):
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
        if self._head:
            lines.append(html.line(f"“{self._head}”", bold=True))
        if self._steps:
            lines.append(html.heading("Plan"))
            for what, state in self._steps:
                sign, colour = _SIGNS[state]
                lines.append(html.line(what, colour, bold=state == "running", mark=sign))
        if self._said is not None:
            text, colour = self._said
            lines += [html.heading("Outcome"), html.line(text, colour)]
        self._board.content = html.block(*lines)


def _outcome(episode: events.Episode, verdict: object) -> tuple[str, str]:
    judged = getattr(verdict, "success", None)
    if episode.refusal is not None and not episode.attempts:
        return f"refused ({episode.refusal.code}): {episode.refusal.message}", "amber"
    if not episode.success:
        return f"{episode.final_reason.replace('_', ' ')}: {episode.final_detail}", "red"
    if episode.answer:
        return episode.answer, "green"
    seen = "" if judged is None else "; judged on the simulated state: " + ("success" if judged else "no success")
    return f"done: {episode.final_detail}{seen}", "red" if judged is False else "green"
