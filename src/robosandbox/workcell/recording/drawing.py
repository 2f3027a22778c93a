"""Pictures of an episode: its states drawn by a camera, its numbers over time."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import mujoco
import numpy as np
from numpy.typing import NDArray

from robosandbox.errors import InputError
from robosandbox.sim.rendering import OffscreenRenderer
from robosandbox.sim.step_recorder import column_of
from robosandbox.sim.world import World, build_world_of
from robosandbox.tasks.task import Task
from robosandbox.types.robot import ARM
from robosandbox.validation import validate
from robosandbox.workcell.recording.episode import RecordedEpisode
from robosandbox.workcell.recording.files import Meta

PLOTS = ("joints", "tcp", "gripper", "force", "phases")


def world_of(episode: RecordedEpisode) -> World:
    """Return the model that an episode's `qpos` is of: the simulated one, or the planning model of what was believed.

    Raises:
        InputError: The task cannot be loaded any more, or its robot is another one now.
    """
    meta = episode.meta
    source = f"{episode.name}/meta.json: task"
    scene = meta.checkpoint.scene if meta.checkpoint is not None else validate(meta.task, Task, source=source).scene
    world = build_world_of(scene)
    if tuple(world.object_bodies) != meta.objects or episode["qpos"].shape[1] != world.model.nq:
        raise InputError(f"{episode.name}: {meta.robot_name} has other joints or objects than when it was recorded")
    return world


def frames(
    episode: RecordedEpisode, world: World, cameras: Sequence[str], every: int, size: tuple[int, int]
) -> Iterator[dict[str, NDArray[np.uint8]]]:
    """Yield RGB pictures (height, width, 3) uint8 by camera, of every `every`-th row, drawn from the recorded states.

    Args:
        episode: What was recorded.
        world: As `world_of` returns it.
        cameras: Names.
        every: Rows from picture to picture.
        size: (height, width), pixels.

    Raises:
        InputError: No such camera.
        RenderingError: No OpenGL on this machine.
    """
    for camera in cameras:
        if camera not in world.cameras:
            raise InputError(f"camera {camera!r} is not one of {', '.join(world.cameras)}")
    qpos = episode["qpos"]
    model = world.model
    data = mujoco.MjData(model)
    renderer = OffscreenRenderer(model, size)
    try:
        for row in range(0, len(qpos), every):
            data.qpos[:] = qpos[row]
            mujoco.mj_kinematics(model, data)
            mujoco.mj_camlight(model, data)
            yield {camera: renderer.render(data, world.cameras[camera]) for camera in cameras}
    finally:
        renderer.close()


def plot(episode: RecordedEpisode, path: Path, kinds: Sequence[str] = PLOTS) -> None:
    """Draw an episode's numbers over time into one PNG file, a panel per kind, with its phases as bands."""
    import matplotlib

    matplotlib.use("Agg")
    from matplotlib.figure import Figure

    figure = Figure(figsize=(10.0, 2.2 * len(kinds)), layout="constrained")
    panels: Any = figure.subplots(len(kinds), 1, sharex=True, squeeze=False)[:, 0]
    draw = {"joints": _joints, "tcp": _tcp, "gripper": _gripper, "force": _force, "phases": _phases}
    for panel, kind in zip(panels, kinds, strict=True):
        if kind != "phases":
            _bands(panel, episode)
        draw[kind](panel, episode)
        panel.margins(x=0.0)
    panels[-1].set_xlabel("simulated seconds")
    figure.suptitle(f"{episode.name}: {episode.meta.prompt}", wrap=True)
    figure.savefig(path, dpi=110)


def contact_force(episode: RecordedEpisode) -> NDArray[np.float64]:
    """Return the largest normal force between an arm and anything else in each row, N, shape (rows,).

    Not a number where contacts were not recorded.
    """
    if "contact_bodies" not in episode:
        return np.full(len(episode), np.nan)
    bodies = episode.ragged("contact_bodies")
    forces = episode.ragged("contact_force")
    arm_of = np.array([_arm_of(name, episode.meta) for name in episode.meta.bodies])
    pairs = arm_of[np.asarray(bodies.values, dtype=int)].reshape(-1, 2)
    counted = np.where(pairs[:, 0] != pairs[:, 1], np.asarray(forces.values, dtype=float), 0.0)
    rows = np.repeat(np.arange(len(episode)), np.diff(forces.offsets))
    largest = np.zeros(len(episode))
    np.maximum.at(largest, rows, counted)
    return largest


