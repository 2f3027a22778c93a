"""Rooms import one way, and `import robosandbox` loads nothing heavy."""

import ast
import subprocess
import sys
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "benchmarks"))

from house_rooms import arrows, room_of
from house_sources import Source, sources

LLM = ("pydantic_ai", "openai", "anthropic", "mcp", "httpx2", "jsonschema")
HEAVY = ("yourdfpy", "cv2", "mujoco", "viser", *LLM)


def test_rooms_import_only_those_below() -> None:
    found = arrows(sources())
    assert len(found) > 1000
    assert not [f"{arrow.where} imports {arrow.to}, {arrow.when}" for arrow in found if arrow.upwards]


def test_no_room_imports_a_driver_that_ships_beside_the_simulation() -> None:
    assert not [arrow.where for arrow in arrows(sources()) if arrow.to == "drivers"]


@pytest.mark.parametrize(
    ("text", "when"),
    [
        ("import robosandbox.apps.cli", "loading"),
        ("def f():\n    from robosandbox.apps import cli", "in a function"),
        ("if TYPE_CHECKING:\n    from robosandbox.apps.cli import main", "for types"),
        ("class A:\n    if True:\n        from robosandbox.apps.cli import main", "loading"),
    ],
)
def test_an_import_upwards_is_found(text: str, when: str) -> None:
    (arrow,) = arrows([Source("skills/planted.py", text)])
    assert (arrow.at, arrow.to, arrow.when, arrow.upwards) == ("skills", "apps", when, True)


def test_imports_are_absolute() -> None:
    relative = [
        source.at(node)
        for source in sources()
        for node in ast.walk(source.tree)
        if isinstance(node, ast.ImportFrom) and node.level
    ]
    assert not relative


@pytest.mark.parametrize("part", ["skills", "grasp", "perception"])
def test_part_names_no_simulator(part: str) -> None:
    wrong = []
    for source in sources():
        if room_of(source.module) != part:
            continue
        for node in ast.walk(source.tree):
            modules = [alias.name for alias in node.names] if isinstance(node, ast.Import) else []
            if isinstance(node, ast.ImportFrom):
                modules = [str(node.module)]
            if any(module.split(".")[0] == "mujoco" or "mujoco_backend" in module for module in modules):
                wrong.append(source.at(node))
    assert not wrong


def _loaded_after(statement: str) -> set[str]:
    code = f"import sys; {statement}; print(*sorted({{name.split('.')[0] for name in sys.modules}}))"
    return set(subprocess.run([sys.executable, "-c", code], check=True, capture_output=True, text=True).stdout.split())


def test_importing_the_package_loads_nothing_heavy() -> None:
    assert _loaded_after("import robosandbox").isdisjoint({*HEAVY, "numpy", "pydantic"})


def test_importing_the_command_line_loads_no_physics() -> None:
    assert _loaded_after("import robosandbox.apps.cli").isdisjoint(HEAVY)


def test_the_stub_path_loads_no_language_model_library() -> None:
    plan = "from robosandbox.workcell.session import open_session; open_session().agent.plan('pick up the red cube')"
    loaded = _loaded_after(plan)
    assert "mujoco" in loaded and loaded.isdisjoint(LLM)


def test_the_names_of_the_model_backed_planners_load_no_language_model_library() -> None:
    assert _loaded_after("import robosandbox.agent.llm.entry, robosandbox.agent.llm.auto").isdisjoint(LLM)
