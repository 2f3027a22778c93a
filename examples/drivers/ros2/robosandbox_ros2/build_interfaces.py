"""Interfaces for an environment of wheels, which has no colcon and lacks control_msgs: generated, compiled and put in.

    uv run --project examples/drivers/ros2 build_interfaces.py

The generators are ROS 2's own, from the wheels; the compiler is gcc. In an installation of ROS nothing of this is needed:
control_msgs and tf2_msgs are there, and robosandbox_msgs is built by colcon.
"""

from __future__ import annotations

import io
import os
import shutil
import subprocess
import sys
import sysconfig
import tempfile
from collections.abc import Iterable
from contextlib import redirect_stderr, redirect_stdout
from pathlib import Path

import robosandbox.workcell

HERE = Path(__file__).resolve().parents[1] / "interfaces"
OURS = Path(robosandbox.workcell.__file__).parent / "ros2" / "robosandbox_msgs"
PACKAGES = (HERE / "control_msgs", HERE / "tf2_msgs", OURS)
_KINDS = ("msg", "srv", "action")
# Two implementations of type support, and what rclpy asks first, which passes on to them.
_FAST, _LOOKS = "rosidl_typesupport_fastrtps_c", "rosidl_typesupport_introspection_c"
_ANY = "rosidl_typesupport_c"


def main() -> None:
    """Build every package that is not there yet."""
    site = Path(sysconfig.get_path("purelib"))
    for package in PACKAGES:
        stamp = site / package.name / "built_from"
        text = "".join(path.read_text() for path in _files(package))
        if stamp.is_file() and stamp.read_text() == text:
            continue
        print(f"building {package.name}", flush=True)
        with tempfile.TemporaryDirectory() as folder:
            generate(package, Path(folder) / package.name)
            compile_into(Path(sys.prefix), site, Path(folder), package.name)
        stamp.write_text(text)


def _files(package: Path) -> list[Path]:
    return [path for kind in _KINDS for path in sorted((package / kind).glob(f"*.{kind}"))]


def generate(package: Path, target: Path) -> None:
    """Write C, type support and Python of a package's interfaces into a folder.

    Args:
        package: Folder with msg, srv and action; its name is the package's.
        target: Where to.
    """
    os.environ["AMENT_PREFIX_PATH"] = sys.prefix
    from rosidl_generator_c.cli import GenerateC
    from rosidl_generator_py.cli import GeneratePython
    from rosidl_typesupport_c.cli import GenerateCTypesupport
    from rosidl_typesupport_fastrtps_c.cli import GenerateFastRTPSCTypesupport
    from rosidl_typesupport_introspection_c.cli import GenerateIntrospectionCTypesupport

    apart = target.parent / "introspection" / package.name
    for folder in (target, apart):
        folder.mkdir(parents=True)
    files = [f"{package}:{path.relative_to(package)}" for path in _files(package)]
    given = [f"{Path(sys.prefix) / 'share'}"]
    # A message and an action of the same name are told apart by their folders, which this generator does not look at.
    kinds = [[file for file in files if f":{kind}/" in file] for kind in _KINDS]
    said = io.StringIO()
    try:
        with redirect_stdout(said), redirect_stderr(said):
            for some in filter(None, kinds):
                GenerateC("c").generate(package.name, some, given, target)
            for generator in (
                GenerateFastRTPSCTypesupport("fastrtps_c"),
                GenerateCTypesupport("c", typesupport_implementations=[_FAST, _LOOKS]),
                GeneratePython("py", typesupport_implementations=[_ANY]),
            ):
                generator.generate(package.name, files, given, target)
            # Its files have the names of the first generator's.
            GenerateIntrospectionCTypesupport("introspection_c").generate(package.name, files, given, apart)
    except BaseException:
        print(said.getvalue(), file=sys.stderr)
        raise


def compile_into(prefix: Path, site: Path, folder: Path, package: str) -> None:
    """Compile what was generated and put it where the wheels have theirs.

    Args:
        prefix: Of the environment.
        site: Its site-packages.
        folder: With a folder of the package's name, as `generate` fills it.
        package: Its name.
    """
    import numpy as np

    source, libraries = folder / package, prefix / "lib"
    included = [
        folder,
        folder / "introspection",
        prefix / "include",
        *(prefix / "include").iterdir(),
        sysconfig.get_path("include"),
    ]
    flags = [
        "-O1",
        "-fPIC",
        "-shared",
        "-w",
        f"-L{libraries}",
        *(f"-I{path}" for path in (*included, np.get_include())),
    ]
    # Generated code refers to that of the packages that it uses; all that are here are linked, those without need for nothing.
    there = {path.name[3:-3] for path in libraries.glob("lib*__rosidl_*.so")}

    def build(name: str, patterns: Iterable[str], part: str, *others: str) -> None:
        where = folder / "introspection" / package if part == _LOOKS else source
        sources = [str(path) for pattern in patterns for path in sorted(where.rglob(pattern))]
        needed = [*others, *sorted(one for one in there if one.endswith(f"__{part}") and not one.startswith(package))]
        output = site / package / name if name.startswith(package) else libraries / name
        command = ["g++" if sources[0].endswith("cpp") else "gcc", *flags, *sources, "-o", str(output)]
        subprocess.run([*command, *(f"-l{one}" for one in needed)], check=True)

    shutil.rmtree(site / package, ignore_errors=True)
    for path in source.rglob("*.py"):
        target = site / package / path.relative_to(source)
        target.parent.mkdir(parents=True, exist_ok=True)
        shutil.copyfile(path, target)
    (site / package / "__init__.py").touch()
    c, py = f"{package}__rosidl_generator_c", f"{package}__rosidl_generator_py"
    plain = ("*__functions.c", "*__description.c", "*__type_support.c")
    build(f"lib{c}.so", plain, "rosidl_generator_c")
    shared = ("fastcdr", "rosidl_typesupport_fastrtps_c", "rosidl_typesupport_fastrtps_cpp")
    build(f"lib{package}__{_FAST}.so", ("*__type_support_c.cpp",), _FAST, c, *shared)
    build(f"lib{package}__{_LOOKS}.so", ("*__type_support.c",), _LOOKS, c, _LOOKS)
    build(f"lib{package}__{_ANY}.so", ("*__type_support.cpp",), _ANY, c, f"{package}__{_FAST}", _ANY)
    build(f"lib{py}.so", ("_*_s.c",), "rosidl_generator_py", c)
    build(f"{package}_s__{_ANY}.so", (f"_{package}_s.ep.{_ANY}.c",), _ANY, py, c, f"{package}__{_ANY}")
    if not list((prefix / "share" / "ament_index" / "resource_index" / "packages").glob(package)):
        (prefix / "share" / "ament_index" / "resource_index" / "packages" / package).touch()


if __name__ == "__main__":
    main()
