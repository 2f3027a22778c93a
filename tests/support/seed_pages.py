"""The user's own pages, read as plain text and taken apart: programs, YAML, commands, printed lines, lists.

ROBOSANDBOX_SEEDS names another folder of pages than the one beside the repository.
"""

import ast
import itertools
import os
import re
from dataclasses import dataclass
from pathlib import Path

import pytest
import yaml

ROOT = Path(__file__).resolve().parents[2]
PANDA = ROOT / "robots" / "franka_panda"
SEEDS = Path(os.environ.get("ROBOSANDBOX_SEEDS") or ROOT.parent / "shared" / "seeds")
# The pages were written for a tree whose package lay elsewhere, and for arms that the reader has.
PACKAGE = "packages/robosandbox-core/src/robosandbox/"
ARM = re.compile(r"/(?:abs/)?path/to/\w+(\.robosandbox\.yaml|\.urdf)")
COMMAND = re.compile(r"(?:uv run )?(?:robo-sandbox-bench|robo-sandbox)(?: --?[a-z-]+| [\w./]+)+")

if not SEEDS.is_dir():
    if os.environ.get("CI") == "true":
        raise FileNotFoundError(f"{SEEDS}: the user's pages are missing; set ROBOSANDBOX_SEEDS to their folder")
    pytest.skip(f"{SEEDS} is not here; ROBOSANDBOX_SEEDS names a folder with the user's pages", allow_module_level=True)


@dataclass(frozen=True)
class Page:
    """A page and what was found in it."""

    name: str
    text: str
    programs: tuple[str, ...]
    yamls: tuple[str, ...]

    def __str__(self) -> str:
        return self.name

    def after(self, heading: str) -> list[str]:
        """Return the lines below a heading that begins so, up to the next blank line after some; none without it."""
        lines = self.text.splitlines()
        found = next((k for k, line in enumerate(lines) if line.startswith(heading)), len(lines))
        rest = itertools.dropwhile(lambda line: not line.strip(), lines[found + 1 :])
        return list(itertools.takewhile(str.strip, rest))

    def outputs(self) -> list[list[str]]:
        """Return what the page says is printed: the paragraphs after "Expected output", each up to the next prose."""
        found = []
        paragraphs = [part.splitlines() for part in re.split(r"\n\s*\n", self.text)]
        for k, paragraph in enumerate(paragraphs):
            if paragraph[0].startswith("Expected output"):
                shown = itertools.takewhile(lambda part: not _is_prose(part), paragraphs[k + 1 :])
                found.append([line for part in shown for line in part])
        return found


def read_page(path: Path) -> Page:
    """Take a page apart: a program is the longest run of lines from an import on that is Python; YAML likewise."""
    text = path.read_text(encoding="utf-8")
    lines = text.splitlines()
    programs, yamls, at = [], [], 0
    while at < len(lines):
        end = at
        if re.match(r"(from|import) \w", lines[at]):
            end = next((e for e in range(len(lines), at, -1) if _is_python("\n".join(lines[at:e]))), at)
            programs.append("\n".join(lines[at:end]))
        elif re.match(r"[a-z_]+:(\s|$)", lines[at]):
            inside = itertools.takewhile(lambda line: re.match(r"\s*$|\s|#|[a-z_]+:(\s|$)", line), lines[at:])
            end = at + len(list(inside))
            yamls.append("\n".join(lines[at:end]))
        at = max(end, at + 1)
    return Page(path.stem, text, tuple(programs), tuple(yamls))


def _is_prose(paragraph: list[str]) -> bool:
    return paragraph[-1].endswith((".", ":")) or re.match(r"\d+\. ", paragraph[0]) is not None


def _is_python(text: str) -> bool:
    try:
        ast.parse(text)
    except SyntaxError:
        return False
    return True


PAGES = [read_page(path) for path in sorted(SEEDS.glob("*.txt"))]
BY_NAME = {page.name: page for page in PAGES}
BRING, TUTORIAL = BY_NAME["bring-your-own-robot"], BY_NAME["custom-arm-tutorial"]
EACH_PAGE = pytest.mark.parametrize("page", PAGES, ids=str)


def sidecars(page: Page) -> list[str]:
    return [text for text in page.yamls if "arm" in yaml.safe_load(text)]


def tasks(page: Page) -> list[str]:
    return [text for text in page.yamls if "prompt" in yaml.safe_load(text)]


def own(text: str, folder: Path) -> str:
    """Replace the pages' paths by those of a robot copied to a folder, and of a package copied to its `src`."""
    text = ARM.sub(lambda match: str(folder / ("panda.xml" if match[1] == ".urdf" else f"panda{match[1]}")), text)
    return text.replace(PACKAGE, f"{folder}/src/robosandbox/")
