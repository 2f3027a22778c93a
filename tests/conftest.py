"""Tests marked `gl` are left out where no picture can be rendered."""

import subprocess
import sys

import hypothesis
import pytest

# Hypothesis's own limit of 200 ms an example is wall time, which other processes use up, too.
hypothesis.settings.register_profile("robosandbox", deadline=None)
hypothesis.settings.load_profile("robosandbox")

_PROBE = "from robosandbox.sim.rendering import _make_gl_context; _make_gl_context(64, 64).free()"


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    marked = [item for item in items if item.get_closest_marker("gl")]
    # In a process of its own: a broken driver may take the interpreter with it.
    if marked and subprocess.run([sys.executable, "-c", _PROBE], capture_output=True).returncode:
        for item in marked:
            item.add_marker(pytest.mark.skip(reason="no OpenGL library renders on this machine"))
