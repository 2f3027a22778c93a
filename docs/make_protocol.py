"""Write protocol.md from the models in workcell/zenoh/messages/, errors.py, evidence.py and the skills: `python docs/make_protocol.py`."""

from __future__ import annotations

import inspect
import json
import re
from pathlib import Path
from typing import Any

from pydantic import BaseModel
from pydantic.json_schema import models_json_schema

from robosandbox import errors, skill_errors
from robosandbox.evidence import Evidence
from robosandbox.skills import push, tap
from robosandbox.workcell.zenoh import messages as wire
from robosandbox.workcell.zenoh.server.loader import MOST_BODIES, MOST_GEOMS

PAGE = Path(__file__).with_name("protocol.md")
PROSE = Path(__file__).with_name("protocol.in.md")

# Under `robosandbox/<robot_id>/`: the key, how it is used, what is sent, what comes back, and what it is for.
KEYS: tuple[tuple[str, str, type[wire.Message] | str, type[wire.Message] | str, str], ...] = (
    ("info", "query", wire.Ask, wire.Info, "what the sim is and can do"),
    ("skill/<name>/send_goal", "query", wire.SendGoal, wire.Goal, "run a skill or an order; answered at once"),
    ("skill/<name>/cancel_goal", "query", wire.GoalRef, wire.Goal, "stop it; answered at once, ended by `status`"),
    ("skill/<name>/get_result", "query", wire.GoalRef, wire.Goal, f"how far it is; the last {wire.KEPT_RESULTS} kept"),
    ("goal/<goal_id>/status", "publication", "", wire.Goal, "each change; late joiners ask get_result"),
    ("goal/<goal_id>/feedback", "publication", "", wire.Feedback, "each phase that begins"),
    ("goal/<goal_id>/intent", "publication", "", wire.GoalIntent, "what it is about to do, for goals that ask for it"),
    ("obs/state", "publication, query", wire.Ask, wire.State, f"{wire.STATE_HZ:g} times a second"),
    ("obs/objects", "publication, query", wire.Ask, wire.Objects, "what perception sees; while somebody listens"),
    ("obs/camera/<name>/rgb", "publication, query", "", "picture", "JPEG; while somebody listens"),
    ("obs/camera/<name>/depth", "publication, query", "", "picture", "float32 metres; while somebody listens"),
    ("truth", "query", wire.Ask, wire.TrueState, "the simulated state, if the sim tells it"),
    ("reset", "query", wire.Reset, wire.TrueState, "start over; refused as busy while a goal runs"),
    ("load", "query", wire.Load, wire.TrueState, "load another task; refused as busy while a goal runs"),
    ("clock", "query", wire.Clock, wire.TrueState, "let simulated time pass"),
    ("checkpoint", "query", wire.Ask, wire.Saved, f"keep the world as it is; the last {wire.KEPT_CHECKPOINTS} kept"),
    ("alive", "liveliness token", "", "", "the sim is there"),
    ("client/<client_id>", "liveliness token", "", "", "declared by a client: when it goes, its goals are cancelled"),
)
REQUESTS = (wire.Ask, wire.SendGoal, wire.GoalRef, wire.Reset, wire.Load, wire.Clock)
ANSWERS = (
    *(
        wire.Info,
        wire.Goal,
        wire.Feedback,
        wire.GoalIntent,
        wire.State,
        wire.Objects,
        wire.TrueState,
        wire.Saved,
        wire.Picture,
    ),
    errors.Failure,
)
# Classes of errors, by how they are drawn in `errors`.
ERRORS = [
    kind
    for module in (skill_errors, push, tap)
    for kind in vars(module).values()
    if isinstance(kind, type) and issubclass(kind, errors.SkillError) and kind.__module__ == module.__name__
]
EVIDENCE = list(dict.fromkeys(kind.evidence_type for kind in ERRORS if kind.evidence_type is not None))


def page() -> str:
    """Return the whole page."""
    _, schema = models_json_schema(
        [*((model, "validation") for model in REQUESTS), *((model, "serialization") for model in (*ANSWERS, *EVIDENCE))]
    )
    shared: dict[str, Any] = schema["$defs"]
    own = {model.__name__ for model in REQUESTS + ANSWERS}
    parts = {
        "keys": keys(),
        "requests": "\n\n".join(section(model.__name__, shared) for model in REQUESTS),
        "answers": "\n\n".join(section(model.__name__, shared, sent=False) for model in ANSWERS),
        "shared": "\n\n".join(
            section(name, shared, sent=False) for name in sorted(shared.keys() - own - {Evidence.__name__})
        ),
        "errors": error_table(),
        "phases": ", ".join(f"`{name}`" for key, name in vars(errors.Phase).items() if key.isupper()),
        "tree": (errors.__doc__ or "").partition("\n\n")[2].strip(),
        **{name.lower(): str(getattr(wire, name)) for name in ("PROTOCOL", "ROOT", "DEFAULT_ENDPOINT")},
        "max_message_bytes": f"{wire.MAX_MESSAGE_BYTES:,}",
        "kept_results": str(wire.KEPT_RESULTS),
        "most_bodies": str(MOST_BODIES),
        "most_geoms": str(MOST_GEOMS),
        "max_request_bytes": f"{wire.MAX_REQUEST_BYTES:,}",
    }
    text = re.sub(r"\{\{(\w+)\}\}", lambda found: parts[found[1]], PROSE.read_text())
    return "<!-- Written by docs/make_protocol.py; change the models or protocol.in.md. -->\n\n" + text


