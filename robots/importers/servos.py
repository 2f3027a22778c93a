"""Position servos where a model has motors or nothing at all, sized from effort, speed and the inertia they move."""

from __future__ import annotations

import mujoco
import numpy as np

from robosandbox.robots.importers.imported import ImportedModel, compile_spec, get_scalar
from robosandbox.robots.tolerances import ROBOT_TOLERANCES
from robosandbox.types import Array

# Position error, radians or metres, at which a servo gives all its effort. Chosen: about a degree.
_FULL_EFFORT_ERROR = 0.02
# Natural frequency of a servo, rad/s. Chosen because a faster one outruns a physics step of 2 ms.
_MAX_FREQUENCY = 100.0
_LEAST_DAMPING = 0.15  # Share of the critical damping below which a servo swings. Chosen.
_STEP = 0.002  # Seconds of a physics step: MuJoCo's default.
# How many times a joint's speed, a ratio, a servo's damping may take away in one step. Chosen: from 2 on it swings, and the
# fingers' mass is only about known.
_MOST_DAMPED = 4.0
_ROTOR_SHARE = 0.05  # Share of the inertia that a joint moves which its rotor adds at the least. Chosen.
# Rotor inertia for each unit of effort, kg m^2 per N m. Chosen: strong motors have heavy rotors.
ROTOR_PER_EFFORT = 0.001
_SAMPLES = 40  # Number of postures over which the largest inertia and gravity are taken. Chosen.
# Newtons at the fingertips of a gripper whose file gives no force. Chosen: between a hobby servo's and the 70 N of a Franka
# Hand.
GRIP_FORCE = 30.0
_JOINT, _TENDON = mujoco.mjtTrn.mjTRN_JOINT, mujoco.mjtTrn.mjTRN_TENDON
_SINGLE = (mujoco.mjtJoint.mjJNT_HINGE, mujoco.mjtJoint.mjJNT_SLIDE)


def model_joint_is_single(model: mujoco.MjModel, joint: int) -> bool:
    """Tell whether a joint is a hinge or a slide."""
    return int(model.jnt_type[joint]) in (_SINGLE[0].value, _SINGLE[1].value)


def ensure_servos(imported: ImportedModel) -> None:
    """Turn motors into position servos and add one wherever a joint has none and nothing else moves it."""
    spec = imported.spec
    model = compile_spec(spec, imported.path.name)
    load = _Load(model)
    driven = _driven_joints(spec, model)
    for actuator in spec.actuators:
        if _is_servo(actuator):
            _strengthen(imported, model, load, actuator)
            _damp(imported, model, load, actuator)
            continue
        if actuator.trntype == _JOINT and spec.joint(actuator.target) is not None:
            joint = spec.joint(actuator.target)
            effort = _motor_effort(actuator)
            kp, kd, force, _ = load.servo(model, joint, effort)
            _write_servo(actuator, joint, kp, kd, force)
            imported.notes.append(f"actuator {actuator.name!r} is no position servo: replaced by one")
        elif actuator.trntype == _TENDON:
            _tendon_servo(imported, model, actuator)
    passive = _passive_joints(spec, driven) | _tied(model, driven)
    for joint in spec.joints:
        if joint.type not in _SINGLE or joint.name in driven or joint.name in passive:
            continue
        effort = None
        if joint.actfrclimited == mujoco.mjtLimited.mjLIMITED_TRUE or joint.actfrcrange[1] > 0.0:
            effort = float(np.abs(joint.actfrcrange).max())
        actuator = spec.add_actuator(name=_free_name(spec, joint.name), target=joint.name, trntype=_JOINT)
        kp, kd, force, armature = load.servo(model, joint, effort)
        if get_armature(joint) <= 0.0:
            joint.armature = armature
        _write_servo(actuator, joint, kp, kd, force)
        imported.made_actuators.add(actuator.name)
    if imported.made_actuators:
        imported.notes.append(f"made position servos for {', '.join(sorted(imported.made_actuators))}")


