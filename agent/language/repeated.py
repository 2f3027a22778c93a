"""Orders that are done several times over: “open and close the gripper three times”, “every two seconds wave, three times”."""

from __future__ import annotations

import re
from collections.abc import Callable, Collection
from dataclasses import replace

from robosandbox.agent.language.draft import Draft, Step
from robosandbox.types import Refusal, RefusalCode, SkillCall

_COUNTED = ("one", "two", "three", "four", "five", "six", "seven", "eight", "nine", "ten")
TIMES = {"once": 1, "just once": 1, "one time": 1, "twice": 2, "thrice": 3, "a couple of times": 2, "a few times": 3}
TIMES |= {f"{word} times": number for number, word in enumerate(_COUNTED, 1) if number > 1}
TIMES |= {f"{phrase} each": count for phrase, count in TIMES.items()}
# How often something may be done over.
_MOST = 20
# "five rounds", "three repetitions of that"
_ROUNDS = r"(?: full| complete| more)? (?:rounds?|cycles?|repetitions?|repeats?|reps?|loops?|goes)"
_OFTEN = "|".join(
    sorted(
        (
            *(words for words, times in TIMES.items() if times > 1),
            r"(?:just )?once(?= ?[.!]?$)",
            r"\d+ times?",
            r"\d+ ?x(?= ?:)",
            r"x ?\d+(?= ?[.!]?$)",
            *(rf"{word}{_ROUNDS}" for word in _COUNTED[1:]),
            rf"\d+{_ROUNDS}",
        ),
        key=len,
        reverse=True,
    )
)
_TIMES = re.compile(
    rf"\b(?P<often>{_OFTEN})(?: in a row| over(?! the\b| it\b)| in all| in total| altogether)?(?: of (?:this|that|it|these|the following)\b| of(?= (?!the\b|your\b|a\b)))?\b",
    re.IGNORECASE,
)
_EVERY = re.compile(r"\b(?:once )?every (?P<pause>(?:\S+ )?(?:seconds?|minutes?|s))\b", re.IGNORECASE)
# "..., resting two seconds at each"
_AT_EACH = re.compile(
    r"[ ,]*\b(?:and )?(?:(?:resting|rest|pausing|pause|waiting|wait|stopping|stop|staying|stay|holding|hold|lingering)(?: there)?(?: for)?|for|with a (?:pause|stop|break|rest) of)"
    r" (?P<pause>(?:about |roughly )?\S+ (?:seconds?|minutes?|s)) (?:(?:at|over|above|on|before|by) )?each\b(?: one| of them| cube| thing| time| place| stop)?",
    re.IGNORECASE,
)
_PAUSED = re.compile(
    r"[ ,]*\bwith (?:an? )?(?:(?:stop|pause|break|wait|rest)s? of (?P<of>(?:\S+ )?(?:seconds?|minutes?|s))|(?P<pause>\S+[ -](?:seconds?|minutes?|s))[ -](?:stop|pause|break|wait|rest)s?)"
    r"(?: (?:in )?(?:after|between|in between)(?: each| every)?(?: one| time| move| of them| the two| them| cycles?| rounds?| repetitions?| reps)?"
    r"| at the (?:bottom|top|end)(?: (?:each|every) time| of each(?: one)?)?)\b",
    re.IGNORECASE,
)
# What only says that something is said over.
_LEADS = re.compile(
    r"^(?:please )?(?:repeat|do|run|execute|perform|make|give me|i(?:'d| would) like|i want|let(?:'s| us) have|let(?:'s| us) do)(?: (?:this|that|it|the following)(?: (?:loop|cycle|sequence|routine|motion))?)?(?=$|[ ]*[:,]| (?:this|that|it)$)"
    r"|^(?:please )?(?:repeat|do)(?: this| that| it| the following)?\b",
    re.IGNORECASE,
)
# What says that it is done over, and not how often.
_ENDLESSLY = re.compile(
    r"[ ,]*\b(?:and )?(?:then )?(?:again and again|over and over(?: again)?|time and (?:time )?again|repeatedly)\b",
    re.IGNORECASE,
)
# What says behind an order that it is done over.
_TAIL = re.compile(
    r"[ ,.;]*(?:and )?(?:then )?(?:do|repeat) (?:that|this|it|the same(?: thing)?|the whole thing|everything|all of that|(?:that|this|the)(?: whole)? (?:round|tour|trip|sequence|cycle|lot))(?P<more> again)?$|[ ,.;]*(?:and )?(?:then )?repeat$",
    re.IGNORECASE,
)
# What asks whether that is understood, or for what is told anyway.
_TAGS = re.compile(
    r"[ ,]*\b(?:ok(?:ay)?|alright|please|thanks|thank you|right|got it|and count(?: for me| aloud| out loud)?)[?!. ]*$|[?]+$",
    re.IGNORECASE,
)
_MARKS = " ,:;.!"


