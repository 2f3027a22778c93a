"""The installed skills, found through the entry points `robosandbox.skills`."""

from __future__ import annotations

from importlib.metadata import entry_points

from robosandbox.protocols import Skill


def load_skills() -> list[Skill]:
    """Return one instance of every installed skill, by name."""
    found = {point.name: point.load()() for point in entry_points(group="robosandbox.skills")}
    return [found[name] for name in sorted(found)]