def _strengthen(imported: ImportedModel, model: mujoco.MjModel, load: _Load, actuator: mujoco.MjsActuator) -> None:
    """Give a servo that its joint's own friction would hold far off its target the stiffness to overcome it."""
    joint = imported.spec.joint(actuator.target) if actuator.trntype == _JOINT else None
    if joint is None or joint.type not in _SINGLE:
        return
    gear = abs(float(actuator.gear[0])) or 1.0
    stiffness = -float(actuator.biasprm[1]) * gear**2
    friction = float(joint.frictionloss)
    j = model.joint(joint.name).id
    slide = joint.type == mujoco.mjtJoint.mjJNT_SLIDE
    low, high = joint_bounds(model)
    # A slide is a finger more often than not: what counts is its own travel.
    travel = 0.1 * float(high[j] - low[j])
    stuck, wanted = (travel, travel) if slide else (ROBOT_TOLERANCES.stuck, _FULL_EFFORT_ERROR)
    if friction <= stuck * stiffness:
        return
    mass = max(load.inertia[model.jnt_dofadr[j]], 1e-5) + get_armature(joint)
    kp = max(min(2.0 * friction / float(wanted), 1e5), stiffness)
    joint.armature = get_armature(joint) + max(0.0, kp / (2.0 * _MAX_FREQUENCY) ** 2 - mass)
    force = friction + (GRIP_FORCE if slide else max(2.0 * friction, float(load.gravity[model.jnt_dofadr[j]])))
    _write_servo(actuator, joint, kp, 2.0 * float(np.sqrt(kp * max(mass, kp / (2.0 * _MAX_FREQUENCY) ** 2))), force)
    imported.notes.append(
        f"actuator {actuator.name!r}: friction of {friction:g} in its joint would hold it {friction / stiffness:.2g} off its "
        f"target; stiffness {stiffness:g} raised to {kp:.0f}"
    )


def _damp(imported: ImportedModel, model: mujoco.MjModel, load: _Load, actuator: mujoco.MjsActuator) -> None:
    """Give a servo that nothing damps the damping that its stiffness asks for: it would swing, or shoot its fingers through."""
    a = model.actuator(actuator.name).id
    if actuator.trntype == _JOINT:
        moved = {int(model.actuator_trnid[a, 0]): float(actuator.gear[0])}
    elif actuator.trntype == _TENDON:
        tendon = int(model.actuator_trnid[a, 0])
        start, count = int(model.tendon_adr[tendon]), int(model.tendon_num[tendon])
        wraps = [w for w in range(start, start + count) if model.wrap_type[w] == mujoco.mjtWrap.mjWRAP_JOINT.value]
        moved = {int(model.wrap_objid[w]): float(model.wrap_prm[w]) for w in wraps}
    else:
        return
    mobility = damping = friction = 0.0
    for joint, coefficient in moved.items():
        if not model_joint_is_single(model, joint) or coefficient == 0.0:
            return
        dof = int(model.jnt_dofadr[joint])
        mobility += coefficient**2 / max(float(load.inertia[dof]), 1e-6)
        damping += float(model.dof_damping[dof].flat[0]) / coefficient**2 / len(moved)
        friction += float(model.dof_frictionloss[dof])
    if mobility == 0.0:
        return
    stiffness, own = -float(actuator.biasprm[1]), -float(actuator.biasprm[2])
    if own < 0.0:
        # A damping ratio, which the compiler turns into a damping.
        return
    if (
        actuator.trntype == _JOINT
        and own * mobility * _STEP > _MOST_DAMPED
        and actuator.forcerange[1] > actuator.forcerange[0]
    ):
        # At its force limit a servo's damping is no longer integrated implicitly: one that is large for what the servo moves
        # throws a light finger back and forth from step to step. A rotor that is slow to it is still quick to the stiffness.
        joint = imported.spec.joint(actuator.target)
        joint.armature = get_armature(joint) + own * float(actuator.gear[0]) ** 2 * _STEP
        return
    critical = 2.0 * float(np.sqrt(stiffness / mobility))
    if friction > 0.0 or own + damping >= _LEAST_DAMPING * critical:
        return
    bias = np.array(actuator.biasprm)
    bias[2] = -critical
    actuator.biasprm = bias
    imported.notes.append(f"actuator {actuator.name!r} is hardly damped: damping {own:.3g} raised to {critical:.3g}")


def get_armature(joint: mujoco.MjsJoint) -> float:
    """Return a joint's rotor inertia."""
    return float(np.asarray(joint.armature).flat[0])


