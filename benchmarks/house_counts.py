"""What `house.py` counts in the source text, and by which rules.

Read are the Python files of `src/robosandbox` and of the six folders beside it; tests, examples, benchmarks and documents are
not. Where a count is split, "language" is what is under `agent/language`.

mujoco_backend_outside_sim: files outside `sim/` whose code, docstrings apart, names `MuJoCoBackend`.
mujoco_imports_elsewhere: files that import mujoco outside `MUJOCO_HOMES`, under `TYPE_CHECKING` and in functions too.
kind_comparisons: `==`, `!=`, `in`, `not in` and `case` between an object's kind and a string, or a collection of strings that is
    written there or under a name in the same file. An expression is a kind if it is called `kind` or ends with `.kind` or
    `_kind`; it is an object's if the string is the name of a registered shape, or "" (other strings tell joints or events).
long_files: files of over 350 lines.
long_functions: functions of over 60 lines, from `def` to the last line, docstring included.
complex_functions: functions with McCabe's number over 15: 1, and 1 for each `if`, `elif`, conditional expression, `for`, `while`,
    `for` of a comprehension, `except`, `case` that is no `_`, and operand of `and` or `or` beyond the first. A function within a
    function counts for itself.
constants_without_source: named numbers without unit or origin, see `house_constants.py`.
import_circles: groups of modules that import each other while they are loaded; imports in functions and under `TYPE_CHECKING`
    are not among these.
"""

from __future__ import annotations

import ast
import tomllib
from collections.abc import Callable, Iterator
from functools import lru_cache

from house_constants import constants_without_source
from house_sources import PACKAGE, ROOT, Source

# The rooms that may import mujoco, and the apps that draw or export a model.
MUJOCO_HOMES = {
    "sim/": "MuJoCo's driver",
    "robots/": "reads models of robots",
    f"{PACKAGE}/motion/": "the planning model",
    f"{PACKAGE}/shapes/": "bodies of objects",
    f"{PACKAGE}/apps/viewer/": "draws a model in the browser",
    f"{PACKAGE}/apps/export/": "writes a model's bodies and frames to other formats",
    f"{PACKAGE}/workcell/recording/drawing.py": "draws a recorded episode's frames with a renderer",
}
MOST_LINES = 350
MOST_FUNCTION_LINES = 60
MOST_COMPLEXITY = 15


def names_of_backend(source: Source) -> Iterator[str]:
    """Yield a file outside `sim/` that names MuJoCo's class."""
    docs = {id(node.value) for node in ast.walk(source.tree) if isinstance(node, ast.Expr)}
    for node in ast.walk(source.tree):
        match node:
            case ast.Name(id=name) | ast.Attribute(attr=name) | ast.alias(name=name):
                found = name == "MuJoCoBackend"
            case ast.Constant(value=str(text)):
                found = "MuJoCoBackend" in text and id(node) not in docs
            case _:
                found = False
        if found and not source.name.startswith("sim/"):
            yield f"{source.name}:{getattr(node, 'lineno', 0)}"
            return


def imports_of_mujoco(source: Source) -> Iterator[str]:
    """Yield a file that imports mujoco and is not at home there."""
    if source.name.startswith(tuple(MUJOCO_HOMES)):
        return
    for node in ast.walk(source.tree):
        match node:
            case ast.Import(names=names):
                modules = [alias.name for alias in names]
            case ast.ImportFrom(module=str(module), level=0):
                modules = [module]
            case _:
                continue
        if any(module.split(".")[0] == "mujoco" for module in modules):
            yield source.at(node)
            return


@lru_cache
def registered_kinds() -> frozenset[str]:
    """Return the names of the shapes that the package brings."""
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    return frozenset(project["entry-points"]["robosandbox.shapes"])


def kind_comparisons(source: Source) -> Iterator[str]:
    """Yield each comparison of an object's kind with a string."""
    kinds = registered_kinds() | {""}
    named = {
        target.id: _strings(node.value, {})
        for node in ast.walk(source.tree)
        if isinstance(node, ast.Assign)
        for target in node.targets
        if isinstance(target, ast.Name)
    }
    for node in ast.walk(source.tree):
        match node:
            case ast.Compare(left=left, comparators=others):
                sides = [left, *others]
                texts = {text for side in sides for text in _strings(side, named)}
                if any(map(_is_kind, sides)) and texts & kinds:
                    yield source.at(node, ast.unparse(node))
            case ast.Match(subject=subject, cases=cases) if _is_kind(subject):
                for case in cases:
                    values = (part.value for part in ast.walk(case.pattern) if isinstance(part, ast.MatchValue))
                    if {text for value in values for text in _strings(value, named)} & kinds:
                        yield source.at(case.pattern, f"case {ast.unparse(case.pattern)}")
            case _:
                pass


