"""Files of an MJCF, listed before MuJoCo reads any of it: includes, attached models, assets, and what they reserve."""

from __future__ import annotations

import math
import os
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from xml.etree import ElementTree

import numpy as np

from robosandbox.errors import InputError
from robosandbox.robots.importers.files import MissingFileError, ModelFiles, is_file, read_xml

_MAX_FILES = 100  # Number of files that a model includes. Chosen.
_MAX_REPLICAS = 1000  # Number of copies that <replicate> makes. Chosen.
_MAX_POINTS = 4096 * 4096  # Number of points of a height field or pixels of a texture, 67 MB of floats. Chosen.
_MAX_RESERVED = 1e9  # Bytes that a file reserves for physics. Chosen: a robot's needs grow by themselves.
_MAX_ROWS = 1e8  # Number of rows of the same. Chosen: files of old versions reserve some millions.
_PNG_SIGNATURE = b"\x89PNG\r\n\x1a\n"
_PNG_HEAD = 24  # Bytes of signature and first chunk up to width and height, as in the PNG specification.
_ASSETS = ("mesh", "texture", "hfield", "skin", "flexcomp")


def check_files(files: ModelFiles) -> dict[str, MissingFileError]:
    """Look at the file and all that it includes or attaches before MuJoCo reads any of it; return what meshes are not there.

    Those of an attached model have to be.
    """
    seen: set[Path] = set()
    missing: dict[str, MissingFileError] = {}
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
        models += _check_model(own, seen, files.model, missing if model == files.model else None)
    return missing


def _check_model(
    files: ModelFiles, seen: set[Path], main: Path, missing: dict[str, MissingFileError] | None
) -> list[Path]:
    """Look at one model with its includes and assets; return the models that it attaches.

    Args:
        files: Of the model.
        seen: Files that were looked at; added to.
        main: The file that leads to it.
        missing: Where meshes are put that are not there; None where they have to be.
    """
    attached = []
    meshdir = texturedir = ""
    assets: list[tuple[ElementTree.Element, Path]] = []
    for element, path in elements(files, files.model, seen, main):
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
        _check_asset(files, element, path, texturedir if element.tag == "texture" else meshdir, main, missing)
    return attached


def _check_asset(
    files: ModelFiles,
    element: ElementTree.Element,
    path: Path,
    folder: str,
    main: Path,
    missing: dict[str, MissingFileError] | None,
) -> None:
    """Look for the files of an asset that stands in the file at `path`."""
    for attribute, name in element.attrib.items():
        if attribute.startswith("file") and name:
            try:
                found = _find(files, name, f"<{element.tag} {attribute}>", folder, path)
            except MissingFileError as error:
                if missing is None or element.tag != "mesh":
                    raise
                missing[name] = error
                continue
            _check_picture(found, f"{main.name}: <{element.tag} {attribute}={name!r}>")


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


def elements(files: ModelFiles, path: Path, seen: set[Path], main: Path) -> Iterator[tuple[ElementTree.Element, Path]]:
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
            yield from elements(files, _find(files, element.get("file", ""), "<include>", "", path), seen, main)
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
