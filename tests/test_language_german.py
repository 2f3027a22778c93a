"""German as data: how well it is understood, that each word counts, and that its files say nothing that English has not."""

from __future__ import annotations

import itertools
from functools import cache
from pathlib import Path

import pytest
from support.scored import language, sentences

from robosandbox.agent.language.front import ENGLISH, language_of
from robosandbox.agent.language.match import CANONICAL_COLOUR, NOUN_CLASS
from robosandbox.agent.language.ruleset import BUILT_IN, Ruleset, bring, ruleset
from robosandbox.agent.language.things import POSITIONS, SIZES
from robosandbox.agent.language.vocabulary import LexiconError
from robosandbox.agent.planner import StubPlanner
from robosandbox.apps.cli import app
from robosandbox.apps.commands.console import run_app
from robosandbox.skills.catalogue import load_skills
from robosandbox.tasks.bundled import bundled_task
from robosandbox.types import Plan, Refusal

FILES = tuple(sorted((Path(__file__).parent / "prompts" / "german").glob("*.yaml")))
# Share of the sentences of each section that has to be right: those written before the rules, and those written after.
RIGHT = 0.9
# Largest share of all sentences that may move something wrongly.
WRONG = 0.01


@cache
def planner() -> StubPlanner:
    return StubPlanner(load_skills())


@cache
def outcomes() -> list[language.Outcome]:
    return language.run([prompt for path in FILES for prompt in sentences.load_prompts(path)], planner())


def said(text: str, task: str = "clear_to_bin") -> str:
    answer = planner().plan(text, sentences.load_scene(bundled_task(task)))
    if isinstance(answer, Refusal):
        return f"{answer.code}: {answer.message}"
    return "; ".join(map(str, answer.steps))


def test_german_sentences_are_understood(record_property) -> None:
    record_property("figures of German", "\n".join(language.table(language.summary(outcomes()))))
    for section in ("first", "held_back", "fresh", "core"):
        own = [o for o in outcomes() if o.prompt.category == section]
        right = [o for o in own if o.verdict in ("right", "refused_right")]
        assert len(own) == 60
        assert len(right) >= RIGHT * len(own), [o.prompt.text for o in own if o not in right]


def test_few_german_sentences_move_wrongly() -> None:
    wrong = [o.prompt.text for o in outcomes() if o.verdict == "wrong_motion"]
    assert len(wrong) <= WRONG * len(outcomes()), wrong


def test_a_word_that_no_rule_accounts_for_moves_nothing() -> None:
    strange = itertools.cycle(["vielleicht", "kaum", "nochmal", "später", "nie"])
    for outcome in outcomes():
        if outcome.verdict != "right" or outcome.prompt.category != "first":
            continue
        words = outcome.prompt.text.split()
        for k in range(len(words) + 1):
            text = " ".join((*words[:k], next(strange), *words[k:]))
            answer = planner().plan(text, outcome.prompt.scene)
            assert isinstance(answer, Refusal), text


def test_umlauts_may_be_written_with_an_e() -> None:
    letters = str.maketrans({"ä": "ae", "ö": "oe", "ü": "ue", "ß": "ss", "Ä": "Ae", "Ö": "Oe", "Ü": "Ue"})
    for outcome in outcomes():
        if outcome.verdict == "right":
            text = outcome.prompt.text.translate(letters)
            assert planner().plan(text, outcome.prompt.scene) == outcome.answer, text


def test_a_pronoun_stands_for_what_agrees_with_it() -> None:
    beside = "pick(object=green_can); place_beside(target=red_cube, side=front)"
    put = "pick(object=yellow_ball); place_in(container=grey_bin)"
    assert said("Leg den Ball in die Kiste und tipp ihn an.") == f"{put}; tap(object=yellow_ball)"
    assert said("Leg den Ball in die Kiste und tipp sie an.") == f"{put}; tap(object=grey_bin)"
    assert said("Stell die grüne Dose neben den roten Würfel und tipp ihn an.") == f"{beside}; tap(object=red_cube)"
    assert said("Nimm die grüne Dose und leg ihn in die Kiste.").startswith("ambiguous: Worauf bezieht sich „ihn“?")


def test_what_is_forbidden_is_left_alone() -> None:
    assert said("Leg den Ball in die Kiste, aber berühr die Kiste nicht.").startswith("impossible")
    assert said("Heb den Ball nicht auf.").startswith("unsupported")
    assert said("Leg den Ball nicht in die Kiste.").startswith("unrecognized")


def test_a_case_says_where_from_and_where_to() -> None:
    assert said("Nimm die Dose neben der Kiste.") == "pick(object=orange_can)"
    assert "place_beside(target=grey_bin" in said("Stell die orange Dose neben die Kiste.")
    assert said("Nimm die orange Dose neben die Kiste.").startswith("unrecognized")


