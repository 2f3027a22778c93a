"""The rules of English: each class of them with the sentences of docs/grammar.md, and no operator passed over."""

from __future__ import annotations

import re
from dataclasses import replace
from functools import cache
from pathlib import Path

import pytest
from support.scored import sentences

from robosandbox.agent.language.ruleset import ruleset
from robosandbox.agent.planner import StubPlanner
from robosandbox.skills.base import Skill
from robosandbox.skills.catalogue import load_skills
from robosandbox.skills.protocols import SkillContext
from robosandbox.skills.words import Words
from robosandbox.tasks.bundled import bundled_task
from robosandbox.types import ObservedScene, Plan, Pose, Refusal, RefusalCode, SkillResult
from robosandbox.world.contracts import Contract

PAGE = (Path(__file__).parent.parent / "docs" / "grammar.md").read_text(encoding="utf-8")
OPERATORS = ("almost", "never", "until", "unless", "pretend", "instead", "again", "not")
TOLD = (
    "tap the green can",
    "put the yellow ball in the grey bin",
    "push the white block 4 cm to the left",
    "My wife is asleep. Tap the white block, please.",
)


# What keeps an order from being one, takes it back or tells how, said before it and behind it.
BEFORE = """
pretend to | imagine you would | almost | do not yet | never | try not to | I will | he will | my brother will | let me | let us not |
you would have to | you could have | you might | you used to | yesterday you had to | tomorrow, | tonight | later today | next week |
in an hour | in ten minutes | when I clap, | after lunch, | before dinner, | once he is back, | as soon as it rings, | at noon, |
if I nod, | unless I object, | in case it rains, | suppose I said | what if you | why did you | did you | have you | how would you |
would you ever | should I | may I | can I | shall we not | I forbid you to | nobody should | nobody may | no one wants you to |
I hate it when you | it would be bad to | it is wrong to | it is dangerous to | there is no need to | you need not | you don't have to |
you are not allowed to | refrain from it: | stop, | hold on, | cancel that: | undo: | instead of that, | rather than that, |
except that you | only say: | just say | write down: | repeat after me: | spell: | translate: | the sign says | the book says to |
my boss told Bob to | tell Anna to | ask him to | remind me to | teach me to | show me how to | explain how to | learn to |
forget how to | it was fun to | I saw you | I dreamt I had to | the old plan was to | the opposite of: | do the reverse of this: |
halfway, | partly | barely | nearly | twice as much: | without moving, | with your eyes closed, | using the spoon, |
with the other arm, | from below, | slowly but not gently | as a joke, | for example, | e.g. | hypothetically, | in theory, |
in the mirror, | backwards: | ideally | perhaps | possibly | theoretically | with luck | if possible not | first ask me, then |
make Bob | have Bob | let Bob | get Bob to
"""
BEHIND = """
, not | , no | , or not | ? no | , maybe | , perhaps | , just kidding | , I was joking | , never mind | , forget it | , cancel | , stop |
, on second thought no | , or rather don't | , as if | , almost | , but not now | , but not yet | , later | , tomorrow | , tonight |
, in five minutes | , when I say so | , once I am gone | , after he left | , if you dare | , unless you are busy | , until Friday |
, as long as it is light | , only if it is heavy | , provided it is clean | , assuming it is mine | , except on Sundays |
, otherwise you are fired | , or else | , said nobody ever | , he said | , she told me | , they say | , I heard | , is what he wrote |
, according to Bob | , I don't want that | , I would hate that | , that would be wrong | , that is forbidden | , that is a lie |
, which is not allowed | , which you must not | , that was yesterday | , that was the old plan | , that is an example |
, would be silly | , did you | , didn't you | , why | , how | , can you believe it | , with the left arm | , with a spoon |
, without touching it | , without the gripper | , from below | , upside down | , backwards | , sideways | , but only half | , halfway |
, partly | , and bring it to me | , and give it to Bob | , and eat it | , and then not | , and don't | , but leave it |
, but not that one | , but not the red one | , other than that one | , rather the other one | , the other one | , the opposite |
, the reverse | , and undo it | , and vice versa | , each time | , from now on | , for ever | , for ten minutes | , for a minute |
, at most | , at least | , not twice | , for Bob, not for me | , Bob | , Alexa | , if Bob agrees | , when Bob is here |
, and Bob the ball | , and the rest yourself | , so that it is on the left | , so that it stands | , to the count of three | , on three |
, at three o'clock | , from tomorrow
"""


