"""Perturbations: what happens to an episode, where and when, all sampled from a seed."""

from __future__ import annotations

import math

import numpy as np
from support import faults
from support.faults import MistakenPerception
from support.sampling import DRAWS, EpisodeSampler, Perturbation, moved_by, standing_at

from robosandbox.shapes.hull import BoxHull
from robosandbox.types import Pose, SceneObject
from robosandbox.world.relations import centre, support

_PICKS = ("pick_cube_scrambled", "pick_can", "pick_ball")
_HANDLED = (*_PICKS, "put_in_bin", "stack_two")
# Metres; measured: the tool centre point of the Panda comes no further out than 0.92 m at table height (200,000 random
# configurations), and a fingertip reaches a centimetre beyond it.
FARTHEST = 0.93
# Of a ball that rolls on the table, m/s^2; measured with pick_ball at 0.1 to 0.3 m/s as speed^2 / (2 distance).
_ROLL_DECELERATION = 0.14

_ON_THE_WAY = ("perceive", "plan", "approach")
_BEFORE_CONTACT = ("approach", "descend")
_CARRYING = ("lift", "transfer")

# What can be recovered from.


def nudged(sampler: EpisodeSampler) -> Perturbation:
    """The object is slid to another place while the hand comes."""
    offset, speed = sampler.offset(sampler.subject, 0.01, 0.08), sampler.uniform(0.1, 0.4)
    at = sampler.moment(_BEFORE_CONTACT)
    about = f"{np.hypot(*offset) * 1e3:.0f} mm at {speed:.2f} m/s"
    return Perturbation(scene=sampler.scene, fault=faults.nudge(sampler.subject, offset, speed), at=at, about=about)


def slipped(sampler: EpisodeSampler) -> Perturbation:
    """The object is let slip while it is lifted or carried."""
    friction = sampler.uniform(0.0, 0.02)
    at = sampler.moment(_CARRYING if sampler.target else ("lift",))
    return Perturbation(
        scene=sampler.scene, fault=faults.slip(sampler.subject, friction), at=at, about=f"friction {friction:.3f}"
    )


def blocked_on_top(sampler: EpisodeSampler) -> Perturbation:
    """Something is put on top of the object after the plan was made."""
    half = sampler.uniform(0.012, 0.02)
    park(sampler, "blocker", half)
    item = sampler.item(sampler.subject)
    room = min(0.008, 0.5 * item.size[0])
    offset = (sampler.uniform(-room, room), sampler.uniform(-room, room))
    at = sampler.moment(_ON_THE_WAY, away_from=item.pose.position)
    fault = faults.put_on("blocker", sampler.subject, offset)
    return Perturbation(scene=sampler.scene, fault=fault, at=at, about=f"{half * 2e3:.0f} mm block")


def crowded(sampler: EpisodeSampler) -> Perturbation:
    """One to four neighbours stand closer than fingers are thick."""
    count, gaps = int(sampler.rng.integers(1, 5)), []
    item = sampler.item(sampler.subject)
    angles = (
        item.pose.yaw if isinstance(item.shape.hull(item.size), BoxHull) else sampler.uniform(0.0, 2.0 * math.pi)
    ) + np.arange(4) * math.pi / 2.0
    for number, angle in enumerate(sampler.rng.permutation(angles)[:count]):
        space = sampler.uniform(0.001, 0.006)
        half = sampler.uniform(0.015, 0.02)
        axis = np.array([math.cos(angle), math.sin(angle), 0.0])
        reach = float(support(item, axis[None])[0] - axis @ centre(item))
        x, y = (centre(item) + axis * (reach + space + half))[:2]
        turn = (0.0, 0.0, math.sin(angle / 2.0), math.cos(angle / 2.0))
        pose = Pose(xyz=(x, y, sampler.scene.table_height + half + 0.001), quat_xyzw=turn)
        stands = SceneObject(
            id=f"neighbour_{number}", kind="box", size=(half,) * 3, pose=pose, rgba=(0.4, 0.4, 0.45, 1.0)
        )
        sampler.add(stands)
        if not sampler.free(sampler.item(stands.id), least=0.0):
            sampler.change(sampler.scene.model_copy(update={"objects": sampler.scene.objects[:-1]}))
            continue
        gaps.append(f"{space * 1e3:.1f}")
    if not gaps:
        raise ValueError("no room for a neighbour")
    return Perturbation(scene=sampler.scene, about=f"gaps {', '.join(gaps)} mm")


