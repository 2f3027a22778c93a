"""Write docs/league.md, what planners and models reach, from the rows in docs/league_rows.jsonl.

uv run benchmarks/agents.py --planner stub --upsets --tasks --resume rows.jsonl; uv run docs/make_league.py [rows.jsonl ...]

Rows of benchmarks/agents.py that are named are taken in first; a planner's rows of a kind (`task`, `upset`, `prompt`, `sentence`) take the
place of those that it had. What the page does not need is left out, and equal rows are counted; where nobody kept the rows of a run, its
means stand in one with a count. A line with `versions` says what ran at a commit.
"""

from __future__ import annotations

import argparse
import json
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

from robosandbox.apps.bench.interval import wilson_interval
from robosandbox.versions import versions

TARGET = Path(__file__).with_name("league.md")
KEPT = Path(__file__).with_name("league_rows.jsonl")
# What a row has, and what it is where a kept line does not say; `seed` tells upsets apart, `detail` why something was not done.
FIELDS: dict[str, Any] = {
    "entry": "",
    "kind": "",
    "name": "",
    "seed": 0,
    "done": None,
    "claimed": False,
    "verdict": "",
    "reason": "",
    "detail": "",
    "failures": 0,
    **dict.fromkeys(("sent_back", "by_schema", "valid", "unchecked", "unfit", "strayed", "turns", "tokens"), 0),
    "cost": 0.0,
    "seconds": 0.0,
    "commit": "",
}
KINDS = ("task", "upset", "prompt", "sentence")
_LONGEST = 200  # Characters of why something was not done. Chosen: two lines.
HEAD = """# League table

<!-- Written by docs/make_league.py; run benchmarks/agents.py. -->

What planners and models reach with the bundled Panda. `stub` is the grammar; `goals` is given each task's success in relations and searches over the
contracts (a push, a pour and a tap are no relations, so that it cannot be told them); `expert` is a scripted model that acts call by call over HTTP and knows
what the grammar knows; the others are models, and the mode they work in; SmolLM2 was given two
answers and four calls a prompt at most. Success is judged on the simulated state. 95% intervals. *At* is the commit that ran.
The rows are in [league_rows.jsonl](league_rows.jsonl).
"""
TASKS = """
## Tasks carried out

*Upsets* are episodes in which something happens on the way. *Claimed* counts episodes that the agent called done and the judge did not.

| planner | of | done | claimed | at |
|---|---|---|---|---|
"""
BESIDE = """
## Upsets side by side

The same happens to each of these in the same layouts; a planner's column counts what was done.

"""
SAID = """
## What was said, and what came of it

*Prompts* are thirty things said over bundled tasks, easy and impossible ones, and carried out; *sentences* are planned for in scenes of their own and are
sealed: nobody mends the grammar for them. A *wrong motion* is a plan for something else; *missed* was refused though it can be done, or has no answer.

| planner | of | right | rightly refused | wrong motion | missed | right or rightly refused | at |
|---|---|---|---|---|---|---|---|
"""
ASKED = """
## What models were asked

*By the schema*: answers that keep to the JSON schema that they were asked for by. *Sent back*: answers, and calls in them, that the check or their form
stopped. *Unchecked* counts calls begun outside of a plan that passes the check or with arguments that the skill or the scene does not have, and
episodes in which anything moved without a call. The rest is per episode; seconds are waited on a machine that does other things, too, and the tokens of
`expert` are its script's.

| model | episodes | by the schema | sent back | unchecked | turns | tokens | US $ | seconds | at |
|---|---|---|---|---|---|---|---|---|---|
"""

Row = Mapping[str, Any]


