"""Named numbers whose unit or origin is not said.

A constant is a name in capitals on a module's or class's top level whose value is made of written numbers alone. It has a source if a
comment says unit and origin. A comment explains what it ends the line of, or what begins on the line below it.

Unit: a word of `UNIT` in the comment or of `UNIT_IN_NAME` in the name, or the value is a whole number, which counts what its name says.
Origin: a word of `ORIGIN` in the comment: a measurement, a document, a standard, a library, or why it was chosen.
Geometry and arithmetic need no comment: 0, 1, 2, 1/2 and their negatives, alone or in a tuple (axes, halves), and whatever is
computed from other names.
"""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator

from house_sources import Source

UNIT = re.compile(
    r"\b(mm|cm|m|metres?|millimetres?|km|rad|radians?|degrees?|deg|turns?|s|ms|us|seconds?|minutes?|hz|fps|n|newtons?|nm|kg|grams?|g|j|w"
    r"|k|kelvin|bytes?|kb|mb|pixels?|px|levels?|characters?|percent|per|shares?|part|fraction|ratio|factor|times|multiples?|units?"
    r"|number|count|steps?|tries|attempts?|probability|cosine|sine|coefficient|dimensionless|standard deviations?|sigma)\b|%",
    re.IGNORECASE,
)
UNIT_IN_NAME = re.compile(
    r"_(MM|M|M2|RAD|DEG|S|MS|SECONDS|HZ|N|NM|KG|BYTES|PIXELS|PX|PERCENT|SHARE|FRACTION|RATIO|FACTOR|STEPS)$"
)
ORIGIN = re.compile(
    r"measured|measurements?\b|benchmarks?/|docs/|tests?/|bench\b|seeds?\b|paper|et al|\b(19|20)\d\d\b|https?://|data ?sheet|manual|standard\b"
    r"|specification|\bISO\b|\bRFC\b|MuJoCo'?s?\b|Zenoh|OpenCV|chosen|tried|derived|(comes?|taken|known|read) from|because|so that"
    r"|\bas (of|in|for|on|with)\b",
    re.IGNORECASE,
)
PLAIN_NUMBERS = {0, 1, 2, 0.5}


def constants(source: Source) -> Iterator[tuple[ast.Assign | ast.AnnAssign, str, ast.expr]]:
    """Yield each constant that is made of written numbers and is neither geometry nor arithmetic."""
    own = source.tree.body
    for node in (*own, *(inner for each in own if isinstance(each, ast.ClassDef) for inner in each.body)):
        match node:
            case ast.Assign(targets=[ast.Name(id=name)], value=value):
                pass
            case ast.AnnAssign(target=ast.Name(id=name), value=ast.expr() as value):
                pass
            case _:
                continue
        numbers = _numbers(value)
        if name.isupper() and numbers and not set(map(abs, numbers)) <= PLAIN_NUMBERS:
            yield node, name, value


def _numbers(node: ast.expr) -> list[float]:
    """Return the numbers that an expression is written with; none where it is computed from anything else."""
    match node:
        case ast.Constant(value=bool()):
            return []
        case ast.Constant(value=int() | float() as number):
            return [number]
        case ast.UnaryOp(operand=inner):
            parts = [inner]
        case ast.BinOp(left=left, right=right):
            parts = [left, right]
        case ast.Tuple(elts=parts) | ast.List(elts=parts):
            pass
        case ast.Call(func=ast.Attribute(attr="eye" | "zeros" | "ones")):
            # Its arguments are a shape.
            return [1]
        case ast.Call(func=ast.Attribute(value=ast.Name(id="np" | "math")), args=parts, keywords=[]):
            pass
        case _:
            return []
    found = [_numbers(part) for part in parts]
    return [number for each in found for number in each] if all(found) else []


def constants_without_source(source: Source) -> Iterator[str]:
    """Yield each constant that no comment explains with unit and origin."""
    for node, name, value in constants(source):
        said = _comment_on(source, node)
        counts = all(isinstance(number, int) for number in _numbers(value))
        has_unit = counts or UNIT_IN_NAME.search(name) or UNIT.search(said)
        if not (said and has_unit and ORIGIN.search(said)):
            lacks = "no comment" if not said else "no origin" if has_unit else "no unit"
            yield source.at(node, f"{name}: {lacks}")


def _comment_on(source: Source, node: ast.stmt) -> str:
    last = node.end_lineno or node.lineno
    found = [source.comments[line][1] for line in range(node.lineno, last + 1) if line in source.comments]
    line = node.lineno - 1
    while source.comments.get(line, (False, ""))[0]:
        found.insert(0, source.comments[line][1])
        line -= 1
    return " ".join(found)
