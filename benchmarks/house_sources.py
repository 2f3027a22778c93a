"""The package's files, as text, syntax trees and comments."""

from __future__ import annotations

import ast
import io
import tokenize
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
FOLDERS = ("agent", "perception", "robots", "sim", "skills", "tasks")
PACKAGE = "src/robosandbox"


@dataclass(frozen=True)
class Source:
    """A file of the package.

    Attributes:
        name: Its path in the repository.
        text: What it holds.
    """

    name: str
    text: str

    @cached_property
    def tree(self) -> ast.Module:
        """Its syntax tree."""
        return ast.parse(self.text)

    @cached_property
    def comments(self) -> dict[int, tuple[bool, str]]:
        """By line: whether a comment is alone there, and what it says."""
        tokens = tokenize.generate_tokens(io.StringIO(self.text).readline)
        return {
            token.start[0]: (not token.line[: token.start[1]].strip(), token.string.lstrip("# "))
            for token in tokens
            if token.type == tokenize.COMMENT
        }

    @property
    def lines(self) -> int:
        """How many lines it has."""
        return len(self.text.splitlines())

    @property
    def is_language(self) -> bool:
        """Whether it belongs to the grammar."""
        return self.name.startswith("agent/language/")

    @property
    def module(self) -> str:
        """The name under which it is imported."""
        path = self.name.removeprefix("src/").removesuffix(".py").removesuffix("/__init__").replace("/", ".")
        return path if path.split(".")[0] == "robosandbox" else f"robosandbox.{path}"

    def at(self, node: ast.stmt | ast.expr | ast.pattern, note: str = "") -> str:
        """Return where a node is, for people."""
        return f"{self.name}:{node.lineno}{' ' if note else ''}{note}"


def sources() -> list[Source]:
    """Return the files of the package."""
    files = sorted(file for folder in (*FOLDERS, PACKAGE) for file in (ROOT / folder).rglob("*.py"))
    # `src/robosandbox` has links to the folders for analysers.
    own = {file.resolve() for file in files if "__pycache__" not in file.parts}
    return [Source(str(file.relative_to(ROOT)), file.read_text(encoding="utf-8")) for file in sorted(own)]
