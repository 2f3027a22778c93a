"""Files that a model may read: its own folder, its package, and the search paths; nothing else through `..`."""

from __future__ import annotations

import os
import re
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path, PurePosixPath
from urllib.parse import unquote
from xml.parsers import expat

from robosandbox.errors import InputError
from robosandbox.values import frozen

PACKAGE_PATH_VARIABLE = "ROS_PACKAGE_PATH"
MAX_MODEL_BYTES = 20_000_000  # Bytes of a model file. Chosen far above any robot's.
MAX_ASSET_BYTES = 200_000_000  # Bytes of a mesh or texture. Chosen far above any robot's.
_MAX_DEPTH = 256  # Number of elements within each other. Chosen: a robot's links form a chain of at most 200.
_MAX_ELEMENTS = 200_000  # Number of elements of a file. Chosen: a robot has a few thousand.
# A URDF in one of these stands beside its meshes' folder, in one package.
_MODEL_FOLDERS = ("urdf", "robots", "mjcf", "mujoco", "xml", "urdfs", "models")


class MissingFileError(InputError):
    """A file that a model names is nowhere."""


@frozen
class ModelFiles:
    """Finds the files that a model names.

    Attributes:
        model: The model file, resolved.
        package_paths: Folders that hold packages, or are one, in order of preference.
    """

    model: Path
    package_paths: tuple[Path, ...]

    @classmethod
    def of(cls, model: Path, package_paths: Iterable[Path] = ()) -> ModelFiles:
        """Return the finder of a model, with `package_paths` before those of ROS_PACKAGE_PATH."""
        listed = [Path(item) for item in os.environ.get(PACKAGE_PATH_VARIABLE, "").split(os.pathsep) if item]
        return cls(model.resolve(), tuple(path.resolve() for path in [*package_paths, *listed]))

    @property
    def root(self) -> Path:
        """The folder that relative names may not leave."""
        folder = self.model.parent
        for candidate in (folder, *folder.parents):
            if (candidate / "package.xml").is_file():
                return candidate
        # urdf/arm.urdf and urdf/arm/arm.urdf alike have their meshes beside urdf/.
        for candidate in (folder, folder.parent):
            if candidate.name.lower() in _MODEL_FOLDERS and candidate.parent != candidate.parent.parent:
                return candidate.parent
        return folder

    def find(self, name: str, element: str, *, folder: str = "") -> Path:
        """Return the file that `name` stands for.

        Args:
            name: As in the model: package://, file://, relative or absolute.
            element: What names it, for messages.
            folder: The model's asset folder, relative to the model (MJCF's meshdir).

        Raises:
            MissingFileError: It is nowhere.
            InputError: It is outside the model's folder and the search paths, or too large.
        """
        if not name or "\0" in name:
            raise InputError(f"{self.model.name}: {element} names no file; give a path")
        try:
            found = self._locate(name, folder)
        except OSError as error:
            raise InputError(f"{self.model.name}: {element}: {name!r} is no path: {error.strerror}") from None
        for path in found:
            if is_file(path):
                self._check_inside(path, name, element, folder)
                if path.stat().st_size > MAX_ASSET_BYTES:
                    raise InputError(f"{self.model.name}: {element}: {path.name} is larger than 200 MB")
                return path
        tried = f" (looked in {found[0].parent})" if found else ""
        remedy = f"give its folder with --package-path, or set {PACKAGE_PATH_VARIABLE}"
        remedy = remedy if "://" in name else f"put it there, or {remedy}"
        raise MissingFileError(f"{self.model.name}: {element}: no file {name!r}{tried}; {remedy}")

    def _locate(self, name: str, folder: str) -> list[Path]:
        """Return where the file may lie, best first."""
        if name.startswith(("package://", "model://")):
            package, _, rest = unquote(name.partition("://")[2]).partition("/")
            if ".." in PurePosixPath(rest).parts:
                raise InputError(
                    f"{self.model.name}: {name!r} leaves its package through '..'; name the file inside it"
                )
            return [base / rest for base in self._packages(package)]
        # file://meshes/link.stl names no host, as a URI would, but a relative path.
        path = Path(unquote(name.removeprefix("file://")) if name.startswith("file://") else name.replace("\\", "/"))
        if path.is_absolute():
            return [path]
        return [self.model.parent / folder / path, *(base / path for base in self.package_paths)]

    def _packages(self, package: str) -> list[Path]:
        """Return the folders that may be a package: on the search paths, then around the model."""
        if package in ("", ".", "..") or "\\" in package:
            return []
        places = []
        for base in self.package_paths:
            places += [base / package, base] if base.name == package else [base / package]
        for parent in self.model.parents:
            if parent.name == package:
                places.append(parent)
            if parent == parent.parent:
                break
            places.append(parent / package)
        named = [place for place in places if place.is_dir()]
        # A checkout may lie in a folder of another name: the model's own package is its root.
        return named or [self.root]

    def _check_inside(self, path: Path, name: str, element: str, folder: str) -> None:
        """Refuse what `..` or a link leads to; an absolute path says openly where it goes."""
        absolute = Path(folder or name).is_absolute() or name.startswith("file:///")
        if absolute and ".." not in PurePosixPath(folder, name.removeprefix("file://")).parts:
            return
        resolved = path.resolve()
        roots = [self.root, *self.package_paths]
        if name.startswith(("package://", "model://")):
            roots += [base.resolve() for base in self._packages(unquote(name.partition("://")[2]).partition("/")[0])]
        if not any(resolved.is_relative_to(root) for root in roots):
            raise InputError(
                f"{self.model.name}: {element}: {name!r} leads outside {self.root} and the search paths; "
                "give its folder with --package-path"
            )


