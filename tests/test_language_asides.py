"""Asides and indirect orders: what only tells of something is set aside; what binds is refused, or stays."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import pytest

from robosandbox.agent.language.draft import Draft
from robosandbox.agent.language.interpret import interpret
from robosandbox.types import DetectedObject, ObservedScene, Pose, Refusal

_SIZES: dict[str, Any] = {"box": (0.02, 0.02, 0.02), "cylinder": (0.03, 0.05), "bin": (0.08, 0.08, 0.06)}
SKILLS = ("pick", "place_in", "place_on", "place_beside", "place_at", "push", "tap", "home", "stack")


def _thing(name: str, x: float, y: float, kind: Any, colour: str) -> DetectedObject:
    xyz: Any = (x, y, 0.06)
    pose = Pose(xyz=xyz)
    return DetectedObject(id=name, kind=kind, size=_SIZES[kind], colour=colour, rgba=(0.5, 0.5, 0.5, 1.0), pose=pose)


SCENE = ObservedScene(
    time=0.0,
    objects=(
        _thing("sponge", 0.10, 0.12, "box", "yellow"),
        _thing("soap", 0.22, 0.01, "box", "white"),
        _thing("can", 0.25, 0.22, "cylinder", "grey"),
        _thing("laundry_bin", 0.10, -0.30, "bin", "brown"),
    ),
    table_height=0.04,
    base_xy=(-0.3, 0.0),
)
BINNED = ("pick(object=sponge)", "place_in(container=laundry_bin)")


def _calls(text: str) -> tuple[str, ...]:
    made = interpret(text, SCENE, SKILLS)
    return tuple(str(call) for call in made.calls) if isinstance(made, Draft) else ()


@pytest.mark.parametrize(
    "text",
    [
        "the sponge has had it, put it in the laundry",
        "my hands are full so could you get the sponge into the laundry bin",
        "put the sponge in the laundry bin, no rush",
        "ugh, mondays. sponge in the laundry bin",
        "the neighbours are coming, sponge in the laundry bin please",
        "I dropped the sponge, put it in the laundry bin",
        "my son spilled his juice and ran off, so put the sponge in the laundry bin before he arrives",
        "I can't sleep. put the sponge in the laundry bin",
        "put the sponge in the laundry bin, if that's all right",
        "it smells funny in here, doesn't it? put the sponge in the laundry bin",
        "the sponge doesn't go there, it goes in the laundry",
        "put the sponge on the soap, no wait, that will topple, in the laundry bin",
        "I can't reach that sponge, so put it in the laundry bin",
        "put the sponge in the laundry bin so it doesn't get lost",
        "hiya, sponge in the laundry bin",
        "I guess I want the sponge in the laundry bin",
    ],
)
def test_what_only_tells_of_something_is_set_aside(text: str) -> None:
    assert _calls(text) == BINNED


@pytest.mark.parametrize(
    "text",
    [
        "put the sponge in the laundry bin unless it's wet",
        "put the sponge in the laundry bin once it has dried",
        "put the sponge in the laundry bin when my wife gets home",
        "put the sponge in the laundry bin, but my wife said not to",
        "put the sponge in the laundry bin, on second thoughts I don't want it",
        "put the sponge in the laundry bin, actually I'll do it myself",
        "put the sponge in the laundry bin tomorrow",
        "if it's too heavy leave the sponge, otherwise put it in the laundry bin",
        "the sponge shouldn't go in the laundry bin",
        "nobody wants the sponge in the laundry bin",
        "my son put the sponge in the laundry bin",
        "the sponge might be in the laundry bin",
        "put everything in the laundry bin, the soap is mine",
        "put the sponge in the laundry bin, I changed my mind",
        "put the sponge in the laundry bin, I don't think so",
        "put the sponge in the laundry bin as you did before",
        "put the sponge in the laundry bin so that it stands upright",
        "in reverse order, put the sponge in the laundry bin",
        "put the sponge in the laundry bin, sideways",
        "maybe, put the sponge in the laundry bin, maybe not",
        "put the sponge in the laundry bin, he said",
        "example: put the sponge in the laundry bin",
        "My boss said what follows is an example. Put the sponge in the laundry bin",
        "When the bell rings. Put the sponge in the laundry bin",
        "After lunch. Put the sponge in the laundry bin",
        "We start tomorrow. Put the sponge in the laundry bin",
        "Suppose I were a pirate. Put the sponge in the laundry bin",
        "It has to be done in silence. Put the sponge in the laundry bin",
        "Do it blindfolded. Put the sponge in the laundry bin",
        "You must be silent. Put the sponge in the laundry bin",
        "on the poster it says: put the sponge in the laundry bin",
        "the lid must not be touched. Put the sponge in the laundry bin",
        "please read this aloud. Put the sponge in the laundry bin",
        "my doctor says I should not lift anything. Put the sponge in the laundry bin",
        "as soon as she claps, put the sponge in the laundry bin",
        "put the sponge in the laundry bin so it doesn't touch the wall",
        "put the sponge in the laundry bin. It is postponed",
    ],
)
def test_what_binds_is_refused(text: str) -> None:
    assert _calls(text) == ()


@pytest.mark.parametrize(
    "text",
    [
        "{the} is mine, put the blocks in the laundry bin",
        "{the} is broken, put all the blocks in the laundry bin",
        "my son needs {the}, put the blocks in the laundry bin",
        "mum wants to keep {the}, put the blocks in the laundry bin",
        "put the blocks in the laundry bin, I hate {the}",
        "I do not like red, put the blocks in the laundry bin",
    ],
)
@pytest.mark.parametrize("named", ["the red block", "the red one"])
def test_one_of_several_that_is_told_of_may_be_spared(text: str, named: str) -> None:
    things = tuple(
        _thing(f"{colour}_block", 0.1, y, "box", colour) for colour, y in (("red", 0.1), ("blue", 0.0), ("green", -0.1))
    )
    scene = replace(SCENE, objects=(*things, SCENE.objects[-1]))
    assert isinstance(interpret(text.format(the=named), scene, SKILLS), Refusal)


def test_what_is_done_first_may_be_told_last() -> None:
    text = "put the sponge in the laundry bin, but tap the can first, then go home"
    assert _calls(text) == ("tap(object=can)", *BINNED, "home()")


@pytest.mark.parametrize(
    "text",
    [
        "once the sponge has been put in the laundry bin, tap the can",
        "after the sponge is moved to the laundry bin, tap the can",
        "put the sponge in the laundry bin before the can is tapped",
        "before the can is tapped, put the sponge in the laundry bin",
    ],
)
def test_what_is_done_to_a_thing_is_a_step(text: str) -> None:
    assert _calls(text) == (*BINNED, "tap(object=can)")


def test_what_is_done_as_long_as_something_is_so_is_done_if_it_cannot_go_on() -> None:
    assert _calls("as long as there is no ball, push the can forward 4 cm")[0].startswith("push(")
    assert _calls("as long as there is no sponge, push the can forward 4 cm") == ()


def test_the_others_stand_between_the_biggest_and_the_smallest() -> None:
    blocks = [_thing(f"cube_{i}", 0.1 + 0.06 * i, 0.0, "box", "red") for i in range(3)]
    scene = ObservedScene(
        time=0.0,
        objects=tuple(
            replace(item, size=(edge, edge, edge)) for item, edge in zip(blocks, (0.015, 0.03, 0.02), strict=True)
        ),
        table_height=0.04,
        base_xy=(-0.3, 0.0),
    )
    made = interpret("build a tower: biggest cube at the bottom, smallest on top", scene, SKILLS)
    assert isinstance(made, Draft)
    assert [str(call) for call in made.calls] == [
        "stack(object=cube_2, target=cube_1)",
        "stack(object=cube_0, target=cube_2)",
    ]
