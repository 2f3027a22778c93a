"""SRDF beside a URDF: named postures, and links that may touch."""

from __future__ import annotations

from pathlib import Path
from xml.etree import ElementTree

from robosandbox.errors import InputError
from robosandbox.robots.importers.files import read_xml
from robosandbox.robots.importers.imported import ImportedModel
from robosandbox.robots.importers.urdf_lint import numbers


def read_srdf(model: ImportedModel) -> None:
    """Add a model's SRDF postures and disabled pairs, where there is one of the same stem and robot name."""
    path = _find(model.path)
    if path is None:
        return
    try:
        root = ElementTree.fromstring(read_xml(path))
    except (InputError, ElementTree.ParseError) as error:
        model.notes.append(f"{path.name} beside the model is left out: {error}")
        return
    if root.tag != "robot":
        return
    for state in root.iter("group_state"):
        values = {}
        for joint in state.findall("joint"):
            value = numbers(joint.get("value", ""))
            if value and len(value) == 1:
                values[joint.get("name", "")] = value[0]
        if values:
            model.keyframes.setdefault(state.get("name", "group_state"), {}).update(values)
    for pair in root.iter("disable_collisions"):
        model.disabled_pairs.append((pair.get("link1", ""), pair.get("link2", "")))


def _find(path: Path) -> Path | None:
    places = (path.with_suffix(".srdf"), path.parent.parent / "srdf" / f"{path.stem}.srdf")
    return next((place for place in places if place.is_file()), None)
