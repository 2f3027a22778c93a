"""What came of an order, in lines for a person."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from robosandbox.agent.episode import FinalReason
from robosandbox.apps.viewer.news import Came, is_question
from robosandbox.error_codes import ErrorCode
from robosandbox.types import Refusal, SkillCall

# Text, and a key of `html.COLOURS`.
Line = tuple[str, str]
STOPPED: Line = ("stopped: the arm holds where it was", "grey")


def told(came: Came) -> list[Line]:
    """Return what came of an order; a plan's steps are told elsewhere."""
    data = came.result.data
    match came.order.name:
        case "plan":
            return _refused(came.refusal) if came.refusal else _planned(data)
        case "simulate":
            return _tried(data)
        case "judge":
            return _judged(data)
        case "check":
            return _checked(data)
        case "recover":
            return [(f"recovered from: {data['fault']}" if data["fault"] else "there was no fault", "green")]
        case _:
            return _ended(data, came.refusal)


def calls(data: Mapping[str, Any]) -> list[str]:
    """Return the steps of a plan that an order has answered."""
    return [str(SkillCall.model_validate(step)) for step in data.get("plan") or ()]


def _refused(refusal: Refusal) -> list[Line]:
    return [(refusal.message if is_question(refusal) else f"refused ({refusal.code}): {refusal.message}", "amber")]


def _planned(data: Mapping[str, Any]) -> list[Line]:
    if not data["plan"]:
        return [(data.get("answer") or "nothing has to be done", "green")]
    return [(f"then look: “{data['then']}”, and go on", "grey")] if "then" in data else []


def _ended(data: Mapping[str, Any], refusal: Refusal | None) -> list[Line]:
    reason, detail = data["reason"], data["detail"]
    match reason:
        case FinalReason.REFUSED if refusal is not None:
            return _refused(refusal)
        case FinalReason.CANCELLED:
            return [STOPPED]
        case _ if not data["success"]:
            return [(f"{reason.replace('_', ' ')}: {detail}", "red")]
        case _:
            return [(data["answer"] or f"done: {detail}", "green")]


def _tried(data: Mapping[str, Any]) -> list[Line]:
    error = data.get("error")
    if error is not None and error["code"] == ErrorCode.CANCELLED:
        return [STOPPED]
    lines = _problems(data)
    if error is not None:
        lines.append((f"{data['would_fail']} would fail at {error['phase']}: {error['message']}", "red"))
    elif data["ok"]:
        lines.append((f"would work, in {data['seconds']:.1f} simulated seconds; nothing has moved", "green"))
    if data.get("would_touch"):
        lines.append((f"would touch {', '.join(data['would_touch'])} on the way", "amber"))
    lines += [(effect, "amber") for effect in data.get("side_effects", ())]
    return lines + [(f"then {_stands(thing)}", "ink") for thing in data.get("changes", {}).get("objects", ())]


def _checked(data: Mapping[str, Any]) -> list[Line]:
    return _problems(data) or [("nothing speaks against the plan; nothing has moved", "green")]


def _problems(data: Mapping[str, Any]) -> list[Line]:
    return [
        (f"{problem['call'] or 'the plan'}: {problem['error']['message']}", "red")
        for problem in data.get("problems", ())
    ]


def _stands(thing: Mapping[str, Any]) -> str:
    """Return how a thing stands, as `described.describe_scene` has it."""
    match thing:
        case {"id": name, "state": state}:
            return f"{name} is {state}"
        case {"id": name, "in": "gripper"}:
            return f"{name} is in the gripper"
        case {"id": name, "in": str(vessel)}:
            return f"{name} is in {vessel}"
        case {"id": name, "on": str(support), "position": [x, y, _]}:
            return f"{name} is on {support}, at ({x:.2f}, {y:.2f}) m"
        case _:
            return f"{thing['id']} lies elsewhere"


def _judged(data: Mapping[str, Any]) -> list[Line]:
    measured = ", ".join(f"{name} {value:.4g}" for name, value in data["detail"].items())
    said = "success" if data["success"] else "no success"
    return [
        (f"judged on the simulated state: {said}", "green" if data["success"] else "red"),
        *([(measured, "grey")] if measured else []),
    ]