def occupied(sampler: EpisodeSampler) -> Perturbation:
    """Something is put where the object is to go, while it is being fetched."""
    half = sampler.uniform(0.015, 0.02)
    park(sampler, "blocker", half)
    assert sampler.target is not None
    target = sampler.item(sampler.target)
    if sampler.task.name == "place_beside":
        # In the middle of the strip on its left.
        y = float(support(target, np.array([[0.0, 1.0, 0.0]]))[0])
        place = np.array(
            [target.pose.xyz[0] + sampler.uniform(-0.02, 0.02), y + half + sampler.uniform(0.01, 0.06), 0.0]
        )
        pose = Pose(xyz=(*place[:2], sampler.scene.table_height + half + 0.001))
        fault = faults.put("blocker", pose)
        if not sampler.free(standing_at(sampler.item("blocker"), pose)):
            raise ValueError("no room for the blocker")
    else:
        room = 0.3 * target.size[0]
        offset = (sampler.uniform(-room, room), sampler.uniform(-room, room))
        place, fault = target.pose.position, faults.put_on("blocker", sampler.target, offset)
    phases = (*_ON_THE_WAY, "descend", "grasp", "lift")
    at = sampler.moment(phases, away_from=place)
    return Perturbation(scene=sampler.scene, fault=fault, at=at, about=f"{half * 2e3:.0f} mm block")


def toppled(sampler: EpisodeSampler) -> Perturbation:
    """The first two of a tower of three are knocked over while the third is fetched."""
    step = 1
    at = sampler.moment(
        ("approach", "descend", "grasp", "lift"), step=step, away_from=sampler.item("blue_cube").pose.position
    )
    velocity = np.array([*(sampler.direction() * sampler.uniform(0.6, 1.1)), sampler.uniform(0.0, 0.5)])
    about = f"{np.hypot(*velocity[:2]):.2f} m/s"
    return Perturbation(scene=sampler.scene, fault=faults.knock(sampler.subject, velocity), at=at, about=about)


def rolled_away(sampler: EpisodeSampler) -> Perturbation:
    """The ball rolls off while the hand comes."""
    item = sampler.item(sampler.subject)
    for _ in range(DRAWS):
        speed = sampler.uniform(0.08, 0.3)
        velocity = sampler.direction() * speed
        end = moved_by(item, velocity * speed / (2.0 * _ROLL_DECELERATION))
        if sampler.easy(end.pose.position[:2]) and sampler.free(end):
            break
    else:
        raise ValueError("nowhere to roll")
    at = sampler.moment(_BEFORE_CONTACT)
    return Perturbation(
        scene=sampler.scene, fault=faults.roll(sampler.subject, velocity), at=at, about=f"{speed:.2f} m/s"
    )


def just_too_far(sampler: EpisodeSampler) -> Perturbation:
    """The object lies further out than a hand can grasp, but not further than a finger reaches."""
    item = sampler.item(sampler.subject)
    for _ in range(DRAWS):
        radius, angle = sampler.uniform(0.81, 0.85), sampler.uniform(-0.65, 0.65)
        xy = sampler.base[:2] + radius * np.array([math.cos(angle), math.sin(angle)])
        there = standing_at(
            item, Pose(xyz=(float(xy[0]), float(xy[1]), item.pose.xyz[2]), quat_xyzw=item.pose.quat_xyzw)
        )
        if (np.abs(xy) < 0.485 - item.size[0]).all() and sampler.free(there):
            break
    else:
        raise ValueError("no room out there")
    sampler.replace(sampler.subject, pose=there.pose)
    return Perturbation(scene=sampler.scene, about=f"{radius:.3f} m away")


def mislocated(sampler: EpisodeSampler) -> Perturbation:
    """The object is seen up to 25 mm from where it is, for a while or throughout."""
    offset = sampler.direction() * sampler.uniform(0.005, 0.025)
    lasting = sampler.uniform(0.0, 1.0) < 0.5
    end = np.inf if lasting else sampler.uniform(1.0, 6.0)
    begin = 0.0 if lasting else sampler.uniform(0.0, 1.0)
    seen = MistakenPerception(sampler.subject, offset=np.array([*offset, 0.0]), begin=begin, end=end)
    about = f"{np.hypot(*offset) * 1e3:.0f} mm " + ("throughout" if lasting else f"from {begin:.1f} to {end:.1f} s")
    return Perturbation(scene=sampler.scene, perception=seen, about=about)


def missized(sampler: EpisodeSampler) -> Perturbation:
    """The object is seen smaller or larger than it is."""
    width = 2.0 * sampler.item(sampler.subject).size[0]
    scale = sampler.uniform(0.6, min(1.6, 0.068 / width))
    seen = MistakenPerception(sampler.subject, scale=scale)
    return Perturbation(scene=sampler.scene, perception=seen, about=f"{scale:.2f} times as large")


def half_closed(sampler: EpisodeSampler) -> Perturbation:
    """The gripper opens no further than half way, but further than the object is wide; or it sticks for a while."""
    width = 2.0 * sampler.item(sampler.subject).size[0]
    at = sampler.moment(_ON_THE_WAY)
    if sampler.uniform(0.0, 1.0) < 0.5:
        aperture = sampler.uniform(width + 0.008, min(0.074, width + 0.03))
        return Perturbation(
            scene=sampler.scene,
            fault=faults.half_open(aperture),
            at=at,
            about=f"opens {aperture * 1e3:.0f} mm for {width * 1e3:.0f} mm",
        )
    aperture, seconds = sampler.uniform(0.02, 0.06), sampler.uniform(0.5, 5.0)
    about = f"at {aperture * 1e3:.0f} mm for {seconds:.1f} s, object {width * 1e3:.0f} mm"
    return Perturbation(scene=sampler.scene, fault=faults.jam(aperture, seconds), at=at, about=about)


