"""Plans by somebody who had not seen the verifier: what can be done passes, what cannot is refused with its cause."""

from __future__ import annotations

import sys
from pathlib import Path

import yaml

BENCHMARKS = Path(__file__).resolve().parents[1] / "benchmarks"


def test_verifier_is_right_about_every_plan(monkeypatch):
    monkeypatch.syspath_prepend(str(BENCHMARKS))
    sys.modules.pop("plans", None)
    import plans

    rows = [row for path in plans.UNSEEN for rows in yaml.safe_load(path.read_text()).values() for row in rows]
    assert len(rows) >= 310
    assert not [row["plan"] for row in rows if not plans.judge(row)[0]]