class _Load:
    """Load on each joint: the largest inertia and gravity torque over sampled postures."""

    def __init__(self, model: mujoco.MjModel) -> None:
        data = mujoco.MjData(model)
        rng = np.random.default_rng(0)
        low, high = joint_bounds(model)
        single = [j for j in range(model.njnt) if model.jnt_type[j] in (2, 3)]
        self.inertia = np.zeros(model.nv)
        self.gravity = np.zeros(model.nv)
        full = np.zeros((model.nv, model.nv))
        for _ in range(_SAMPLES):
            data.qpos[:] = model.qpos0
            for j in single:
                data.qpos[model.jnt_qposadr[j]] = rng.uniform(low[j], high[j])
            mujoco.mj_forward(model, data)
            mujoco.mj_fullM(model, data, full)
            self.inertia = np.maximum(self.inertia, np.diag(full))
            self.gravity = np.maximum(self.gravity, np.abs(data.qfrc_bias))

    def servo(
        self, model: mujoco.MjModel, joint: mujoco.MjsJoint, effort: float | None
    ) -> tuple[float, float, float, float]:
        """Return stiffness, damping, force limit and rotor inertia of a joint's servo."""
        dof = int(model.jnt_dofadr[model.joint(joint.name).id])
        moved = max(float(self.inertia[dof]), 1e-5)
        if effort is None or effort <= 0.0:
            effort = max(3.0 * float(self.gravity[dof]) + 10.0 * moved, 1.0)
        # A file's 50,000 Nm is a placeholder, no motor.
        effort = min(effort, 20.0 * float(self.gravity[dof]) + 200.0 * moved + 50.0)
        armature = max(_ROTOR_SHARE * moved, ROTOR_PER_EFFORT * effort)
        mass = moved + armature
        kp = min(effort / _FULL_EFFORT_ERROR, mass * _MAX_FREQUENCY**2)
        # Friction of its own must not hold the joint within the tolerance of an arrival.
        kp = max(kp, float(joint.frictionloss) / 0.004)
        kd = 2.0 * float(np.sqrt(kp * mass))
        return kp, max(0.0, kd - get_scalar(joint, "damping")), effort, armature


def joint_bounds(model: mujoco.MjModel) -> tuple[Array, Array]:
    """Return lower and upper values of every joint, a full turn or half a metre where it has no limits; (njnt,)."""
    limited = model.jnt_limited.astype(bool)
    slide = model.jnt_type == mujoco.mjtJoint.mjJNT_SLIDE.value
    free = np.where(slide, 0.5, np.pi)
    return np.where(limited, model.jnt_range[:, 0], -free), np.where(limited, model.jnt_range[:, 1], free)


def _write_servo(actuator: mujoco.MjsActuator, joint: mujoco.MjsJoint, kp: float, kd: float, force: float) -> None:
    write_gains(actuator, kp, kd, force)
    if joint.limited == mujoco.mjtLimited.mjLIMITED_TRUE or joint.range[0] < joint.range[1]:
        degrees = bool(joint.compiler.degree) if hasattr(joint, "compiler") and joint.compiler is not None else False
        turn = np.pi / 180.0 if degrees and joint.type == mujoco.mjtJoint.mjJNT_HINGE else 1.0
        actuator.ctrllimited = mujoco.mjtLimited.mjLIMITED_TRUE
        actuator.ctrlrange = np.asarray(joint.range) * turn
    else:
        actuator.ctrllimited = mujoco.mjtLimited.mjLIMITED_FALSE


def write_gains(actuator: mujoco.MjsActuator, kp: float, kd: float, force: float) -> None:
    """Make an actuator a position servo of this stiffness, damping and force limit."""
    gain, bias = np.zeros(len(actuator.gainprm)), np.zeros(len(actuator.biasprm))
    gain[0], bias[1], bias[2] = kp, -kp, -kd
    actuator.gaintype, actuator.biastype = mujoco.mjtGain.mjGAIN_FIXED, mujoco.mjtBias.mjBIAS_AFFINE
    actuator.dyntype = mujoco.mjtDyn.mjDYN_NONE
    actuator.gainprm, actuator.biasprm = gain, bias
    actuator.gear = [1.0, 0.0, 0.0, 0.0, 0.0, 0.0]
    actuator.forcelimited = mujoco.mjtLimited.mjLIMITED_TRUE
    actuator.forcerange = [-force, force]


def _tendon_servo(imported: ImportedModel, model: mujoco.MjModel, actuator: mujoco.MjsActuator) -> None:
    """Make a tendon's motor a servo on its length."""
    tendon = model.tendon(actuator.target).id
    start, count = int(model.tendon_adr[tendon]), int(model.tendon_num[tendon])
    if any(model.wrap_type[start : start + count] != mujoco.mjtWrap.mjWRAP_JOINT.value):
        return
    low, high = joint_bounds(model)
    ends = np.zeros(2)
    for wrap in range(start, start + count):
        joint, coefficient = int(model.wrap_objid[wrap]), float(model.wrap_prm[wrap])
        ends += np.sort([coefficient * low[joint], coefficient * high[joint]])
    effort = _motor_effort(actuator) or 20.0
    write_gains(actuator, effort / max(0.1 * float(ends[1] - ends[0]), 1e-4), 0.0, effort)
    actuator.ctrllimited = mujoco.mjtLimited.mjLIMITED_TRUE
    actuator.ctrlrange = ends
    imported.notes.append(f"actuator {actuator.name!r} is no position servo: replaced by one on its tendon")


