"""A scene's sidecar as YAML, with what was found in the file beside each field, and a picture."""

from __future__ import annotations

from typing import Any

from robosandbox.sim.scene_file import SceneFile
from robosandbox.types import Scene, SceneObject


def to_yaml(file: SceneFile, base: tuple[float, float, float, float], why: str) -> str:
    """Return a sidecar that loads and changes nothing, every field explained in a comment.

    Args:
        file: The scene.
        base: Where the robot stands.
        why: Why there, in words.
    """
    lines = [f"# Inferred from {file.path.name}; check it with: robo-sandbox scene check {file.path.name}", ""]
    lines += [f"# {why}", f"robot_base: [{', '.join(f'{value:.4g}' for value in base)}]  # x, y, z, yaw", ""]
    area = " x ".join(f"{low:.2f}..{high:.2f}" for low, high in file.table.area)
    lines += [f"# {file.table.why}: top at {file.table.height:.3f} m, {area} m"]
    lines += [f"table: {file.table.body}", ""]
    lines += ["# Bodies that are not in the scene, with all on them."]
    lines += [f"#   {name}: {reason}" for name, reason in file.left_out.items()]
    lines += [f"leave_out: [{', '.join(file.sidecar.leave_out)}]", ""]
    if file.keyframes:
        lines += [
            f"# The file has the keyframes {', '.join(key.name for key in file.keyframes)}; it starts as it stands."
        ]
        lines += ["# keyframe: " + file.keyframes[0].name, ""]
    lines += ["# By the bodies' names: what they are called, their kind and colour."]
    lines += ["objects:"] if file.objects else ["objects: {}"]
    for item in file.objects:
        lines += [f"  # {described(item)}", f"  {item.body}: {{id: {item.id}}}"]
    return "\n".join(lines) + "\n"


def described(item: SceneObject) -> str:
    """Return what an object of a file was found to be, and by what, in words."""
    if item.geometry is None:
        numbers = " x ".join(f"{2e3 * value:.0f}" for value in item.size)
        return f"a {item.kind}, {numbers} mm, {1e3 * item.mass:.0f} g: free, one piece"
    geometry = item.geometry
    whole = " x ".join(f"{2e3 * half:.0f}" for half in geometry.box[1])
    count = len(geometry.pieces)
    pieces = f"{count} convex piece{'s' if count != 1 else ''}"
    if geometry.joint is not None:
        joint = geometry.joint
        unit = (180.0 / 3.14159265, "deg") if joint.kind == "hinge" else (1e3, "mm")
        span = f"{joint.low * unit[0]:.0f}..{joint.high * unit[0]:.0f} {unit[1]}"
        spring = ", with a spring" if joint.stiffness else ""
        return f"a part on a {joint.kind}, {span}{spring}, {whole} mm, {pieces}"
    hollow = geometry.hollow if item.shape.holds_things else None
    inside = ""
    if hollow is not None:
        width = " x ".join(f"{2e3 * half:.0f}" for half in hollow.half)
        inside = f", hollow {width} mm wide and {1e3 * (hollow.rim - hollow.floor):.0f} mm deep"
    faces = [face for face in geometry.surfaces if face.half_width > 0.02]
    tops = ", ".join(f"{face.height + item.pose.xyz[2]:.3f} m" for face in faces)
    if item.is_fixed:
        return f"a {item.kind}, {whole} mm, {pieces}; level faces at {tops or 'no height'}"
    return f"a {item.kind}, {whole} mm, {1e3 * item.mass:.0f} g, {pieces}{inside}: free"


def document(file: SceneFile, scene: Scene, why: str) -> dict[str, Any]:
    """Return what was found as JSON data."""
    return {
        "file": str(file.path),
        "table": {"body": file.table.body, "height": file.table.height, "area": file.table.area, "why": file.table.why},
        "robot_base": scene.robot_base,
        "robot_base_why": why,
        "left_out": file.left_out,
        "keyframes": [key.name for key in file.keyframes],
        "objects": [
            {
                "id": item.id,
                "body": item.body,
                "kind": item.kind,
                "rgba": item.rgba,
                "mass": item.mass,
                "pose": item.pose.model_dump(mode="json"),
                "found": described(item),
            }
            for item in file.objects
        ],
        "notes": list(file.notes),
    }
