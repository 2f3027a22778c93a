"""Imports point one way, and `import robosandbox` loads nothing heavy."""

import ast
import subprocess
import sys
from collections.abc import Iterator
from functools import cache
from pathlib import Path

import pytest

SOURCE = Path(__file__).resolve().parents[1] / "src" / "robosandbox"

# A module may import from its own layer and from those before it.
LAYERS = (
    {"tags", "error_codes", "errors", "ranges", "printable", "progress", "suggestions"},
    {"validation"},
    {"plugins", "spatial", "cache"},
    {"shapes"},
    {"types"},
    {"evidence"},
    {"skill_errors", "world"},
    {"versions", "extras"},
    {"protocols"},
    {"drivers"},
    {"robots"},
    {"driver_base"},
    {"sim"},
    {"motion", "grasp", "perception"},
    {"skills"},
    {"agent"},
    {"recording", "tasks", "service"},
    {"export", "envs"},
    {"testing"},
    {"viewer", "mcp"},
    {"commands"},
    {"cli"},
)
RANK = {part: rank for rank, layer in enumerate(LAYERS) for part in layer}
LLM = ("pydantic_ai", "openai", "anthropic", "mcp", "httpx2", "jsonschema")
HEAVY = ("yourdfpy", "cv2", "mujoco", "viser", *LLM)


@cache
def _trees() -> dict[Path, tuple[str, ast.Module]]:
    """Return, for each file, its part (the top-level name inside the package that it belongs to) and its syntax tree."""
    parts = {file: file.stem for file in SOURCE.glob("*.py")}
    for top in SOURCE.iterdir():
        if top.is_dir():
            parts |= {file: top.name for file in top.resolve().rglob("*.py")}
    return {file: (part, ast.parse(file.read_text())) for file, part in sorted(parts.items())}


def _of(*parts: str) -> Iterator[tuple[Path, ast.Module]]:
    """Yield the files of these parts with their trees."""
    yield from ((file, tree) for file, (part, tree) in _trees().items() if part in parts)


def _imported(tree: ast.AST) -> Iterator[tuple[int, str]]:
    for node in ast.walk(tree):
        match node:
            case ast.ImportFrom(module="robosandbox", level=0):
                # The version is in __init__.py, below every layer.
                yield from ((node.lineno, alias.name) for alias in node.names if alias.name != "__version__")
            case ast.ImportFrom(module=str(module), level=0) if module.startswith("robosandbox."):
                yield node.lineno, module.split(".")[1]
            case ast.ImportFrom(level=level) if level:
                yield node.lineno, "a relative import"
            case ast.Import():
                for alias in node.names:
                    if alias.name.split(".")[0] == "robosandbox":
                        yield node.lineno, alias.name.partition(".")[2].split(".")[0]
            case _:
                pass


def _is_type_checking(node: ast.AST) -> bool:
    return isinstance(node, ast.If) and isinstance(node.test, ast.Name) and node.test.id == "TYPE_CHECKING"


def _run_time(tree: ast.Module) -> ast.Module:
    """Return a module without what it holds at its top for type checkers alone."""
    return ast.Module(body=[node for node in tree.body if not _is_type_checking(node)], type_ignores=[])


def test_every_part_of_the_package_has_a_layer() -> None:
    # __init__.py only hands out names on first use.
    assert {part for part, _ in _trees().values()} - {"__init__"} <= set(RANK)


@pytest.mark.parametrize("part", sorted(RANK))
def test_part_imports_only_from_its_layer_and_those_before(part: str) -> None:
    wrong = []
    for file, tree in _of(part):
        # Protocols name what later parts hold, for type checkers alone; the next test sees to that. The tree of errors
        # hands out those of skills on first use.
        names_later = part in ("errors", "protocols")
        for line, other in _imported(_run_time(tree) if names_later else tree):
            if RANK.get(other, len(LAYERS)) > RANK[part]:
                wrong.append(f"{file.name}:{line} imports {other}")
    assert not wrong


def test_protocols_import_the_package_under_type_checking_alone() -> None:
    trees = [tree for _, tree in _of("protocols")]
    assert {part for tree in trees for _, part in _imported(_run_time(tree))} <= {"protocols"}
    assert {part for tree in trees for _, part in _imported(tree)} > {"protocols"}


@pytest.mark.parametrize("part", ["skills", "grasp", "perception"])
def test_part_names_no_simulator(part: str) -> None:
    wrong = []
    for file, tree in _of(part):
        for node in ast.walk(tree):
            modules = [alias.name for alias in node.names] if isinstance(node, ast.Import) else []
            if isinstance(node, ast.ImportFrom):
                modules = [str(node.module)]
            if any(module.split(".")[0] == "mujoco" or "mujoco_backend" in module for module in modules):
                wrong.append(f"{file.name}:{node.lineno}")
    assert not wrong


def _loaded_after(statement: str) -> set[str]:
    code = f"import sys; {statement}; print(*sorted({{name.split('.')[0] for name in sys.modules}}))"
    return set(subprocess.run([sys.executable, "-c", code], check=True, capture_output=True, text=True).stdout.split())


def test_importing_the_package_loads_nothing_heavy() -> None:
    assert _loaded_after("import robosandbox").isdisjoint({*HEAVY, "numpy", "pydantic"})


def test_importing_the_command_line_loads_no_physics() -> None:
    assert _loaded_after("import robosandbox.cli").isdisjoint(HEAVY)


def test_the_stub_path_loads_no_language_model_library() -> None:
    plan = "from robosandbox.tasks.session import open_session; open_session().agent.plan('pick up the red cube')"
    loaded = _loaded_after(plan)
    assert "mujoco" in loaded and loaded.isdisjoint(LLM)


def test_the_names_of_the_model_backed_planners_load_no_language_model_library() -> None:
    assert _loaded_after("import robosandbox.agent.llm.entry, robosandbox.agent.llm.auto").isdisjoint(LLM)
