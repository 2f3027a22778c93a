"""What is described must be so, and words that put an order off or limit it are not dropped."""

import pytest

from robosandbox.agent.language.interpret import interpret
from robosandbox.types import DetectedObject, ObservedScene, Pose, Refusal

SIZES = {"box": (0.02, 0.02, 0.02), "cylinder": (0.03, 0.05), "bin": (0.08, 0.08, 0.06), "sphere": (0.02,)}


def thing(name: str, x: float, y: float, *, kind: str = "box", colour: str = "red") -> DetectedObject:
    pose = Pose(xyz=(x, y, 0.06))
    return DetectedObject(id=name, kind=kind, size=SIZES[kind], colour=colour, rgba=(0.5, 0.5, 0.5, 1.0), pose=pose)


OBJECTS = (
    thing("red_cube", 0.05, 0.0),
    thing("blue_cube", 0.05, 0.1, colour="blue"),
    thing("left_shoe", 0.15, -0.1, colour="black"),
    thing("metal_spoon", 0.2, 0.1, colour="grey"),
    thing("big_block", 0.1, -0.25, colour="white"),
    thing("green_can", 0.2, -0.2, kind="cylinder", colour="green"),
    thing("yellow_ball", 0.0, -0.2, kind="sphere", colour="yellow"),
    thing("grey_bin", 0.1, 0.35, kind="bin", colour="grey"),
)
THINGS = ObservedScene(time=0.0, objects=OBJECTS, table_height=0.04, base_xy=(-0.3, 0.0))
BINNED = ["pick(object=red_cube)", "place_in(container=grey_bin)"]


def told(text: str) -> list[str]:
    made = interpret(text, THINGS, ("pick", "place_in", "place_on", "place_beside", "tap", "push", "home"))
    return [] if isinstance(made, Refusal) else [str(call) for call in made.calls]


@pytest.mark.parametrize(
    "text",
    [
        "pick up the red cube that is blue",
        "grab the red cube, which is blue",
        "pick up the red blue cube",
        "pick up the right shoe",
        "put the ball next to the right shoe",
        "pick up the wooden spoon",
        "pick up the small block",
        "put the ball in the other bin",
        "put the red cube on the other block",
        "tap everything that is not round",
        "tap all but the round things",
        "maybe put the red cube in the bin",
        "put the red cube, and maybe the ball, in the bin",
        "put the red cube in the bin and perhaps the ball too",
        "possibly tap the ball",
        "later tap the ball",
        "tap the ball again and again",
        "tap the ball over and over",
        "if there is only one cube tap the ball, then if there is exactly one block tap the can, otherwise go home",
        "put the red cube in the bin. If the bin is empty, tap the ball",
    ],
)
def test_what_is_not_so_or_not_decided_moves_nothing(text: str) -> None:
    assert told(text) == []


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("pick up the cube that is red", ["pick(object=red_cube)"]),
        ("pick up the red cube which is red", ["pick(object=red_cube)"]),
        ("pick up the left shoe", ["pick(object=left_shoe)"]),
        ("pick up the metal spoon", ["pick(object=metal_spoon)"]),
        ("tap the red cube, then tap the other cube", ["tap(object=red_cube)", "tap(object=blue_cube)"]),
        ("could you maybe put the red cube in the bin", BINNED),
        ("maybe put the red cube in the bin?", BINNED),
        ("put only the red cube in the bin", BINNED),
        ("if there is only one ball put the red cube in the bin, otherwise go home", BINNED),
        (
            "put the red cube in the bin, and if the bin is not empty, tap the ball",
            [*BINNED, "tap(object=yellow_ball)"],
        ),
    ],
)
def test_what_is_so_is_done(text: str, expected: list[str]) -> None:
    assert told(text) == expected
