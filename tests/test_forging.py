"""Only the sim speaks in its name: forgeries by every role, on every key, through every shipped configuration."""

import importlib.util
import sys
from collections.abc import Iterator
from pathlib import Path
from types import ModuleType

import pytest

from robosandbox.testing.kits import KITS, OPEN, Kit, running_kit

ROOT = Path(__file__).resolve().parents[1]
EXAMPLES = ROOT / "examples" / "zenoh"
HOME = ("--task", "home", "--pace", "fast")
MODES = ("peer", "client", "router")


@pytest.fixture(scope="module")
def bench() -> ModuleType:
    path = ROOT / "benchmarks" / "forging.py"
    spec = importlib.util.spec_from_file_location("forging_bench", path)
    assert spec and spec.loader
    module = importlib.util.module_from_spec(spec)
    sys.modules[spec.name] = module
    spec.loader.exec_module(module)
    return module


@pytest.fixture(scope="module", params=KITS)
def kit(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Kit]:
    with running_kit(request.param, EXAMPLES, tmp_path_factory.mktemp("kit"), options=HOME) as made:
        yield made


@pytest.fixture(scope="module")
def open_kit(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Kit]:
    with running_kit(OPEN, EXAMPLES, tmp_path_factory.mktemp("open"), options=HOME) as made:
        yield made


@pytest.mark.parametrize("mode", MODES)
def test_no_role_can_forge_on_any_key(kit: Kit, mode: str, bench: ModuleType) -> None:
    for role in kit.roles:
        rows = list(bench.attack(kit, role, mode, times=1))
        assert {row.key for row in rows} == set(bench.protocol_keys()) and {row.kind for row in rows} == set(
            bench.FORGERIES
        )
        assert not [row for row in rows if row.forged]


def test_every_forgery_works_where_nothing_stops_it(open_kit: Kit, bench: ModuleType) -> None:
    stopped = {(row.kind, row.key) for row in bench.attack(open_kit, "anyone", "client", times=1) if not row.forged}
    # The sim's own token is there as long as one of the two is.
    assert stopped == {("departure", "alive")}
