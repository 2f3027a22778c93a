"""An arm alone: what the model holds besides it is taken away, or stands still."""

from __future__ import annotations

from collections.abc import Iterable

import mujoco

from robosandbox.robots.importers.imported import ImportedModel, compile_spec
from robosandbox.robots.importers.importing import let_neighbours_touch
from robosandbox.robots.importers.welding import weld


def keep_arm(imported: ImportedModel, model: mujoco.MjModel, joints: Iterable[str]) -> None:
    """Remove the trees of a model that the arm does not belong to, and the joints that are neither its nor beyond it.

    A torso, wheels or another arm stay where the file draws them, as firm as the base.

    Args:
        imported: The model; it is changed.
        model: The same, compiled.
        joints: The arm's.
    """
    spec = imported.spec
    arm = [model.joint(name).id for name in joints]
    root = str(model.body(int(model.body_rootid[model.jnt_bodyid[arm[0]]])).name)
    others = [tree for tree in spec.worldbody.bodies if tree.name != root]
    moving = [tree for tree in others if tree.find_all(mujoco.mjtObj.mjOBJ_JOINT) or tree.joints]
    for tree in moving:
        spec.delete(tree)
    if moving:
        imported.notes.append(f"left out beside {root!r}: {', '.join(tree.name for tree in moving)}")
    carried = {int(model.jnt_bodyid[joint]) for joint in arm}
    for body in range(1, model.nbody):
        if int(model.body_parentid[body]) in carried:
            carried.add(body)
    held = {str(model.joint(j).name) for j in range(model.njnt) if int(model.jnt_bodyid[j]) not in carried}
    held = {joint.name for joint in spec.joints if joint.name in held}
    if held:
        weld(spec, model, dict.fromkeys(held))
        let_neighbours_touch(spec, compile_spec(spec, imported.path.name))
        imported.made_actuators &= {actuator.name for actuator in spec.actuators}
        imported.notes.append(f"held still: {', '.join(sorted(held))}")