def _arm_of(body: str, meta: Meta) -> int:
    """Return the number of the arm that a body belongs to by its name; -1 of others."""
    arms = [*meta.arms]
    if arms == [ARM]:
        return -1 if body in {*meta.objects, "table", "floor", "world"} else 0
    arm = body.partition("/")[0]
    return arms.index(arm) if arm in arms else -1


def _bands(panel: Any, episode: RecordedEpisode) -> None:
    seconds = np.append(episode.seconds, episode.seconds[-1])
    for number, (skill, _, begin, end) in enumerate(episode.spans()):
        if skill and number % 2:
            panel.axvspan(seconds[begin], seconds[end], color="0.94", linewidth=0.0)


def _joints(panel: Any, episode: RecordedEpisode) -> None:
    for arm, robot in episode.meta.arms.items():
        q, commanded = episode[column_of(arm, "q")], episode.of_arm(arm, "action_q")
        for index, name in enumerate(robot.joints):
            (line,) = panel.plot(episode.seconds, q[:, index], linewidth=1.2, label=column_of(arm, name))
            if commanded is not None:
                dotted = {"linewidth": 0.8, "linestyle": ":", "color": line.get_color()}
                panel.plot(episode.seconds[1:], commanded[1:, index], **dotted)
    panel.set_ylabel("joints; dotted: commanded")
    panel.legend(fontsize=6, ncols=2, loc="upper left", bbox_to_anchor=(1.0, 1.0))


def _tcp(panel: Any, episode: RecordedEpisode) -> None:
    for arm in episode.meta.arms:
        tcp = episode[column_of(arm, "tcp_pose")]
        for index, axis in enumerate("xyz"):
            panel.plot(episode.seconds, tcp[:, index], linewidth=1.2, label=column_of(arm, axis))
    panel.set_ylabel("TCP, m")
    panel.legend(fontsize=7, loc="upper left", bbox_to_anchor=(1.0, 1.0))


def _gripper(panel: Any, episode: RecordedEpisode) -> None:
    panel.set_ylabel("gripper, mm")
    grippers = {arm: found for arm in episode.meta.arms if (found := episode.of_arm(arm, "gripper")) is not None}
    if not grippers:
        panel.text(0.5, 0.5, "no gripper", ha="center", transform=panel.transAxes)
        return
    for arm, gripper in grippers.items():
        (line,) = panel.plot(episode.seconds, 1000.0 * gripper[:, 1], linewidth=1.2, label=column_of(arm, "width"))
        width, closed = episode.meta.arms[arm].gripper or (0.0, 0.0), episode.of_arm(arm, "action_gripper")
        if closed is not None:
            commanded = width[1] + closed * (width[0] - width[1])
            dotted = {"linewidth": 0.8, "linestyle": ":", "color": line.get_color()}
            panel.plot(episode.seconds, 1000.0 * commanded, **dotted, label=column_of(arm, "commanded"))
    panel.legend(fontsize=7, loc="upper left", bbox_to_anchor=(1.0, 1.0))


def _force(panel: Any, episode: RecordedEpisode) -> None:
    panel.plot(episode.seconds, contact_force(episode), linewidth=1.0, color="C3")
    panel.set_ylabel("largest contact, N")


def _phases(panel: Any, episode: RecordedEpisode) -> None:
    seconds = np.append(episode.seconds, episode.seconds[-1])
    names: list[str] = []
    for skill, phase, begin, end in episode.spans():
        if not skill:
            continue
        name = f"{skill}: {phase}" if phase else skill
        if name not in names:
            names.append(name)
        panel.barh(names.index(name), seconds[end] - seconds[begin], left=seconds[begin], height=0.8, color="C2")
    panel.set_yticks(range(len(names)), names, fontsize=6)
    panel.invert_yaxis()
