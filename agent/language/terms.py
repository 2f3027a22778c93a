"""Tempo of an order, by words and by numbers, and terms that its plan is checked against."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import replace
from itertools import zip_longest

from robosandbox.agent.language.discourse import RefusedError, listed
from robosandbox.agent.language.draft import Draft, Step
from robosandbox.agent.language.front import ENGLISH
from robosandbox.agent.language.intent import Sentence
from robosandbox.agent.language.ruleset import ruleset
from robosandbox.types import SLOWEST, TEMPOS, RefusalCode, SkillCall

# Calls that are one motion, which may last as long as it is told to.
ONE_MOTION = frozenset(
    {
        "move_by",
        "move_to",
        "move_over",
        "move_to_height",
        "move_towards",
        "turn_hand",
        "move_joint",
        "move_to_pose",
        "home",
    }
)
# m/s beyond which no hand of an arm goes.
_FASTEST = 3.0
# What is slower than the careful tempo.
_VERY_SLOWLY = re.compile(r"\b(?:very|really|so|extremely|as)\b.*\bslow(?:ly)?\b|\bslow motion\b", re.IGNORECASE)
# Calls that touch nothing, and those that grip nothing, by what they may be asked to be.
UNTOUCHED = ONE_MOTION | {
    "move_beside",
    "move_through",
    "move_joints",
    "point_at",
    "wait",
    "save_pose",
    "set_tempo",
    "trace",
}
# What is to be held is not let go: here the calls are told that would.
_HELD = "held"
# How a term is told that a plan does not keep, where that is not its name.
_WORDS = {
    "in_place": "with the fingertips in place",
    "fingers_closed": "with closed fingers",
    "level": "at one height",
    "turned": "without a turn of the hand",
    "fingers": "with the fingers as they are",
    "joints": "with the other joints as they are",
    "spot": "over the same spot",
    "others": "with all else as it is",
    "unlifted": "left where it stands",
    "straight": "in a straight line",
    "straight_up": "straight up",
    "straight_down": "straight down",
}
# Skills that close the fingers themselves.
_CLOSES = frozenset({"tap", "push", "push_to", "press_down", "press", "close_gripper"})
# Calls that move no joint but the fingers'.
_STILL = frozenset({"wait", "open_gripper", "close_gripper", "save_pose", "set_tempo"})
# Calls that go, or take a thing, straight.
_LINES = frozenset({"move_by", "move_to_height", "lift"})
_UNGRIPPED = UNTOUCHED | {"push", "push_to", "tap", "press_down", "press", "open_gripper", "close_gripper"}
_SKILLS_OF = {
    "in_place": _STILL | {"turn_hand"},
    "fingers_closed": UNTOUCHED | _CLOSES | {"shake"},
    "untouched": UNTOUCHED | {"open_gripper", "close_gripper", "shake"},
    "ungripped": _UNGRIPPED,
    "level": _STILL | {"turn_hand", "move_by", "trace"},
    "turned": _STILL | {"move_by", "move_to_height", "trace"},
    "fingers": UNTOUCHED | {"shake"},
    "joints": frozenset({"move_joint"}),
    "spot": _STILL | {"turn_hand", "move_to_height", "move_by", "lift"},
    "unlifted": _UNGRIPPED | {"squeeze"},
    "still": _STILL,
    "straight": _STILL | _LINES,
    "straight_up": _STILL | _LINES,
    "straight_down": _STILL | _LINES,
}
# Skills that do what they must not.
_OTHER_THAN = {
    _HELD: frozenset(
        {"place_on", "place_in", "place_at", "place_beside", "drop", "hand_over", "pour", "stack", "put_over", "insert"}
    ),
    "others": frozenset[str](),
}
# Skills by which the fingers are open, and shut, when they were the last.
_ENDS = {"ends_open": "open_gripper", "ends_shut": "close_gripper"}
_TERMS = frozenset({*_SKILLS_OF, *_OTHER_THAN, *_ENDS})


def _keeps(call: SkillCall, term: str) -> bool:
    """Say whether a call keeps a term."""
    if term in _OTHER_THAN:
        return call.skill not in _OTHER_THAN[term]
    dx, dy, dz = (float(call.arguments.get(name, 0.0)) for name in ("dx", "dy", "dz"))
    if call.skill == "move_by" and term == "level":
        return dz == 0.0
    if call.skill == "trace" and term == "level":
        return str(call.arguments.get("plane", "level")) == "level"
    if call.skill == "move_by" and term == "spot":
        return dx == dy == 0.0
    if call.skill == "move_by" and term in ("straight_up", "straight_down"):
        return dx == dy == 0.0 and (dz > 0.0) is (term == "straight_up")
    return call.skill in _SKILLS_OF[term]


def _gripped(draft: Draft, skills: Sequence[str], *, lifted: bool) -> Draft:
    """Return a draft in which what is gripped with a force is so from the start: where it stands, before it is picked up or in place of that."""
    if "squeeze" not in skills:
        return draft
    steps: list[Step] = []
    for step, then in zip_longest(draft.steps, draft.steps[1:]):
        call, last = step.call, steps[-1].call if steps else None
        told = then.call.arguments if then is not None and then.call.skill == "close_gripper" else {}
        force = {"force": told["force"]} if "held" in told and "force" in told else {}
        if call.skill == "pick" and (force or not lifted):
            steps.append(Step(SkillCall(skill="squeeze", arguments={**call.arguments, **force, "keep": True})))
        if lifted or not (call.skill == "pick" or (call.skill == "close_gripper" and last and last.skill == "squeeze")):
            steps.append(step)
    return replace(draft, steps=tuple(steps))


def done_as_told(reading: Sentence, draft: Draft, skills: Sequence[str]) -> Draft:
    """Return the draft of a reading with the tempo that it was told, and notes of what it takes account of and what not.

    Raises:
        RefusedError: It was told two tempos in numbers, or what it cannot keep.
    """
    standing = [words for words in reading.manners if is_of(words, "FROM_NOW_ON")]
    if standing and "set_tempo" not in {call.skill for call in draft.calls}:
        told = f"I do what is asked of me once; “{standing[0]}” I keep a pace alone."
        raise RefusedError(RefusalCode.UNSUPPORTED, told)
    turned = any(call.skill == "turn_hand" for call in draft.calls)
    manners = [words for words in reading.manners if words not in standing]
    # Clockwise is seen from above.
    tempo, told = _tempo_of([words for words in manners if not (turned and words == "from above")], skills)
    terms = [term for term in reading.terms if term in _TERMS]
    draft = _gripped(draft, skills, lifted="unlifted" not in terms)
    _check_terms(terms, draft)
    if (
        "fingers_closed" in terms
        and "close_gripper" in skills
        and not any(call.skill in _CLOSES for call in draft.calls)
    ):
        draft = replace(draft, steps=(Step(SkillCall(skill="close_gripper", arguments={})), *draft.steps))
    if len(reading.terms) > len(terms):
        tempo, told = _timed([each for each in reading.terms if each not in terms], draft, skills)
    notes = [told] if told else []
    if reading.asides:
        notes.append(f"I take no account of {listed([f'“{aside}”' for aside in reading.asides])}.")
    return replace(draft, note=" ".join(notes), tempo=tempo)


def is_of(words: str, name: str) -> bool:
    """Say whether words are a form of a class of English."""
    vocabulary = ruleset(ENGLISH).vocabulary
    return vocabulary.is_form(vocabulary.folded(words), name)


def paced(reading: Sentence) -> Sentence | None:
    """Return a reading with the pace that its words of manner say, as in "work at half speed"; None where it lacks one."""
    unsaid = [step for step in reading.steps if step.words and step.words.pace and not step.slots]
    if not unsaid:
        return reading
    said = [words for words in reading.manners if not is_of(words, "FROM_NOW_ON")]
    numbers = [tempo for tempo in reading.terms if tempo not in _TERMS]
    tempo = numbers[0] if numbers else _tempo_of(said, ("set_tempo",))[0]
    if not tempo or len(unsaid) > 1:
        return None
    step = unsaid[0]
    paced = step._replace(slots=((step.words.pace, tempo),)) if step.words else step
    steps = tuple(paced if one is step else one for one in reading.steps)
    terms = tuple(each for each in reading.terms if each != tempo)
    manners = tuple(words for words in reading.manners if numbers or words not in said)
    return replace(reading, steps=steps, manners=manners, terms=terms)


def _tempo_of(manners: Sequence[str], names: Sequence[str]) -> tuple[str, str]:
    """Return the tempo that words of speed and care ask for, "" for none, and a note of what comes of them.

    Args:
        manners: As they were said.
        names: Of the skills; where none sets the tempo, it stays as it is.
    """
    if not manners:
        return "", ""
    tempos = ruleset(ENGLISH).vocabulary.classes["TEMPO"]
    # "not too fast" has a word of each: careful comes first.
    asked = {
        words: tempo
        for words in manners
        for tempo in reversed(tempos)
        if not {*tempos[tempo]}.isdisjoint(_told_by(words.lower().split()))
    }
    others = [words for words in manners if words not in asked]
    if "set_tempo" not in names or len({*asked.values()}) != 1:
        asked, others = {}, [*manners]
    if any(_VERY_SLOWLY.search(words) for words in asked):
        asked = dict.fromkeys(asked, SLOWEST)
    notes = [
        f"{f'At {tempo} at most' if tempo == SLOWEST else f'At the {tempo} tempo'}: {listed([f'“{words}”' for words in asked])}."
        for tempo in {*asked.values()}
    ]
    if others:
        usual = "" if asked else ": I go at my usual speed"
        notes.append(f"No skill takes {listed([f'“{words}”' for words in others])}{usual}.")
    return next(iter(asked.values()), ""), " ".join(notes)


def _told_by(words: Sequence[str]) -> Sequence[str]:
    """Return which of some words of speed and care tell the tempo: "as fast as you safely can" is fast."""
    return words[1:2] if words[:1] == ["as"] and "as" in words[2:] else words


def _timed(tempos: Sequence[str], draft: Draft, skills: Sequence[str]) -> tuple[str, str]:
    """Return the tempo that a plan was told in numbers, or by what must not happen, and a note of it.

    Raises:
        RefusedError: It was told two, or one that it cannot keep.
    """
    told = [tempo for tempo in tempos if tempo not in TEMPOS] or [*tempos]
    if len(told) > 1:
        raise RefusedError(RefusalCode.AMBIGUOUS, f"At {listed(told, 'or')}?", told)
    if "set_tempo" not in skills:
        raise RefusedError(RefusalCode.UNSUPPORTED, "This needs 'set_tempo', which this robot has no skill for.")
    (tempo,) = told
    lasts = tempo.endswith(" s")
    if lasts and (len(draft.calls) != 1 or draft.calls[0].skill not in ONE_MOTION):
        raise RefusedError(RefusalCode.UNSUPPORTED, "I can say how long one motion of the hand takes, and not this.")
    if lasts:
        return tempo, f"The motion lasts {tempo} or longer."
    if tempo in TEMPOS:
        return tempo, f"At the {tempo} tempo; what comes of it is not checked."
    if tempo.endswith(" %"):
        return tempo, f"At {tempo} of the usual speed; where it touches things, slower."
    if float(tempo.removesuffix(" m/s")) > _FASTEST:
        raise RefusedError(
            RefusalCode.IMPOSSIBLE, f"The fastest of arms go at some {_FASTEST:g} m/s, and not at {tempo}.", firm=True
        )
    return tempo, f"The hand goes at {tempo} at most; where it touches things, slower."


def _check_terms(terms: Sequence[str], draft: Draft) -> None:
    """Refuse a plan that does what it was told not to do on the way.

    Raises:
        RefusedError: A call of it touches, or grips, things.
    """
    for term in terms:
        if term in _ENDS:
            last = next((call for call in reversed(draft.calls) if call.skill in _ENDS.values()), None)
            if last is None or last.skill != _ENDS[term]:
                told = f"the fingers {term.replace('ends_', '')} in the end"
                raise RefusedError(RefusalCode.IMPOSSIBLE, f"You asked for {told}, and they would not be.", firm=True)
            continue
        other = next((call for call in draft.calls if not _keeps(call, term)), None)
        if other is not None:
            raise RefusedError(
                RefusalCode.IMPOSSIBLE,
                f"You asked for it {_WORDS.get(term, term)}, and {other} would not be.",
                firm=True,
            )
