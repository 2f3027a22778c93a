"""MJCF to a spec of the robot alone: no scene, no options, no keyframes, no compiler settings that could leak."""

from __future__ import annotations

import math
import os
from collections.abc import Iterable, Iterator
from dataclasses import replace
from pathlib import Path
from xml.etree import ElementTree

import mujoco
import numpy as np

from robosandbox.errors import InputError
from robosandbox.robots.importers import inertia
from robosandbox.robots.importers.files import ModelFiles, is_file, read_xml
from robosandbox.robots.importers.imported import ImportedModel, compile_spec, copy_options, copy_physics, one_line

_MAX_FILES = 100  # Number of files that a model includes. Chosen.
_MAX_REPLICAS = 1000  # Number of copies that <replicate> makes. Chosen.
_MAX_POINTS = 4096 * 4096  # Number of points of a height field or pixels of a texture, 67 MB of floats. Chosen.
_MAX_RESERVED = 1e9  # Bytes that a file reserves for physics. Chosen: a robot's needs grow by themselves.
_MAX_ROWS = 1e8  # Number of rows of the same. Chosen: files of old versions reserve some millions.
_SPECK = 1e-6  # Kilograms and kg m^2 that bodies without mass get, so that MuJoCo compiles them.
# A turn and a little, radians. Chosen because a robot whose joints all stay below so many degrees could not work.
_MOST_RADIANS = 6.4
_PNG_SIGNATURE = b"\x89PNG\r\n\x1a\n"
_PNG_HEAD = 24  # Bytes of signature and first chunk up to width and height, as in the PNG specification.
_ASSETS = ("mesh", "texture", "hfield", "skin", "flexcomp")
_SINGLE = (mujoco.mjtJoint.mjJNT_HINGE, mujoco.mjtJoint.mjJNT_SLIDE)


def import_mjcf(path: Path, package_paths: Iterable[Path] = (), *, as_in_file: bool = False) -> ImportedModel:
    """Read an MJCF's robot.

    Args:
        path: The file.
        package_paths: Folders outside the model's own that it may read from.
        as_in_file: Whether what it says of the solver is kept.

    Raises:
        InputError: The file is wrong, names a file that is not there, or holds no robot.
    """
    files = ModelFiles.of(path, package_paths)
    _check_files(files)
    try:
        spec = mujoco.MjSpec.from_file(str(path))
    except (ValueError, mujoco.FatalError) as error:
        raise InputError(f"{path.name}: {one_line(error)}") from None
    named = spec.modelname if spec.modelname not in ("", "MuJoCo Model") else path.stem
    model = ImportedModel(name=str(named), path=path, spec=spec)
    spec.compiler.discardvisual = False
    spec.compiler.fusestatic = False
    _settle_angles(model, files)
    _name_all(spec)
    try:
        compiled = compile_spec(spec, path.name)
    except InputError as error:
        if "mjMINVAL" not in str(error):
            raise
        # A moving body without mass or shape: a little of both, replaced below by what fits its shape.
        spec.compiler.boundmass = spec.compiler.boundinertia = _SPECK
        compiled = compile_spec(spec, path.name)
    _read_keyframes(model, compiled)
    _bake_inertias(model, compiled)
    _drop_scene(model)
    if as_in_file:
        model.options = mujoco.MjSpec()
        copy_physics(model.options, spec)
    _isolate(spec)
    return model


def _settle_angles(model: ImportedModel, files: ModelFiles) -> None:
    """Read angles as radians in a file that names no unit and whose joints would hardly move in degrees.

    A file that is meant to be merged into another leaves the unit to that one.
    """
    spec, path = model.spec, model.path
    limits = [np.abs(joint.range).max() for joint in spec.joints if joint.type == _SINGLE[0]]
    most = float(max(limits, default=0.0))
    if not spec.compiler.degree or not 0.0 < most <= _MOST_RADIANS:
        return
    if any(item.tag == "compiler" and item.get("angle") for item, _ in _elements(files, path, set(), path)):
        return
    spec.compiler.degree = False
    model.notes.append(f"no <compiler angle>, and no hinge goes beyond {most:.3g}: taken as radians, not degrees")


