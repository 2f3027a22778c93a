"""A hand of three and more fingers made a gripper: one way to close, everything else of it held."""

from __future__ import annotations

from collections.abc import Iterable

import mujoco
import numpy as np

from robosandbox.robots.gripper.calibrate import IN_STEP, joints_below, moving_groups, servo_map
from robosandbox.robots.gripper.opposition import MOST_SERVOS, Opposition, find_opposition
from robosandbox.robots.importers.imported import ImportedModel, compile_spec
from robosandbox.robots.importers.isolate import weld
from robosandbox.robots.importers.servos import GRIP_FORCE, ROTOR_PER_EFFORT, get_armature
from robosandbox.robots.infer.kinematic_tree import actuator_joints, tendon_joints
from robosandbox.robots.tolerances import ROBOT_TOLERANCES
from robosandbox.types import Array
from robosandbox.values import frozen

# Number of fingers from which a gripper is a hand; chosen as the least that need not close on each other: two jaws are left as
# their files have them.
LEAST_FINGERS = 3
# Share of its leader's travel over which a coupling must lead a joint outside its limits to make them void. Chosen as the
# half: a limit that stops a finger at its end is meant.
_OUTSIDE = 0.5
_STEPS = 21  # Number of places over a leader's travel at which that is looked at. Chosen.
_TOLERANCE = 1e-6  # Radians or metres outside a limit that are rounding. Chosen.
# Metres from a finger's first joint to where it holds things, to turn a force at its tip into effort. Chosen: of a hand that
# is as large as a person's.
_LEVER = 0.08


def settle_hand(imported: ImportedModel, joints: Iterable[str], listed: Iterable[str] = ()) -> tuple[str, ...]:
    """Hold what does not close a hand, and let the rest follow what drives it; return the joints that are left to move.

    Args:
        imported: The model; it is changed where the hand has three fingers or more, and what is changed is noted.
        joints: The hand's.
        listed: Those that a sidecar names; they are not held.
    """
    joints, listed = tuple(joints), tuple(listed)
    model = compile_spec(imported.spec, imported.path.name)
    # The far bars of a jaw's linkage, which nothing drives, are no fingers.
    if sum(count > 0 for count in _servos(model, joints)) < LEAST_FINGERS:
        return joints
    hold_stopped(imported, joints, listed)
    joints = _left(imported, joints)
    fit_couplings(imported, joints)
    model = compile_spec(imported.spec, imported.path.name)
    found = find_opposition(model, [model.joint(name).id for name in joints])
    if found is not None:
        _hold_spread(imported, model, found, listed)
        _keep_in_step(imported, model, found)
    return _left(imported, joints)


def why_no_gripper(imported: ImportedModel, joints: Iterable[str]) -> str:
    """Return why a hand is not driven as a gripper, which has one way to close; "" where it is.

    Args:
        imported: The model.
        joints: The hand's.
    """
    model = compile_spec(imported.spec, imported.path.name)
    servos = [count for count in _servos(model, tuple(joints)) if count]
    if len(servos) < LEAST_FINGERS or max(servos) <= MOST_SERVOS:
        return ""
    return (
        f"this hand has {len(servos)} fingers with up to {max(servos)} servos each; a hand is driven as a gripper where no finger "
        f"has more than {MOST_SERVOS}, one that closes it and one that spreads it"
    )


def _servos(model: mujoco.MjModel, joints: tuple[str, ...]) -> list[int]:
    """Return how many actuators drive each of a hand's sides."""
    groups = moving_groups(model, [model.joint(name).id for name in joints])
    driven = [{int(model.jnt_bodyid[j]) for j in actuator_joints(model, a)} for a in range(model.nu)]
    return [sum(bool(bodies & group) for bodies in driven) for group in groups]


def _hold_spread(imported: ImportedModel, model: mujoco.MjModel, found: Opposition, listed: tuple[str, ...]) -> None:
    """Weld what only spreads the fingers where they oppose each other best."""
    held: dict[str, float | None] = {str(model.joint(j).name): value for j, value in found.held.items()}
    held = {name: value for name, value in held.items() if name not in listed}
    if held:
        weld(imported.spec, model, held)
        told = ", ".join(f"{name} at {value:.3g}" for name, value in held.items())
        imported.notes.append(f"joints that spread the fingers are held where these oppose each other best: {told}")