def _paused_at_each(prompt: str, read: Callable[[str], Draft | Refusal]) -> Draft | None:
    """Return the plan of an order that says how long is waited at each of several things; None where it is another one."""
    told = _AT_EACH.search(prompt)
    if told is None:
        return None
    order, waits = read(prompt[: told.start()] + prompt[told.end() :]), read(f"wait {told['pause']}")
    if not isinstance(order, Draft) or not isinstance(waits, Draft) or order.rest is not None:
        return None
    skills = [call.skill for call in order.calls]
    often = {skill for skill in skills if skills.count(skill) > 1}
    if len(often) != 1:
        return None
    steps = (each for step in order.steps for each in ((step, *waits.steps) if step.call.skill in often else (step,)))
    return replace(order, steps=tuple(steps))


def _number(often: str) -> int:
    """Return how often "twice", "3 times" or "five rounds" says."""
    if often in TIMES:
        return TIMES[often]
    first = often.split()[0]
    return _COUNTED.index(first) + 1 if first in _COUNTED else int(re.findall(r"\d+", often)[0])


def endlessly(prompt: str) -> tuple[str, str, bool] | None:
    """Return the words of an order that say that it is done over, as "again and again", the rest, and whether that says how often."""
    found = _ENDLESSLY.search(prompt)
    if found is None:
        return None
    rest = _ENDLESSLY.sub("", prompt)
    return found[0].strip(_MARKS), rest, _TIMES.search(rest) is not None


def several_times(prompt: str, ids: Collection[str], read: Callable[[str], Draft | Refusal]) -> Draft | Refusal | None:
    """Return the plan of an order that says how often it is done, without the words for that; None where it is another one.

    One call that is about a thing is not done over: what is picked up is held then. Nor are several about several things, unless
    the sentence says that it means all of them ("three times: ...", "... and do that three times").

    Args:
        prompt: What was said.
        ids: Of the things in the scene.
        read: Reads a sentence.
    """
    rhythm = _EVERY.search(prompt)
    # "wave twice every two seconds, three times": what is done is "wave twice".
    often = (rhythm and _TIMES.search(prompt, rhythm.end())) or _TIMES.search(prompt)
    if often is None:
        return _paused_at_each(prompt, read)
    counted = read(prompt[: often.end("often")] + prompt[often.end() :]) if often.end("often") < often.end() else None
    if isinstance(counted, Draft) and any("times" in call.arguments for call in counted.calls):
        # "nod five times in all": a stroke that counts itself.
        return counted
    order, pause = prompt[: often.start()] + prompt[often.end() :], tuple[Step, ...]()
    times = _number(often["often"].lower())
    every = _EVERY.search(order)
    rests = every or _PAUSED.search(order)
    if rests is not None:
        order = order[: rests.start()] + order[rests.end() :]
        told = rests.groupdict()
        length = told["pause"] or told.get("of") or ""
        waits = read(f"wait {length.replace('-', ' ')}")
        if isinstance(waits, Refusal):
            return None
        pause = waits.steps
    order = _TAGS.sub("", order).strip(_MARKS)
    leads = _LEADS.match(order) is not None or often.start() == 0
    if (tail := _TAIL.search(order)) is not None:
        order, times = order[: tail.start()], times + (tail["more"] is not None)
    order = _LEADS.sub("", order).strip(_MARKS)
    once = read(order) if order else None
    if not isinstance(once, Draft) or not once.steps or once.rest is not None:
        return None
    given = (value for call in once.calls for value in call.arguments.values())
    named = {value for value in given if isinstance(value, str) and value in ids}
    # Behind several clauses about several things it may be said of the last alone.
    whole = leads or tail is not None or len(named) <= 1
    if not whole or (named and len(once.calls) == 1):
        return None
    if times > _MOST:
        return Refusal(
            code=RefusalCode.UNSUPPORTED, message=f"I do things at most {_MOST} times over; say it again then."
        )
    if every is not None:
        # From the start of one to that of the next.
        since = {"since": len(once.steps)}
        pause = tuple(Step(SkillCall(skill=step.call.skill, arguments=step.call.arguments | since)) for step in pause)
    return replace(once, steps=(*once.steps, *(pause + once.steps) * (times - 1)))
