"""Goals of BDDL files as relations, found through bodies, sites and joints: no name is looked up in a table."""

from __future__ import annotations

from robosandbox.errors import InputError
from robosandbox.sim.scene_file import SceneFile, read_scene_file
from robosandbox.types import Array
from robosandbox.world.facts import Fact, fact
from robosandbox_libero.environment import LiberoEnvironment


def relations_of(environment: LiberoEnvironment) -> tuple[Fact, ...]:
    """Return the goal of an environment's task as relations.

    Raises:
        InputError: A predicate or its argument has no like here.
    """
    world = environment.scene.world
    assert world is not None
    return tuple(_relation(predicate, environment, read_scene_file(world)) for predicate in environment.task.goal)


def _relation(predicate: tuple[str, ...], environment: LiberoEnvironment, file: SceneFile) -> Fact:
    match predicate:
        case ("on" | "in" as relation, a, where) if where in environment.regions:
            site = environment.data.site(where)
            body = int(environment.model.site(where).bodyid[0])
            place = _object_of(body, environment, file)
            if place is None:
                # A region of the table, or of the room.
                return fact("at", a, round(float(site.xpos[0]), 4), round(float(site.xpos[1]), 4))
            if relation == "on":
                return fact("on", a, place)
            return fact("inside", a, _compartment_at(site.xpos, place, file) or place)
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


def _compartment_at(point: Array, name: str, file: SceneFile) -> str | None:
    """Return the id of the compartment of a fixture in which a point (3,) is; None where it has none there."""
    for item in file.objects:
        if item.id.startswith(f"{name}.") and item.geometry is not None and item.geometry.compartment is not None:
            room = item.geometry.hollow
            if room is not None and room.margin(item.pose.rotation.T @ (point - item.pose.position)) > 0.0:
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