def main() -> None:
    """Take in rows, and write the page."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("rows", type=Path, nargs="*", help="written by benchmarks/agents.py --resume")
    files = parser.parse_args().rows
    rows, measured = read(KEPT)
    if files:
        new = [json.loads(text) for file in files for text in file.read_text(encoding="utf-8").splitlines()]
        taken = {(row["entry"], row["kind"]) for row in new}
        rows = [row for row in rows if (row["entry"], row["kind"]) not in taken] + new
        measured |= {row["commit"]: versions() for row in new}
        KEPT.write_text("".join(f"{json.dumps(one)}\n" for one in kept(rows, measured)), encoding="utf-8")
        rows, measured = read(KEPT)
    TARGET.write_text(page(rows, measured), encoding="utf-8")


def read(file: Path) -> tuple[list[Row], dict[str, Row]]:
    """Return the rows that are kept in a file, and the versions that ran by commit."""
    rows: list[Row] = []
    measured: dict[str, Row] = {}
    for text in file.read_text(encoding="utf-8").splitlines() if file.exists() else []:
        data = json.loads(text)
        if "versions" in data:
            measured[data["commit"]] = data["versions"]
        else:
            rows += [{**FIELDS, **data}] * data.get("count", 1)
    return rows, measured


def kept(rows: Iterable[Row], measured: Mapping[str, Row]) -> list[Row]:
    """Return what is kept: the versions of each commit, then the rows, those alike but for the seed counted."""
    counted: dict[str, int] = {}
    for row in rows:
        short = {name: row[name] for name, usual in FIELDS.items() if row[name] != usual}
        if row["kind"] == "sentence":
            # Nobody looks a sentence up by its number; how long it took is no model's.
            short = {name: value for name, value in short.items() if name not in ("seed", "detail", "reason")}
        elif row["done"] is not False:
            short.pop("detail", None)
        else:
            short["detail"] = " ".join(row["detail"].split())[:_LONGEST]
        text = json.dumps(short)
        counted[text] = counted.get(text, 0) + 1
    ran = {row["commit"] for row in rows}
    return [
        *({"commit": name, "versions": found} for name, found in measured.items() if name in ran),
        *({**json.loads(text), **({"count": count} if count > 1 else {})} for text, count in counted.items()),
    ]


def page(rows: Sequence[Row], measured: Mapping[str, Row]) -> str:
    """Return the page."""
    entries: dict[str, list[Row]] = {}
    for row in rows:
        entries.setdefault(row["entry"], []).append(row)
    tasks = [
        text for kind in ("task", "upset") for name, found in entries.items() for text in carried_out(name, found, kind)
    ]
    said = [text for name, found in entries.items() for text in understood(name, found)]
    models = [text for name, found in entries.items() for text in asking(name, found)]
    ran = [
        f"- `{name}`: {', '.join(f'{one} {value}' for one, value in found.items())}\n"
        for name, found in measured.items()
    ]
    return "".join(
        [
            HEAD,
            TASKS,
            *tasks,
            *beside(entries),
            SAID,
            *said,
            ASKED,
            *models,
            "\nMeasured with:\n\n",
            *ran,
            *missed(rows),
        ]
    )


def carried_out(name: str, rows: Sequence[Row], kind: str) -> Iterable[str]:
    """Yield an entry's line of tasks or of upsets, where it has any."""
    judged = [row for row in rows if row["done"] is not None and row["kind"] == kind]
    if judged:
        claimed = sum(row["claimed"] and not row["done"] for row in judged)
        yield line(name, f"{len(judged)} {kind}s", share([bool(row["done"]) for row in judged]), claimed, at(judged))


def beside(entries: Mapping[str, Sequence[Row]]) -> Iterable[str]:
    """Yield a table of the upsets that several entries went through, a column for each."""
    upsets = {
        name: {(row["name"], row["seed"]): row for row in rows if row["kind"] == "upset"}
        for name, rows in entries.items()
    }
    upsets = {name: found for name, found in upsets.items() if found}
    shared = set.intersection(*map(set, upsets.values())) if upsets else set()
    if len(upsets) < 2 or not shared:
        return
    yield BESIDE + line("what happens", "episodes", *upsets) + line(*["---"] * (len(upsets) + 2))
    for case in sorted({name.split()[0] for name, _ in shared}):
        keys = [key for key in shared if key[0].split()[0] == case]
        yield line(case, len(keys), *(sum(found[key]["done"] for key in keys) for found in upsets.values()))
    yield line("all", len(shared), *(sum(found[key]["done"] for key in shared) for found in upsets.values()))


def understood(name: str, rows: Sequence[Row]) -> Iterable[str]:
    """Yield an entry's lines of prompts and sentences."""
    for kind in ("prompt", "sentence"):
        verdicts = [row["verdict"] for row in rows if row["kind"] == kind]
        if verdicts:
            counts = [verdicts.count(one) for one in ("right", "refused_right", "wrong_motion", "missed")]
            good = [one in ("right", "refused_right") for one in verdicts]
            yield line(
                name, f"{len(verdicts)} {kind}s", *counts, share(good), at([row for row in rows if row["kind"] == kind])
            )


def asking(name: str, rows: Sequence[Row]) -> Iterable[str]:
    """Yield an entry's line of what a model was asked, by kind of episode."""
    for kind in KINDS:
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
        yield line(
            name, f"{len(asked)} {kind}s", schema, f"{total('sent_back'):.0f}", unsafe, *each, seconds, at(asked)
        )


def missed(rows: Sequence[Row]) -> Iterable[str]:
    """Yield a line for each task and upset that was not done, but for those that cannot be said in relations."""
    yield "\nTasks and upsets that were not done:\n\n"
    told = [row for row in rows if row["done"] is False and row["detail"] != "no relation says it"]
    for row in told:
        yield f"- {row['entry']}: {row['name']}, seed {row['seed']}: {' '.join(str(row['detail']).split())[:200]}\n"
    if not told:
        yield "None.\n"


def at(rows: Sequence[Row]) -> str:
    """Return the commits that rows were taken at."""
    return ", ".join(f"`{name}`" for name in dict.fromkeys(row["commit"] for row in rows))


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