def _keep_in_step(imported: ImportedModel, model: mujoco.MjModel, found: Opposition) -> None:
    """Let fingers with a servo each close together: all of them meet what lies in their middle at the same time.

    Servos at their force limits do not hold a place: two fingers would push the one against them back.
    """
    spec, first = imported.spec, found.fingers[0]
    for one in found.fingers:
        actuator = spec.actuator(model.actuator(one.actuator).name)
        scale, offset = servo_map(model, one.actuator)
        ends = np.array([one.open, one.closed]) * float(model.actuator_gear[one.actuator, 0]) * scale + offset
        actuator.ctrllimited = mujoco.mjtLimited.mjLIMITED_TRUE
        actuator.ctrlrange = np.sort(ends)
        _weigh(spec.joint(model.joint(one.joint).name), actuator)
        if one is first:
            continue
        ratio = (one.open - one.meets) / (first.open - first.meets)
        mine, its = (float(model.qpos0[model.jnt_qposadr[j]]) for j in (one.joint, first.joint))
        equality = spec.add_equality(
            name=f"{IN_STEP}{model.joint(one.joint).name}",
            type=mujoco.mjtEq.mjEQ_JOINT,
            objtype=mujoco.mjtObj.mjOBJ_JOINT,
            name1=model.joint(one.joint).name,
            name2=model.joint(first.joint).name,
        )
        data = np.zeros(len(equality.data))
        data[:2] = (one.meets - mine) - ratio * (first.meets - its), ratio
        equality.data = data
    names = ", ".join(str(model.joint(one.joint).name) for one in found.fingers)
    imported.notes.append(f"fingers with a servo each are kept in step, to meet what is between them together: {names}")


def _weigh(joint: mujoco.MjsJoint, actuator: mujoco.MjsActuator) -> None:
    """Give a finger's joint the rotor that its servo's force comes from.

    Fingers without inertia, kept in step by a constraint, tremble against what they hold until it slips out of their grip
    (measured: Kinova's Jaco leaves a cube of 50 g twenty times a second).
    """
    low, high = actuator.forcerange
    if high > low:
        effort = float(max(abs(low), abs(high))) * abs(float(actuator.gear[0]))
        joint.armature = max(get_armature(joint), ROTOR_PER_EFFORT * effort)


def settle_listed(imported: ImportedModel, listed: tuple[str, ...]) -> None:
    """Settle the hand whose joints a sidecar names; of names that are not there somebody else complains."""
    there = {joint.name for joint in imported.spec.joints}
    if not there.issuperset(listed):
        return
    model = compile_spec(imported.spec, imported.path.name)
    joints = joints_below(model, [model.joint(name).id for name in listed])
    settle_hand(imported, [str(model.joint(j).name) for j in joints], listed)


def _left(imported: ImportedModel, joints: tuple[str, ...]) -> tuple[str, ...]:
    there = {joint.name for joint in imported.spec.joints}
    return tuple(name for name in joints if name in there)


@frozen
class _Coupling:
    """A fixed tendon over two joints of a hand, by ids: its coefficients of leader and follower, and whether its length is set."""

    tendon: int
    leader: int
    follower: int
    lead: float
    follow: float
    is_held: bool


def hold_stopped(imported: ImportedModel, joints: Iterable[str], listed: Iterable[str] = ()) -> None:
    """Weld joints that a set length presses against a limit nearly all the way, as a finger's stop holds its outer link.

    Args:
        imported: The model; it is changed.
        joints: The hand's.
        listed: Those that a sidecar names; they are left.
    """
    model = compile_spec(imported.spec, imported.path.name)
    reached: dict[int, Array] = {}
    stopped: dict[str, float | None] = {}
    for one in _couplings(model, joints):
        leader = reached.get(one.leader, np.linspace(*_driven_range(model, one.leader), _STEPS))
        follower = (float(model.tendon_length0[one.tendon]) - one.lead * leader) / one.follow
        if model.jnt_limited[one.follower]:
            inside = np.clip(follower, *model.jnt_range[one.follower])
            firm = str(model.joint(one.leader).name) in stopped
            pressed = (np.abs(follower - inside) > _TOLERANCE).mean() > _OUTSIDE
            if one.is_held and (firm or pressed):
                inside = np.full(_STEPS, float(np.median(inside)))
                stopped[str(model.joint(one.follower).name)] = float(inside[0])
            follower = inside
        reached[one.follower] = follower
    stopped = {name: value for name, value in stopped.items() if name not in set(listed)}
    if stopped:
        weld(imported.spec, model, stopped)
        told = ", ".join(f"{name} at {value:.3g}" for name, value in stopped.items())
        imported.notes.append(f"joints that their coupling presses against their limits are held there: {told}")