def keys() -> str:
    """Return the table of keys."""
    lines = ["| key | kind | sent | comes back | what for |", "|---|---|---|---|---|"]
    for key, kind, sent, back, what in KEYS:
        lines.append(f"| `{key}` | {kind} | {_model(sent)} | {_model(back)} | {what} |")
    return "\n".join(lines)


def _model(item: type[BaseModel] | str) -> str:
    if isinstance(item, str):
        return f"{item}, {_link('Picture')} as attachment" if item else ""
    return _link(item.__name__)


def _link(name: str) -> str:
    return f"[{name}](#{name.lower()})"


def section(name: str, shared: dict[str, Any], *, sent: bool = True) -> str:
    """Return a model's heading, what it is, a table of its fields, and its JSON schema.

    Args:
        name: Of the model.
        shared: Schemas by name.
        sent: A client sends it and may leave fields out; what comes back has them all.
    """
    schema = shared[name]
    said, attributes = documented(schema.get("description", ""))
    lines = [f"### {name}", "", said, ""]
    fields = schema.get("properties", {})
    required = schema.get("required", ())
    if fields:
        lines += ["| field | type | meaning |", "|---|---|---|"]
    for field, content in fields.items():
        meaning = attributes.get(field) or ("The version that the sender speaks." if field == "protocol" else None)
        if meaning is None:
            raise ValueError(f"{name}.{field}: is not in the Attributes of its docstring")
        default = ""
        if sent and field not in required:
            default = f"; {json.dumps(content['default'])} if left out" if "default" in content else "; may be left out"
        lines.append(f"| `{field}` | {type_text(content)}{default} | {meaning} |")
    if "enum" in schema:
        lines += ["One of " + ", ".join(f"`{value}`" for value in schema["enum"]) + "."]
    bare = without_prose(schema)
    return "\n".join([*lines, "", "```json", compact(bare), "```"])


def documented(docstring: str) -> tuple[str, dict[str, str]]:
    """Return a docstring's text and its Attributes."""
    text, _, listed = docstring.partition("Attributes:\n")
    found: dict[str, str] = {}
    for line in inspect.cleandoc(listed).splitlines():
        name, colon, meaning = line.partition(": ")
        if colon and not line.startswith(" "):
            found[name] = meaning
        elif found:
            found[next(reversed(found))] += " " + line.strip()
    return " ".join(text.split()), found


def type_text(schema: dict[str, Any]) -> str:
    """Return a schema's type in words."""
    match schema:
        case {"$ref": ref}:
            return _link(str(ref).rpartition("/")[2])
        case {"anyOf": options}:
            return " or ".join(dict.fromkeys(type_text(option) for option in options))
        case {"const": value}:
            return f"`{json.dumps(value)}`"
        case {"enum": values}:
            return " or ".join(f"`{json.dumps(value)}`" for value in values)
        case {"type": "array", "prefixItems": items}:
            return f"list of {len(items)}: {type_text(items[0])}"
        case {"type": "array", "items": item}:
            return f"list of {type_text(item)}"
        case {"type": "object", "additionalProperties": dict(item)}:
            return f"object of {type_text(item)}"
        case {"type": str(kind)}:
            limits = [
                f"{sign} {json.dumps(schema[key])}"
                for key, sign in {
                    "minimum": "≥",
                    "exclusiveMinimum": ">",
                    "maximum": "≤",
                    "exclusiveMaximum": "<",
                }.items()
                if key in schema
            ]
            if "pattern" in schema:
                pattern = str(schema["pattern"])
                limits.append("a UUID in lower case" if pattern.startswith("^[0-9a-f]{8}-") else f"like `{pattern}`")
            if "maxLength" in schema:
                limits.append(f"at most {schema['maxLength']} characters")
            return ", ".join([kind, *limits]) if kind == "string" else f"{kind} {', '.join(limits)}".strip()
        case _:
            return "anything"


def without_prose(schema: Any) -> Any:
    """Return a schema without titles and descriptions of its own making."""
    if isinstance(schema, dict):
        keep = {"title", "description"}
        return {
            key: {name: without_prose(item) for name, item in value.items()}
            if key == "properties"
            else without_prose(value)
            for key, value in schema.items()
            if key not in keep
        }
    return [without_prose(item) for item in schema] if isinstance(schema, list) else schema


def compact(schema: dict[str, Any]) -> str:
    """Return a schema as JSON with a line for each property."""
    lines = []
    for key, value in schema.items():
        if key == "properties":
            inner = ",\n".join(f"    {json.dumps(name)}: {json.dumps(item)}" for name, item in value.items())
            lines.append(f'  "properties": {{\n{inner}\n  }}')
        else:
            lines.append(f"  {json.dumps(key)}: {json.dumps(value, ensure_ascii=False)}")
    return "{\n" + ",\n".join(lines) + "\n}"


def error_table() -> str:
    """Return the table of error codes."""
    lines = ["| code | class | meaning | evidence |", "|---|---|---|---|"]
    for kind in ERRORS:
        if kind is errors.SkillError or "code" not in vars(kind):
            continue
        said = " ".join((kind.__doc__ or "").split())
        evidence = _link(kind.evidence_type.__name__) if kind.evidence_type else "null"
        lines.append(f"| `{kind.code}` | {kind.__name__} | {said} | {evidence} |")
    return "\n".join(lines)


if __name__ == "__main__":
    PAGE.write_text(page())
