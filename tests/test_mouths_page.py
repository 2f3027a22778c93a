"""The table of docs/mouths.md: every cell of it is tested."""

import re
from pathlib import Path

import pytest
from support import mouths

ROOT = Path(__file__).resolve().parents[1]


def rows() -> list[list[str]]:
    lines = (ROOT / "docs" / "mouths.md").read_text(encoding="utf-8").splitlines()
    table = [line for line in lines if line.startswith("|") and "---" not in line]
    return [[cell.strip() for cell in line.strip("|").split("|")] for line in table]


def test_the_columns_are_the_mouths_that_are_tested() -> None:
    assert [name.strip("`") for name in rows()[0][2:]] == list(mouths.MOUTHS)


@pytest.mark.parametrize("row", rows()[1:], ids=lambda row: row[1].strip("`"))
def test_each_row_names_a_test_of_all_mouths(row: list[str]) -> None:
    source = (ROOT / "tests" / "test_mouths.py").read_text(encoding="utf-8")
    found = re.search(rf"((?:@.*\n)*)def {row[1].strip('`')}\((mouth|opened|name): ", source)
    assert found is not None, f"tests/test_mouths.py has no {row[1]}"
    assert found[2] in ("mouth", "opened") or 'parametrize("name", NAMES)' in found[1]
    assert len(row) == 2 + len(mouths.MOUTHS) and all(row)


def test_each_test_has_its_row() -> None:
    source = (ROOT / "tests" / "test_mouths.py").read_text(encoding="utf-8")
    assert set(re.findall(r"^def (test_\w+)", source, re.M)) == {row[1].strip("`") for row in rows()[1:]}
