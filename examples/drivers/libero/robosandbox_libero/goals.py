"""Goals of BDDL files as relations, found through bodies, sites and joints: no name is looked up in a table."""

from __future__ import annotations

import numpy as np

from robosandbox.errors import InputError
from robosandbox.sim.scene_file import SceneFile, read_scene_file
from robosandbox.types import Array, ObservedScene
from robosandbox.world.facts import Fact, fact
from robosandbox.world.placement_sampling import tried_on_table
from robosandbox_libero.environment import LiberoEnvironment

# Metres by which a region's middle may lie over or under what it is in.
_BESIDE = 0.03
# Share of a region in which a place is looked for, and number of places along each of its sides.
_WITHIN, _PLACES = 0.9, 11
# Free space around a place, metres, the most first: a hand that opens takes some, and what is put down beside it later.
_SPACES = (0.07, 0.05, 0.03, 0.008)


def relations_of(environment: LiberoEnvironment, seen: ObservedScene) -> tuple[Fact, ...]:
    """Return the goal of an environment's task as relations.

    Args:
        environment: The world at its start.
        seen: What is seen there: of a region of the table a free place is asked for.

    Raises:
        InputError: A predicate or its argument has no like here.
    """
    world = environment.scene.world
    assert world is not None
    file = read_scene_file(world)
    return tuple(_relation(predicate, environment, file, seen) for predicate in environment.task.goal)


def _relation(predicate: tuple[str, ...], environment: LiberoEnvironment, file: SceneFile, seen: ObservedScene) -> Fact:
    match predicate:
        case ("on" | "in" as relation, a, where) if where in environment.regions:
            site = environment.data.site(where)
            place = _object_of(int(environment.model.site(where).bodyid[0]), environment, file)
            if place is not None and relation == "on":
                return fact("on", a, place)
            holder = None if place is None else _holder_at(site.xpos, place, file)
            if holder is not None:
                return fact("inside", a, holder)
            # A region of the table, of the room, or under a board.
            return fact("at", a, *_free_point(a, site.xpos, environment.model.site(where).size, seen))
        case ("on", a, b):
            # Nothing stands on what is open above: it lies in it.
            base = next(item.shape for item in file.objects if item.id == b)
            return fact("inside" if base.holds_things and not base.flat_top else "on", a, b)
        case ("in", a, b):
            return fact("inside", a, b)
        case ("open", part):
            return fact("open", _part_of(part, environment, file))
        case ("close", part):
            return fact("closed", _part_of(part, environment, file))
        case ("turnon", part):
            return fact("turned_to", _part_of(part, environment, file), 1.0)
        case ("turnoff", part):
            return fact("turned_to", _part_of(part, environment, file), 0.0)
        case _:
            raise InputError(f"{' '.join(predicate)}: no relation says that")


def _free_point(name: str, middle: Array, half: Array, seen: ObservedScene) -> tuple[float, float]:
    """Return the point of a region (3,) of these half-extents (3,) at which a thing has most room, x and y; the nearest to its middle of several."""
    shares = np.linspace(-_WITHIN, _WITHIN, _PLACES)
    offsets = sorted(((u, v) for u in shares for v in shares), key=lambda one: (round(np.hypot(*one), 6), one))
    points = [middle[:2] + np.array(offset) * half[:2] for offset in offsets]
    item = seen.find(name)
    tried = ([] if item is None else [*tried_on_table(seen, item, points, space)] for space in _SPACES)
    x, y = next((spot.xy for found in tried for spot, names in found if not names), points[0])
    return round(float(x), 4), round(float(y), 4)


def _holder_at(point: Array, name: str, file: SceneFile) -> str | None:
    """Return the id of what holds things where a point (3,) is: an object, or a compartment of it; None where nothing does."""
    for item in sorted(file.objects, key=lambda one: one.id == name):
        room = item.shape.room(item.size) if item.id == name or item.id.startswith(f"{name}.") else None
        if room is None:
            continue
        local = item.pose.rotation.T @ (point - item.pose.position)
        if room.margin(local) > 0.0 and room.floor - _BESIDE < local[2] < room.rim + _BESIDE:
            return item.id
    return None


def _part_of(name: str, environment: LiberoEnvironment, file: SceneFile) -> str:
    """Return the id of the part that moves on the joint of a thing or region."""
    joint = environment.joints_of(name)[0]
    found = _object_of(int(environment.model.joint(joint).bodyid[0]), environment, file)
    if found is None:
        raise InputError(f"{name}: its joint {joint} moves nothing that was imported")
    return found


def _object_of(body: int, environment: LiberoEnvironment, file: SceneFile) -> str | None:
    """Return the id of the object that a body belongs to; None for the table's and the room's."""
    name = str(environment.model.body(body).name)
    return next((found for found, bodies in file.bodies.items() if name in bodies), None)
