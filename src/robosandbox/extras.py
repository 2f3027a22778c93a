"""Optional dependencies: what to tell a person whose installation lacks one."""

from __future__ import annotations

from functools import cache
from pathlib import Path

from robosandbox.errors import InputError

# The distribution's name; `robosandbox` on the package index is another project.
DISTRIBUTION = "robo-sandbox"


def install_command(extra: str) -> str:
    """Return the command that installs an extra of this package: uv's in a clone, pip's elsewhere.

    Args:
        extra: A key of `[project.optional-dependencies]` in pyproject.toml.
    """
    return f"uv sync --extra {extra}" if _in_clone() else f"pip install '{DISTRIBUTION}[{extra}]'"


def missing_extra(error: ImportError, what: str, extra: str) -> InputError:
    """Return the error for a package that is not installed.

    Args:
        error: What the import raised.
        what: The option or command that needs the package.
        extra: The extra that brings it.

    Raises:
        ImportError: The module that is missing is one of this package, which is a fault of ours.
    """
    if error.name is None or error.name.startswith("robosandbox"):
        raise error
    package = error.name.partition(".")[0]
    return InputError(f"{what}: needs the package {package!r}; install it with `{install_command(extra)}`")


@cache
def _in_clone() -> bool:
    """Return whether this file lies in a working tree, where pyproject.toml is two folders above the package."""
    project = Path(__file__).resolve().parents[2] / "pyproject.toml"
    return project.is_file() and f'name = "{DISTRIBUTION}"' in project.read_text(encoding="utf-8")
