"""One sentence and one scene: a draft of a plan, or a refusal."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Mapping, Sequence
from copy import deepcopy
from dataclasses import replace

from robosandbox.agent.language.build import build
from robosandbox.agent.language.discourse import AlreadySoError, Discourse, RefusedError, listed
from robosandbox.agent.language.draft import Draft
from robosandbox.agent.language.front import (
    ENGLISH,
    Readings,
    language_of,
    questions_in,
    read_in,
    says_in_turn,
    told_in,
)
from robosandbox.agent.language.intent import Sentence, unseen
from robosandbox.agent.language.offers import with_offer
from robosandbox.agent.language.repeated import several_times, to_and_fro
from robosandbox.agent.language.ruleset import ruleset
from robosandbox.agent.language.wordlist import word_set
from robosandbox.types import TEMPOS, ObservedScene, Refusal, RefusalCode

# Costs of readings that differ by no more are of equal right; one whose thing is not there is replaced by none that costs more.
CLOSE = 0.35
# Characters of a prompt that is read in parts as well: longer ones are no commands.
_MOST_READ_IN_PARTS = 500
_ON_THE_WAY = word_set(
    """
    then after afterwards before first next finally later again back once lastly last second followed subsequently until
    when over swap exchange trade switch . ; :
    """
)
_NEVERTHELESS = frozenset({"back", ".", ";", ":"})
_AT_HOME = frozenset({"live", "lives", "belong", "belongs"})
_WHERE_IT_GOES = re.compile(r"[.;:] (?:but |and |oh,? |well,? )?(?:the|my|our|that) [^.;:]*\b(?:goes|go|belongs?)\b")
_STAYS_OPEN = re.compile(
    r"[.,;!] (?!.*\b(?:not|never|without)\b)(?!.*n't)[^.,;!]*\b(?:stays?|remains?|leave|keep|left|kept)\b[^.,;!]*\bopen\b[^.,;!]*$"
)
# Calls that are one motion, which may last as long as it is told to.
_ONE_MOTION = frozenset(
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
# What is slower than the careful tempo, and how fast the hand goes then, at most. Chosen.
_VERY_SLOWLY = re.compile(r"\b(?:very|really|so|extremely|as)\b.*\bslow(?:ly)?\b|\bslow motion\b", re.IGNORECASE)
_SLOWEST = "0.05 m/s"
# Calls that touch nothing, and those that grip nothing, by what they may be asked to be.
_UNTOUCHED = _ONE_MOTION | {
    "move_beside",
    "move_through",
    "move_joints",
    "point_at",
    "wait",
    "save_pose",
    "set_tempo",
    "trace",
}
# What may be asked behind an order: what is told of the hand and of single things, and not how many are "left".
_ASKED_AFTERWARDS = frozenset(
    {
        "what",
        "where",
        "far",
        "from_hand",
        "hand",
        "grip",
        "joints",
        "pointing",
        "which",
        "weight",
        "squeezing",
        "whether",
        "pace",
    }
)
# What is to be held is not let go: here the calls are told that would.
_HELD = "held"
_TERMS = {
    "untouched": _UNTOUCHED | {"open_gripper", "close_gripper", "shake"},
    _HELD: frozenset(
        {"place_on", "place_in", "place_at", "place_beside", "drop", "hand_over", "pour", "stack", "put_over", "insert"}
    ),
    "ungripped": _UNTOUCHED | {"push", "push_to", "tap", "press_down", "press", "open_gripper"},
}
_AND_TELL = re.compile(
    r"[ ,.;]+(?:(?:and|then|afterwards|after that),? )*(?P<question>(?:tell|show|give) (?:me|us) (?:then |afterwards )?(?:how|where|what|which|whether|if|the|your|its|all) .+)$",
    re.IGNORECASE,
)
_ANEW = ("once more", "one more time", "again", "instead", "rather")


def interpret(
    prompt: str,
    scene: ObservedScene,
    skills: Iterable[str],
    discourse: Discourse | None = None,
    chosen: Mapping[str, str] | None = None,
) -> Draft | Refusal:
    """Return the plan that a sentence asks for in a scene, or why there is none.

    Args:
        prompt: What was said.
        scene: What perception sees.
        skills: Names of the skills at hand.
        discourse: What was spoken of before; updated when a plan comes out.
        chosen: Answers to questions asked before: unclear words and the ids that they mean.
    """
    names, language = tuple(skills), language_of(prompt)
    made = _interpreted(language, prompt, scene, names, discourse, chosen)
    if isinstance(made, Draft) or language != ENGLISH or len(prompt) > _MOST_READ_IN_PARTS:
        return told_in(language, made) if isinstance(made, Refusal) else made

    def read_anew(sentence: str) -> Draft | Refusal:
        context = deepcopy(discourse) if discourse else None
        return _interpreted(language, sentence, scene, names, context, chosen)

    ids = tuple(item.id for item in scene.objects)
    over = (
        to_and_fro(prompt, read_anew) or several_times(prompt, ids, read_anew) or _with_question(prompt, ids, read_anew)
    )
    return over or with_offer(made, prompt, ids, lambda sentence: isinstance(read_anew(sentence), Draft))


def _interpreted(
    language: str,
    prompt: str,
    scene: ObservedScene,
    names: tuple[str, ...],
    discourse: Discourse | None,
    chosen: Mapping[str, str] | None,
) -> Draft | Refusal:
    readings = read_in(language, prompt, tuple(item.id for item in scene.objects))
    if isinstance(readings, tuple) and (discourse is None or discourse.last is None):
        begun = tuple((cost, reading) for cost, reading in readings if not reading.anew)
        if not begun:
            anew = next((word for word in _ANEW if re.search(rf"\b{word}\b", prompt.lower())), "again")
            return _unrecognized(f"I have done nothing yet that “{anew}” could mean.", (anew,))
        readings = begun
    if isinstance(readings, Refusal):
        return readings
    made = choose(readings, scene, names, discourse, chosen)
    if isinstance(made, Refusal):
        return made
    return _once_each(prompt if language == ENGLISH else "then" * says_in_turn(language, prompt), made)


def _with_question(prompt: str, ids: tuple[str, ...], read: Callable[[str], Draft | Refusal]) -> Draft | None:
    """Return the plan of an order behind which something is asked, as in "weigh it and tell me how wide it is"."""
    told = _AND_TELL.search(prompt)
    asked = questions_in(ENGLISH, told["question"], ids) if told else ()
    if told is None or not asked or isinstance(asked, Refusal):
        return None
    if asked[0].about not in _ASKED_AFTERWARDS:
        return None
    order = prompt[: told.start()]
    if asked[0].about == "weight":
        # What is not seen is felt.
        weighed = read(f"{order} and weigh it")
        return weighed if isinstance(weighed, Draft) else None
    draft = read(order)
    return replace(draft, question=told["question"]) if isinstance(draft, Draft) and draft.rest is None else None


def _is_of(words: str, name: str) -> bool:
    """Say whether words are a form of a class of English."""
    vocabulary = ruleset(ENGLISH).vocabulary
    return vocabulary.is_form(vocabulary.folded(words), name)


def _paced(reading: Sentence) -> Sentence | None:
    """Return a reading with the pace that its words of manner say, as in "work at half speed"; None where it lacks one."""
    unsaid = [step for step in reading.steps if step.words and step.words.pace and not step.slots]
    if not unsaid:
        return reading
    said = [words for words in reading.manners if not _is_of(words, "FROM_NOW_ON")]
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
        if not {*tempos[tempo]}.isdisjoint(words.lower().split())
    }
    others = [words for words in manners if words not in asked]
    if "set_tempo" not in names or len({*asked.values()}) != 1:
        asked, others = {}, [*manners]
    if any(_VERY_SLOWLY.search(words) for words in asked):
        asked = dict.fromkeys(asked, _SLOWEST)
    notes = [
        f"{f'At {tempo} at most' if tempo == _SLOWEST else f'At the {tempo} tempo'}: {listed([f'“{words}”' for words in asked])}."
        for tempo in {*asked.values()}
    ]
    if others:
        usual = "" if asked else ": I go at my usual speed"
        notes.append(f"No skill takes {listed([f'“{words}”' for words in others])}{usual}.")
    return next(iter(asked.values()), ""), " ".join(notes)


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
    if lasts and (len(draft.calls) != 1 or draft.calls[0].skill not in _ONE_MOTION):
        raise RefusedError(RefusalCode.UNSUPPORTED, "I can say how long one motion of the hand takes, and not this.")
    if lasts:
        return tempo, f"The motion lasts {tempo} or longer."
    if tempo in TEMPOS:
        return tempo, f"At the {tempo} tempo; what comes of it is not checked."
    return tempo, f"The hand goes at {tempo} at most; where it touches things, slower."


def _check_terms(terms: Sequence[str], draft: Draft) -> None:
    """Refuse a plan that does what it was told not to do on the way.

    Raises:
        RefusedError: A call of it touches, or grips, things.
    """
    for term in terms:
        other = next((call for call in draft.calls if (call.skill in _TERMS[term]) is (term == _HELD)), None)
        if other is not None:
            raise RefusedError(RefusalCode.IMPOSSIBLE, f"You asked for it {term}, and {other} would not be.", firm=True)


def _once_each(prompt: str, made: Draft) -> Draft | Refusal:
    """Refuse to put a thing in two places one after the other where no word says that it goes on.

    As in "mum says the lemon goes in the tray, but I want it in the bowl".
    """
    said = prompt.lower().rstrip(" .!;")
    doors = [(call.skill, str(call.arguments["drawer"])) for call in made.calls if "drawer" in call.arguments]
    if doors and doors[-1][0] == "close_drawer" and _STAYS_OPEN.search(said):
        # "put the sponge in the drawer and close it. The drawer stays open."
        return Refusal(code=RefusalCode.AMBIGUOUS, message=f"Should {doors[-1][1]} be open or closed in the end?")
    # "the fruit in the bowl; the lime goes in the bin" tells what is where in the end, and no step.
    marks = "" if _WHERE_IT_GOES.search(said) else "|[.;:]"
    words = {*re.findall(r"next to|[a-z]+" + marks, said)}
    # "the ball lives in the basket, put it back": back is where it lives.
    at_home = bool(words & _AT_HOME)
    reopened = [d for k, (skill, d) in enumerate(doors) if skill == "open_drawer" and ("close_drawer", d) in doors[:k]]
    if reopened and words & {"before", "after"} and "open" not in words:
        # "close the drawer before you put the egg in it", "put the egg in, after you close the drawer"
        return Refusal(
            code=RefusalCode.AMBIGUOUS,
            message=f"Nothing goes into {reopened[-1]} while it is closed; when should it be?",
        )
    if (_ON_THE_WAY - _NEVERTHELESS if at_home else _ON_THE_WAY) & words:
        return made
    if reopened and "open" not in prompt.lower() and ("close_drawer", reopened[-1]) != doors[-1]:
        # "the drawer should be closed and the sponge in it"
        return Refusal(code=RefusalCode.AMBIGUOUS, message=f"Should {reopened[-1]} be closed at first or in the end?")
    held, places = "", dict[str, str]()
    for call in made.calls:
        held = str(call.arguments["object"]) if call.skill in ("pick", "stack") else held
        if call.skill != "stack" and not call.skill.startswith("place_"):
            continue
        place = str(call.arguments.get("container") or call.arguments.get("target") or "another place")
        place = f"beside {place}" if call.skill == "place_beside" else place
        again = places.get(held, "") == place and call.skill == "place_beside"
        if places.get(held, place) != place or again or (at_home and held in places):
            which = f"twice {place}" if again else f"to {places[held]} or to {place}"
            return Refusal(
                code=RefusalCode.AMBIGUOUS,
                message=f"Should {held} go {which}? Say “then” if one after the other.",
                candidates=(places[held], place),
            )
        if call.skill != "place_at":
            places[held] = place
    return made


def choose(
    readings: Readings,
    scene: ObservedScene,
    skills: Sequence[str],
    discourse: Discourse | None = None,
    chosen: Mapping[str, str] | None = None,
) -> Draft | Refusal:
    """Return the plan of the plainest reading that has one; two different plans of equal right are ambiguous.

    Args:
        readings: What a sentence may mean, and what each costs.
        scene: What perception sees.
        skills: Names of the skills at hand.
        discourse: What was spoken of before; updated when a plan comes out.
        chosen: Answers to questions asked before.
    """
    plans: dict[tuple[str, ...], tuple[Draft, Discourse]] = {}
    refused: list[tuple[RefusedError, Sentence]] = []
    feelings = ruleset(ENGLISH).vocabulary.classes["FEELING"]
    best, limit = 0.0, float("inf")
    paced = [(cost, whole) for cost, reading in readings if (whole := _paced(reading)) is not None]
    for cost, reading in paced or readings:
        if (plans and cost > best + CLOSE) or cost > limit:
            break
        context = deepcopy(discourse) if discourse else Discourse()
        try:
            draft = build(reading, scene, skills, context, chosen)
            felt = [f"“{word}”" for word in unseen(reading) if word in feelings]
            standing = [words for words in reading.manners if _is_of(words, "FROM_NOW_ON")]
            if standing and "set_tempo" not in {call.skill for call in draft.calls}:
                told = f"I do what is asked of me once; “{standing[0]}” I keep a pace alone."
                raise RefusedError(RefusalCode.UNSUPPORTED, told)
            turned = any(call.skill == "turn_hand" for call in draft.calls)
            manners = [words for words in reading.manners if words not in standing]
            # Clockwise is seen from above.
            tempo, told = _tempo_of([words for words in manners if not (turned and words == "from above")], skills)
            terms = [term for term in reading.terms if term in _TERMS]
            _check_terms(terms, draft)
            if len(reading.terms) > len(terms):
                tempo, told = _timed([each for each in reading.terms if each not in terms], draft, skills)
            notes = [told] if told else []
            notes += (
                [f"I take no account of {listed([f'“{aside}”' for aside in reading.asides])}."]
                if reading.asides
                else []
            )
            notes += [f"I do not see what is {listed(felt)}."] if felt else []
            draft = replace(draft, note=" ".join(notes), tempo=tempo)
        except RefusedError as error:
            # Without its frames it is freed at once, and no garbage piles up.
            refused.append((error.with_traceback(None), reading))
            if not plans:
                # What the plainest reading cannot do, a far-fetched one must not do in its place.
                limit = min(limit, cost + _leeway(error, reading))
            continue
        best = cost if not plans else best
        if not any(_same_in_the_end(_effect(draft), other) for other in plans):
            plans[_effect(draft)] = (draft, context)
    if len(plans) > 1:
        both = " or ".join("; ".join(calls) or "nothing" for calls in list(plans)[:2])
        return Refusal(code=RefusalCode.AMBIGUOUS, message=f"That can mean two things: {both}. Which?")
    if not plans:
        plainest, reading = refused[0]
        if isinstance(plainest, AlreadySoError) and len(reading.steps) == 1:
            return Draft((), nothing=plainest.refusal)
        if discourse is not None:
            discourse.question = plainest.about
        return plainest.refusal
    draft, context = next(iter(plans.values()))
    if draft.nothing is not None:
        return draft.nothing
    if discourse is not None:
        discourse.become(context)
    return draft


def _leeway(error: RefusedError, reading: Sentence) -> float:
    """Return how much more a reading may cost that is taken in place of one that was refused.

    One whose things are ambiguous, or that cannot be done, is not replaced by a farther one.
    """
    code = error.refusal.code
    # "put the fruit in the bowl, don't touch the lemon" means the other fruit.
    spares = bool(reading.avoid) or code is RefusalCode.UNRECOGNIZED
    return CLOSE if spares or (code is RefusalCode.OBJECT_NOT_FOUND and not error.firm) else 0.0


def resumed(draft: Draft, scene: ObservedScene, skills: Sequence[str]) -> Draft | Refusal:
    """Return the plan for what a draft left for later, as things are now.

    Args:
        draft: Its steps are done.
        scene: What perception sees now.
        skills: Names of the skills at hand.
    """
    if draft.rest is None:
        return Draft(())
    try:
        return build(Sentence(draft.rest.steps, draft.rest.avoid), scene, skills, draft.rest.discourse)
    except RefusedError as error:
        return error.refusal


def _same_in_the_end(one: tuple[str, ...], other: tuple[str, ...]) -> bool:
    """Say whether two plans carry the same things into the same containers, in whatever order, and end alike."""
    while one and other and one[-1] == other[-1] == "home()":
        one, other = one[:-1], other[:-1]

    def carried(calls: tuple[str, ...]) -> list[tuple[str, str]] | None:
        pairs = list(zip(calls[::2], calls[1::2], strict=False))
        plain = len(calls) % 2 == 0 and all(a.startswith("pick(") and b.startswith("place_in(") for a, b in pairs)
        return sorted(pairs) if plain else None

    return one == other or (carried(one) is not None and carried(one) == carried(other))


def _effect(draft: Draft) -> tuple[str, ...]:
    """Return the calls in a form in which `stack` and pick-and-place are the same."""
    calls: list[str] = []
    for call in draft.calls:
        if call.skill == "stack":
            calls += [f"pick(object={call.arguments['object']})", f"place_on(target={call.arguments['target']})"]
        else:
            calls.append(str(call))
    return tuple(calls)


def _unrecognized(message: str, words: Sequence[str] = ()) -> Refusal:
    return Refusal(code=RefusalCode.UNRECOGNIZED, message=message, candidates=tuple(words), sure=False)
