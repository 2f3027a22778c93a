"""A hook of mkdocs: pages that live at the repository's root, and the examples, become part of the site."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

from mkdocs.structure.files import File, Files

ROOT = Path(__file__).resolve().parents[1]
PAGES = {"README.md": "index.md", "CONTRIBUTING.md": "contributing.md", "CHANGELOG.md": "changelog.md"}
FOLDERS = ("examples", "robots")
SUFFIXES = {".py", ".yaml", ".json5", ".md"}


def on_files(files: Files, config: Any) -> Files:
    """Add the root's pages, and the files that pages link to, under their own paths."""
    for name, target in PAGES.items():
        files.append(File.generated(config, target, content=from_root((ROOT / name).read_text(encoding="utf-8"))))
    for folder in FOLDERS:
        for path in sorted((ROOT / folder).rglob("*")):
            if path.suffix in SUFFIXES and "__pycache__" not in path.parts:
                # As text: a browser shows it, and no page is made of it.
                target = f"{path.relative_to(ROOT)}.txt"
                files.append(File.generated(config, target, content=path.read_text(encoding="utf-8")))
    return files


def on_page_markdown(markdown: str, **_: Any) -> str:
    """Let links that lead out of docs/ lead to where the files are on the site."""
    return re.sub(r"\]\(\.\./([^)#\s]+)", lambda link: f"]({place(link[1])}", markdown)


def from_root(markdown: str) -> str:
    """Return a page of the root with its links as seen from the site's root."""
    return re.sub(r"\]\((?!https?:|#|mailto:)([^)#\s]+)", lambda link: f"]({place(link[1])}", markdown)


def place(path: str) -> str:
    """Return where a file or folder of the repository is on the site."""
    if path in PAGES:
        return PAGES[path]
    if path.startswith("docs/"):
        return path.removeprefix("docs/")
    if (ROOT / path).is_dir():
        readme = next((ROOT / path).glob("README.md"), None) or next(iter(sorted((ROOT / path).glob("*.py"))))
        return f"{readme.relative_to(ROOT)}.txt"
    return f"{path}.txt"
