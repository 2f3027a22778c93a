"""The installed skills, found through the entry points `robosandbox.skills`."""

from __future__ import annotations

from robosandbox.plugins import make_installed
from robosandbox.skills.base import Skill


def load_skills() -> list[Skill]:
    """Return one instance of every installed skill, by name; what does not load is left out with a warning."""
    return list(make_installed("skills", Skill).values())
