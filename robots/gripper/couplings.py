"""The joints of a hand that follow others, over tendons of a set length or on springs: made to follow and to carry a grip."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import mujoco
import numpy as np

from robosandbox.robots.importers.imported import ImportedModel, compile_spec
from robosandbox.robots.importers.servos import GRIP_FORCE, ROTOR_PER_EFFORT, get_armature
from robosandbox.robots.importers.welding import weld
from robosandbox.robots.infer.kinematic_tree import actuator_joints, tendon_joints
from robosandbox.types import Array

# Position error, radians, at which a coupling's own friction may hold a joint. Chosen as of servos: three degrees.
_STUCK_ERROR = 0.05
# Share of its leader's travel over which a coupling must lead a joint outside its limits to make them void. Chosen as the
# half: a limit that stops a finger at its end is meant.
_OUTSIDE = 0.5
_STEPS = 21  # Number of places over a leader's travel at which that is looked at. Chosen.
_TOLERANCE = 1e-6  # Radians or metres outside a limit that are rounding. Chosen.
# Metres from a finger's first joint to where it holds things, to turn a force at its tip into effort. Chosen: of a hand that
# is as large as a person's.
_LEVER = 0.08


@dataclass(frozen=True, slots=True)
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
    wanted = friction / (_STUCK_ERROR * abs(one.follow))
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
