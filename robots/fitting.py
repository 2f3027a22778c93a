"""A model made fit for its roles: a site at the tool centre point, and servos that grip as a hand does."""

from __future__ import annotations

import mujoco
import numpy as np

from robosandbox.robots.importers.imported import ImportedModel, compile_spec, get_scalar, put_scalar
from robosandbox.robots.importers.servos import GRIP_FORCE, ROTOR_PER_EFFORT, get_armature, joint_bounds, write_gains
from robosandbox.robots.sidecar import GripperRoles, Sidecar

TCP_SITE = "robosandbox_tcp"
_GRIP_ERROR = 0.05  # Share of its travel by which a finger is off when it presses with all of its force. Chosen.
# Newtons at the fingertips below which a gripper's servos are stiffened. Chosen: two fingers hold 0.4 kg at a friction of 1
# twice over.
_LEAST_GRIP_FORCE = 4.0
# Newtons beyond what common grippers give. Chosen because a light object under more is pressed out of their grip, not held.
_MOST_GRIP_FORCE = 100.0


def fit_roles(imported: ImportedModel, sidecar: Sidecar) -> str:
    """Change a model to fit its roles, and return the name of its TCP site.

    What a gripper does is measured on a model after this, by whoever asks: its servos decide how far it closes.
    """
    tcp_site = _place_tcp(imported.spec, sidecar)
    if sidecar.fingers and imported.options is None:
        fit_grip(imported, sidecar.fingers, tcp_site)
    return tcp_site


def _place_tcp(spec: mujoco.MjSpec, sidecar: Sidecar) -> str:
    inject = sidecar.ee_site.inject
    if inject is None:
        return str(sidecar.ee_site.name)
    x, y, z, w = inject.quat_xyzw or (0.0, 0.0, 0.0, 1.0)
    spec.body(inject.attach_body).add_site(name=TCP_SITE, pos=inject.xyz, quat=[w, x, y, z], size=[0.005] * 3, group=4)
    return TCP_SITE


def fit_grip(imported: ImportedModel, roles: GripperRoles, tcp_site: str) -> None:
    """Let gripper servos press as a hand does: those that the import made, that would crush what they hold, or hold nothing."""
    spec = imported.spec
    model = compile_spec(spec, imported.path.name)
    data = mujoco.MjData(model)
    mujoco.mj_fwdPosition(model, data)
    tcp = data.site_xpos[model.site(tcp_site).id]
    low, high = joint_bounds(model)
    for name in roles.actuator_names:
        actuator = spec.actuator(name)
        if actuator is None or actuator.trntype != mujoco.mjtTrn.mjTRN_JOINT:
            continue
        joint = model.joint(actuator.target).id
        lever = 1.0
        if model.jnt_type[joint] == mujoco.mjtJoint.mjJNT_HINGE.value:
            offset = tcp - data.xanchor[joint]
            lever = max(float(np.linalg.norm(np.cross(data.xaxis[joint], offset))), 0.01)
        travel = float(high[joint] - low[joint])
        if name in imported.made_actuators:
            force = min(GRIP_FORCE * lever, float(abs(actuator.forcerange[1])))
            write_gains(actuator, *_grip_gains(model, joint, force, travel), force)
            continue
        gear = abs(float(actuator.gear[0])) or 1.0
        limited = actuator.forcerange[1] > actuator.forcerange[0]
        force = float(np.abs(actuator.forcerange).max()) if limited else -float(actuator.biasprm[1]) * gear * travel
        friction = float(model.dof_frictionloss[model.jnt_dofadr[joint]])
        weakest = -float(actuator.biasprm[1]) * gear**2 * travel / 2.0
        if weakest < _LEAST_GRIP_FORCE * lever + friction:
            wanted = GRIP_FORCE * lever + friction
            wanted = min(wanted, force * gear) if limited else wanted
            _stiffen(spec.joint(actuator.target), actuator, model, wanted, travel)
            imported.notes.append(
                f"actuator {name!r} would press with {max(0.0, weakest - friction) / lever:.1f} N at the fingertips when half "
                f"open: stiffened to {(wanted - friction) / lever:.0f} N"
            )
            continue
        most = (_MOST_GRIP_FORCE * lever + friction) / gear
        if force > most:
            actuator.forcelimited = mujoco.mjtLimited.mjLIMITED_TRUE
            actuator.forcerange = [-most, most]
            _damp_at_force_limit(
                spec.joint(actuator.target), actuator, model, most * gear, _MOST_GRIP_FORCE * lever / travel
            )
            imported.notes.append(
                f"actuator {name!r} could press with {(force * gear - friction) / lever:.0f} N at the fingertips: "
                f"limited to {_MOST_GRIP_FORCE:.0f} N"
            )


def _grip_gains(model: mujoco.MjModel, joint: int, force: float, travel: float) -> tuple[float, float]:
    """Return stiffness and damping with which a finger presses with `force`, N or N m, a small share off its target."""
    kp = force / (_GRIP_ERROR * travel)
    inertia = max(float(model.dof_M0[model.jnt_dofadr[joint]]), ROTOR_PER_EFFORT * force)
    return kp, 2.0 * float(np.sqrt(kp * inertia))


def _stiffen(
    joint: mujoco.MjsJoint, actuator: mujoco.MjsActuator, model: mujoco.MjModel, force: float, travel: float
) -> None:
    """Give a finger's servo the stiffness to press with `force`, N or N m; its controls keep their meaning."""
    kp, kd = _grip_gains(model, model.joint(joint.name).id, force, travel)
    gear = abs(float(actuator.gear[0])) or 1.0
    gain, bias = np.array(actuator.gainprm), np.array(actuator.biasprm)
    factor = kp / gear**2 / -bias[1]
    gain[0], bias[:2] = factor * gain[0], factor * bias[:2]
    actuator.gainprm, actuator.biasprm = gain, bias
    actuator.forcelimited = mujoco.mjtLimited.mjLIMITED_TRUE
    actuator.forcerange = [-force / gear, force / gear]
    put_scalar(joint, "damping", max(kd, get_scalar(joint, "damping")))
    _damp_at_force_limit(joint, actuator, model, force, kd)


def _damp_at_force_limit(
    joint: mujoco.MjsJoint, actuator: mujoco.MjsActuator, model: mujoco.MjModel, force: float, damping: float
) -> None:
    """Let a finger that presses with up to `force` come to rest on what it holds: at most this damping, all in its joint.

    At its force limit a servo's own damping is no longer integrated implicitly, and a finger much lighter than what pushes
    it trembles on what it holds and works itself off: it gets the rotor that such a force comes from.
    """
    bias = np.array(actuator.biasprm)
    bias[2] = 0.0
    actuator.biasprm = bias
    own = max(0.0, -float(model.actuator_biasprm[model.actuator(actuator.name).id, 2])) * float(actuator.gear[0]) ** 2
    put_scalar(joint, "damping", min(get_scalar(joint, "damping") + own, damping))
    joint.armature = max(get_armature(joint), ROTOR_PER_EFFORT * force)
