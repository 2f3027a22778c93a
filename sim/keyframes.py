"""Keyframes of a scene's file, kept where other bodies come and go."""

from __future__ import annotations

from collections.abc import Iterable, Mapping

import mujoco
import numpy as np

from robosandbox.types import Array
from robosandbox.values import frozen


@frozen
class Keyframe:
    """A keyframe by joints.

    Attributes:
        name: Its name.
        time: Seconds.
        qpos: Positions by joint.
        qvel: Speeds by joint.
    """

    name: str
    time: float
    qpos: Mapping[str, Array]
    qvel: Mapping[str, Array]


def keyframes_of(model: mujoco.MjModel) -> tuple[Keyframe, ...]:
    """Return a model's keyframes."""
    joints = [(str(model.joint(j).name), *_sizes(model, j)) for j in range(model.njnt)]
    return tuple(
        Keyframe(
            name=str(model.key(k).name),
            time=float(model.key_time[k]),
            qpos={name: model.key_qpos[k, q : q + nq].copy() for name, q, nq, _, _ in joints},
            qvel={name: model.key_qvel[k, v : v + nv].copy() for name, _, _, v, nv in joints},
        )
        for k in range(model.nkey)
    )


def _sizes(model: mujoco.MjModel, joint: int) -> tuple[int, int, int, int]:
    """Return the address and number of a joint's positions, then of its speeds."""
    q, v = int(model.jnt_qposadr[joint]), int(model.jnt_dofadr[joint])
    ends = int(model.jnt_qposadr[joint + 1]) if joint + 1 < model.njnt else model.nq
    stops = int(model.jnt_dofadr[joint + 1]) if joint + 1 < model.njnt else model.nv
    return q, ends - q, v, stops - v


def put_keyframes(
    spec: mujoco.MjSpec, keys: Iterable[Keyframe], model: mujoco.MjModel, home: Mapping[str, float]
) -> None:
    """Put keyframes into a spec that has none, the robots at home in each; joints that are gone are left out.

    Args:
        spec: Where they go.
        keys: The keyframes.
        model: The spec, compiled.
        home: Where the robots' joints are at home, by their names in the model.
    """
    there = {str(model.joint(j).name) for j in range(model.njnt)}
    for key in keys:
        qpos, qvel = model.qpos0.copy(), np.zeros(model.nv)
        for name, value in home.items():
            qpos[model.jnt_qposadr[model.joint(name).id]] = value
        for name in key.qpos.keys() & there:
            q, nq, v, nv = _sizes(model, model.joint(name).id)
            qpos[q : q + nq], qvel[v : v + nv] = key.qpos[name], key.qvel[name]
        spec.add_key(name=key.name, time=key.time, qpos=qpos, qvel=qvel)
