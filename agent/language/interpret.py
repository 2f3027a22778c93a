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
from robosandbox.agent.language.remarks import tells_nothing, without_remarks
from robosandbox.agent.language.repeated import endlessly, several_times
from robosandbox.agent.language.ruleset import ruleset
from robosandbox.agent.language.skill_words import ways_of
from robosandbox.agent.language.terms import done_as_told, paced
from robosandbox.agent.language.wordlist import word_set
from robosandbox.types import ObservedScene, Refusal, RefusalCode

# Costs of readings that differ by no more are of equal right; one whose thing is not there is replaced by none that costs more.
CLOSE = 0.35
# Characters of a prompt that is read in parts as well: longer ones are no commands.
_MOST_READ_IN_PARTS = 500
# Refusals of what was not understood, which may be for a remark.
_UNREAD = (RefusalCode.UNSUPPORTED, RefusalCode.UNRECOGNIZED)
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
        "moved",
    }
)
_AND_TELL = re.compile(
    r"[ ,.;]+(?:(?:and|then|afterwards|after that),? )*(?P<question>(?:tell|show|give) (?:me|us) (?:then |afterwards )?(?:how|where|what|which|whether|if|the|your|its|all) .+"
    r"|(?<=[.!;] )(?:how|what|where|which|is|are|did|has|have|does|do)\b[^.!;?]*\?)$",
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
    in_parts = language == ENGLISH and len(prompt) <= _MOST_READ_IN_PARTS
    if in_parts and (endless := endlessly(prompt)) is not None:
        words, rest, counted = endless
        if counted:
            return interpret(rest, scene, names, discourse, chosen)
        return Refusal(code=RefusalCode.AMBIGUOUS, message=f"“{words}”: how often? Say a number.")
    made = _interpreted(language, prompt, scene, names, discourse, chosen)
    if isinstance(made, Draft) or not in_parts:
        return told_in(language, made) if isinstance(made, Refusal) else made

    def read_on(sentence: str) -> Draft | Refusal:
        return _interpreted(language, sentence, scene, names, discourse, chosen)

    def read_anew(sentence: str) -> Draft | Refusal:
        context = deepcopy(discourse) if discourse else None
        return _interpreted(language, sentence, scene, names, context, chosen)

    ids = tuple(item.id for item in scene.objects)
    over = several_times(prompt, ids, read_anew) or _with_question(prompt, ids, read_anew, read_on)
    plain, remarks = without_remarks(prompt, ids) if over is None and made.code in _UNREAD else (prompt, ())
    if remarks:
        heard = interpret(plain, scene, names, discourse, chosen)
        # What is said beside an order to bring things somewhere may tell which of them is meant.
        own = isinstance(heard, Draft) and any(ways_of(call.skill) for call in heard.calls)
        if isinstance(heard, Draft) and (own or all(map(tells_nothing, remarks))):
            told = f"I take no account of {listed([f'“{remark}”' for remark in remarks])}."
            return replace(heard, note=f"{heard.note} {told}".strip())
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


def _with_question(
    prompt: str, ids: tuple[str, ...], read: Callable[[str], Draft | Refusal], read_on: Callable[[str], Draft | Refusal]
) -> Draft | None:
    """Return the plan of an order behind which something is asked, as in "weigh it and tell me how wide it is".

    Args:
        prompt: What was said.
        ids: Those of the scene.
        read: Reads an order, and what was spoken of stays as it is.
        read_on: Reads one that is carried out: what it is about is spoken of.
    """
    told = _AND_TELL.search(prompt)
    asked = questions_in(ENGLISH, told["question"], ids) if told else ()
    if told is None or not asked or isinstance(asked, Refusal):
        return None
    if asked[0].about not in _ASKED_AFTERWARDS:
        return None
    order = prompt[: told.start()]
    if asked[0].about == "weight":
        # What is not seen is felt.
        weighed = read_on(f"{order} and weigh it")
        return weighed if isinstance(weighed, Draft) else None
    draft = read(order)
    if isinstance(draft, Refusal) or draft.rest is not None:
        return None
    draft = read_on(order)
    return replace(draft, question=told["question"]) if isinstance(draft, Draft) else None


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
    with_pace = [(cost, whole) for cost, reading in readings if (whole := paced(reading)) is not None]
    for cost, reading in with_pace or readings:
        if (plans and cost > best + CLOSE) or cost > limit:
            break
        context = deepcopy(discourse) if discourse else Discourse()
        try:
            draft = build(reading, scene, skills, context, chosen)
            draft = done_as_told(reading, draft, skills)
            felt = [f"“{word}”" for word in unseen(reading) if word in feelings]
            notes = [draft.note] * bool(draft.note) + [f"I do not see what is {listed(felt)}."] * bool(felt)
            draft = replace(draft, note=" ".join(notes))
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
    named = [calls for calls, (draft, _) in plans.items() if _goes_by_name(draft)]
    if len(plans) > 1 and named:
        plans = {named[0]: plans[named[0]]}
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


def _goes_by_name(draft: Draft) -> bool:
    """Tell whether a plan goes to a pose by the name that it gives it first: "save this as start, go up, then back to start"."""
    saved: set[object] = set()
    for call in draft.calls:
        if call.skill == "move_to_pose" and call.arguments["pose"] in saved:
            return True
        if call.skill == "save_pose":
            saved.add(call.arguments["pose"])
    return False


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