def weakened(sampler: EpisodeSampler) -> Perturbation:
    """An arm servo loses stiffness and force; what is left still carries arm and object."""
    joint, gain, limit = int(sampler.rng.integers(7)), sampler.uniform(0.1, 0.6), sampler.uniform(0.2, 0.9)
    at = sampler.moment((*_ON_THE_WAY, "descend", "grasp", "lift", "push"))
    about = f"joint {joint + 1} to {gain:.2f}, force to {limit:.2f}"
    return Perturbation(scene=sampler.scene, fault=faults.weaken(joint, gain, limit), at=at, about=about)


# What cannot be helped.


def bolted(sampler: EpisodeSampler) -> Perturbation:
    """The object is fixed to the table."""
    return Perturbation(scene=sampler.scene, fault=faults.bolt(sampler.subject), hopeless=True)


def too_wide(sampler: EpisodeSampler) -> Perturbation:
    """The object is wider than the gripper opens, however it is turned."""
    item = sampler.item(sampler.subject)
    half = sampler.uniform(0.043, 0.07)
    size = {"box": (half, half * sampler.uniform(1.0, 1.2), half), "sphere": (half,), "cylinder": (half, 1.2 * half)}
    height = {"box": half, "sphere": half, "cylinder": 1.2 * half}[item.kind]
    x, y, _ = item.pose.xyz
    pose = Pose(xyz=(x, y, sampler.scene.table_height + height + 0.001), quat_xyzw=item.pose.quat_xyzw)
    sampler.replace(sampler.subject, size=size[item.kind], pose=pose)
    if not sampler.free(sampler.item(sampler.subject)):
        raise ValueError("no room for so large a thing")
    return Perturbation(scene=sampler.scene, hopeless=True, about=f"{half * 2e3:.0f} mm")


def too_heavy(sampler: EpisodeSampler) -> Perturbation:
    """The object weighs more than the friction of two pads that press with 50 N each can carry: 100 N."""
    mass = sampler.uniform(12.0, 40.0)
    sampler.replace(sampler.subject, mass=mass)
    return Perturbation(scene=sampler.scene, hopeless=True, about=f"{mass:.0f} kg")


def far_out(sampler: EpisodeSampler) -> Perturbation:
    """The object lies on the floor, further out than any part of the hand comes."""
    item = sampler.item(sampler.subject)
    low = float(item.pose.xyz[2] - sampler.scene.table_height)
    for _ in range(DRAWS):
        radius, angle = sampler.uniform(FARTHEST + 0.03, 1.5), sampler.uniform(-math.pi, math.pi)
        x, y = sampler.base[:2] + radius * np.array([math.cos(angle), math.sin(angle)])
        if max(abs(x), abs(y)) > 0.56:
            break
    else:
        raise ValueError("no room on the floor")
    sampler.replace(sampler.subject, pose=Pose(xyz=(float(x), float(y), low), quat_xyzw=item.pose.quat_xyzw))
    return Perturbation(scene=sampler.scene, hopeless=True, about=f"{radius:.2f} m away")


def jammed(sampler: EpisodeSampler) -> Perturbation:
    """The fingers stick for good, at an aperture at which they hold nothing.

    Stiff fingers pressed onto a ball hold it where it is at least 0.71 times as wide as all of it: there the cones of
    friction (coefficient 1) take in the line between the two contacts.
    """
    width = 2.0 * sampler.item(sampler.subject).size[0]
    aperture = sampler.uniform(0.3, 0.65) * width
    at = sampler.moment(_ON_THE_WAY)
    about = f"at {aperture * 1e3:.0f} mm, object {width * 1e3:.0f} mm"
    return Perturbation(scene=sampler.scene, fault=faults.jam(aperture, None), at=at, hopeless=True, about=about)


def locked(sampler: EpisodeSampler) -> Perturbation:
    """The drawer does not slide."""
    return Perturbation(scene=sampler.scene, fault=faults.lock(sampler.subject), hopeless=True)


def parked(sampler: EpisodeSampler, half: float) -> Pose:
    """Return where a thing of this half height stands in a corner of the table, out of everybody's way; metres."""
    return Pose(xyz=(-0.3, 0.42, sampler.scene.table_height + half + 0.001))


def park(sampler: EpisodeSampler, name: str, half: float) -> None:
    """Add a block of this half edge, metres, in a corner of the table."""
    pose = parked(sampler, half)
    sampler.add(SceneObject(id=name, kind="box", size=(half,) * 3, pose=pose, rgba=(0.3, 0.3, 0.35, 1.0)))
