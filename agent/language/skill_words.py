"""The words of a skill: what `Words` of skills/words.py says, as lines of English for its lexicon and rules, and as arguments."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from typing import Any, NamedTuple, Protocol, runtime_checkable

from robosandbox.agent.language.discourse import RefusedError
from robosandbox.agent.language.inflection import inflections
from robosandbox.agent.language.intent import Ref
from robosandbox.skills.words import Slot, Words
from robosandbox.types import RefusalCode

# What is asked for where it was not said.
_QUESTIONS = {
    "object": "which thing",
    "length": "how far",
    "duration": "how long",
    "point": "where to",
    "force": "how hard",
    "speed": "how fast",
}
# Number of digits behind the point of a number that is said: a millionth of a radian or a metre.
_DIGITS = 6
# What rule reads a number of each kind, in SI units.
_MEASURES = {
    "length": "length",
    "angle": "angle",
    "duration": "duration",
    "force": "force",
    "share": "share",
    "number": "count",
}
# Kinds that any word may fill.
_FREE = frozenset({"name", "pose"})
_PREPOSITIONS = frozenset({"at", "on", "onto", "over", "to", "towards", "above"})
_FORMS = ("base", "third", "ing", "past", "past")
_MOST_SLOTS = 4  # Number of phrases that may follow one verb: more than anybody says.


class Vague(float):
    """A number that a phrase stands for, as "a little" does: where a number is told as well, that counts."""


Filled = tuple[tuple[str, Any], ...]


@runtime_checkable
class Worded(Protocol):
    """A skill that says how people ask for it."""

    name: str
    words: Words | tuple[Words, ...] | None


_KNOWN: dict[str, tuple[Words, ...]] = {}


def learn(skills: Iterable[object]) -> bool:
    """Make the skills among these that have words sayable; a plan still calls only what its planner was given.

    Returns:
        Whether any of them is new, so that sentences read before may now have another reading.
    """
    told = {
        s.name: s.words if isinstance(s.words, tuple) else (s.words,)
        for s in skills
        if isinstance(s, Worded) and s.words
    }
    new = {name: words for name, words in told.items() if _KNOWN.get(name) != words}
    if new:
        _KNOWN.update(new)
    return bool(new)


def known() -> Iterator[tuple[str, Words]]:
    """Yield the words of every skill that was learnt, with its name."""
    return ((name, words) for name, ways in _KNOWN.items() for words in ways)


def known_verbs() -> frozenset[str]:
    """Return the verbs of one word of the skills that were learnt."""
    return frozenset(verb for _, words in known() for verb in words.verbs)


def ways_of(skill: str) -> tuple[Words, ...]:
    """Return what a skill says of its verbs."""
    return _KNOWN.get(skill, ())


def words_of(skill: str, *, with_object: bool) -> Words:
    """Return what a skill says of its verbs that have an object, or have none; of rules for it nothing else is known."""
    return next((words for words in _KNOWN.get(skill, ()) if bool(words.object) is with_object), Words(verbs=(skill,)))


def _is_enough(words: Words, filled: Filled) -> bool:
    """Say whether what has to be said beside a verb was said."""
    told = {argument for argument, _ in filled}
    return told.issuperset(words.needed) and (not words.required or not told.isdisjoint(words.required))


def resolved(words: Words, filled: Filled, one: Any) -> dict[str, Any]:
    """Return the arguments that phrases fill; `one` returns the id that a noun phrase means.

    Raises:
        RefusedError: One argument is said twice, or what has to be said is not.
    """
    if not _is_enough(words, filled):
        told = {argument for argument, _ in filled}
        lacking = [argument for argument in words.needed if argument not in told] or words.required
        asked = dict.fromkeys(_asked(slot) for slot in words.slots if slot.argument in lacking)
        raise RefusedError(RefusalCode.AMBIGUOUS, f"Tell me {' or '.join(asked)} as well.", words.required)
    told = {argument for argument, _ in filled}
    filled = (*((name, value) for name, value in words.means if name not in told), *filled)
    arguments: dict[str, Any] = {}
    vague: frozenset[str] = frozenset()
    for argument, value in filled:
        if argument in arguments and isinstance(value, Ref) and value.determiner == "it":
            # "above the green cube, 15 cm over it"
            continue
        if argument in vague and argument in arguments:
            # "a moment, say ten seconds"
            arguments.pop(argument)
        if argument in arguments and isinstance(value, Vague):
            continue
        if argument in arguments and arguments[argument] != (_rounded(value) if isinstance(value, float) else value):
            raise RefusedError(RefusalCode.AMBIGUOUS, f"You said two things for {argument.replace('_', ' ')}; which?")
        if isinstance(value, Ref):
            arguments[argument] = one(value)
        elif isinstance(value, tuple):
            names = argument.split()
            values = [one(each) if isinstance(each, Ref) else _rounded(each) for each in value]
            if len(values) != len(names) or any(arguments.get(*at) != at[1] for at in zip(names, values, strict=True)):
                raise RefusedError(RefusalCode.AMBIGUOUS, f"You said two things for {', '.join(names)}; which?")
            arguments.update(zip(names, values, strict=True))
        else:
            arguments[argument] = _rounded(value)
            vague = vague | {argument} if isinstance(value, Vague) else vague - {argument}
    return arguments


def points_of(words: Words, filled: Filled) -> list[Filled]:
    """Return the phrases for each of the points that a verb needs and that are told one after the other: "to (a), (b) and (c)".

    Where it begins goes with the first of them.
    """
    points = [slot.argument for slot in words.slots if slot.kind == "point"]
    for to in points:
        if to in (*words.required, *words.needed):
            numbers = [number for argument, value in filled if argument == to for number in value]
            places = zip(*(numbers[k :: len(to.split())] for k in range(len(to.split()))), strict=True)
            others = tuple(phrase for phrase in filled if phrase[0] != to)
            along = tuple(phrase for phrase in others if phrase[0] not in points)
            return [((to, place), *(along if k else others)) for k, place in enumerate(places)]
    return []


def _asked(slot: Slot) -> str:
    return _QUESTIONS.get(slot.kind, f"the {slot.argument.replace('_', ' ')}")


def _rounded(value: float | str) -> float | str:
    return round(value, _DIGITS) if isinstance(value, float) else value


def lines_of(skill: str, ways: Sequence[Words]) -> str:
    """Return the classes and rules by which people ask for a skill, as the text of a lexicon and rules file."""
    return "\n".join(line for k, words in enumerate(ways) for line in _way(skill, k, words))


class _Phrases(NamedTuple):
    """Parts that the rules of one way to ask for a skill are put together of.

    Attributes:
        own: Name of the way, of which those of its rules and classes are made.
        act: How a rule begins that tells the skill and the way, with the verb's field.
        body: What of the robot may be named; "" for nothing.
        filled: One phrase that fills an argument or several.
        slots: The same behind a verb, or what it costs to say none; "" for a way without.
        gap: One phrase or several that may stand alone behind another step: any word might be a name; "" for none.
    """

    own: str
    act: str
    body: str
    filled: str
    slots: str
    gap: str


def _way(skill: str, k: int, words: Words) -> Iterator[str]:
    own = f"{skill}_{k}"
    verbs = tuple(_verbs(own, words))
    yield from (line for lines, _ in verbs for line in lines)
    for j, slot in enumerate(words.slots):
        yield from _slot(f"{own}_{j}", slot, words)
    free = [j for j, slot in enumerate(words.slots) if slot.kind in _FREE and "" in slot.prepositions]
    if words.slots and len(free) < len(words.slots):
        yield f"gap_with_{own}"
        yield from (f"  = slots+:said_{own}_{j}" for j in range(len(words.slots)) if j not in free)
    if words.slots:
        yield f"said_with_{own}"
        yield from (f"  = slots+:said_{own}_{j}" for j in range(len(words.slots)))
        yield "  = paced_at"

    def several(rule: str, count: int) -> str:
        return f"{rule}{f' (slot_joint? {rule})?' * min(_MOST_SLOTS - 1, count)}"

    filled = several(f"said_with_{own}", len(words.slots))
    # What is done with what is held is left out as what names that is.
    told = len(words.slots) - len(free) if words.object or words.hand != "holding" else 0
    # What leaves out what has to be said is far-fetched, or asks for a pace: "go slowly".
    cost = ("!" if words.pace else "!!") if words.required else ""
    unsaid = "" if words.needed else f" | {cost}"
    phrases = _Phrases(
        own=own,
        act=f"  = verb=worded skill={skill} way={k}",
        body=f" own_{words.body}" if words.body else "",
        filled=filled,
        slots=f' (("," | ":")? {filled} stays_there*{unsaid})' if words.slots else "",
        gap=several(f"gap_with_{own}", told) if told else "",
    )
    yield "acts"
    yield from (line for _, verb in verbs for line in _said(phrases, words, *verb))
    yield from _said_by_nouns(phrases, words)
    yield from _said_without_verbs(phrases, words, f"  = skill={skill} way={k}")


def _verbs(own: str, words: Words) -> Iterator[tuple[list[str], tuple[str, str, bool]]]:
    """Yield the classes of verbs that are followed alike; the phrase for them, what comes behind the object, and whether "{}" is said."""
    behind: dict[tuple[str, bool], list[str]] = {}
    for verb in words.verbs:
        begins, mark, after = verb.partition("{}")
        behind.setdefault((after.strip(), bool(mark)), []).append(begins.strip())
    count = 0
    for (after, marked), verbs in behind.items():
        # "move up", "go up", "move down", ...: a verb and what follows it are classes of their own.
        followed: dict[str, dict[str, None]] = {}
        for verb in verbs:
            first, _, rest = verb.partition(" ")
            followed.setdefault(first, {})[rest] = None
        alike: dict[tuple[str, ...], list[str]] = {}
        for first, behind_it in followed.items():
            alike.setdefault(tuple(behind_it), []).append(first)
        for follows, firsts in alike.items():
            name = f"V_{own}_{count}".upper()
            count += 1
            lines = [name]
            for first in firsts:
                inflected = zip(inflections(first), _FORMS, strict=False)
                lines.append(f"  {first} = {', '.join(f'{form}({kind})' for form, kind in inflected)}")
            rests = [rest for rest in follows if rest]
            lines += [f"WITH_{name}", f"  {', '.join(rests)}"] if rests else []
            optional = "?" if "" in follows else ""
            yield lines, (f"&{name}{f' WITH_{name}{optional}' if rests else ''}", after, marked)


def _said(phrases: _Phrases, words: Words, verb: str, after: str, marked: bool) -> Iterator[str]:
    """Yield the rules of a class of verbs."""
    act, body, slots = phrases.act, phrases.body, phrases.slots
    rest = "".join(f' "{word}"' for word in after.split())
    if words.object:
        yield f"{act} {verb} objects{rest}{slots}"
        if words.hand != "empty" and words.required and slots:
            # "pick green, lift 15 cm"
            yield f"{act} {verb} objects+:unsaid{rest} {phrases.filled} !!"
    elif not body or marked:
        yield f"{act} {verb}{body}{rest}{slots}"
    elif words.body == "fingers":
        # "open" alone may be said of anything.
        yield f"{act} {verb}{body}{slots}"
        yield from [f'{act} {verb} ","? {phrases.filled} stays_there? !'] * bool(slots)
    else:
        yield f"{act} {verb}{body}?{slots}"


def _said_by_nouns(phrases: _Phrases, words: Words) -> Iterator[str]:
    """Yield the rules by which an act is told by a noun: "do a small turn", "give it a shake", "give it three good shakes"."""
    if not words.nouns:
        return
    act, slots, own = phrases.act, phrases.slots, phrases.own
    quoted = " | ".join(f'"{noun}"' for noun in words.nouns)
    if not words.object:
        yield f'{act} MAKING MAKING_A SMALL_ACT* ({quoted}) ("with"{phrases.body or " own_hand"})? "of"?{slots}'
        # "do a quarter turn", "make a 5 cm move to the left"
        yield from [f'{act} MAKING MAKING_A? ","? {phrases.filled} stays_there?'] * bool(slots)
        return
    yield f"{act} VGIVE.base objects MAKING_A SMALL_ACT* ({quoted}){slots}"
    if any(slot.argument == "times" for slot in words.slots):
        yield f"{act} VGIVE.base objects slots+:counted_{own}{slots}"
        yield f"counted_{own} : slot"
        several = " | ".join(f'"{noun}s"' for noun in words.nouns)
        yield f"  = times:count SMALL_ACT* ({several})"
        yield "acts"


def _said_without_verbs(phrases: _Phrases, words: Words, act: str) -> Iterator[str]:
    """Yield the rules of what is said without a verb: in notes, and behind a step whose verb may be one of these."""
    body = phrases.body
    if words.alone and words.slots:
        yield "bare_worded : Command"
        # "5 cm" alone is no width of the gripper.
        named = f'{body} ":"?' if words.body == "fingers" else f'({body} ":"?)?' if body else ""
        yield f"{phrases.act} alone=yes {named} {phrases.filled}"
        if body:
            # "I want the hand 5 cm higher", "the fingers should be 3 cm apart"
            yield "wish : Command"
            be = '("to" ("be" | "go" | "move") | "at")?'
            yield f"{phrases.act} alone=yes desire{body} {be} {phrases.filled}"
            yield f'{phrases.act} alone=yes{body} ("should" | "must" | "has" "to" | "have" "to") "be" {phrases.filled}'
    if phrases.gap:
        # "..., then 3 cm to the left"
        yield "gap_worded : Command"
        yield f"{act} {phrases.gap}"
    if words.object:
        # "point at the red cube, then at the blue one"
        before = {
            verb.partition("{}")[0].split()[-1] for verb in words.verbs if len(verb.partition("{}")[0].split()) > 1
        }
        yield "gap_worded : Command"
        yield from (
            f'{act} "{word}" objects{phrases.slots}{"?" * bool(phrases.slots)}'
            for word in sorted(before & _PREPOSITIONS)
        )


def _slot(own: str, slot: Slot, words: Words) -> Iterator[str]:
    """Yield the rule of what fills an argument, and the classes that it is made of; nouns of the act may stand in it."""
    plain = [(phrase, value) for phrase, value in slot.phrases if "," not in phrase]
    begins = [(phrase, value) for phrase, value in slot.beginnings if phrase and "," not in phrase]
    yield from _class(f"PH_{own}", plain)
    yield from _class(f"BE_{own}", begins)
    yield from _class(f"EN_{own}", [(phrase, value) for phrase, value in slot.endings if "," not in phrase])
    numeric = slot.kind in _MEASURES
    if numeric:
        measure = f"ROUGHLY? of+:{_MEASURES[slot.kind]} or_so?"
        # "a hand's breadth, say 9 cm"
        measure = f'({_MEASURES[slot.kind]} ",")? {measure}'
        told = [measure] if slot.bare or any(not phrase for phrase, _ in slot.beginnings) else []
        # "forward a bit, like 20 degrees", "a bit forward, 20 degrees"
        told += [f'{_of(f"BE_{own}")} a_bit? ","? {measure}'] if begins else []
        told += [f'a_bit? {_of(f"BE_{own}")} "," {measure}'] if begins else []
        told += [f"{measure} {_of(f'EN_{own}')}"] if slot.endings else []
        # "back 10 cm towards you": the way is told twice.
        for sign, both in ((1.0, "P"), (-1.0, "N")) if begins and slot.endings else ():
            ways = [[each for each in of if each[1] == sign and "," not in each[0]] for of in (begins, slot.endings)]
            if all(ways):
                yield from (
                    line for name, of in zip("BE", ways, strict=True) for line in _class(f"{both}{name}_{own}", of)
                )
                told.append(
                    f"{_of(f'{both}B_{own}')} {measure} {both}E_{own}".replace(
                        f"{both}E_{own}", f"{both}E_{own}".upper()
                    )
                )
        quoted = " | ".join(f'"{noun}"' for noun in words.nouns)
        told += (
            [f"{measure} ({quoted}) {_of(f'EN_{own}')}"]
            if slot.endings and words.nouns and slot.kind == "length"
            else []
        )
        # "a bit narrower", where "a bit" is no way of its own.
        unsigned = all(isinstance(value, float) and value > 0.0 for _, value in plain)
        vague = [_of(f"PH_{own}")]
        vague += [f"{_of(f'PH_{own}')} {_of(f'EN_{own}')}"] if slot.endings and unsigned else []
        vague += [f"{_of(f'BE_{own}')} {_of(f'PH_{own}')}"] if begins else []
        sign = next((value for phrase, value in slot.beginnings if not phrase), 1.0)
        if sign != 1.0:
            told[0] = f"of+={sign} {measure}"
        yield f"value_{own} : product"
        yield from (f"  = {way}" for way in told)
        if plain:
            yield f"vague_{own} : vague"
            yield from (f"  = {way}" for way in vague)
    field = slot.argument.replace(" ", "__")
    yield f"said_{own} : slot"
    if plain and numeric and not begins:
        # "a moment, say ten seconds"; "from a small height, about an inch"; but "up a little, down a little" are two
        yield f'  = PH_{own} "," {field}:value_{own}'.replace(f"PH_{own}", f"PH_{own}".upper())
    if plain:
        # "by half a turn"
        yield f'  = ("by" | "through")? {field}:vague_{own}' if numeric else f"  = {field}:{f'PH_{own}'.upper()}"
    filler = {
        "object": "alone",
        "pair": "two_things",
        "name": "name",
        "pose": "name",
        "point": "point_in_space",
        "speed": "rate",
    }.get(slot.kind) or (f"value_{own}" if numeric else "")
    for preposition in slot.prepositions if filler else ():
        before = "".join(f'"{word}" ' for word in preposition.split())
        yield f"  = {'RIGHTLY? ' if before else ''}{before}{field}:{filler}"
        if slot.kind == "object":
            # "over the red, the green and the blue cube"
            yield f"  = {before}{field}:one_by_one"
            yield from [f"  = {field}:from_one_to_another"] * (preposition == "over")
        if slot.kind == "point" and slot.argument in (*words.required, *words.needed):
            yield f"  = {before}{field}:points_in_order"


def _of(name: str) -> str:
    return f"of+:{name.upper()}"


def _class(name: str, phrases: Sequence[tuple[str, float | str]]) -> Iterator[str]:
    if phrases:
        yield name.upper()
        yield from (f"  {value} = {phrase}" for phrase, value in dict(phrases).items())