def _rows() -> list[tuple[str, str, str, str]]:
    """Return (class, task, sentence, plan) of each row of the page."""
    rows, name, task = [], "", ""
    for line in PAGE.splitlines():
        if head := re.match(r"`(\w+)`: [^`]*(?:In `(\w+)`:)?$", line):
            name, task = head[1], head[2] or "clear_to_bin"
        elif (row := re.match(r"\| (.+?) \| `(.+)` \|", line)) and name:
            rows.append((name, task, row[1], row[2]))
    return rows


@cache
def scene(task: str) -> ObservedScene:
    return sentences.load_scene(bundled_task(task))


@cache
def planner() -> StubPlanner:
    return StubPlanner(load_skills())


def plan_of(sentence: str, task: str = "clear_to_bin") -> Plan | Refusal:
    return planner().plan(sentence, scene(task))


@pytest.mark.parametrize(("name", "task", "sentence", "expected"), _rows())
def test_each_sentence_of_the_page_is_planned_as_it_says(name: str, task: str, sentence: str, expected: str) -> None:
    answer = plan_of(sentence, task)
    if isinstance(answer, Refusal):
        assert f"!{answer.code}" == expected, answer.message
    else:
        calls = [f"{call.skill}({', '.join(map(str, call.arguments.values()))})" for call in answer.steps]
        assert "; ".join(calls) == expected


def test_each_class_of_rules_has_three_sentences() -> None:
    names = [name for name, *_ in _rows()]
    assert len(set(names)) > 15
    assert {name for name in names if names.count(name) != 3} == set()


@pytest.mark.parametrize("sentence", TOLD)
@pytest.mark.parametrize("operator", OPERATORS)
def test_no_operator_is_passed_over(sentence: str, operator: str) -> None:
    plain = plan_of(sentence)
    assert isinstance(plain, Plan)
    chat, dot, order = sentence.rpartition(". ")
    words = order.split()
    for k in range(len(words) + 1):
        answer = plan_of(chat + dot + " ".join((*words[:k], operator, *words[k:])))
        assert isinstance(answer, Refusal) or answer.steps != plain.steps, (k, answer)


@pytest.mark.parametrize("sentence", TOLD)
def test_a_word_that_nobody_knows_moves_nothing(sentence: str) -> None:
    chat, dot, order = sentence.rpartition(". ")
    words = order.split()
    for k in range(len(words) + 1):
        answer = plan_of(chat + dot + " ".join((*words[:k], "brumpf", *words[k:])))
        assert isinstance(answer, Refusal), (k, answer)


@pytest.mark.parametrize(
    "sentence",
    [
        "after lunch, tap the white block",
        "in an hour, tap the white block",
        "tap the white block, while I hold it",
        "tap the white block, or I will",
        "tap the white block. That was a test",
        "the middle one first. Tap the cubes",
    ],
)
def test_when_and_on_what_condition_is_no_chat(sentence: str) -> None:
    assert isinstance(plan_of(sentence), Refusal)


@pytest.mark.parametrize(
    "sentence",
    [
        "pour the green can to the left of the bin",
        "put the red cube behind the white block in the bin",
        "take the orange can to the right",
        "put the cube nearest to the bin",
        "push the cube closest to you two inches",
        "put the ball on the far left",
        "pick up the ball, any cube",
        "tap the red cube and the yellow ball, no ball",
        "tap the yellow ball, not the yellow ball",
        "put the cans and the ball in the bin, but not the ball",
        "line up the cans, but not the green one",
        "do not tap the green can, then the orange can",
        "pls no touch the ball, tap the ball",
        "grab the ball. Actually, never mind the ball, tap the bin",
        "tap the ball, put the can in the bin, scratch that, tap the bar",
        "if you can't reach the ball, tap the green can",
        "only the ball in the bin and the red cube",
        "push the ball on the left and the red cube to the right",
        "the red cube and the ball, tap it",
        "pick up the ball and another 2 cm",
        "pour half of the green can into the bin",
        "put one in the bin and one on the white block",
        "smallest ball, tap the green can",
        "my bar, tap the green can",
        "top down: red cube in the bin",
        "my turn: tap the ball",
        "if the red cube is not near the bin put it there",
        "put the cubes in the bin but not the ball in your dreams",
        "do not tap the cans, tap the green can",
        "Marta, tap the green can",
        "the moment my tea is ready, tap the yellow ball",
        "close the drawer before you put the ball in it",
    ],
)
def test_what_is_contradicted_or_left_open_moves_nothing(sentence: str) -> None:
    answer = plan_of(sentence)
    assert isinstance(answer, Refusal), answer


