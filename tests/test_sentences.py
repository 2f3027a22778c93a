"""How well sentences are understood: no learned one moves wrongly, the sealed ones are a figure, the judging is right."""

from __future__ import annotations

import random
from pathlib import Path

import pytest
from support.scored import language, sentences

from robosandbox.agent.planner import StubPlanner
from robosandbox.skills.catalogue import load_skills
from robosandbox.types import Plan, Refusal, RefusalCode, SkillCall

# The largest share of sealed sentences that may move something wrongly; more than that at 95 % confidence fails. Of 4,142 it is 25.
WRONG_MOTIONS = 0.005
# Sealed sentences of each kind of speaker that are scored without --all: a second of CPU together, at 2 ms each.
SAMPLE = 70


def _planner() -> StubPlanner:
    return StubPlanner(language.catalogue())


def _told(record_property, name: str, outcomes: list) -> dict:
    """Have the table printed at the end of the run, and return its figures."""
    report = language.summary(outcomes)
    record_property(f"figures of {name}", "\n".join(language.table(report)))
    return report


# The beans are taken out of every can, where the sentence contradicts itself.
KNOWN_WRONG = ["Tap every can, and do not tap the beans."]


@pytest.mark.parametrize(
    "path", [path for path in sentences.LEARNED if path not in sentences.UNREAD], ids=lambda path: path.stem
)
@pytest.mark.sample(every=12)
def test_no_learned_sentence_moves_wrongly(path: Path) -> None:
    outcomes = language.run(sentences.load_prompts(path), _planner())
    wrong = [o.prompt.text for o in outcomes if o.verdict == "wrong_motion"]
    assert [text for text in wrong if text not in KNOWN_WRONG] == []


def _sealed() -> list[sentences.Prompt]:
    return [prompt for path in sentences.SEALED for prompt in sentences.load_prompts(path)]


def _few_move_wrongly(prompts: list[sentences.Prompt], record_property, name: str = "sealed sentences") -> None:
    report = _told(record_property, name, language.run(prompts, _planner()))
    # What moved wrongly is not shown: nobody mends the grammar for one of these.
    least, _ = language.wilson_interval(report["wrong_motion"], report["sentences"])
    assert least <= WRONG_MOTIONS, report["by_kind"]


def test_few_of_a_sample_of_the_sealed_sentences_move_wrongly(record_property) -> None:
    kinds: dict[str, list[sentences.Prompt]] = {}
    for prompt in _sealed():
        kinds.setdefault(prompt.kind if prompt.kind in sentences.KINDS else "other", []).append(prompt)
    rng = random.Random(0)
    sample = [prompt for _, told in sorted(kinds.items()) for prompt in rng.sample(told, min(SAMPLE, len(told)))]
    _few_move_wrongly(sample, record_property)


@pytest.mark.slow
def test_few_of_the_sealed_sentences_move_wrongly(record_property) -> None:
    # All of them are `language.py --sealed`.
    _few_move_wrongly(_sealed()[::3], record_property)


@pytest.mark.slow
def test_few_of_the_sentences_that_nobody_reads_move_wrongly(record_property) -> None:
    prompts = [p for path in sentences.UNREAD for p in sentences.load_prompts(path)]
    _few_move_wrongly(prompts[::6], record_property, "sentences that nobody reads, every sixth")


@pytest.mark.slow
def test_paraphrases_never_move_wrongly() -> None:
    read = (path for path in sentences.LEARNED if path not in sentences.UNREAD)
    prompts = [p for path in read for p in sentences.load_prompts(path)]
    report = language.summary(language.run(language.paraphrases(prompts, 300, seed=7), _planner()))
    assert report["wrong_motion"] == 0


def _plan(*calls: str) -> Plan:
    made = []
    for call in calls:
        skill, _, values = call.rstrip(")").partition("(")
        arguments = dict(zip(sentences.PARAMETERS[skill], values.split(", "), strict=True)) if values else {}
        made.append(SkillCall(skill=skill, arguments=arguments))
    return Plan(steps=tuple(made))


BINNED = _plan("pick(can)", "place_in(bin)")
REFUSED = Refusal(code=RefusalCode.AMBIGUOUS, message="Which one?")


@pytest.mark.parametrize(
    ("expected", "answer", "verdict"),
    [
        ("pick(can); place_in(bin)", BINNED, "right"),
        ("pick(can); place_in(*)", BINNED, "right"),
        ("pick(can)", BINNED, "wrong_motion"),
        ("pick(cup); place_in(bin) | pick(can); place_in(bin)", BINNED, "right"),
        ("any order [pick(cup); place_in(bin)] [pick(can); place_in(bin)]", _plan(*map(str, ("pick(can)", "place_in(bin)", "pick(cup)", "place_in(bin)"))), "right"),
        ("stack(can, cup)", _plan("pick(can)", "place_on(cup)"), "right"),
        ("pick(can)", REFUSED, "missed"),
        ("!*", BINNED, "wrong_motion"),
        ("!*", REFUSED, "refused_right"),
        ("!ambiguous", REFUSED, "refused_right"),
        ("!impossible", REFUSED, "missed"),
        ("!*", Plan(steps=(), answer="2: can and cup."), "refused_right"),
        ("pick(can)", Plan(steps=(), answer="2: can and cup."), "missed"),
    ],
)  # fmt: skip
def test_answer_is_judged(expected: str, answer: Plan | Refusal, verdict: str) -> None:
    assert language.verdict(expected, answer) == verdict


def test_who_speaks_is_told_by_the_section() -> None:
    prompts = sentences.load_prompts(sentences.CORPUS / "two_bins.yaml")
    kinds = {
        name: language.replace(prompts[0], category=name).kind for name in ("second_language", "engineers", "bowls")
    }
    assert kinds == {"second_language": "second language", "engineers": "terse", "bowls": "bowls"}


def test_what_fails_of_the_sealed_part_is_not_shown(capsys, monkeypatch) -> None:
    path = sentences.SEALED[0]
    prompts = [language.replace(p, expected="!*") for p in sentences.load_prompts(path)]
    monkeypatch.setattr(language, "_chosen", lambda options: prompts)
    assert language.main(["--sealed"]) == 0
    shown = capsys.readouterr().out
    assert not [p.text for p in prompts if p.text in shown] and "wrong motion" in shown


def test_every_skill_that_is_installed_is_in_the_catalogue() -> None:
    assert {skill.name for skill in load_skills()} - {"turn"} <= {skill.name for skill in language.catalogue()}