def _is_kind(node: ast.expr) -> bool:
    name = node.id if isinstance(node, ast.Name) else node.attr if isinstance(node, ast.Attribute) else ""
    return name == "kind" or name.endswith("_kind")


def _strings(node: ast.expr, named: dict[str, set[str]]) -> set[str]:
    """Return the strings that an expression is, or is a collection of."""
    match node:
        case ast.Constant(value=str(text)):
            return {text}
        case ast.Tuple(elts=items) | ast.List(elts=items) | ast.Set(elts=items):
            return {text for item in items for text in _strings(item, named)}
        case ast.Dict(keys=keys):
            return {text for key in keys if key is not None for text in _strings(key, named)}
        case ast.Call(func=ast.Name(id="frozenset" | "set" | "tuple"), args=[only]):
            return _strings(only, named)
        case ast.Name(id=name):
            return named.get(name, set())
        case ast.Attribute(value=ast.Name(id=name), attr="kind") if name[0].isupper():
            # `Drawer.kind` is the string by another name.
            return {""}
        case _:
            return set()


def long_files(source: Source) -> Iterator[str]:
    """Yield a file that is too long."""
    if source.lines > MOST_LINES:
        yield f"{source.name} {source.lines}"


def _functions(source: Source) -> Iterator[ast.FunctionDef | ast.AsyncFunctionDef]:
    for node in ast.walk(source.tree):
        if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef):
            yield node


def long_functions(source: Source) -> Iterator[str]:
    """Yield each function that is too long."""
    for node in _functions(source):
        lines = (node.end_lineno or node.lineno) - node.lineno + 1
        if lines > MOST_FUNCTION_LINES:
            yield source.at(node, f"{node.name} {lines}")


def complex_functions(source: Source) -> Iterator[str]:
    """Yield each function that branches too much."""
    for node in _functions(source):
        number = 1 + sum(map(_branches, node.body))
        if number > MOST_COMPLEXITY:
            yield source.at(node, f"{node.name} {number}")


def _branches(node: ast.AST) -> int:
    match node:
        case ast.FunctionDef() | ast.AsyncFunctionDef() | ast.ClassDef():
            return 0
        case (
            ast.If()
            | ast.IfExp()
            | ast.For()
            | ast.AsyncFor()
            | ast.While()
            | ast.ExceptHandler()
            | ast.comprehension()
        ):
            own = 1
        case ast.BoolOp(values=values):
            own = len(values) - 1
        case ast.match_case(pattern=pattern):
            own = int(not (isinstance(pattern, ast.MatchAs) and pattern.pattern is None))
        case _:
            own = 0
    return own + sum(map(_branches, ast.iter_child_nodes(node)))


def import_circles(files: list[Source]) -> list[str]:
    """Return the groups of modules that import each other while they are loaded."""
    modules = {source.module: source for source in files}
    edges = {name: {other for other in _loaded_by(source) if other in modules} for name, source in modules.items()}
    reach: dict[str, set[str]] = {}
    for name in modules:
        seen, waiting = set[str](), list(edges[name])
        while waiting:
            other = waiting.pop()
            if other not in seen:
                seen.add(other)
                waiting += edges[other]
        reach[name] = seen
    groups = {
        frozenset(other for other in reach[name] if name in reach[other]) for name in modules if name in reach[name]
    }
    return sorted(" <-> ".join(sorted(group)) for group in groups)


def _loaded_by(source: Source) -> Iterator[str]:
    waiting: list[ast.stmt] = list(source.tree.body)
    while waiting:
        node = waiting.pop()
        match node:
            case ast.Import(names=names):
                yield from (alias.name for alias in names)
            case ast.ImportFrom(module=str(module), names=names, level=0):
                # A name may be a module of the package that is imported from.
                yield from (f"{module}.{alias.name}" for alias in names)
                yield module
            case ast.If(test=ast.Name(id="TYPE_CHECKING"), orelse=rest):
                waiting += rest
            case ast.If(body=body, orelse=rest) | ast.Try(body=body, orelse=rest):
                waiting += [*body, *rest]
            case _:
                pass


COUNTS: dict[str, Callable[[Source], Iterator[str]]] = {
    "mujoco_backend_outside_sim": names_of_backend,
    "mujoco_imports_elsewhere": imports_of_mujoco,
    "kind_comparisons": kind_comparisons,
    "long_files": long_files,
    "long_functions": long_functions,
    "complex_functions": complex_functions,
    "constants_without_source": constants_without_source,
}