def test_a_question_is_answered_in_german() -> None:
    scene = sentences.load_scene(bundled_task("clear_to_bin"))
    talking = StubPlanner(load_skills(), dialogue=True)
    asked = talking.plan("Leg den Würfel in die Kiste.", scene)
    assert isinstance(asked, Refusal)
    assert asked.message.startswith("Was ist mit „den Würfel“ gemeint")
    answered = talking.plan("Den blauen.", scene)
    assert isinstance(answered, Plan)
    assert [str(step) for step in answered.steps] == ["pick(object=blue_cube)", "place_in(container=grey_bin)"]
    again = talking.plan("Tipp ihn an.", scene)
    assert isinstance(again, Plan)
    assert [str(step) for step in again.steps] == ["tap(object=blue_cube)"]


def test_refusals_are_in_german_and_name_the_word() -> None:
    assert "vielleicht" in said("Leg den Ball vielleicht in die Kiste.")
    assert said("Heb den Würfel auf.") == (
        "ambiguous: Was ist mit „den Würfel“ gemeint: red_cube, blue_cube oder cyan_cube?"
    )
    assert said("Wo ist der Ball?").startswith("unsupported: Fragen beantworte ich nur auf Englisch")


def test_no_sign_is_an_english_word() -> None:
    signs = ruleset("german").vocabulary.signs
    assert signs
    # "Put it in the bin, bitte", "lass" for a girl: such a sentence has more words of English.
    assert signs & ruleset(ENGLISH).known == {"bitte", "lass"}


@pytest.mark.parametrize("path", sentences.LEARNED[::10], ids=lambda path: path.stem)
def test_english_is_not_taken_for_german(path: Path) -> None:
    taken = [p.text for p in sentences.load_prompts(path) if language_of(p.text) != ENGLISH]
    assert taken == []


def test_german_is_taken_for_german() -> None:
    assert {language_of(outcome.prompt.text) for outcome in outcomes()} == {"german"}


def test_every_rule_and_class_is_used() -> None:
    book = ruleset("german")
    used = {
        "sentence",
        "reply",
        "COURTESY",
        "IN_TURN",
        "AT_FIRST",
        "QUESTION",
        *BUILT_IN,
        *(name for pair in book.vocabulary.joins for name in pair),
    }
    while True:
        more = {ref for name in used & {*book.written} for ref in book.names(name)} - used
        if not more:
            break
        used |= more
    assert {*book.written, *book.vocabulary.classes} - used == set()


def test_meanings_are_those_of_english() -> None:
    classes, english = ruleset("german").vocabulary.classes, ruleset(ENGLISH).vocabulary.classes
    assert {*classes["NOUN"]} <= {*NOUN_CLASS, "bar"}
    assert {*classes["COLOUR"], *classes["PLAIN_COLOUR"]} <= {*CANONICAL_COLOUR}
    assert {*classes["UNIT"]} <= {*english["UNIT"]}
    assert {*classes["AMOUNT"]} <= {*english["AMOUNT"]}
    assert {*classes["SIZE"]} <= {*SIZES}
    assert {*classes["POSITION"]} <= {*POSITIONS}
    assert {*classes["MOST"], *classes["FROM_SIDE"], *classes["AT_END"]} <= {*english["SUPER"]}
    assert {*classes["TWOWAY"], *classes["SIDEWAYS"], *classes["ASIDE"], *classes["THEREON"]} <= {*english["REL"]}
    assert {*classes["DIRECTION"]} <= {*english["DIR"]}


def test_a_skill_brings_its_own_words() -> None:
    bring("wave", {"german": "WAVE\n  wave = verb wink\norder : Command\n  = verb=home WAVE.imp YOU*\n"})
    try:
        assert said("Wink bitte und tipp den Ball an.") == "home(); tap(object=yellow_ball)"
    finally:
        bring("wave", {"german": ""})


def test_a_mistake_in_a_file_is_told_with_its_line() -> None:
    with pytest.raises(LexiconError, match=r"a\.rules, line 2: '= nonsense\.nom'"):
        Ruleset({"a.rules": "sentence : Sentence\n  = nonsense.nom"})
    with pytest.raises(LexiconError, match="sentence names nonsense"):
        Ruleset({"a.rules": "sentence : Sentence\n  = nonsense"})
    with pytest.raises(LexiconError, match="no line begins with"):
        Ruleset({"a.lexicon": "  cube = der Würfel"})


def test_a_command_lists_rules_and_words(capsys: pytest.CaptureFixture[str]) -> None:
    assert run_app(app, "robo-sandbox", ["grammar", "german"]) == 0
    text = capsys.readouterr().out
    assert "sentence : Sentence" in text
    assert "cube = der Würfel" in text
    assert run_app(app, "robo-sandbox", ["grammar", "klingon"]) == 2
    assert "there is english, german" in capsys.readouterr().err


def test_plans_name_installed_skills_alone() -> None:
    names = {skill.name for skill in load_skills()}
    assert {step.skill for o in outcomes() if isinstance(o.answer, Plan) for step in o.answer.steps} <= names
