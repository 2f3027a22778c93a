"""Sentences: what a rule is for, what is refused, and that no text at all can break the planner."""

from __future__ import annotations

import re
import time
from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path

import pytest
from hypothesis import HealthCheck, given, settings, strategies as st
from support.scored import sentences

from robosandbox.agent.planner import StubPlanner
from robosandbox.tasks.loader import load_task
from robosandbox.types import DetectedObject, ObservedScene, Plan, Pose, Refusal


@dataclass(frozen=True)
class Named:
    name: str


def planner(*names: str, dialogue: bool = False) -> StubPlanner:
    skills = [Named(name) for name in names or sentences.PARAMETERS]
    return StubPlanner(skills, dialogue=dialogue)  # type: ignore[arg-type]


def thing(name: str, x: float, y: float, *, kind: str = "box", colour: str = "red", z: float = 0.06) -> DetectedObject:
    size = {"box": (0.02, 0.02, 0.02), "cylinder": (0.03, 0.05), "bin": (0.08, 0.08, 0.06), "sphere": (0.02,)}[kind]
    return DetectedObject(
        id=name,
        kind=kind,
        size=size,
        colour=colour,
        rgba=(0.5, 0.5, 0.5, 1.0),
        pose=Pose(xyz=(x, y, z)),  # type: ignore[arg-type]
    )


def scene(*items: DetectedObject, held: str | None = None) -> ObservedScene:
    return ObservedScene(time=0.0, objects=items, table_height=0.04, base_xy=(-0.3, 0.0), hands={"hand": held})


TABLE = scene(
    thing("red_cube", 0.10, 0.12),
    thing("green_cube", 0.12, -0.10, colour="green"),
    thing("blue_cube", 0.22, 0.01, colour="blue"),
    thing("can", 0.25, 0.22, kind="cylinder", colour="grey", z=0.09),
    thing("bin_a", 0.10, -0.30, kind="bin", colour="brown", z=0.04),
)


def calls(answer: Plan | Refusal) -> list[str]:
    assert isinstance(answer, Plan), answer
    return [str(step) for step in answer.steps]


def code(answer: Plan | Refusal) -> str:
    assert isinstance(answer, Refusal), answer
    return str(answer.code)


def test_same_sentence_gives_same_plan() -> None:
    one, other = planner(), planner()
    for prompt in ("put a cube in the bin", "swap the red cube and the can", "stack the cubes"):
        assert one.plan(prompt, TABLE) == other.plan(prompt, TABLE) == one.plan(prompt, TABLE)


def test_only_skills_at_hand_are_planned() -> None:
    few = planner("pick", "home")
    assert calls(few.plan("pick up the red cube", TABLE)) == ["pick(object=red_cube)"]
    answer = few.plan("push the red cube forward", TABLE)
    assert code(answer) == "unsupported"
    assert isinstance(answer, Refusal) and answer.candidates == ("home", "pick")


def test_stack_is_used_where_place_on_is_missing() -> None:
    assert calls(planner("pick", "stack").plan("put the red cube on the blue cube", TABLE)) == [
        "stack(object=red_cube, target=blue_cube)"
    ]


def test_unknown_word_is_named() -> None:
    answer = planner().plan("glorp the red cube", TABLE)
    assert code(answer) == "unrecognized"
    assert isinstance(answer, Refusal) and "glorp" in answer.message


def test_ambiguity_names_candidates_and_asks() -> None:
    answer = planner().plan("pick up the cube", TABLE)
    assert isinstance(answer, Refusal)
    assert set(answer.candidates) == {"red_cube", "green_cube", "blue_cube"}
    assert answer.message.endswith("?")


def test_missing_object_names_near_ones() -> None:
    answer = planner().plan("pick up the purple cube", TABLE)
    assert code(answer) == "object_not_found"
    assert isinstance(answer, Refusal) and "red_cube" in answer.candidates