def _check_files(files: ModelFiles) -> None:
    """Look at the file and all that it includes or attaches before MuJoCo reads any of it."""
    seen: set[Path] = set()
    models = [files.model]
    while models:
        model = models.pop()
        if model in seen:
            continue
        # An attached model has folders of its own; what the main one may read, it may read too.
        own = (
            files
            if model == files.model
            else replace(files, model=model, package_paths=(*files.package_paths, files.root))
        )
        models += _check_model(own, seen, files.model)


def _check_model(files: ModelFiles, seen: set[Path], main: Path) -> list[Path]:
    """Look at one model with its includes and assets; return the models that it attaches."""
    attached = []
    meshdir = texturedir = ""
    assets: list[tuple[ElementTree.Element, Path]] = []
    for element, path in _elements(files, files.model, seen, main):
        if element.tag == "model" and element.get("file") is not None:
            attached.append(files.find(element.get("file", ""), "<model>").resolve())
        elif element.tag == "compiler":
            # The last one counts, as in MuJoCo: an empty one too.
            folder = element.get("assetdir")
            meshdir = element.get("meshdir", meshdir if folder is None else folder)
            texturedir = element.get("texturedir", texturedir if folder is None else folder)
        elif element.tag == "replicate" and _count(element) > _MAX_REPLICAS:
            raise InputError(f"{main.name}: <replicate count={element.get('count')!r}>: at most {_MAX_REPLICAS}")
        else:
            _check_amounts(element, main.name)
        if element.tag in _ASSETS:
            assets.append((element, path))
    for element, path in assets:
        folder = texturedir if element.tag == "texture" else meshdir
        for attribute, name in element.attrib.items():
            if attribute.startswith("file") and name:
                found = _find(files, name, f"<{element.tag} {attribute}>", folder, path)
                _check_picture(found, f"{main.name}: <{element.tag} {attribute}={name!r}>")
    return attached


# Elements, attributes whose numbers multiply to what MuJoCo allocates, and the most of that.
_AMOUNTS = (
    ("hfield", ("nrow", "ncol"), _MAX_POINTS, "points"),
    ("texture", ("width", "height"), _MAX_POINTS, "pixels"),
    ("composite", ("count",), _MAX_REPLICAS, "elements"),
    ("flexcomp", ("count",), _MAX_REPLICAS, "points"),
    ("size", ("memory",), _MAX_RESERVED, "bytes"),
    *(("size", (name,), _MAX_ROWS, "rows") for name in ("njmax", "nconmax", "nuserdata", "nstack")),
)


def _check_amounts(element: ElementTree.Element, main: str) -> None:
    """Refuse what MuJoCo would allocate by a number in the file before it does."""
    for tag, attributes, most, unit in _AMOUNTS:
        given = {name: text for name in attributes if tag == element.tag and (text := element.get(name))}
        product = math.prod(max(1.0, _amount(word)) for text in given.values() for word in text.split())
        if product > most:
            shown = " ".join(f"{name}={text[:20]!r}" for name, text in given.items())
            raise InputError(f"{main}: <{tag} {shown}>: {product:g} is outside 1 to {most:g} {unit}; give fewer")


def _amount(word: str) -> float:
    """Return a count or size; MuJoCo takes 10K, 10M and so on for bytes."""
    exponent = "KMGTPE".find(word[-1:].upper()) + 1 if word else 0
    try:
        value = float(word[:-1] if exponent else word)
    except ValueError:
        # MuJoCo's own reader says what is wrong with it.
        return 1.0
    return value * 1024.0**exponent if np.isfinite(value) else np.inf


