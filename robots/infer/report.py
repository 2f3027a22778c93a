"""An inferred sidecar as YAML, with the confidence and the evidence of each field beside it."""

from __future__ import annotations

import os
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from robosandbox.robots.findings import FieldEvidence
from robosandbox.robots.infer.sidecar import Inference
from robosandbox.robots.sidecar import SuctionRoles

_WIDTH = 110  # Characters of a line. Chosen: fits terminals of 120.


def to_yaml(inference: Inference, beside: Path | None = None) -> str:
    """Return the sidecar as YAML that loads, every field explained in a comment.

    Args:
        inference: What was found out.
        beside: The folder that the file is for; a gripper's model is named relative to it, and by its whole path without one.
    """
    sidecar, found = inference.sidecar, inference.findings
    lines = [f"# Inferred from {inference.model.path.name}; check it with: robo-sandbox robot check"]
    if len(inference.choices) > 1:
        lines.append(
            f"# This arm: {inference.choices[0]}; others in the file: {', '.join(inference.choices[1:])} (--arm)"
        )
    lines += ["arm:", *_said(found.get("arm.joints"), 2)]
    lines.append(f"  joints: {_list(sidecar.arm.joints)}")
    lines += [*_said(found.get("arm.actuators"), 2), f"  actuators: {_list(sidecar.arm.actuators)}"]
    lines += [*_said(found.get("arm.home_qpos"), 2), f"  home_qpos: {_list(sidecar.arm.home_qpos)}", ""]
    lines += _gripper(inference, beside)
    inject = sidecar.ee_site.inject
    if inject is not None:
        lines += ["ee_site:", "  inject:", f"    attach_body: {_name(inject.attach_body)}"]
        lines += [*_said(found.get("ee_site.inject.xyz"), 4), f"    xyz: {_list(inject.xyz)}"]
        lines += _said(found.get("ee_site.inject.quat_xyzw"), 4)
        if inject.quat_xyzw is not None:
            lines.append(f"    quat_xyzw: {_list(_round(inject.quat_xyzw))}")
        lines.append("")
    lines += ["base_pose:", *_said(found.get("base_pose.xyz"), 2), f"  xyz: {_list(sidecar.base_pose.xyz)}"]
    if sidecar.base_pose.quat_xyzw != (0.0, 0.0, 0.0, 1.0):
        lines.append(f"  quat_xyzw: {_list(_round(sidecar.base_pose.quat_xyzw))}")
    lines += [*_said(found.get("reach"), 2)]
    return "\n".join(lines) + "\n"


def _gripper(inference: Inference, beside: Path | None) -> list[str]:
    roles, found = inference.sidecar.gripper, inference.findings
    if roles is None:
        return [*_said(found.get("gripper"), 0), "# gripper: none", ""]
    lines = [*_said(found.get("gripper"), 0), "gripper:"]
    if isinstance(roles, SuctionRoles):
        lines.append(f"  kind: {roles.kind}")
    if roles.attach is not None:
        model = roles.attach.model
        if beside is not None and model.is_absolute():
            model = Path(os.path.relpath(model, beside))
        place = (
            f"to_site: {_name(roles.attach.to_site)}"
            if roles.attach.to_site
            else f"to_body: {_name(str(roles.attach.to_body))}"
        )
        lines += ["  attach:", f"    model: {_name(str(model))}", f"    {place}"]
        if any(roles.attach.xyz) or roles.attach.quat_xyzw != (0.0, 0.0, 0.0, 1.0):
            lines.append(f"    xyz: {_list(_round(roles.attach.xyz))}")
            lines.append(f"    quat_xyzw: {_list(_round(roles.attach.quat_xyzw))}")
    if isinstance(roles, SuctionRoles):
        lines += [*_said(found.get("gripper.actuator"), 2), f"  actuator: {_name(roles.actuator)}", ""]
        return lines
    lines += [*_said(found.get("gripper.joints"), 2), f"  joints: {_list(roles.joints)}"]
    lines += [*_said(found.get("gripper.primary_joint"), 2), f"  primary_joint: {_name(roles.primary_joint)}"]
    if roles.actuator:
        lines.append(f"  actuator: {_name(roles.actuator)}")
    elif roles.actuators:
        lines.append(f"  actuators: {_list(roles.actuators)}")
    lines += [*_said(found.get("gripper.open_qpos"), 2), f"  open_qpos: {_value(roles.open_qpos)}"]
    lines += [*_said(found.get("gripper.closed_qpos"), 2), f"  closed_qpos: {_value(roles.closed_qpos)}", ""]
    return lines


def document(inference: Inference) -> dict[str, Any]:
    """Return the inference as JSON data."""
    space = inference.workspace
    return {
        "model": str(inference.model.path),
        "name": inference.model.name,
        "sidecar": inference.sidecar.model_dump(mode="json", exclude_none=True),
        "findings": {
            field: {"confidence": item.confidence, "evidence": item.evidence}
            for field, item in inference.findings.items()
        },
        "choices": list(inference.choices),
        "reach": {"near": round(space.near, 4), "far": round(space.far, 4), "tilt": round(space.tilt, 3)},
        "notes": list(inference.notes),
    }


def _said(finding: FieldEvidence | None, indent: int) -> list[str]:
    """Return a comment of a finding, wrapped."""
    if finding is None:
        return []
    words = f"{finding.confidence * 100:.0f}% sure: {finding.evidence}".split()
    lines, line = [], " " * indent + "#"
    for word in words:
        if len(line) + len(word) + 1 > _WIDTH:
            lines.append(line)
            line = " " * indent + "#"
        line += f" {word}"
    return [*lines, line]


def _list(values: Sequence[Any]) -> str:
    return "[" + ", ".join(_value(item) for item in values) + "]"


def _value(value: Any) -> str:
    if isinstance(value, str):
        return _name(value)
    return repr(float(value) + 0.0)


def _round(values: Sequence[float]) -> tuple[float, ...]:
    return tuple(round(float(value), 6) + 0.0 for value in values)


def _name(name: str | None) -> str:
    """Return a name as a YAML scalar; quoted when YAML would read something else."""
    text = str(name)
    plain = text and all(c.isalnum() or c in "_-./" for c in text) and text[0].isalpha() and text.lower() not in _WORDS
    return text if plain else "'" + text.replace("'", "''") + "'"


_WORDS = ("true", "false", "null", "yes", "no", "on", "off")
