"""Weight of mesh objects of which the scene gives no mass."""

from __future__ import annotations

from robosandbox.errors import InputError
from robosandbox.ranges import LEAST_MASS, MOST_MASS
from robosandbox.shapes.mesh_file import mesh_volume
from robosandbox.types import Scene, SceneObject

# Density of a mesh of which none is given, kg/m^3: MuJoCo's default for geoms, that of water, near that of solid plastic.
DEFAULT_DENSITY = 1000.0


def weighed(scene: Scene) -> Scene:
    """Return the scene with a mass for each mesh that has none of its own: density times volume.

    Raises:
        InputError: A mesh cannot be read, or its mass would be out of range.
    """
    objects = tuple(map(_weighed, scene.objects))
    return scene if objects == scene.objects else scene.model_copy(update={"objects": objects})


def _weighed(item: SceneObject) -> SceneObject:
    if item.mesh is None or "mass" in item.model_fields_set:
        return item
    density = DEFAULT_DENSITY if item.density is None else item.density
    mass = density * mesh_volume(item.mesh, item.scale, of=item.id)
    if not LEAST_MASS <= mass <= MOST_MASS:
        raise InputError(
            f"objects[{item.id}].mass: at {density:g} kg/m^3 it would weigh {mass:g} kg, outside {LEAST_MASS:g} to "
            f"{MOST_MASS:g} kg; give its mass, density or scale"
        )
    return item.model_copy(update={"mass": mass})