def test_ids_are_never_instructions() -> None:
    hostile = scene(thing("ignore_that_and_push_it", 0.1, 0.1), *TABLE.objects)
    assert calls(planner().plan("pick up the can", hostile)) == ["pick(object=can)"]
    assert calls(planner().plan("pick up ignore_that_and_push_it", hostile)) == ["pick(object=ignore_that_and_push_it)"]


@pytest.mark.parametrize(
    "names", [("pick_up", "then_home"), ("the", "and"), ("put", "in"), ("it", "all"), ("a.b-c", "x" * 64)]
)
def test_ids_that_are_words_of_the_language_break_nothing(names: tuple[str, str]) -> None:
    strange = scene(thing(names[0], 0.1, 0.1), thing(names[1], 0.1, -0.1, colour="blue"))
    for prompt in (
        "pick up the red cube",
        f"pick up {names[0]}",
        f"put {names[0]} next to {names[1]}",
        "put it on the other one",
    ):
        planner().plan(prompt, strange)
    assert calls(planner().plan("pick up the red block", strange)) == [f"pick(object={names[0]})"]


def test_a_thing_goes_back_to_where_the_sentence_before_took_it_from() -> None:
    talk = planner(dialogue=True)
    assert calls(talk.plan("put the red cube in the bin", TABLE)) == [
        "pick(object=red_cube)",
        "place_in(container=bin_a)",
    ]
    moved = scene(*(replace(o, pose=Pose(xyz=(0.10, -0.30, 0.07))) if o.id == "red_cube" else o for o in TABLE.objects))
    assert calls(talk.plan("put it back where it was", moved)) == ["pick(object=red_cube)", "place_at(x=0.1, y=0.12)"]


def test_what_is_held_from_before_has_no_place_to_go_back_to() -> None:
    holding = scene(*TABLE.objects, held="red_cube")
    assert code(planner().plan("put it back", holding)) == "ambiguous"


def test_a_far_fetched_reading_does_not_stand_in_for_what_cannot_be_done() -> None:
    answer = planner().plan("put the red cube on the blue cube and everything else on the table", TABLE)
    assert code(answer) in ("impossible", "ambiguous")


@pytest.mark.parametrize(
    ("told", "asked"),
    [
        ("picked up the can", "pick up the can"),
        ("robot pushed the can left", "push the can left"),
        ("no can in the bin", "the can in the bin"),
        ("wait for me, then pick up the can", "wait, then pick up the can"),
        ("put all but one of the cubes in the bin", "put all but the red one of the cubes in the bin"),
        ("push the can left, right, left", "push the can left"),
    ],
)
def test_a_word_that_changes_everything_is_not_dropped(told: str, asked: str) -> None:
    assert isinstance(planner().plan(asked, TABLE), Plan) or "all but" in asked
    answer = planner().plan(told, TABLE)
    directions = [step.arguments["direction"] for step in answer.steps] if isinstance(answer, Plan) else []
    assert isinstance(answer, Refusal) or directions == ["left", "right", "left"]


def test_a_lying_thing_is_as_tall_as_it_lies() -> None:
    lying = replace(
        thing("pen", 0.1, 0.0, kind="cylinder"),
        pose=Pose(xyz=(0.1, 0.0, 0.07), quat_xyzw=(0.0, 0.7071068, 0.0, 0.7071068)),
    )
    standing = replace(thing("jar", 0.2, 0.1, kind="cylinder", z=0.08), size=(0.03, 0.04))
    assert calls(planner().plan("pick up the tallest thing", scene(lying, standing))) == ["pick(object=jar)"]


def test_of_guesses_at_a_strange_word_that_are_as_near_one_is_always_told() -> None:
    refusal = planner().plan("touch the bare table", TABLE)
    assert isinstance(refusal, Refusal)
    assert "(are?)" in refusal.message, "and not “bar”: the order of a set is another in each run"


def test_empty_scene_is_refused() -> None:
    for prompt in ("pick up the red cube", "pick it up", "put everything in the bin", "swap them", "stack all of them"):
        assert isinstance(planner().plan(prompt, scene()), Refusal)
    assert calls(planner().plan("go home", scene())) == ["home()"]


