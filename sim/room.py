"""The house's own room: floor, table, light, cameras, and the settings under which a held object stays held."""

from __future__ import annotations

import mujoco
import numpy as np

from robosandbox.types import Vec3

TABLE, FLOOR = "table", "floor"
TABLE_HALF_EXTENT = 0.5
# Seconds; MuJoCo's own default. Of six tasks all succeed at 1, 2 and 5 ms too, but at 5 ms a drawer's grip slips once
# more (9.6 s in place of 5.8); 1 ms costs twice as much.
PHYSICS_TIMESTEP = 0.002
# Speed below which a body lies still, m/s of any of its points; MuJoCo's own default. What contacts leave of things at rest in
# the bundled tasks was measured: boxes 1e-10 at the most, cans 1e-4, beads 3e-4, cups and bowls, which rock on their pieces, 6e-4.
_SLEEP_TOLERANCE = 0.001


def set_options(spec: mujoco.MjSpec) -> None:
    """Choose settings under which a held object stays held.

    Elliptic cones with impratio 10 and no-slip iterations: without the latter, held objects creep by tenths of a
    millimetre a second (google-deepmind/mujoco issue 3328).
    """
    spec.option.timestep = PHYSICS_TIMESTEP
    spec.option.integrator = mujoco.mjtIntegrator.mjINT_IMPLICITFAST
    spec.option.cone = mujoco.mjtCone.mjCONE_ELLIPTIC
    spec.option.impratio = 10.0
    spec.option.noslip_iterations = 10
    spec.option.enableflags |= mujoco.mjtEnableBit.mjENBL_SLEEP.value
    spec.option.sleep_tolerance = _SLEEP_TOLERANCE
    spec.compiler.autolimits = True
    quality = spec.visual.quality
    quality.shadowsize = 0
    quality.offsamples = 0
    spec.visual.global_.offwidth = 1280
    spec.visual.global_.offheight = 960
    # All lights together keep a white thing that faces the camera just below what a pixel can hold.
    spec.visual.headlight.ambient = [0.27, 0.27, 0.27]
    spec.visual.headlight.diffuse = [0.25, 0.25, 0.25]
    spec.visual.headlight.specular = [0.05, 0.05, 0.05]
    spec.visual.map.znear = 0.01
    spec.visual.map.zfar = 20.0


def add_sky(spec: mujoco.MjSpec, name: str) -> None:
    """Give a scene a pale sky, as a texture of this name."""
    spec.add_texture(
        name=name,
        type=mujoco.mjtTexture.mjTEXTURE_SKYBOX,
        builtin=mujoco.mjtBuiltin.mjBUILTIN_GRADIENT,
        rgb1=[0.85, 0.89, 0.94],
        rgb2=[0.55, 0.62, 0.70],
        width=64,
        height=384,
    )


def add_room(spec: mujoco.MjSpec, *, table_height: float) -> None:
    """Give a scene the house's floor, lights, cameras, and a table of this height, metres."""
    add_floor(spec)
    table = spec.worldbody.add_body(name=TABLE, pos=[0.0, 0.0, table_height / 2.0])
    half = [TABLE_HALF_EXTENT, TABLE_HALF_EXTENT, table_height / 2.0]
    table.add_geom(
        name=TABLE,
        type=mujoco.mjtGeom.mjGEOM_BOX,
        size=half,
        rgba=[0.80, 0.74, 0.66, 1.0],
        condim=4,
        friction=[1.0, 0.005, 0.0001],
    )
    add_camera(spec, "scene", (1.05, -0.85, table_height + 0.75), (0.0, 0.0, table_height + 0.14), 42.0)
    add_camera(spec, "top", (0.1, 0.0, table_height + 1.36), (0.1, 0.0, table_height), 45.0)


def add_floor(spec: mujoco.MjSpec) -> None:
    """Give a scene a floor at z = 0, the sky and two lights."""
    add_sky(spec, "sky")
    world = spec.worldbody
    floor = world.add_body(name=FLOOR)
    plane = mujoco.mjtGeom.mjGEOM_PLANE
    floor.add_geom(name=FLOOR, type=plane, size=[3.0, 3.0, 0.1], rgba=[0.50, 0.53, 0.57, 1.0])
    world.add_light(
        pos=[0.6, -1.2, 2.2],
        dir=[-0.25, 0.5, -0.9],
        diffuse=[0.38, 0.38, 0.37],
        specular=[0.1, 0.1, 0.1],
        castshadow=False,
    )
    world.add_light(
        pos=[-0.8, 1.0, 2.0],
        dir=[0.4, -0.5, -0.9],
        diffuse=[0.17, 0.17, 0.18],
        specular=[0.1, 0.1, 0.1],
        castshadow=False,
    )


def add_camera(spec: mujoco.MjSpec, name: str, eye: Vec3, target: Vec3, fovy: float) -> None:
    """Give a scene a camera at `eye` that looks at `target`, metres, with a vertical field of view in degrees."""
    backward = np.array(eye) - np.array(target)
    z_axis = backward / np.linalg.norm(backward)
    up = np.array([0.0, 0.0, 1.0]) if abs(z_axis[2]) < 0.99 else np.array([1.0, 0.0, 0.0])
    x_axis = np.cross(up, z_axis)
    x_axis /= np.linalg.norm(x_axis)
    quat = np.zeros(4)
    mujoco.mju_mat2Quat(quat, np.column_stack([x_axis, np.cross(z_axis, x_axis), z_axis]).flatten())
    spec.worldbody.add_camera(name=name, pos=eye, quat=quat, fovy=fovy)