def _check_picture(path: Path, where: str) -> None:
    """Refuse a small PNG file that unpacks to more than a texture or height field may have."""
    with open(path, "rb") as file:
        head = file.read(_PNG_HEAD)
    if head.startswith(_PNG_SIGNATURE):
        width, height = (int.from_bytes(head[place : place + 4], "big") for place in (16, 20))
        if width * height > _MAX_POINTS:
            raise InputError(
                f"{where}: {width} x {height} is outside 1 to {_MAX_POINTS} pixels; give a smaller picture"
            )


def _elements(files: ModelFiles, path: Path, seen: set[Path], main: Path) -> Iterator[tuple[ElementTree.Element, Path]]:
    """Yield a file's elements in their order, those of an included file where it is included; with the file of each."""
    if path in seen:
        return
    seen.add(path)
    if len(seen) > _MAX_FILES:
        raise InputError(f"{main.name}: includes over {_MAX_FILES} files")
    root = ElementTree.fromstring(read_xml(path))
    if path == main and root.tag != "mujoco":
        raise InputError(_not_a_model(main, root))
    for element in root.iter():
        if element.tag == "include" and element.get("file") is not None:
            yield from _elements(files, _find(files, element.get("file", ""), "<include>", "", path), seen, main)
        yield element, path


def _find(files: ModelFiles, name: str, element: str, folder: str, holder: Path) -> Path:
    """Return the file that MuJoCo will read: by the main model's folders, else beside the file that names it."""
    if not is_file(files.model.parent / folder / name) and is_file(holder.parent / name):
        folder = os.path.relpath(holder.parent, files.model.parent)
    return files.find(name, element, folder=folder).resolve()


def _count(element: ElementTree.Element) -> float:
    try:
        return float(element.get("count", "1"))
    except ValueError:
        return 1.0


def _not_a_model(path: Path, root: ElementTree.Element) -> str:
    if root.tag == "mujocoinclude":
        users = [item.name for item in sorted(path.parent.glob("*.xml")) if _includes(item, path.name)]
        remedy = f"load {' or '.join(users)}, which includes it" if users else "load the model that includes it"
        return f"{path.name}: is a fragment (<mujocoinclude>); {remedy}"
    return f"{path.name}: the root element is <{str(root.tag)[:40]}>; an MJCF's is <mujoco>, a URDF's <robot>"


def _includes(path: Path, name: str) -> bool:
    try:
        content = path.read_bytes()
    except OSError:
        return False
    return b"<mujoco" in content and b"<mujocoinclude" not in content and name.encode() in content


def _name_all(spec: mujoco.MjSpec) -> None:
    """Give every body, joint and actuator a name, so that a sidecar can say it."""
    _name(spec.bodies, "body", lambda body: f"{body.parent.name if body.parent else 'world'}_body")
    _name(spec.joints, "joint", lambda joint: f"{joint.parent.name}_joint")
    _name(spec.actuators, "actuator", lambda actuator: str(actuator.target))


def _name(elements: Iterable[object], kind: str, stem: object) -> None:
    items = list(elements)
    taken = {item.name for item in items}  # type: ignore[attr-defined]
    for item in items:
        if item.name:  # type: ignore[attr-defined]
            continue
        base = stem(item) or kind  # type: ignore[operator]
        name, number = base, 2
        while name in taken:
            name, number = f"{base}_{number}", number + 1
        item.name = name  # type: ignore[attr-defined]
        taken.add(name)


def _read_keyframes(model: ImportedModel, compiled: mujoco.MjModel) -> None:
    for k in range(compiled.nkey):
        values = {}
        for j in range(compiled.njnt):
            if compiled.jnt_type[j] in (_SINGLE[0].value, _SINGLE[1].value):
                values[compiled.joint(j).name] = float(compiled.key_qpos[k, compiled.jnt_qposadr[j]])
        if np.isfinite(list(values.values())).all():
            model.keyframes[compiled.key(k).name or f"key{k}"] = values
    for key in list(model.spec.keys):
        model.spec.delete(key)


