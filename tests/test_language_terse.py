"""Notation of programs and work instructions, and forms of second-language speakers: what they mean, what is refused beside them."""

from __future__ import annotations

from typing import Any

import pytest

from robosandbox.agent.language.draft import Draft
from robosandbox.agent.language.interpret import interpret
from robosandbox.skills.catalogue import load_skills
from robosandbox.types import DetectedObject, ObservedScene, Pose

SCENE = ObservedScene(
    time=0.0,
    table_height=0.04,
    base_xy=(-0.3, 0.0),
    objects=tuple(
        DetectedObject(id=name, kind=kind, size=size, colour=colour, rgba=(0.5, 0.5, 0.5, 1.0), pose=Pose(xyz=xyz), opening=opening)
        for name, kind, size, colour, xyz, opening in (
            ("disc_1", "cylinder", (0.02, 0.02), "red", (0.05, 0.15, 0.06), None),
            ("disc_2", "cylinder", (0.02, 0.02), "green", (0.05, 0.05, 0.06), None),
            ("disc_3", "cylinder", (0.02, 0.02), "yellow", (0.05, -0.05, 0.06), None),
            ("small_bolt", "box", (0.015, 0.015, 0.015), "grey", (0.18, 0.1, 0.055), None),
            ("large_bolt", "box", (0.025, 0.02, 0.02), "grey", (0.2, -0.06, 0.06), None),
            ("parts_tray", "bin", (0.09, 0.09, 0.05), "white", (0.1, 0.34, 0.04), None),
            ("waste_bin", "bin", (0.08, 0.08, 0.06), "black", (0.1, -0.32, 0.04), None),
            ("cabinet", "drawer", (0.2, 0.18, 0.1, 0.12), "brown", (0.42, 0.2, 0.04), 0.0),
        )
    ),
)  # fmt: skip
SKILLS = tuple(skill.name for skill in load_skills())


def _calls(text: str) -> tuple[str, ...]:
    made = interpret(text, SCENE, SKILLS)
    calls = made.calls if isinstance(made, Draft) else ()
    return tuple(f"{call.skill}:{':'.join(_said(value) for value in call.arguments.values())}" for call in calls)


def _said(value: Any) -> str:
    return f"{value:g}" if isinstance(value, float) else str(value)


def _into(thing: str, container: str) -> tuple[str, ...]:
    return (f"pick:{thing}", f"place_in:{container}")


_STOWED = ("open_drawer:cabinet", *_into("small_bolt", "cabinet"), "close_drawer:cabinet")


@pytest.mark.parametrize(
    ("text", "calls"),
    [
        ("place_in(disc_1, waste_bin); home()", (*_into("disc_1", "waste_bin"), "home:")),
        ("push(disc_3, right, 3 cm)", ("push:disc_3:right:0.03",)),
        ("discs 1–3 -> parts_tray", (*_into("disc_1", "parts_tray"), *_into("disc_2", "parts_tray"), *_into("disc_3", "parts_tray"))),
        ("push small_bolt -y 2 cm", ("push:small_bolt:right:0.02",)),
        ("large_bolt: dx = +20 mm", ("push:large_bolt:forward:0.02",)),
        ("pick(object=disc_1); place_in(container=waste_bin)", _into("disc_1", "waste_bin")),
        ("tap large_bolt x2", ("tap:large_bolt", "tap:large_bolt")),
        ("tap the small bolt and the large bolt, large first", ("tap:large_bolt", "tap:small_bolt")),
        ("small bolt in cabinet, and after you must close it", _STOWED),
        ("put the small bolt in the cabinet and after close it", _STOWED),
    ],
)  # fmt: skip
def test_what_is_written_or_said_in_another_way_is_planned(text: str, calls: tuple[str, ...]) -> None:
    assert _calls(text) == calls


@pytest.mark.parametrize(
    "text",
    [
        "place_in(disc_4, waste_bin)",
        "place_in(not disc_1, waste_bin)",
        "op 1: disc_2 -> waste_bin. op 3: home",
        "discs 1-4 -> parts_tray",
        "discs 3-1 -> parts_tray",
        "push small_bolt +z 2 cm",
        "push small_bolt 2 cm to the left, y unchanged",
        "push small_bolt +x +y 2 cm",
        "M bolt to waste bin",
        "tap the discs in reverse order",
        "tap the small bolt and the large bolt, blue first",
        "gripper to large bolt, do not grasp",
        "tap disc 1 and disc 2, the small bolt first",
        "tap the bolt w/o the smallest y",
        "small bolt -> cabinet (do not open / insert)",
        "in the parts tray must not come the small bolt",
        "the bolt small, in the tray of parts it must not",
        "for the small bolt there is no place in the parts tray",
        "it is possible that the small bolt is in the parts tray, tap disc 1",
        "it is not required that the small bolt be placed in the tray",
        "do not make fall the small bolt in the waste bin",
        "he must go home",
    ],
)
def test_what_binds_or_is_not_there_is_refused(text: str) -> None:
    assert _calls(text) == ()


def test_after_with_a_comma_alone_is_asked_about() -> None:
    made = interpret("put the small bolt in the cabinet, after you close the cabinet", SCENE, SKILLS)
    assert not isinstance(made, Draft) and made.code == "ambiguous"


def test_after_without_a_joint_comes_before() -> None:
    assert _calls("tap disc 1 after you tap disc 2") == ("tap:disc_2", "tap:disc_1")


def test_a_colour_before_a_shared_noun_takes_no_other_thing() -> None:
    assert _calls("tap the grey and red disc") == ()
