"""`--package-path`: where the package:// names of a robot's files are looked up."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from robosandbox.errors import InputError


def _search(folders: list[Path] | None) -> list[Path] | None:
    """Put the folders on the search path of this process and of those that it starts.

    Raises:
        InputError: One is no folder.
    """
    from robosandbox.robots.importers.files import search_first

    for folder in folders or ():
        if not folder.is_dir():
            raise InputError(f"--package-path: {folder}: no such folder; name one that holds packages, or is one")
    search_first(folders or ())
    return folders


PackagePath = Annotated[
    list[Path] | None,
    typer.Option(
        "--package-path",
        callback=_search,
        help="Where the robot's package:// names are looked up, before ROS_PACKAGE_PATH; may be repeated.",
    ),
]