def _bake_inertias(model: ImportedModel, compiled: mujoco.MjModel) -> None:
    """Write into each body what the file's compiler settings made of it, so that the settings can go."""
    moves = {body: bool(compiled.body_dofnum[body]) for body in range(compiled.nbody)}
    for body in model.spec.bodies:
        if body.name == "world":
            continue
        b = compiled.body(body.name).id
        mass, moments = float(compiled.body_mass[b]), compiled.body_inertia[b].copy()
        wrong = inertia.fault(mass, np.diag(moments)) if moves[b] else None
        if moves[b] and mass <= 2.0 * _SPECK:
            wrong = "is missing"
        if wrong is not None:
            low, high = _bounds(compiled, b)
            made = inertia.of_box(low, high, mass if mass > 1e-4 else None)
            model.notes.append(f"body {body.name!r}: inertia {wrong}; replaced by that of its shape")
            inertia.write(body, made)
            continue
        body.explicitinertial = True
        body.fullinertia = np.full(6, np.nan)
        body.mass = mass
        body.ipos, body.iquat, body.inertia = compiled.body_ipos[b], compiled.body_iquat[b], moments


def _bounds(compiled: mujoco.MjModel, body: int) -> tuple[np.ndarray, np.ndarray]:
    geoms = np.flatnonzero(compiled.geom_bodyid == body)
    if not len(geoms):
        return np.full(3, -0.01), np.full(3, 0.01)
    radius = compiled.geom_rbound[geoms][:, None]
    return (compiled.geom_pos[geoms] - radius).min(axis=0), (compiled.geom_pos[geoms] + radius).max(axis=0)


def _drop_scene(model: ImportedModel) -> None:
    """Remove what is no robot: lights, cameras, sensors, the floor, furniture and loose objects."""
    spec = model.spec
    for element in [*spec.lights, *spec.cameras, *spec.sensors, *spec.worldbody.geoms]:
        spec.delete(element)
    trees = list(spec.worldbody.bodies)
    joints = {tree.name: _robot_joints(tree) for tree in trees}
    most = max(joints.values(), default=0)
    if most == 0:
        raise InputError(f"{model.path.name}: has no hinge or slide joint; a robot needs one")
    # Articulated furniture has a joint or two; an arm in the same scene has more.
    keep = [tree for tree in trees if joints[tree.name] >= max(1, most // 2)]
    dropped = [tree.name for tree in trees if tree not in keep]
    for tree in trees:
        if tree in keep:
            for joint in list(tree.joints):
                if joint.type not in _SINGLE:
                    model.notes.append(f"joint {joint.name!r} lets the whole robot float: held fixed")
                    spec.delete(joint)
        else:
            spec.delete(tree)
    if dropped or len(keep) > 1:
        # A scene file places the robot's root; that place belongs to the scene.
        for tree in keep:
            tree.pos = [0.0, 0.0, 0.0]
            if len(keep) > 1:
                tree.quat = [1.0, 0.0, 0.0, 0.0]
    if dropped:
        model.notes.append(f"left out of the scene: {', '.join(dropped)}")


def _robot_joints(tree: mujoco.MjsBody) -> int:
    count = len([joint for joint in tree.joints if joint.type in _SINGLE])
    return count + len([j for j in tree.find_all(mujoco.mjtObj.mjOBJ_JOINT) if j.type in _SINGLE])


def _isolate(spec: mujoco.MjSpec) -> None:
    """Put back compiler settings that act on bodies, now that their effect is written down."""
    compiler = spec.compiler
    compiler.boundmass = compiler.boundinertia = 0.0
    compiler.balanceinertia = False
    compiler.settotalmass = -1.0
    compiler.inertiafromgeom = mujoco.mjtInertiaFromGeom.mjINERTIAFROMGEOM_AUTO
    compiler.inertiagrouprange = [0, 5]
    # Measured alone, a robot obeys the options that it will have in every scene, not those of its file.
    copy_options(spec, mujoco.MjSpec())
    spec.option.integrator = mujoco.mjtIntegrator.mjINT_IMPLICITFAST
