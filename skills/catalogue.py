"""The installed skills, found through the entry points `robosandbox.skills`."""

from __future__ import annotations

from robosandbox.plugins import plugins
from robosandbox.skills.base import Skill


def load_skills() -> list[Skill]:
    """Return one instance of every installed skill, by name."""
    return [point.load()() for point in plugins("skills")]