def fit_couplings(imported: ImportedModel, joints: Iterable[str]) -> None:
    """Let what follows in a hand follow, and carry a grip; what is changed is noted.

    A spring that is weaker than the friction of its own tendon leaves a finger's outer link anywhere; and a constraint, which
    pulls in proportion to what it moves, lets links without inertia give way to any touch.

    Args:
        imported: The model; it is changed.
        joints: The hand's.
    """
    model = compile_spec(imported.spec, imported.path.name)
    for one in _couplings(model, joints):
        _overcome_friction(imported, model, one)
        follower = imported.spec.joint(model.joint(one.follower).name)
        follower.armature = max(get_armature(follower), ROTOR_PER_EFFORT * GRIP_FORCE * _LEVER)


def _couplings(model: mujoco.MjModel, names: Iterable[str]) -> list[_Coupling]:
    """Return a hand's couplings from what is driven outwards, each joint led once by each tendon."""
    joints = [model.joint(name).id for name in names]
    held = {int(model.eq_obj1id[e]) for e in np.flatnonzero(model.eq_type == mujoco.mjtEq.mjEQ_TENDON.value)}
    led = {j for a in range(model.nu) for j in actuator_joints(model, a)}
    pending = [t for t in range(model.ntendon) if len(tendon_joints(model, t)) == 2]
    found: list[_Coupling] = []
    moved = True
    while moved:
        moved = False
        for tendon in list(pending):
            pair = tendon_joints(model, tendon)
            leaders = [j for j in pair if j in led]
            if not set(pair) <= set(joints) or not leaders:
                continue
            start = int(model.tendon_adr[tendon])
            first, second = (float(model.wrap_prm[start + k]) for k in range(2))
            lead, follow = (first, second) if leaders[0] == pair[0] else (second, first)
            follower = pair[1] if leaders[0] == pair[0] else pair[0]
            pending.remove(tendon)
            if lead and follow:
                found.append(_Coupling(tendon, leaders[0], follower, lead, follow, tendon in held))
                moved = True
        led |= {one.follower for one in found}
    return found


def _driven_range(model: mujoco.MjModel, joint: int) -> tuple[float, float]:
    """Return the ends between which a joint is driven: its servo's where that has any, else its own."""
    for a in range(model.nu):
        if actuator_joints(model, a) == [joint] and model.actuator_ctrllimited[a]:
            low, high = model.actuator_ctrlrange[a]
            return float(low), float(high)
    low, high = model.jnt_range[joint]
    return float(low), float(high)


def _overcome_friction(imported: ImportedModel, model: mujoco.MjModel, one: _Coupling) -> None:
    """Give a spring that its own tendon's friction holds far off its rest the stiffness to overcome it."""
    stiffness = float(np.asarray(model.tendon_stiffness[one.tendon]).flat[0])
    friction = float(model.tendon_frictionloss[one.tendon])
    wanted = friction / (ROBOT_TOLERANCES.stuck * abs(one.follow))
    if stiffness <= 0.0 or wanted <= stiffness:
        return
    name = str(model.tendon(one.tendon).name)
    tendon = imported.spec.tendon(name)
    value = np.asarray(tendon.stiffness)
    if value.ndim:
        value = value.copy()
        value.flat[0] = wanted
        tendon.stiffness = value
    else:
        tendon.stiffness = wanted
    imported.notes.append(
        f"tendon {name!r}: friction of {friction:g} would hold {model.joint(one.follower).name!r} "
        f"{friction / stiffness / abs(one.follow):.2g} off where its spring puts it; stiffness {stiffness:g} raised to {wanted:.0f}"
    )
