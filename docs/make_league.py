"""Write docs/league.md, what planners and models reach, from rows of benchmarks/agents.py.

uv run benchmarks/agents.py --planner stub --upsets --tasks --resume rows.jsonl; uv run docs/make_league.py rows.jsonl ...
"""

from __future__ import annotations

import argparse
import json
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

from robosandbox.tasks.interval import wilson_interval
from robosandbox.versions import versions

TARGET = Path(__file__).with_name("league.md")
HEAD = """# League table

<!-- Written by docs/make_league.py; run benchmarks/agents.py. -->

What planners and models reach with the bundled Panda. `stub` is the grammar; `goals` is given each task's success in relations and searches over the
contracts (a push, a pour and a tap are no relations, so that it cannot be told them); `expert` is a scripted model that acts call by call over HTTP and knows
what the grammar knows; the others are models, with their server's context and the mode. Success is judged on the simulated state. 95% intervals.
"""
TASKS = """
## Tasks carried out

*Upsets* are episodes in which something happens on the way. *Claimed* counts episodes that the agent called done and the judge did not.

| planner | tasks done | upsets done | claimed |
|---|---|---|---|
"""
SAID = """
## What was said, and what came of it

*Prompts* are thirty things said over bundled tasks, easy and impossible ones, and carried out; *sentences* are planned for in scenes of their own and are
sealed: nobody mends the grammar for them. A *wrong motion* is a plan for something else; *missed* was refused though it can be done, or has no answer.

| planner | of | right | rightly refused | wrong motion | missed | right or rightly refused |
|---|---|---|---|---|---|---|
"""
ASKED = """
## What models were asked

*By the schema*: answers that keep to the JSON schema that they were asked for by. *Sent back*: answers, and calls in them, that the check or their form
stopped. *Unchecked* counts calls begun outside of a plan that passes the check or with arguments that the skill or the scene does not have, and
episodes in which anything moved without a call. The rest is per episode; seconds are waited on a machine that does other things, too, and the tokens of
`expert` are its script's.

| model | episodes | by the schema | sent back | unchecked | turns | tokens | US $ | seconds |
|---|---|---|---|---|---|---|---|---|
"""

Row = Mapping[str, Any]


def main() -> None:
    """Write the page."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("rows", type=Path, nargs="+", help="written by benchmarks/agents.py --resume")
    files = parser.parse_args().rows
    rows = [json.loads(text) for file in files for text in file.read_text(encoding="utf-8").splitlines()]
    TARGET.write_text(page(rows), encoding="utf-8")


def page(rows: Sequence[Row]) -> str:
    """Return the page."""
    entries: dict[str, list[Row]] = {}
    for row in rows:
        entries.setdefault(row["entry"], []).append(row)
    measured = ", ".join(f"{name} {value}" for name, value in versions().items())
    tasks = [text for name, found in entries.items() for text in carried_out(name, found)]
    said = [text for name, found in entries.items() for text in understood(name, found)]
    models = [text for name, found in entries.items() for text in asking(name, found)]
    return "".join([HEAD, TASKS, *tasks, SAID, *said, ASKED, *models, f"\nMeasured with {measured}.\n", *missed(rows)])


def carried_out(name: str, rows: Sequence[Row]) -> Iterable[str]:
    """Yield an entry's line of tasks, where it has any."""
    judged = [row for row in rows if row["done"] is not None]
    if judged:
        shares = [share([bool(row["done"]) for row in judged if row["kind"] == kind]) for kind in ("task", "upset")]
        yield line(name, *shares, sum(row["claimed"] and not row["done"] for row in judged))


def understood(name: str, rows: Sequence[Row]) -> Iterable[str]:
    """Yield an entry's lines of prompts and sentences."""
    for kind in ("prompt", "sentence"):
        verdicts = [row["verdict"] for row in rows if row["kind"] == kind]
        if verdicts:
            counts = [verdicts.count(one) for one in ("right", "refused_right", "wrong_motion", "missed")]
            good = [one in ("right", "refused_right") for one in verdicts]
            yield line(name, f"{len(verdicts)} {kind}s", *counts, share(good))


def asking(name: str, rows: Sequence[Row]) -> Iterable[str]:
    """Yield an entry's line of what a model was asked, by kind of episode."""
    for kind in ("task", "upset", "prompt", "sentence"):
        asked = [row for row in rows if row["kind"] == kind and row["turns"]]
        if not asked:
            continue

        def total(field: str, of: Sequence[Row] = asked) -> float:
            return sum(row[field] for row in of)

        schema = f"{total('valid')}/{total('by_schema')}" if total("by_schema") else "not asked so"
        unsafe = total("unchecked") + total("unfit") + total("strayed")
        each = (
            f"{total(field) / len(asked):.{digits}f}" for field, digits in (("turns", 1), ("tokens", 0), ("cost", 4))
        )
        seconds = f"{total('seconds') / len(asked):.1f}"
        yield line(name, f"{len(asked)} {kind}s", schema, total("sent_back"), unsafe, *each, seconds)


def missed(rows: Sequence[Row]) -> Iterable[str]:
    """Yield a line for each task and upset that was not done, but for those that cannot be said in relations."""
    yield "\nTasks and upsets that were not done:\n\n"
    told = [row for row in rows if row["done"] is False and row["detail"] != "no relation says it"]
    for row in told:
        yield f"- {row['entry']}: {row['name']}, seed {row['seed']}: {' '.join(str(row['detail']).split())[:200]}\n"
    if not told:
        yield "None.\n"


def share(good: Sequence[bool]) -> str:
    """Return a count with its interval."""
    if not good:
        return ""
    low, high = wilson_interval(sum(good), len(good))
    return f"{sum(good)}/{len(good)} ({100 * low:.0f}..{100 * high:.0f}%)"


def line(*fields: object) -> str:
    """Return a line of a table."""
    return f"| {' | '.join(map(str, fields))} |\n"


if __name__ == "__main__":
    main()
