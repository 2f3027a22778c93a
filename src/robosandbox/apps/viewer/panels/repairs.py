"""After a failure: what was measured, and what would do instead, as buttons."""

from __future__ import annotations

import math
from typing import Any

import viser

from robosandbox.agent.episode import SkillFailed
from robosandbox.apps.viewer import html
from robosandbox.apps.viewer.control import Control
from robosandbox.apps.viewer.news import Began, Came, Doing, Loaded, News, Went
from robosandbox.apps.viewer.theme import BRAND
from robosandbox.error_codes import ErrorCode
from robosandbox.errors import Failure, Repair
from robosandbox.types import Plan
from robosandbox.workcell.orders import ORDERS

# Of the evidence, what is in metres whatever the error.
_LENGTHS = frozenset(
    {
        "position_error",
        "depth",
        "object_width",
        "aperture",
        "max_aperture",
        "commanded",
        "along",
        "across",
        "opening",
        "moved",
        "wanted",
    }
)


class RepairsPanel:
    """Shows the last failure's evidence, and a button for each repair that was tried on the twin.

    Args:
        server: Where.
        control: Carries a repair out.
    """

    def __init__(self, server: viser.ViserServer, control: Control) -> None:
        self._gui = server.gui
        self._control = control
        self._folder = server.gui.add_folder("Failure", visible=False)
        self._made: list[viser.GuiButtonHandle | viser.GuiHtmlHandle] = []
        self._error: Failure | None = None

    def hear(self, news: News) -> None:
        """Take news."""
        match news:
            case SkillFailed(_, error):
                # What a person stopped needs no repair.
                self._error = None if error.code == ErrorCode.CANCELLED else error
            case Began(Doing.RUNNING | Doing.PLANNING | Doing.TRYING, _) | Went() | Loaded():
                self._error = None
                self._show()
            case Came(order, answer) if ORDERS[order.name].moves:
                self._error = None if answer.failure is None else self._error
                self._show()
            case _:
                pass

    def _show(self) -> None:
        for made in self._made:
            made.remove()
        self._made = []
        self._folder.visible = self._error is not None
        if self._error is None:
            return
        error = self._error
        with self._folder:
            self._say(
                html.line(f"{error.code} during {error.phase}", "red", bold=True),
                html.heading("Would work instead" if error.repairs else "No repair was found"),
            )
            for number, repair in enumerate(error.repairs, start=1):
                self._add(number, repair)
            if error.evidence is not None:
                measured = html.rows(_pairs(error.evidence.model_dump(mode="json")))
                self._say(html.heading("What was measured"), measured)

    def _say(self, *lines: str) -> None:
        self._made.append(self._gui.add_html(html.block(*lines)))

    def _add(self, number: int, repair: Repair) -> None:
        """Add what a repair does, and under it the button that carries it out."""
        self._say(html.line(f"{repair.why}: {', '.join(map(str, repair.calls))}", mark=str(number)))
        button = self._gui.add_button(
            f"Repair {number} ({repair.cost:.0f} s)", color=BRAND, icon=viser.Icon.TOOL, hint=repair.why
        )
        button.on_click(lambda _: self._control.follow(Plan(steps=repair.calls)))
        self._made.append(button)


def _pairs(evidence: dict[str, Any]) -> list[tuple[str, str]]:
    return [(name.replace("_", " "), _measured(name, value)) for name, value in evidence.items()]


def _measured(name: str, value: Any) -> str:
    if name in _LENGTHS and isinstance(value, float):
        return f"{html.number(1000.0 * value, 1)} mm"
    if name == "orientation_error":
        return f"{html.number(math.degrees(value), 1)}°"
    return _words(value)


def _words(value: Any) -> str:
    match value:
        case bool() | None:
            return {None: "none", True: "yes", False: "no"}[value]
        case float():
            return f"{value:.4g}"
        case {"xyz": xyz, **rest}:
            del rest
            return "(" + ", ".join(html.number(c, 3) for c in xyz) + ") m"
        case dict():
            return ", ".join(f"{count} {name}" for name, count in value.items()) or "none"
        case list():
            return ", ".join(map(_words, value)) or "none"
        case _:
            return str(value)
