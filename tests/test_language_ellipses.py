"""Orders, kinds and ellipses: what is left out of a sentence is what was said before, and what binds is not left out."""

from __future__ import annotations

import pytest

from robosandbox.agent.language.draft import Draft
from robosandbox.agent.language.interpret import interpret
from robosandbox.types import DetectedObject, ObservedScene, Pose

SCENE = ObservedScene(
    time=0.0,
    table_height=0.04,
    base_xy=(-0.3, 0.0),
    objects=tuple(
        DetectedObject(id=name, kind=kind, size=size, colour=colour, rgba=(0.5, 0.5, 0.5, 1.0), pose=Pose(xyz=xyz), opening=opening)
        for name, kind, size, colour, xyz, opening in (
            ("lemon", "sphere", (0.025,), "yellow", (0.0, 0.32, 0.065), None),
            ("red_cube", "box", (0.02, 0.02, 0.02), "red", (0.15, 0.1, 0.06), None),
            ("blue_cube", "box", (0.025, 0.025, 0.025), "blue", (0.15, -0.1, 0.065), None),
            ("tray", "bin", (0.07, 0.07, 0.02), "grey", (0.22, 0.28, 0.04), None),
            ("drawer", "drawer", (0.2, 0.18, 0.1, 0.12), "brown", (0.36, -0.25, 0.04), 0.0),
        )
    ),
)  # fmt: skip
SKILLS = [
    "pick",
    "place_on",
    "place_in",
    "place_at",
    "place_beside",
    "stack",
    "push",
    "tap",
    "open_drawer",
    "close_drawer",
    "home",
]


@pytest.mark.parametrize(
    ("said", "calls"),
    [
        ("put the cubes in the tray, smallest first", "pick(object=red_cube); place_in(container=tray); pick(object=blue_cube); place_in(container=tray)"),
        ("cubes into the tray, starting with the biggest", "pick(object=blue_cube); place_in(container=tray); pick(object=red_cube); place_in(container=tray)"),
        ("put the cubes in the tray, both of them", "pick(object=red_cube); place_in(container=tray); pick(object=blue_cube); place_in(container=tray)"),
        ("not the red cube, the blue one: tap it", "tap(object=blue_cube)"),
        ("take the lemon and leave it standing in the tray", "pick(object=lemon); place_in(container=tray)"),
        ("whichever thing is red, tap it", "tap(object=red_cube)"),
        ("stack the cubes, red on blue", "stack(object=red_cube, target=blue_cube)"),
        ("build a tower with the cubes: red, blue from the bottom up", "stack(object=blue_cube, target=red_cube)"),
        ("the red cube goes in the tray, and the lemon does too", "pick(object=red_cube); place_in(container=tray); pick(object=lemon); place_in(container=tray)"),
        ("the red cube goes in the tray and the lemon joins it there", "pick(object=red_cube); place_in(container=tray); pick(object=lemon); place_in(container=tray)"),
        ("push the lemon back 5 cm, then left by the same amount", "push(object=lemon, direction=back, distance=0.05); push(object=lemon, direction=left, distance=0.05)"),
        ("put the lemon in the tray and go home afterwards", "pick(object=lemon); place_in(container=tray); home()"),
        ("put the lemon in the drawer but leave the drawer open", "open_drawer(drawer=drawer); pick(object=lemon); place_in(container=drawer)"),
    ],
)  # fmt: skip
def test_orders_kinds_and_ellipses_are_read_by_the_grammar(said: str, calls: str) -> None:
    draft = interpret(said, SCENE, SKILLS)
    assert isinstance(draft, Draft), draft.message
    assert "; ".join(map(str, draft.calls)) == calls


@pytest.mark.parametrize(
    "said",
    [
        "go home once it is done",
        "tap the lemon after it is moved",
        "put the lemon in the tray, smallest first",
        "put the lemon in the tray and close the drawer, but leave the drawer open",
        "stack the cubes, green on blue",
        "use the tray as a base unless it is full and put the lemon on it",
        "roll the lemon until it stops",
        "i have finished with the lemon unless you need it, put it in the tray",
        "it would make me happy if you never touched the lemon",
        "may i have the lemon back",
        "give the lemon a second push to",
        "everything that is not red, meaning the lemon, in the tray",
    ],
)
def test_what_binds_is_refused_rather_than_left_out(said: str) -> None:
    assert not isinstance(interpret(said, SCENE, SKILLS), Draft)
