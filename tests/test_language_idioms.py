"""Every idiom in a simple frame: what it means is planned, and nothing else."""

from __future__ import annotations

import pytest

from robosandbox.agent.language.draft import Draft
from robosandbox.agent.language.idioms import PLAIN
from robosandbox.agent.language.interpret import interpret
from robosandbox.skills.catalogue import load_skills
from robosandbox.types import DetectedObject, ObservedScene, Pose

_SCENE = ObservedScene(
    time=0.0,
    table_height=0.04,
    base_xy=(-0.3, 0.0),
    objects=tuple(
        DetectedObject(id=name, kind=kind, size=size, colour=colour, rgba=(0.5, 0.5, 0.5, 1.0), pose=Pose(xyz=xyz), opening=opening)
        for name, kind, size, colour, xyz, opening in (
            ("lemon", "sphere", (0.025,), "yellow", (0.0, 0.32, 0.065), None),
            ("red_cube", "box", (0.02, 0.02, 0.02), "red", (0.15, 0.1, 0.06), None),
            ("mug", "cup", (0.04, 0.08), "white", (0.25, 0.0, 0.04), None),
            ("beans", "beads", (0.004, 20), "brown", (0.25, 0.0, 0.05), None),
            ("bowl", "bowl", (0.07, 0.05), "blue", (0.22, 0.28, 0.04), None),
            ("drawer", "drawer", (0.2, 0.18, 0.1, 0.12), "brown", (0.36, -0.25, 0.04), 0.0),
        )
    ),
)  # fmt: skip
_FRAMES = {
    "pick up": ("the lemon", ["pick(object=lemon)"]),
    "put": ("the lemon into the bowl", ["pick(object=lemon)", "place_in(container=bowl)"]),
    "move": ("the lemon 5 cm to the left", ["push(object=lemon, direction=left, distance=0.05)"]),
    "push": ("the lemon 5 cm to the left", ["push(object=lemon, direction=left, distance=0.05)"]),
    "open": ("the drawer", ["open_drawer(drawer=drawer)"]),
    "close": ("the drawer", ["close_drawer(drawer=drawer)"]),
    "tap": ("the lemon", ["tap(object=lemon)"]),
    "go home": ("", ["home()"]),
    "pour": ("the mug into the bowl", ["pick(object=mug)", "pour(target=bowl)"]),
}


@pytest.mark.parametrize("verb", sorted(_FRAMES))
def test_every_idiom_means_its_verb(verb: str) -> None:
    rest, calls = _FRAMES[verb]
    skills = [skill.name for skill in load_skills()]
    wrong = {}
    for phrase in (phrase for phrase, plain in PLAIN.items() if plain == verb):
        draft = interpret(f"{phrase} {rest}".strip(), _SCENE, skills)
        answer = [str(call) for call in draft.calls] if isinstance(draft, Draft) else draft.message
        if answer != calls:
            wrong[phrase] = answer
    assert not wrong
