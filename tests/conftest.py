"""Which tests run, and on how many processes.

Without `--all` a sample of the long families runs and none of the slow tests; those marked `gl` run where pictures can be made.
"""

import atexit
import itertools
import os
import shutil
import subprocess
import sys
import tempfile
from collections import Counter

import hypothesis
import pytest

# Tests start some two hundred Python processes, and without bytecode each compiles all that it imports: seconds of CPU.
os.environ.pop("PYTHONDONTWRITEBYTECODE", None)
sys.dont_write_bytecode = False

# What is learnt of a scripted server on a random port must not meet the next server there, nor the person's own.
os.environ["XDG_STATE_HOME"] = tempfile.mkdtemp(prefix="robosandbox-state-")
atexit.register(shutil.rmtree, os.environ["XDG_STATE_HOME"], ignore_errors=True)

# Hypothesis's own limit of 200 ms an example is wall time, which other processes use up, too.
hypothesis.settings.register_profile("robosandbox", deadline=None)
hypothesis.settings.load_profile("robosandbox")

_PROBE = "from robosandbox.sim.rendering import _make_gl_context; _make_gl_context(64, 64).free()"
_MOST_WORKERS = 8
# The files that take longest, the longest first, as `uv run pytest --durations=0` tells: workers begin with them.
_LONGEST = (
    "test_second_engine.py",
    "test_viewer.py",
    "test_llm_models.py",
    "test_seeds.py",
    "test_scale.py",
    "test_robots.py",
    "test_forging.py",
    "test_llm_planner.py",
    "test_docs.py",
    "test_perception.py",
    "test_repl.py",
    "test_security.py",
    "test_service.py",
    "test_startup.py",
    "test_diagnosis.py",
    "test_symptoms.py",
    "test_giving_up.py",
)


def pytest_addoption(parser: pytest.Parser) -> None:
    parser.addoption("--all", action="store_true", help="run every test, the slow ones and whole families, too")


@pytest.hookimpl(tryfirst=True)
def pytest_cmdline_main(config: pytest.Config) -> None:
    """Spread a run of the whole suite over the cores; files and tests that are named run in this process.

    Workers take neighbouring tests, so that those of a file share its worlds, and help one another at the end, where
    `_dealt` puts what is short.
    """
    if "PYTEST_XDIST_WORKER" in os.environ or not config.pluginmanager.hasplugin("xdist"):
        return
    named = config.args_source is pytest.Config.ArgsSource.ARGS
    if not named and config.option.numprocesses is None and not config.option.usepdb:
        # One more than cores: a worker waits a quarter of its time, for the processes and servers that tests start.
        config.option.numprocesses = min((os.cpu_count() or 1) + 1, _MOST_WORKERS)
        config.option.dist = "worksteal"


def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    # A test that is named, or asked for by a mark, is meant.
    chosen = config.option.markexpr or any("::" in str(argument) for argument in config.args)
    if not config.option.all and not chosen:
        left = set(_left_out(items))
        config.hook.pytest_deselected(items=[item for item in items if item in left])
        items[:] = [item for item in items if item not in left]
    if hasattr(config, "workerinput"):
        # Beside other tests this computer is one that stalls, and what watches the wall's clock says so.
        config.hook.pytest_deselected(items=[item for item in items if item.get_closest_marker("alone")])
        items[:] = [item for item in items if not item.get_closest_marker("alone")]
        items[:] = _dealt(items, int(config.workerinput["workercount"]))
    marked = [item for item in items if item.get_closest_marker("gl")]
    # In a process of its own: a broken driver may take the interpreter with it.
    if marked and subprocess.run([sys.executable, "-c", _PROBE], capture_output=True).returncode:
        for item in marked:
            item.add_marker(pytest.mark.skip(reason="no OpenGL library renders on this machine"))


def pytest_terminal_summary(terminalreporter: pytest.TerminalReporter) -> None:
    """Print the figures that tests recorded, such as how many sentences are understood."""
    for reports in terminalreporter.stats.values():
        for report in reports:
            for name, figures in getattr(report, "user_properties", ()):
                if name.startswith("figures of ") and report.when == "call":
                    terminalreporter.section(name)
                    terminalreporter.write_line(figures)


def _left_out(items: list[pytest.Item]) -> list[pytest.Item]:
    """Return what only `--all` runs: the slow tests, those that run alone, and of a sampled family all but its first, and every so many on."""
    members: Counter[str] = Counter()
    found = []
    for item in items:
        sample = item.get_closest_marker("sample")
        family = item.nodeid.partition("[")[0]
        later = item.get_closest_marker("slow") or item.get_closest_marker("alone")
        if later or (sample and members[family] % sample.kwargs["every"]):
            found.append(item)
        members[family] += 1
    return found


def _dealt(items: list[pytest.Item], workers: int) -> list[pytest.Item]:
    """Return the tests in an order in which each worker's share, a run of equally many, begins with some of the longest files."""
    files: dict[str, list[pytest.Item]] = {}
    for item in items:
        files.setdefault(item.path.name, []).append(item)
    longest = [files.pop(name) for name in _LONGEST if name in files]
    short = iter([item for file in files.values() for item in file])
    dealt: list[pytest.Item] = []
    for worker in range(workers):
        begin = [item for file in longest[worker::workers] for item in file]
        share = (len(items) - len(dealt)) // (workers - worker)
        dealt += [*begin, *itertools.islice(short, max(0, share - len(begin)))]
    return [*dealt, *short]
