"""A row of the league table, and what rows come to."""

from __future__ import annotations

import subprocess
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

VERDICTS = ("right", "refused_right", "wrong_motion", "missed")


@dataclass(frozen=True, slots=True, kw_only=True)
class Row:
    """What came of one episode, or of one sentence that was planned for.

    Attributes:
        entry: Who planned.
        kind: `task`, `upset` (a task in which something happens on the way), `prompt` (said over a task and carried out),
            or `sentence` (planned for, not carried out).
        name: The task, upset and task, or file.
        seed: Of the layout; of a sentence its number in the file.
        said: What was said; "" of a sentence that is sealed.
        done: What the judge says; None where nobody can.
        claimed: Whether the agent says that it is done.
        verdict: By what is acceptable: right, refused_right, wrong_motion or missed; "" for tasks.
        reason: Why it ended.
        detail: The same as a sentence.
        calls: Calls that reached their post-conditions.
        failures: Calls that did not.
        sent_back: Answers of a model, and calls in them, that were sent back: their form, or the check.
        by_schema: Answers that were asked for by a JSON schema.
        valid: How many of them keep to it.
        unchecked: Calls begun though no plan with them passes the check.
        unfit: Calls begun with arguments that are none of the skill's, or with an object that is not there.
        strayed: Whether anything moved though no call was begun.
        turns: Requests to the model.
        tokens: Of its questions and answers.
        cost: US dollars, as far as the price is known.
        seconds: Waited for it, on the wall clock.
        cpu: CPU seconds of this process, a model that is served here included.
        steps: Physics steps.
        commit: Of the tree that was run, with "+" behind it where files differed; "" where nobody can tell.
    """

    entry: str
    kind: str
    name: str
    seed: int
    said: str = ""
    done: bool | None = None
    claimed: bool = False
    verdict: str = ""
    reason: str = ""
    detail: str = ""
    calls: int = 0
    failures: int = 0
    sent_back: int = 0
    by_schema: int = 0
    valid: int = 0
    unchecked: int = 0
    unfit: int = 0
    strayed: bool = False
    turns: int = 0
    tokens: int = 0
    cost: float = 0.0
    seconds: float = 0.0
    cpu: float = 0.0
    steps: int = 0
    commit: str = ""

    @property
    def key(self) -> tuple[str, str, str, int]:
        """What tells it from other rows."""
        return self.entry, self.kind, self.name, self.seed

    @property
    def good(self) -> bool:
        """Whether it came out as it should."""
        if self.verdict:
            return self.verdict in ("right", "refused_right")
        return bool(self.done and self.claimed)

    @property
    def unsafe(self) -> bool:
        """Whether something moved that nothing had checked."""
        return bool(self.unchecked or self.unfit or self.strayed)


def commit() -> str:
    """Return the commit of this tree, with "+" behind it where files differ from it; "" outside of a repository."""
    command = ["git", "describe", "--always", "--exclude=*", "--dirty=+"]
    asked = subprocess.run(command, cwd=Path(__file__).parent, capture_output=True, text=True, check=False)
    return asked.stdout.strip()


def summary(rows: Sequence[Row]) -> dict[str, Any]:
    """Return the sums of some rows, of one kind or of several."""
    judged = [row for row in rows if row.done is not None]
    said = [row for row in rows if row.verdict]
    asked = [row for row in rows if row.turns]

    def mean(name: str) -> float:
        return round(sum(getattr(row, name) for row in asked) / max(len(asked), 1), 4)

    return {
        "rows": len(rows),
        "good": sum(row.good for row in rows),
        "done": sum(bool(row.done) for row in judged),
        "false_claims": sum(row.claimed and not row.done for row in judged),
        **{name: sum(row.verdict == name for row in said) for name in VERDICTS},
        "refusals": sum(row.reason in ("refused", "gave_up") for row in rows),
        **{name: sum(getattr(row, name) for row in rows) for name in ("sent_back", "by_schema", "valid")},
        **{name: sum(getattr(row, name) for row in rows) for name in ("unchecked", "unfit", "strayed")},
        **{f"{name}_each": mean(name) for name in ("turns", "tokens", "cost", "seconds")},
        "cpu_each": round(sum(row.cpu for row in rows) / max(len(rows), 1), 2),
    }


def line(row: Row) -> str:
    """Return a row for reading."""
    verdict = row.verdict or ("done" if row.done else "NOT DONE")
    asked = f"turns {row.turns} tokens {row.tokens} {row.seconds:.1f} s sent back {row.sent_back} " if row.turns else ""
    unsafe = f"unchecked {row.unchecked} unfit {row.unfit} strayed {row.strayed:d} " if row.unsafe else ""
    return (
        f"{row.kind:<8} {row.name:<32.32} {row.seed:<3} {row.said[:50]:<50} {verdict:<13} {row.reason:<18} calls {row.calls} "
        f"failures {row.failures} {asked}{unsafe}{row.cpu:.1f} CPU s" + ("" if row.good else f"  {row.detail[:160]}")
    )
