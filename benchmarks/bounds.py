"""What a model is bound to by a sentence: things that are forbidden and not bound, and things that are bound and were never forbidden.

    uv run benchmarks/bounds.py [--bounds tests/prohibitions/*.yaml] [--prompts tests/prompts/*.yaml] [--show] [--json]

A bounds file holds a scene and sentences that the grammar need not understand, each with what it forbids (`never` and ids) or alone
allows (`only` and ids), `-` for nothing. A prompts file holds sentences with every acceptable plan: whatever binds a model there must
let one of them pass. A prohibition is missed where a forbidden thing could still be moved.
"""

from __future__ import annotations

import argparse
import json
import re
from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from language import catalogue
from sentences import LEARNED, load_prompts

from robosandbox.agent.partial import partial_reading
from robosandbox.agent.planner import StubPlanner
from robosandbox.types import ObservedScene
from robosandbox.world.verifier import Constraints

BOUNDS = tuple(sorted((Path(__file__).parent.parent / "tests" / "prohibitions").glob("*.yaml")))

# Calls that move what they name first.
_MOVERS = ("pick", "push", "turn", "stack", "open_drawer", "close_drawer", "set_upright", "lay_down")


@dataclass(frozen=True, slots=True, kw_only=True)
class Row:
    """One sentence.

    Attributes:
        file: Where it stands.
        text: What is said.
        missed: Things that it forbids and a model may move all the same.
        wrong: Things that it does not forbid and a model may not move, or that a model has to move though it must not.
    """

    file: str
    text: str
    missed: tuple[str, ...] = ()
    wrong: tuple[str, ...] = ()


def of_bounds(file: Path) -> Iterator[Row]:
    """Yield a row for each sentence of a bounds file."""
    for prompt in load_prompts(file):
        ids = {item.id for item in prompt.scene.objects}
        kind, *named = prompt.expected.split()
        forbidden = {"-": set[str](), "never": {*named}, "only": ids - {*named}}[kind]
        bound = bound_by(prompt.text, prompt.scene)
        held = _held(bound, ids)
        yield Row(
            file=file.name,
            text=prompt.text,
            missed=tuple(sorted(forbidden - held)),
            wrong=tuple(sorted((held - forbidden) | (bound.moved & forbidden))),
        )


def of_prompts(file: Path) -> Iterator[Row]:
    """Yield a row for each sentence of a prompts file that asks for a plan."""
    for prompt in load_prompts(file):
        plans = [_moved(plan) for plan in prompt.expected.split("|") if not plan.strip().startswith("!")]
        plans = [moved for moved in plans if moved is not None]
        if not plans:
            continue
        ids = {item.id for item in prompt.scene.objects}
        bound = bound_by(prompt.text, prompt.scene)
        held = _held(bound, ids)
        against = [
            (moved & held) | (bound.moved - moved) | ({"too few"} if len(moved) < bound.fewest else set())
            for moved in plans
        ]
        yield Row(file=file.name, text=prompt.text, wrong=tuple(sorted(min(against, key=len))))


def bound_by(text: str, scene: ObservedScene) -> Constraints:
    """Return what a sentence holds a model to with `--planner auto`."""
    skills = catalogue()
    return partial_reading(StubPlanner(skills), text, scene, skills).constraints


def _held(bound: Constraints, ids: set[str]) -> set[str]:
    return set(bound.never) | (ids - bound.only if bound.only is not None else set())


def _moved(plan: str) -> set[str] | None:
    """Return what an acceptable plan moves; None where it leaves open which."""
    skills = {skill.name: skill for skill in catalogue()}
    moved: set[str] = set()
    for name, given in re.findall(r"(\w+)\(([^)]*)\)", plan):
        first = given.split(",")[0].strip()
        if name in _MOVERS and name in skills:
            if first == "*" or "/" in first:
                return None
            moved.add(first)
    return moved


def report(rows: Sequence[Row]) -> dict[str, Any]:
    """Return the figures of some rows."""
    return {
        "sentences": len(rows),
        "missed": sum(bool(row.missed) for row in rows),
        "wrong": sum(bool(row.wrong) for row in rows),
    }


def main() -> int:
    """Print the figures of each bounds file and of all prompts; 0 where nothing is missed and nothing is wrong."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--bounds", type=Path, nargs="*", default=BOUNDS)
    parser.add_argument("--prompts", type=Path, nargs="*", default=LEARNED)
    parser.add_argument("--show", action="store_true", help="each sentence that is missed or wrong")
    parser.add_argument("--json", action="store_true")
    arguments = parser.parse_args()
    found = {file.name: list(of_bounds(file)) for file in arguments.bounds}
    found["prompts"] = [row for file in arguments.prompts for row in of_prompts(file)]
    figures = {name: report(rows) for name, rows in found.items()}
    failed = [row for rows in found.values() for row in rows if row.missed or row.wrong]
    if arguments.json:
        print(json.dumps({"figures": figures, "failed": [asdict(row) for row in failed]}, indent=1))
        return 1 if failed else 0
    for name, of in figures.items():
        print(f"{name:<16} {of['sentences']:>5} sentences, {of['missed']} missed, {of['wrong']} wrong")
    for row in failed if arguments.show else ():
        print(f"{row.file}: {row.text!r}: missed {', '.join(row.missed) or '-'}; wrong {', '.join(row.wrong) or '-'}")
    return 1 if failed else 0


if __name__ == "__main__":
    raise SystemExit(main())
