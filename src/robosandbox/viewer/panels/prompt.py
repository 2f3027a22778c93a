"""The prompt box: what to do, the plan for it, what is under way, and Run, Stop, Reset and Step back."""

from __future__ import annotations

import viser

from robosandbox.agent import episode as events
from robosandbox.types import Plan, Refusal, SkillCall
from robosandbox.viewer import html, operator
from robosandbox.viewer.handles import assign
from robosandbox.viewer.operator import Doing, News, Operator

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
        with gui.add_form(None) as form:
            self._prompt = gui.add_text("Prompt", control.cell.workcell.task.prompt, hint="What the robot should do")
            self._run = gui.add_button("Run", color="green", icon=viser.Icon.PLAYER_PLAY, hint="Enter does the same")
        self._stop = gui.add_button("Stop", color="red", icon=viser.Icon.PLAYER_STOP, hint="The arm holds where it is")
        self._more = gui.add_button_group("", ("Plan", "Reset", "Step back"))
        self._seed = gui.add_number(
            "Seed", 0, min=0, step=1, hint="The layout that Reset makes; 0 is the task as written"
        )
        self._board = gui.add_html("")
        self._steps: list[tuple[str, str]] = []
        self._head = ""
        self._phase = ""
        self._said: tuple[str, str] | None = None
        form.on_submit(lambda _: self._clicked_run())
        self._run.on_click(lambda _: form.submit())
        self._stop.on_click(lambda _: control.stop())
        self._more.on_click(lambda _: self._clicked_more())
        self._enable()
        self._draw()

    def hear(self, news: News) -> None:
        """Take news."""
        match news:
            case operator.Began(doing, what):
                self._phase, self._said = "", None
                if doing in (Doing.RUNNING, Doing.PLANNING):
                    self._head, self._steps = what, []
            case operator.Idle():
                self._phase = ""
            case operator.Answered(_, answer):
                self._answer(answer)
            case events.Planned(plan, replan):
                self._answer(plan)
                self._phase = "planned anew" if replan else "planned"
            case events.SkillStarted(call, index, _):
                self._steps[index] = (str(call), "running")
            case events.PhaseEntered(_, phase):
                self._phase = phase
            case events.SkillEnded(call, result):
                self._mark(call, "done")
                for effect in result.side_effects:
                    self._steps.append((effect, "waiting"))
            case events.SkillFailed(call, error):
                self._mark(call, "failed")
                self._said = (f"{call} at {error.phase}: {error.message}", "red")
            case operator.Finished(episode, verdict):
                self._said = _outcome(episode, verdict)
            case operator.Went(how):
                self._steps, self._head, self._said = [], "", (how, "grey")
            case operator.Loaded():
                task = self._control.cell.workcell.task
                assign(self._prompt, task.prompt)
                self._steps, self._head, self._said = [], "", (f"loaded {task.name}", "grey")
            case operator.Complaint(message):
                self._said = (message, "red")
            case _:
                return
        self._enable()
        self._draw()

    def _clicked_run(self) -> None:
        if prompt := self._prompt.value.strip():
            self._control.run(prompt)

    def _clicked_more(self) -> None:
        match self._more.value:
            case "Plan":
                if prompt := self._prompt.value.strip():
                    self._control.plan(prompt)
            case "Reset":
                self._control.reset(int(self._seed.value))
            case _:
                self._control.back()

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

    def _enable(self) -> None:
        # Stop can be clicked at any time: nobody should have to wait for it to be enabled.
        self._run.disabled = self._control.doing is not Doing.NOTHING

    def _draw(self) -> None:
        doing = self._control.doing
        lines = []
        if doing is Doing.NOTHING:
            lines.append(html.line("ready", "grey", mark="●"))
        else:
            lines.append(html.line(f"{doing}{': ' + self._phase if self._phase else ''}", "blue", bold=True, mark="●"))
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
        return f"{episode.final_reason}: {episode.final_detail}", "red"
    seen = "" if judged is None else "; judged on the simulated state: " + ("success" if judged else "no success")
    return f"done: {episode.final_detail}{seen}", "red" if judged is False else "green"
