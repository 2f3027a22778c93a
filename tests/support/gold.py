"""A task's success as relations: what a planner is told that does not read the sentence."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any

from robosandbox.tasks.judge.checks import AtHome, Beside, Check, Closed, Inside, Lifted, On, Opened, Undisturbed
from robosandbox.tasks.judge.place_checks import InPlaceOf
from robosandbox.types import ObservedScene
from robosandbox.workcell.embedded import EmbeddedWorkcell

_SAID: dict[type[Check], Callable[[Any, ObservedScene], str]] = {
    On: lambda check, scene: f"on({check.object}, {check.target})",
    Inside: lambda check, scene: f"inside({check.object}, {check.target})",
    Beside: lambda check, scene: f"beside({check.object}, {check.target}, {check.side})",
    Lifted: lambda check, scene: f"holding({check.object})",
    Opened: lambda check, scene: f"open({check.object})",
    Closed: lambda check, scene: f"closed({check.object})",
    AtHome: lambda check, scene: "at_home()",
    InPlaceOf: lambda check, scene: f"at({check.object}, {_place(scene, check.target)})",
}


def gold_goal(session: EmbeddedWorkcell) -> str | None:
    """Return the success of a session's task in relations; None where a part of it has none, as a push or a pour."""
    scene = session.observe()
    said = []
    for check in _parts(session.task.success):
        if isinstance(check, Undisturbed):
            continue
        if type(check) not in _SAID:
            return None
        said.append(_SAID[type(check)](check, scene))
    return ", ".join(said)


def _parts(check: Check) -> Iterator[Check]:
    """Yield the criteria that make up one."""
    children = [child for _, child in check.children()]
    if not children:
        yield check
    for child in children:
        yield from _parts(child)


def _place(scene: ObservedScene, name: str) -> str:
    x, y, _ = next(item.pose.xyz for item in scene.objects if item.id == name)
    return f"{x:.4f}, {y:.4f}"