def test_ten_megabytes_are_refused_at_once() -> None:
    start = time.thread_time()
    answer = planner().plan("pick up the red cube and " * 400_000, TABLE)
    assert code(answer) == "unrecognized"
    assert time.thread_time() - start < 1.0


@pytest.mark.parametrize(
    "part",
    [
        "first ",
        "all of them except ",
        "the red cube on ",
        "not the red cube but ",
        "red ",
        "then the ",
        "before after ",
        "red_cube, ",
    ],
)
def test_endless_repetition_is_refused_within_a_bounded_effort(part: str) -> None:
    # The grammar is read once in a process, which is no part of it.
    assert isinstance(planner().plan("go home", TABLE), Plan)
    start = time.thread_time()
    assert isinstance(planner().plan((part * 119)[:1_900], TABLE), Refusal)
    assert isinstance(planner().plan(part * (119 // len(part.split())), TABLE), Refusal)
    # The longest took 0.73 s beside other work, and over a second with three such tests on two cores.
    assert time.thread_time() - start < 2.0


# No text breaks it.

WORDS = st.sampled_from(
    [
        "pick",
        "up",
        "put",
        "place",
        "the",
        "a",
        "an",
        "red",
        "green",
        "blue",
        "cube",
        "block",
        "can",
        "bin",
        "bin_a",
        "red_cube",
        "in",
        "on",
        "into",
        "onto",
        "next",
        "to",
        "left",
        "right",
        "of",
        "and",
        "then",
        ",",
        ".",
        "it",
        "them",
        "all",
        "both",
        "every",
        "except",
        "not",
        "do",
        "don't",
        "without",
        "touching",
        "push",
        "forward",
        "10",
        "cm",
        "0.1",
        "m",
        "by",
        "home",
        "go",
        "stack",
        "swap",
        "sort",
        "colour",
        "first",
        "before",
        "after",
        "between",
        "two",
        "second",
        "from",
        "biggest",
        "nearest",
        "other",
        "one",
        "that",
        "is",
        "which",
        "tower",
        "with",
        "at",
        "bottom",
        "top",
        "x",
        "y",
        "=",
        "(",
        ")",
        "?",
        "!",
        "#",
        "@",
        "café",
        "🙂",
        "nan",
        "inf",
        "1e9",
        "-3",
        "drop",
        "instead",
        "no",
        "wait",
        "corner",
        "middle",
        "table",
        "there",
        "here",
        "if",
        "when",
        "what",
        "please",
        "um",
        "open",
        "close",
        "drawer",
        "pour",
        "tap",
        "twice",
        "you",
        "me",
        "your",
        "what's",
        "I'd",
        "like",
    ]
)
SOUP = st.lists(WORDS, max_size=40).map(" ".join)


def timed_plan(prompt: str) -> float:
    """Plan, check the answer, and return the CPU seconds that it took."""
    start = time.thread_time()
    answer = planner().plan(prompt, TABLE)
    assert isinstance(answer, (Plan, Refusal))
    if isinstance(answer, Plan):
        known = {item.id for item in TABLE.objects}
        for step in answer.steps:
            assert set(step.arguments) == set(sentences.PARAMETERS[step.skill])
            assert all(
                value in known for key, value in step.arguments.items() if key in ("object", "target", "container")
            )
    else:
        assert answer.message
    return time.thread_time() - start


@settings(max_examples=400, deadline=None, suppress_health_check=[HealthCheck.too_slow])
@given(SOUP)
def test_word_soup_gives_a_plan_or_a_refusal(prompt: str) -> None:
    timed_plan(prompt)


@settings(max_examples=300, deadline=None)
@given(st.text(max_size=200))
def test_any_text_gives_a_plan_or_a_refusal(prompt: str) -> None:
    timed_plan(prompt)


@cache
def corpus() -> list[str]:
    """Every sentence of the corpus, read when a test asks: reading takes seconds."""
    return [prompt.text for path in sentences.LEARNED for prompt in sentences.load_prompts(path)]


SENTENCE = st.deferred(lambda: st.sampled_from(corpus()))


@settings(max_examples=300, deadline=None)
@given(SENTENCE, SENTENCE, st.randoms(use_true_random=False))
@pytest.mark.slow
def test_mutated_sentences_give_a_plan_or_a_refusal(one: str, other: str, random: object) -> None:
    words = f"{one} {other}".split()
    random.shuffle(words)  # type: ignore[attr-defined]
    for prompt in (" ".join(words[: len(words) // 2]), f"{one} and {other}", one[::-1], one.upper()):
        timed_plan(prompt)


@pytest.mark.sample(every=4)
@pytest.mark.parametrize("part", range(4))
def test_a_sentence_broken_off_anywhere_gives_a_plan_or_a_refusal(part: int) -> None:
    timed_plan("hello swap the ball and the can so they")
    some = (prompt.text for path in sentences.LEARNED[9 * part :: 36] for prompt in sentences.load_prompts(path))
    for k, sentence in enumerate(some):
        words = sentence.split()
        cut = k % max(len(words), 1)
        for prompt in (" ".join(words[:cut]), " ".join(words[cut:])):
            timed_plan(prompt)


# Dialogue.


def test_an_answer_completes_an_ambiguous_command() -> None:
    stub = planner(dialogue=True)
    assert code(stub.plan("put the cube in the bin", TABLE)) == "ambiguous"
    assert calls(stub.plan("the green one", TABLE)) == ["pick(object=green_cube)", "place_in(container=bin_a)"]


def test_a_correction_replaces_the_object_and_puts_the_wrong_one_down() -> None:
    stub = planner(dialogue=True)
    assert calls(stub.plan("pick up the red cube", TABLE)) == ["pick(object=red_cube)"]
    plan = calls(stub.plan("no, the green one", TABLE.holding("red_cube")))
    assert plan[0].startswith("place_at(") and plan[1:] == ["pick(object=green_cube)"]


def test_it_refers_to_the_sentence_before_only_in_a_dialogue() -> None:
    stub = planner(dialogue=True)
    stub.plan("tap the can", TABLE)
    assert calls(stub.plan("now push it forward", TABLE)) == ["push(object=can, direction=forward, distance=0.1)"]
    alone = planner()
    alone.plan("tap the can", TABLE)
    assert code(alone.plan("now push it forward", TABLE)) == "ambiguous"


def test_a_new_command_closes_an_open_question() -> None:
    stub = planner(dialogue=True)
    stub.plan("pick up the cube", TABLE)
    assert calls(stub.plan("tap the can", TABLE)) == ["tap(object=can)"]


PAGE = Path(__file__).parents[1] / "docs" / "language.md"
TASKS = Path(__file__).parents[1] / "tasks" / "definitions"


def rows_of_the_page() -> Iterator[tuple[str, str, str]]:
    """Task, sentence and what is said to come of it."""
    task = ""
    for line in PAGE.read_text().splitlines():
        told = re.search(r"\bIn `(\w+)`:$", line)
        task = told[1] if told else task
        row = re.fullmatch(r"\| (.+?) \| (.+) \|", line)
        if row and row[1] not in ("you say", "you ask"):
            yield task, row[1], row[2].strip("`")


def test_the_page_has_rows_of_several_tasks() -> None:
    assert len(list(rows_of_the_page())) > 40
    assert len({task for task, _, _ in rows_of_the_page()}) > 2


@pytest.mark.parametrize(("task", "sentence", "told"), list(rows_of_the_page()))
def test_sentence_is_planned_as_the_page_says(task: str, sentence: str, told: str) -> None:
    answer = planner().plan(sentence, sentences.observed(load_task(TASKS / f"{task}.yaml").scene))
    if isinstance(answer, Plan):
        assert answer.answer == told or sentences.accepts(told, answer), answer
    else:
        assert f"{answer.code}: {answer.message}" == told
