"""What a person is told where an optional package is missing: in a clone, and where the package is installed."""

import re
import shutil
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest

from robosandbox.extras import install_command, missing_extra

ROOT = Path(__file__).resolve().parents[1]
EXTRAS = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]["optional-dependencies"]
SUFFIXES = {".py", ".md", ".yaml", ".toml", ".json5", ""}
# A name in sys.modules without a module is one that cannot be imported.
PROGRAM = "import sys; sys.modules[sys.argv.pop(1)] = None; from robosandbox.apps.cli import main; main()"


def told(site: Path, package: str, *command: str) -> str:
    """Return what a command says on stderr where a package is missing and ours is imported from `site`."""
    program = f"import sys; sys.path.insert(0, {str(site)!r}); {PROGRAM}"
    done = subprocess.run(
        [sys.executable, "-c", program, package, *command], capture_output=True, text=True, timeout=120, cwd=site
    )
    assert done.returncode == 2 and done.stderr.count("\n") == 1, done.stderr
    return done.stderr


@pytest.mark.parametrize(
    ("package", "command", "extra"),
    [
        ("viser", ("viewer",), "viewer"),
        ("mcp", ("mcp",), "mcp"),
        ("pyarrow", ("runs", "show", "."), "record"),
        ("mujoco_menagerie", ("run", "go home", "--robot", "menagerie:ur5e"), "menagerie"),
    ],
)
def test_clone_is_told_to_sync_with_the_extra(package: str, command: tuple[str, ...], extra: str) -> None:
    said = told(ROOT / "src", package, *command)
    assert f"needs the package {package!r}" in said and f"`uv sync --extra {extra}`" in said


def test_installation_is_told_to_install_this_distribution(tmp_path: Path) -> None:
    shutil.copytree(ROOT / "src" / "robosandbox", tmp_path / "lib" / "robosandbox")
    said = told(tmp_path / "lib", "pyarrow", "runs", "show", ".")
    assert "needs the package 'pyarrow'; install it with `pip install 'robo-sandbox[record]'`" in said


def test_a_missing_module_of_ours_is_no_missing_extra() -> None:
    fault = ModuleNotFoundError("No module named 'robosandbox.viewr'", name="robosandbox.viewr")
    with pytest.raises(ModuleNotFoundError, match="viewr"):
        missing_extra(fault, "viewer", "viewer")


def test_every_extra_that_code_and_pages_name_exists() -> None:
    assert install_command("llm") == "uv sync --extra llm"
    named = set()
    for text in _texts().values():
        named |= set(re.findall(r'(?:missing_extra\([^)]*|install_command\()["\'](\w+)["\']\)', text))
        named |= set(re.findall(r"--extra (\w+)", text))
        named |= {extra for found in re.findall(r"robo-sandbox\[([\w,]+)\]", text) for extra in found.split(",")}
    assert {"llm", "mcp", "viewer", "record", "export", "gym", "scale", "menagerie"} <= named <= {*EXTRAS, "X"}


def test_nothing_tells_to_install_the_project_of_another_owner() -> None:
    # `robosandbox` on the package index is not this project.
    wrong = [
        f"{path}: {match[0]}"
        for path, text in _texts().items()
        for match in re.finditer(
            r"(?:pip3? install|uv add|uvx|pipx install)[^\n]*\brobosandbox\b(?![./])|robosandbox\[\w", text
        )
        if path.name != Path(__file__).name
    ]
    assert wrong == []


def _texts() -> dict[Path, str]:
    listed = subprocess.run(["git", "ls-files"], cwd=ROOT, capture_output=True, text=True, check=True).stdout.split(
        "\n"
    )
    files = [ROOT / name for name in listed if name and Path(name).suffix in SUFFIXES]
    return {file: file.read_text(encoding="utf-8") for file in files if file.is_file() and not file.is_symlink()}