def test_what_an_act_takes_no_account_of_is_refused() -> None:
    answer = plan_of("line up the cubes from left to right")
    assert isinstance(answer, Refusal) and "takes no account of an order" in answer.message
    assert isinstance(plan_of("line up the cubes"), Plan)


def test_manner_is_told_of_in_the_note() -> None:
    for sentence, word in (("slowly tap the green can", "slowly"), ("give the green can a gentle tap", "gentle")):
        answer = plan_of(sentence)
        assert isinstance(answer, Plan) and f"“{word}”" in answer.note


def test_a_turn_is_read_by_the_words_of_its_skill() -> None:
    answer = plan_of("turn the white block by 90 degrees to the left")
    assert isinstance(answer, Plan)
    assert [str(call) for call in answer.steps] == ["turn(object=white_block, angle=1.570796)"]


@pytest.mark.parametrize(
    ("sentence", "calls"),
    [
        (
            "push the white block 4 cm to the left, make that 2",
            ["push(object=white_block, direction=left, distance=0.02)"],
        ),
        ("tap the orenge can", ["tap(object=orange_can)"]),
        ("tap the closest cube to the yellow ball", ["tap(object=cyan_cube)"]),
        ("of the green can and the white block, tap the taller one", ["tap(object=green_can)"]),
        ("pick up the yellow ball, and don't put it in the bin", ["pick(object=yellow_ball)"]),
        ('I said "tap the green can", and meant the ball', None),
        ("the cans: tap them, except the orange one", ["tap(object=green_can)"]),
    ],
)
def test_what_is_said_is_what_is_done(sentence: str, calls: list[str] | None) -> None:
    answer = plan_of(sentence)
    assert (None if isinstance(answer, Refusal) else [str(call) for call in answer.steps]) == calls


def test_what_could_be_meant_is_asked_and_not_read_farther() -> None:
    cups = scene("pour_beads")
    empty = replace(cups.objects[0], id="empty_cup", pose=Pose(xyz=(0.1, -0.2, 0.04)))
    asked = planner().plan(
        "tap the empty cup, then pour the cup into the bowl",
        replace(cups, objects=(*cups.objects, empty)),
    )
    assert isinstance(asked, Refusal) and asked.code is RefusalCode.AMBIGUOUS, asked


def test_what_was_not_read_is_read_anew_when_a_skill_brings_its_words() -> None:
    class Salute(Skill):
        """Salute."""

        name = "salute"
        words = Words(verbs=("salute smartly",))

        def contract(self) -> Contract:
            return Contract()

        def run(self, ctx: SkillContext) -> SkillResult:
            raise NotImplementedError

    said, seen = "salute smartly", scene("clear_to_bin")
    assert isinstance(StubPlanner(load_skills()).plan(said, seen), Refusal)
    answer = StubPlanner([*load_skills(), Salute()]).plan(said, seen)
    assert isinstance(answer, Plan) and [str(step) for step in answer.steps] == ["salute()"]
    assert isinstance(StubPlanner(load_skills()).plan(said, seen), Refusal)


def test_ways_to_say_something_have_three_costs() -> None:
    book = ruleset("english")
    written = [
        mark for rule in book.written.values() for way in rule.source for mark in re.findall(r"(?<!\S)!+(?!\S)", way)
    ]
    assert {*written} == {"!", "!!", "!!!"}


def _phrases(text: str) -> list[str]:
    return [phrase.strip() for phrase in text.replace("\n", " | ").split("|") if phrase.strip()]


@pytest.mark.parametrize("phrase", _phrases(BEFORE))
def test_what_binds_before_an_order_moves_nothing(phrase: str) -> None:
    answer = plan_of(f"{phrase} tap the green can")
    assert isinstance(answer, Refusal) or not answer.steps, answer


@pytest.mark.parametrize("phrase", _phrases(BEHIND))
def test_what_binds_behind_an_order_moves_nothing(phrase: str) -> None:
    said = f"tap the green can{phrase}" if phrase[0] in ",?" else f"tap the green can {phrase}"
    answer = plan_of(said)
    assert isinstance(answer, Refusal) or not answer.steps, answer
