"""The package's map in pyproject.toml, the links that analysers follow, and the folders themselves say the same."""

import tomllib
from importlib.metadata import entry_points
from pathlib import Path

import pytest

import robosandbox

ROOT = Path(__file__).resolve().parents[1]
SETUP = tomllib.loads((ROOT / "pyproject.toml").read_text())["tool"]["setuptools"]
FOLDERS = {name: ROOT / folder for name, folder in SETUP["package-dir"].items() if name}
PACKAGES = SETUP["packages"]


def _folder(package: str) -> Path:
    for name, folder in FOLDERS.items():
        if package == name or package.startswith(f"{name}."):
            return folder.joinpath(*package.removeprefix(name).split(".")[1:])
    return (ROOT / "src").joinpath(*package.split("."))


def _packages_in(name: str, folder: Path) -> set[str]:
    found = set()
    for init in folder.rglob("__init__.py"):
        inner = init.parent.relative_to(folder)
        found.add(".".join((name, *inner.parts)))
    return found


def test_each_mapped_folder_has_one_relative_link_in_the_source_tree() -> None:
    links = {path.name: path for path in (ROOT / "src" / "robosandbox").iterdir() if path.is_symlink()}
    assert {f"robosandbox.{name}" for name in links} == set(FOLDERS)
    for name, link in links.items():
        assert str(link.readlink()) == f"../../{name}"
        assert link.resolve() == FOLDERS[f"robosandbox.{name}"]


def test_every_folder_with_an_init_is_a_listed_package_and_no_other_is() -> None:
    inside = {"robosandbox"}
    source = ROOT / "src" / "robosandbox"
    for child in source.iterdir():
        if child.is_dir() and not child.is_symlink():
            inside |= _packages_in(f"robosandbox.{child.name}", child)
    for name, folder in FOLDERS.items():
        inside |= _packages_in(name, folder)
    assert set(PACKAGES) == inside
    assert len(PACKAGES) == len(set(PACKAGES))


@pytest.mark.parametrize("package", PACKAGES)
def test_no_python_file_lies_in_a_folder_that_is_not_a_package(package: str) -> None:
    folder = _folder(package)
    stray = [
        file.parent
        for child in folder.iterdir()
        if child.is_dir() and not child.is_symlink()
        for file in child.rglob("*.py")
        if not (file.parent / "__init__.py").exists()
    ]
    assert not stray


@pytest.mark.parametrize("name", ["types.py", "types", "__init__.py", "robosandbox"])
def test_nothing_at_the_root_hides_a_module(name: str) -> None:
    assert not (ROOT / name).exists()


@pytest.mark.parametrize("group", ["skills", "planners", "perceptions", "engines"])
def test_every_entry_point_loads_under_its_own_name(group: str) -> None:
    points = [point for point in entry_points(group=f"robosandbox.{group}") if point.value.startswith("robosandbox.")]
    assert points
    for point in points:
        loaded = point.load()
        if group == "skills":
            assert loaded.name == point.name


def test_version_is_the_one_in_pyproject() -> None:
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
    assert robosandbox.__version__ == project["version"]