def _is_servo(actuator: mujoco.MjsActuator) -> bool:
    stateless = actuator.dyntype in (mujoco.mjtDyn.mjDYN_NONE, mujoco.mjtDyn.mjDYN_FILTEREXACT)
    stateless = stateless or actuator.dyntype == mujoco.mjtDyn.mjDYN_FILTER
    affine = actuator.biastype == mujoco.mjtBias.mjBIAS_AFFINE and actuator.gaintype == mujoco.mjtGain.mjGAIN_FIXED
    return bool(stateless and affine and actuator.gainprm[0] != 0.0 and actuator.biasprm[1] < 0.0)


def _motor_effort(actuator: mujoco.MjsActuator) -> float | None:
    """Return the joint force that a motor could give, where its file says."""
    if actuator.forcerange[1] > actuator.forcerange[0]:
        force = float(np.abs(actuator.forcerange).max())
    elif actuator.ctrlrange[1] > actuator.ctrlrange[0] and actuator.biasprm[2] == 0.0:
        force = float(np.abs(actuator.ctrlrange).max() * abs(actuator.gainprm[0]))
    else:
        return None
    return force * abs(float(actuator.gear[0])) or None


def _driven_joints(spec: mujoco.MjSpec, model: mujoco.MjModel) -> set[str]:
    driven: set[str] = set()
    for actuator in spec.actuators:
        if actuator.trntype == _TENDON:
            driven |= _along(model, model.tendon(actuator.target).id)
        else:
            driven.add(actuator.target)
    return driven


def _along(model: mujoco.MjModel, tendon: int) -> set[str]:
    """Return the joints whose sum a fixed tendon's length is."""
    start, count = int(model.tendon_adr[tendon]), int(model.tendon_num[tendon])
    return {
        str(model.joint(int(model.wrap_objid[wrap])).name)
        for wrap in range(start, start + count)
        if model.wrap_type[wrap] == mujoco.mjtWrap.mjWRAP_JOINT.value
    }


def _tied(model: mujoco.MjModel, driven: set[str]) -> set[str]:
    """Return joints that tendons of a set length, or with a spring, move along with driven ones."""
    held = {int(e) for e in model.eq_obj1id[model.eq_type == mujoco.mjtEq.mjEQ_TENDON.value]}
    held |= {t for t in range(model.ntendon) if np.any(model.tendon_stiffness[t])}
    groups = [_along(model, tendon) for tendon in sorted(held)]
    moved: set[str] = set(driven)
    while more := set().union(*(group for group in groups if group & moved)) - moved:
        moved |= more
    return moved - driven


def _passive_joints(spec: mujoco.MjSpec, driven: set[str]) -> set[str]:
    """Return joints that an equality, a closed loop or a spring moves."""
    passive: set[str] = set()
    looped: set[str] = set()
    for equality in spec.equalities:
        if equality.type == mujoco.mjtEq.mjEQ_JOINT and equality.name2:
            pair = (equality.name1, equality.name2)
            # The second of two coupled joints leads, unless only the first has an actuator.
            passive.add(pair[1] if pair[0] in driven else pair[0])
        elif equality.type in (mujoco.mjtEq.mjEQ_CONNECT, mujoco.mjtEq.mjEQ_WELD):
            looped |= _loop(spec, equality.name1, equality.name2)
    for body in spec.bodies:
        names = {joint.name for joint in body.joints}
        if body.name in looped:
            passive |= names if driven & _near(body) else set()
        passive |= {joint.name for joint in body.joints if get_scalar(joint, "stiffness") > 0.0}
    return passive - driven


def _loop(spec: mujoco.MjSpec, first: str, second: str) -> set[str]:
    """Return the bodies that a closed loop goes through, by the names of the bodies or sites that close it."""
    chains = []
    for name in (first, second):
        body = spec.body(name) or (spec.site(name).parent if spec.site(name) else None)
        chain: list[str] = []
        while body is not None and body.name != "world":
            chain.append(body.name)
            body = body.parent
        chains.append(chain)
    # The body that both hang on carries the loop and is no part of it.
    return set(chains[0]) ^ set(chains[1]) if all(chains) else set(chains[0] + chains[1])


def _near(body: mujoco.MjsBody) -> set[str]:
    """Return the joints on and around a body's mechanism: below its grandparent."""
    root = body
    for _ in range(2):
        if root.parent is not None and root.parent.name != "world":
            root = root.parent
    return {joint.name for joint in root.find_all(mujoco.mjtObj.mjOBJ_JOINT)}


def _free_name(spec: mujoco.MjSpec, wanted: str) -> str:
    taken = {actuator.name for actuator in spec.actuators}
    name = wanted
    while name in taken:
        name += "_servo"
    return name
