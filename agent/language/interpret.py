"""One sentence and one scene: a draft of a plan, or a refusal."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping, Sequence
from copy import deepcopy
from dataclasses import replace
from functools import lru_cache

from robosandbox.agent.language import lazy_regex
from robosandbox.agent.language.adjectives import FEELINGS
from robosandbox.agent.language.asides import without_asides
from robosandbox.agent.language.build import build
from robosandbox.agent.language.chart import TooComplicatedError
from robosandbox.agent.language.corrections import may_correct, set_right
from robosandbox.agent.language.discourse import AlreadySoError, Discourse, RefusedError, listed
from robosandbox.agent.language.draft import Draft
from robosandbox.agent.language.front import (
    ENGLISH,
    VERBS_FOR_PEOPLE,
    Readings,
    language_of,
    read_in,
    says_in_turn,
    told_in,
)
from robosandbox.agent.language.grammar import Grammar
from robosandbox.agent.language.intent import Sentence, unseen
from robosandbox.agent.language.lexicon import LEXICON
from robosandbox.agent.language.loosely import loosely
from robosandbox.agent.language.offers import with_offer
from robosandbox.agent.language.purposes import where_it_goes
from robosandbox.agent.language.repeated import several_times
from robosandbox.agent.language.ruleset import ruleset
from robosandbox.agent.language.slots import Said
from robosandbox.agent.language.speech import CONDITIONS, QUESTIONS
from robosandbox.agent.language.spelling import respelled
from robosandbox.agent.language.tokens import (
    SceneWords,
    Token,
    TooLongError,
    passed_over,
    scene_words,
    spoken,
    tokenize,
    without_fillers,
)
from robosandbox.agent.language.verbs import UNSUPPORTED_VERBS
from robosandbox.agent.language.worded import known
from robosandbox.agent.language.wordings import WORDINGS
from robosandbox.agent.language.wordlist import word_set
from robosandbox.types import ObservedScene, Refusal, RefusalCode

CLOSE = 0.5
CLOSE_RULES = 0.35
_MOST_REMEMBERED = 500  # Characters of a prompt that is remembered and read again. Chosen: longer ones are no commands.
_OF_THE_HAND = "“move up 5 cm”, “hover over” and a thing, “open the gripper to 4 cm” or “turn the hand by 90 degrees”"
STRANGE = 20.0  # Strain, a number of units as of strain.py, from which a reading is too strange to act on. Chosen.
_STEPS_AGAIN = 4_000  # Number of steps of a second reading. Chosen: less than half of the first.
_ON_THE_WAY = word_set(
    """
    then after afterwards before first next finally later again back once lastly last second followed subsequently until
    when over swap exchange trade switch . ; :
    """
)
_NEVERTHELESS = frozenset({"back", ".", ";", ":"})
_BINDING = frozenset({"again", "only", "except", "maybe", "perhaps"})
_AT_HOME = frozenset({"live", "lives", "belong", "belongs"})
_WHERE_IT_GOES = lazy_regex.compile(
    r"[.;:] (?:but |and |oh,? |well,? )?(?:the|my|our|that) [^.;:]*\b(?:goes|go|belongs?)\b"
)
_STAYS_OPEN = lazy_regex.compile(
    r"[.,;!] (?!.*\b(?:not|never|without)\b)(?!.*n't)[^.,;!]*\b(?:stays?|remains?|leave|keep|left|kept)\b[^.,;!]*\bopen\b[^.,;!]*$"
)
# What `typography` writes for words that must not pass for others.
_SAID_AS = {"namelyonly": "only", "backagain": "back again"}
_ANEW = ("once more", "one more time", "again", "instead", "rather")
_PERHAPS_MISREAD = frozenset(
    {RefusalCode.OBJECT_NOT_FOUND, RefusalCode.AMBIGUOUS, RefusalCode.UNSUPPORTED, RefusalCode.IMPOSSIBLE}
)


def interpret(
    prompt: str,
    scene: ObservedScene,
    skills: Iterable[str],
    discourse: Discourse | None = None,
    chosen: Mapping[str, str] | None = None,
    *,
    by_rules: bool = True,
) -> Draft | Refusal:
    """Return the plan that a sentence asks for in a scene, or why there is none.

    Args:
        prompt: What was said.
        scene: What perception sees.
        skills: Names of the skills at hand.
        discourse: What was spoken of before; updated when a plan comes out.
        chosen: Answers to questions asked before: unclear words and the ids that they mean.
        by_rules: Read English by its rules.
    """
    names = tuple(skills)
    language = language_of(prompt)
    if language != ENGLISH:
        return _interpreted_in(language, prompt, scene, names, discourse, chosen)
    goes_on = discourse is not None and discourse.last is not None
    understood = _by_rules if by_rules else _interpreted
    made = understood(prompt, scene, names, discourse, chosen)
    if isinstance(made, Draft):
        return made if by_rules else _accounted(prompt, scene, names, made, goes_on=goes_on)
    if len(prompt) > _MOST_REMEMBERED:
        return made

    def read_anew(sentence: str) -> Draft | Refusal:
        context = deepcopy(discourse) if discourse else None
        again = understood(sentence, scene, names, context, chosen)
        return (
            again
            if by_rules or isinstance(again, Refusal)
            else _accounted(sentence, scene, names, again, goes_on=goes_on)
        )

    ids = tuple(item.id for item in scene.objects)
    over = several_times(prompt, ids, read_anew)
    return over or with_offer(made, prompt, ids, lambda sentence: isinstance(read_anew(sentence), Draft))


def _by_rules(
    prompt: str,
    scene: ObservedScene,
    names: tuple[str, ...],
    discourse: Discourse | None,
    chosen: Mapping[str, str] | None,
) -> Draft | Refusal:
    found = read_in(ENGLISH, prompt, tuple(item.id for item in scene.objects))
    if isinstance(found, tuple) and (discourse is None or discourse.last is None):
        told = tuple((cost, reading) for cost, reading in found if not reading.anew)
        anew = [word for word in _ANEW if re.search(rf"\b{word}\b", prompt.lower())] or ["again"]
        found = told or _unrecognized(f"I have done nothing yet that “{anew[0]}” could mean.", anew[:1])
    if isinstance(found, Refusal):
        return found
    return _once_each(
        prompt, choose(found, scene, names, discourse, chosen, close=CLOSE_RULES, far=CLOSE_RULES, strict=True)
    )


def _accounted(
    prompt: str, scene: ObservedScene, names: Sequence[str], draft: Draft, *, goes_on: bool
) -> Draft | Refusal:
    """Return a plan with a note of the words that it takes no account of, or a refusal for one that it may not do without.

    Args:
        prompt: What was said.
        scene: What perception sees.
        names: Of the skills.
        draft: The plan.
        goes_on: Whether there was an order before.
    """
    over = passed_over(prompt, scene_words(tuple(item.id for item in scene.objects)))
    anew = [each.words for each in over if each.kind == "repeat" and not (each.follows or goes_on)]
    if anew:
        return _unrecognized(f"I have done nothing yet that “{anew[0]}” could mean.", anew)
    tempo, told = _tempo_of([each.words for each in over if each.kind == "manner"], names)
    return replace(draft, note=f"{told} {draft.note}".strip(), tempo=tempo)


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
        if not {*tempos[tempo]}.isdisjoint(words.split())
    }
    others = [words for words in manners if words not in asked]
    if "set_tempo" not in names or len({*asked.values()}) != 1:
        asked, others = {}, [*manners]
    notes = [f"At the {tempo} tempo: {listed([f'“{words}”' for words in asked])}." for tempo in {*asked.values()}]
    if others:
        usual = "" if asked else ": I go at my usual speed"
        notes.append(f"No skill takes {listed([f'“{words}”' for words in others])}{usual}.")
    return next(iter(asked.values()), ""), " ".join(notes)


def _interpreted_in(
    language: str,
    prompt: str,
    scene: ObservedScene,
    names: tuple[str, ...],
    discourse: Discourse | None,
    chosen: Mapping[str, str] | None,
) -> Draft | Refusal:
    """As `interpret`, for a sentence of a language that is data."""
    made: Draft | Refusal | Readings = read_in(language, prompt, tuple(item.id for item in scene.objects))
    if isinstance(made, tuple):
        made = choose(made, scene, names, discourse, chosen)
    if isinstance(made, Draft):
        made = _once_each("then" if says_in_turn(language, prompt) else "", made)
    return told_in(language, made) if isinstance(made, Refusal) else made


def _interpreted(
    prompt: str,
    scene: ObservedScene,
    names: tuple[str, ...],
    discourse: Discourse | None,
    chosen: Mapping[str, str] | None,
) -> Draft | Refusal:
    readings = read(prompt, scene, names)
    if isinstance(readings, Refusal):
        return readings
    made = _once_each(prompt, choose(readings, scene, names, discourse, chosen))
    if isinstance(made, Refusal) and (made.code in _PERHAPS_MISREAD or may_correct(prompt)):
        ids = tuple(item.id for item in scene.objects)
        for read_again in (_plainer, _corrected, _read_in_any_order) if len(prompt) <= _MOST_REMEMBERED else ():
            others = read_again(prompt, ids)
            # What it was read as already makes no more sense now.
            if others and others != readings:
                better = _once_each(prompt, choose(others, scene, names, discourse, chosen))
                if isinstance(better, Draft):
                    return better
    return made


def forget_readings() -> None:
    """Read sentences anew that were read before; words were learnt since."""
    for remembered in (_read, _said, _order, _in_plain_words, _plainer, _corrected, _read_in_any_order):
        remembered.cache_clear()


def read(prompt: str, scene: ObservedScene, skills: Sequence[str]) -> Readings | Refusal:
    """Return the readings of a sentence, the plainest first, or a refusal that names what was not understood."""
    ids = tuple(item.id for item in scene.objects)
    if len(prompt) > _MOST_REMEMBERED:
        return _read.__wrapped__(prompt, ids, tuple(skills))
    return _read(prompt, ids, tuple(skills))


# What a sentence says depends on the words of the scene, not on what is where: replans and benches ask for it again.
@lru_cache(maxsize=32)
def _read(prompt: str, ids: tuple[str, ...], skills: tuple[str, ...]) -> Readings | Refusal:
    try:
        said = _said(prompt, ids)
        readings = said.grammar.sentences()
        for apart in (_order, _in_plain_words, _read_loosely):
            if readings and readings[0][0] < STRANGE:
                break
            plain = apart(prompt, ids)
            better = plain.grammar.sentences(_STEPS_AGAIN) if plain.tokens and plain is not said else ()
            readings = better if better and (not readings or better[0][0] < readings[0][0]) else readings
        readings = readings or _set_right(said)
        return readings or _unsure(_not_understood(said, skills))
    except TooLongError as error:
        return _unrecognized(f"That is too long to be one command ({error}); say it in a few sentences.")
    except TooComplicatedError:
        return _unrecognized("That is too complicated for me; please say it in shorter sentences.")


def _once_each(prompt: str, made: Draft | Refusal) -> Draft | Refusal:
    """Refuse to put a thing in two places one after the other where no word says that it goes on.

    As in "mum says the lemon goes in the tray, but I want it in the bowl".
    """
    said = prompt.lower().rstrip(" .!;")
    if isinstance(made, Refusal):
        return made
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


# A chart is large: kept any longer, those of sentences past would have the garbage collector walk through them all.
@lru_cache(maxsize=1)
def _said(prompt: str, ids: tuple[str, ...]) -> Said:
    known = scene_words(ids)
    return where_it_goes(Said(tokenize(prompt, known), known))


@lru_cache(maxsize=1)
def _order(prompt: str, ids: tuple[str, ...]) -> Said:
    """Return a sentence without the chat around its order; the whole sentence if there is none."""
    said, known = _said(prompt, ids), scene_words(ids)
    whole = Said(spoken(prompt, known), known)
    order = without_asides(whole)
    return said if order is whole else where_it_goes(Said(without_fillers(order.tokens, known), known))


@lru_cache(maxsize=1)
def _in_plain_words(prompt: str, ids: tuple[str, ...]) -> Said:
    return _plainly(_order(prompt, ids))


def _read_loosely(prompt: str, ids: tuple[str, ...]) -> Said:
    """Return a sentence as plain orders; as it is if it cannot be read so."""
    order, known = _order(prompt, ids), scene_words(ids)
    if _BINDING & {token.text for token in spoken(prompt, known)} - {*order.texts}:
        # What the grammar may pass over where it reads the rest is not passed over here.
        return order
    return loosely(order.now(_respelled(order.tokens, order.words)))


@lru_cache(maxsize=32)
def _plainer(prompt: str, ids: tuple[str, ...]) -> Readings:
    """Return the readings of a sentence in plainer words, none if those are its own: for what makes no sense as it stands."""
    try:
        said = _said(prompt, ids)
        if "anything" in said.texts:
            # "anything but the apple can go in the bin" allows it, and asks for nothing.
            return ()
        plain = _in_plain_words(prompt, ids)
        return plain.grammar.sentences(_STEPS_AGAIN) if plain.texts and plain.texts != said.texts else ()
    except (TooLongError, TooComplicatedError):
        return ()


@lru_cache(maxsize=32)
def _read_in_any_order(prompt: str, ids: tuple[str, ...]) -> Readings:
    """Return the readings of a sentence read loosely, none if that changes nothing: for what makes no sense as it stands."""
    try:
        said = _said(prompt, ids)
        loose = _read_loosely(prompt, ids)
        return loose.grammar.sentences(_STEPS_AGAIN) if loose.texts != said.texts else ()
    except (TooLongError, TooComplicatedError):
        return ()


@lru_cache(maxsize=32)
def _corrected(prompt: str, ids: tuple[str, ...]) -> Readings:
    """Return the readings of a sentence with what it corrects set right: for what makes no sense as it stands."""
    try:
        said = _said(prompt, ids)
        return () if "anything" in said.texts else _set_right(said)
    except (TooLongError, TooComplicatedError):
        return ()


def _plainly(said: Said) -> Said:
    plain = WORDINGS.reworded(said.now(_respelled(said.tokens, said.words)))
    return without_asides(where_it_goes(plain))


def _set_right(said: Said) -> Readings:
    """Return the readings of a sentence with its corrections carried out."""
    ways = set_right(said.now(_respelled(said.tokens, said.words)))
    # "if nothing is wrong, go home" says under what condition, and corrects nothing.
    told = [word for word in ("if", "unless") if word in said.texts]
    ways = tuple(way for way in ways if all(word in way.texts for word in told))
    readings = [reading for way in ways for reading in _plainly(way).grammar.sentences(_STEPS_AGAIN)]
    return tuple(sorted(readings, key=lambda reading: reading[0]))


def _respelled(tokens: Sequence[Token], known: SceneWords) -> tuple[Token, ...]:
    words = respelled([token.text for token in tokens], known.parts)
    return tuple(
        token if token.kind != "word" or token.text == word else Token(word, token.raw, "word")
        for token, word in zip(tokens, words, strict=True)
        if word
    )


def choose(
    readings: Readings,
    scene: ObservedScene,
    skills: Sequence[str],
    discourse: Discourse | None = None,
    chosen: Mapping[str, str] | None = None,
    *,
    close: float = CLOSE,
    far: float = 3 * CLOSE,
    strict: bool = False,
) -> Draft | Refusal:
    """Return the plan of the plainest reading that has one; two different plans of equal right are ambiguous.

    Args:
        readings: What a sentence may mean, and what each costs.
        scene: What perception sees.
        skills: Names of the skills at hand.
        discourse: What was spoken of before; updated when a plan comes out.
        chosen: Answers to questions asked before.
        close: Costs that differ by no more are of equal right.
        far: How much more a reading may cost that is taken in place of one whose things are unclear.
        strict: One whose things are ambiguous, or that cannot be done, is not replaced by a farther one.
    """
    plans: dict[tuple[str, ...], tuple[Draft, Discourse]] = {}
    refused: list[tuple[RefusedError, Sentence]] = []
    best, limit = 0.0, float("inf")
    for strain, reading in readings:
        if (plans and strain > best + close) or strain > limit:
            break
        context = deepcopy(discourse) if discourse else Discourse()
        try:
            draft = build(reading, scene, skills, context, chosen)
            felt = [f"“{word}”" for word in unseen(reading) if word in FEELINGS]
            tempo, told = _tempo_of(reading.manners, skills)
            notes = [told] if told else []
            notes += [f"I do not see what is {listed(felt)}."] if felt else []
            draft = replace(draft, note=" ".join(notes), tempo=tempo)
        except RefusedError as error:
            # Without its frames it is freed at once, and no garbage piles up.
            refused.append((error.with_traceback(None), reading))
            if not plans:
                # What the plainest reading cannot do, a far-fetched one must not do in its place.
                limit = min(limit, strain + _leeway(error, reading, far, strict=strict))
            continue
        best = strain if not plans else best
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


def _leeway(error: RefusedError, reading: Sentence, far: float, *, strict: bool) -> float:
    """Return how much more a reading may cost that is taken in place of one that was refused."""
    code = error.refusal.code
    if not strict:
        unclear = code in (RefusalCode.OBJECT_NOT_FOUND, RefusalCode.AMBIGUOUS) and not error.firm
        return far if unclear else min(far, CLOSE)
    # "put the fruit in the bowl, don't touch the lemon" means the other fruit.
    spares = bool(reading.avoid) or code is RefusalCode.UNRECOGNIZED
    return far if spares or (code is RefusalCode.OBJECT_NOT_FOUND and not error.firm) else 0.0


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


def _unsure(refusal: Refusal) -> Refusal:
    """Mark a refusal of a sentence that has no reading; a question about what is missing from it stays sure."""
    asks = refusal.code is RefusalCode.AMBIGUOUS
    return refusal if asks else refusal.model_copy(update={"sure": False})


def _not_understood(said: Said, skills: Sequence[str]) -> Refusal:
    """Say which part was not understood."""
    tokens, known = said.tokens, said.words
    if not tokens:
        return _unrecognized("Tell me what to do, for example: pick up the red cube.")
    words = [token.text for token in tokens]
    strange = [
        _SAID_AS.get(token.text, token.raw) for i, token in enumerate(tokens)
        if token.kind == "word" and not LEXICON.at(tokens, i) and not {token.text, token.text.removesuffix("s")} & known.parts and not _inside_phrase(tokens, i)
    ]  # fmt: skip
    told = [f"“{word}”" for word in strange if word not in QUESTIONS | CONDITIONS]
    if words[0] in QUESTIONS:
        return Refusal(
            code=RefusalCode.UNSUPPORTED,
            message="I say where things are, how many, how big, how far apart and what holds of them, and not "
            f"{listed(told, 'or') if told else 'this'}; or tell me what to do.",
            candidates=tuple(skills),
        )
    bare = _only_a_thing(said.grammar)
    if bare:
        return Refusal(code=RefusalCode.AMBIGUOUS, message=f"What should I do with “{bare}”?", candidates=tuple(skills))
    unable = _unable(tokens, skills)
    if unable:
        return unable
    unmovable = _unmovable(tokens, known, skills)
    if unmovable:
        return unmovable
    if words[0] == "not" or words[:2] == ["do", "not"]:
        return Refusal(
            code=RefusalCode.UNSUPPORTED,
            message="That asks me to leave something undone, and I had not begun anything; say it beside an order, "
            "or name what I must not touch.",
        )
    if "hand_over" not in skills and any(token.text in ("me", "us") for token in tokens):
        return Refusal(
            code=RefusalCode.UNSUPPORTED,
            message=f"I cannot hand things over; I can {VERBS_FOR_PEOPLE}.",
            candidates=tuple(skills),
        )
    for token in tokens:
        if token.text in CONDITIONS:
            return Refusal(
                code=RefusalCode.UNSUPPORTED,
                message=f"I cannot make out {listed(told) + ' after' if told else 'what follows'} “{token.raw}”: I follow conditions on what is there, where it is and how it looks.",
                candidates=tuple(skills),
            )
    for j, verb in said.grammar.tag(0, "VERB"):
        ends = [refs for end, refs in said.grammar.np_list(j) if end == len(tokens)]
        if verb == "put" and ends and not any(ref.unknown for ref in ends[0]):
            return Refusal(
                code=RefusalCode.AMBIGUOUS, message=f"Where should “{said.grammar.said(j, len(tokens))}” go?"
            )
    if strange:
        return _unrecognized(f"I do not understand {listed([f'“{word}”' for word in strange])} here.", strange)
    return _unrecognized(
        f"I know the words but not the sentence “{' '.join(t.raw for t in tokens)}”; please say it differently."
    )


def _unable(tokens: Sequence[Token], skills: Sequence[str]) -> Refusal | None:
    """Say which verb lacks what it takes, or is none that a skill has; None where there is no such verb."""
    words = [token.text for token in tokens]
    for i, token in enumerate(tokens):
        tags = {tag for _, tag, _ in LEXICON.at(tokens, i)}
        starts = i == 0 or tokens[i - 1].text in (",", "and", "then", ".", "to", ";", "you")
        giving = any(tag == "VERB" and value == "give" for _, tag, value in LEXICON.at(tokens, i))
        if starts and token.text in known_verbs(skills):
            return _unrecognized(f"To {token.text} takes a thing, and how: say which and how far, or where to.")
        if starts and token.text == "do" and words[i + 1 : i + 2] == ["not"]:
            continue
        if starts and (giving or (token.text in UNSUPPORTED_VERBS and ("VERB" not in tags or i == 0))):
            return Refusal(
                code=RefusalCode.UNSUPPORTED,
                message=f"I cannot “{token.raw}”; I can {VERBS_FOR_PEOPLE}.",
                candidates=tuple(skills),
            )
    return None


def known_verbs(skills: Sequence[str]) -> frozenset[str]:
    """Return the verbs of skills that say themselves how they are asked for."""
    return frozenset(verb for name, words in known() if name in skills for verb in words.verbs)


def _unmovable(tokens: Sequence[Token], known: SceneWords, skills: Sequence[str]) -> Refusal | None:
    """Refuse what is asked of the table, the floor or the arm itself."""
    words = [token.text for token in tokens]
    for i in range(len(words)):
        tags = [(end, tag) for end, tag, _ in LEXICON.at(tokens, i)]
        if words[i] not in known.parts and any(tag == "FLOOR" for _, tag in tags):
            return Refusal(code=RefusalCode.IMPOSSIBLE, message="The floor is out of my reach; I work on the table.")
        for end in [end for end, tag in tags if tag == "VERB"]:
            start = end + 1 if words[end : end + 1] in (["the"], ["your"], ["my"]) else end
            for _, tag, _ in LEXICON.at(tokens, start) if start < len(words) else ():
                if tag == "TABLE":
                    return Refusal(code=RefusalCode.IMPOSSIBLE, message="The table stays where it is.")
                if tag == "ARM":
                    able = "move_by" in skills
                    moves = f"I do not understand what to do with the {words[start]}; say for example {_OF_THE_HAND}."
                    needed = f"I move the {words[start]} as the skills need it; I can {VERBS_FOR_PEOPLE}."
                    return Refusal(code=RefusalCode.UNSUPPORTED, message=moves if able else needed)
    return None


def _only_a_thing(grammar: Grammar) -> str | None:
    """Return the words if they name things and no action: "the red cube, please"."""
    end = grammar.count
    while end and grammar.tokens[end - 1].kind == "mark":
        end -= 1
    for start in grammar.optional(0, "DESIRE"):
        for stop, refs in grammar.np_list(start):
            if stop == end and not any(ref.unknown for ref in refs):
                return grammar.said(start, end)
    return None


def _inside_phrase(tokens: Sequence[Token], i: int) -> bool:
    return any(end > i for k in range(max(0, i - 6), i) for end, _, _ in LEXICON.at(tokens, k))