def search_first(package_paths: Iterable[Path]) -> None:
    """Put folders at the head of ROS_PACKAGE_PATH, for all that loads robots by way of a scene, here and in children."""
    added = [str(Path(path).resolve()) for path in package_paths]
    if added:
        before = os.environ.get(PACKAGE_PATH_VARIABLE)
        os.environ[PACKAGE_PATH_VARIABLE] = os.pathsep.join([*added, *([before] if before else [])])


@contextmanager
def searching(package_paths: Iterable[Path]) -> Iterator[None]:
    """Search folders first for a while."""
    before = os.environ.get(PACKAGE_PATH_VARIABLE)
    search_first(package_paths)
    try:
        yield
    finally:
        if before is None:
            os.environ.pop(PACKAGE_PATH_VARIABLE, None)
        else:
            os.environ[PACKAGE_PATH_VARIABLE] = before


def read_xml(path: Path) -> bytes:
    """Return a model file's bytes after a first look: XML without DTD, of sane size and depth.

    Raises:
        InputError: It is none of that; the message names line and remedy.
    """
    if not is_file(path):
        raise InputError(f"{path}: no such file")
    if path.stat().st_size > MAX_MODEL_BYTES:
        raise InputError(f"{path.name}: is {path.stat().st_size / 1e6:.0f} MB; a model file is at most 20 MB")
    try:
        content = bind_prefixes(path.read_bytes())
    except OSError as error:
        raise InputError(f"{path}: cannot be read: {error.strerror}") from None
    check_xml(content, path.name)
    return content


def bind_prefixes(content: bytes) -> bytes:
    """Declare on the root the prefixes that a file uses and nobody declared, as ROS reads `drake:` and `sensor:`."""
    declared = set(re.findall(rb"xmlns:([\w.-]+)\s*=", content)) | {b"xml", b"xmlns"}
    used = set(re.findall(rb"<([A-Za-z_][\w.-]*):[A-Za-z_]", content))
    used |= set(re.findall(rb"\s([A-Za-z_][\w.-]*):[A-Za-z_][\w.-]*\s*=\s*[\"']", content))
    root = re.search(rb"<(?:robot|mujoco)\b", content)
    missing = sorted(used - declared)
    if root is None or not missing:
        return content
    names = b"".join(b' xmlns:%s="urn:%s"' % (prefix, prefix) for prefix in missing)
    return content[: root.end()] + names + content[root.end() :]


def check_xml(content: bytes, source: str) -> None:
    """Refuse what is no XML, has a DTD (entities can read other files), or is nested without end.

    Raises:
        InputError: `source`, line and remedy.
    """
    depth = elements = 0
    parser = expat.ParserCreate()

    def start(name: str, attributes: dict[str, str]) -> None:
        nonlocal depth, elements
        depth, elements = depth + 1, elements + 1
        if depth > _MAX_DEPTH:
            raise InputError(f"{source}: line {parser.CurrentLineNumber}: <{name}> is nested over {_MAX_DEPTH} deep")
        if elements > _MAX_ELEMENTS:
            raise InputError(f"{source}: has over {_MAX_ELEMENTS} elements; a robot has a few thousand")

    def end(name: str) -> None:
        nonlocal depth
        depth -= 1

    def doctype(*_: object) -> None:
        raise InputError(
            f"{source}: line {parser.CurrentLineNumber}: has a document type (<!DOCTYPE>), which could pull in other "
            "files; remove it"
        )

    parser.StartElementHandler = start
    parser.EndElementHandler = end
    parser.StartDoctypeDeclHandler = doctype
    try:
        parser.Parse(content, True)
    except expat.ExpatError as error:
        line, column = error.lineno, error.offset + 1
        reason = expat.errors.messages.get(error.code, "malformed")
        raise InputError(f"{source}: line {line}, column {column}: {reason}; it is not well-formed XML") from None
    except (ValueError, LookupError) as error:
        raise InputError(f"{source}: {error}; save it as UTF-8 XML") from None


def is_file(path: Path) -> bool:
    """Tell whether there is a file; a name that no file system takes is none."""
    try:
        return path.is_file()
    except (OSError, ValueError):
        return False
