"""Notation of programs, work instructions and data sheets in a prompt, written out: calls, step labels, ranges, axes, times.

It is rewritten before names are looked for, so every rule leaves words and ids as they are.
"""

from __future__ import annotations

import re

from robosandbox.agent.language import lazy_regex

_BETWEEN = {
    "put": "to", "place": "to", "move": "to", "transfer": "to", "drop": "to", "pick_and_place": "to", "pick_place": "to",
    "put_in": "in", "place_in": "in", "drop_in": "in", "insert": "in", "put_into": "in", "place_into": "in",
    "put_on": "on", "place_on": "on", "stack": "on", "stack_on": "on", "pour": "into", "pour_into": "into",
    "place_beside": "next to", "put_beside": "next to", "place_next_to": "next to", "swap": "and",
}  # fmt: skip
"""What stands between the two things that a call takes."""
_ARGUMENT = r"\s*[\"']?([A-Za-z_][\w ]*?)[\"']?\s*"
_CALL_OF_TWO = lazy_regex.compile(
    rf"(?:\b(?:robot|arm|gripper)\.)?\b({'|'.join(_BETWEEN)})\({_ARGUMENT},{_ARGUMENT}\)", re.IGNORECASE
)
_ANY_CALL_OF_TWO = lazy_regex.compile(rf"\b([a-z_]{{4,}})(?=\({_ARGUMENT},{_ARGUMENT}\))", re.IGNORECASE)
_CALL_OF_ONE = lazy_regex.compile(rf"(?:\b(?:robot|arm|gripper)\.)?\b([a-z_]+)\({_ARGUMENT}\)", re.IGNORECASE)
_CALL_OF_NONE = lazy_regex.compile(r"(?:\b(?:robot|arm|gripper)\.)?\b([a-z_]+)\(\s*\)", re.IGNORECASE)
_LABEL = (
    r"(?:(?:(?:step|task|operation|op|phase|stage|action|command|cmd|seq|item|point|no|nr|pos|[tsp#])\.?\s*#?\s*)?"
    r"\(?{number}(?:[.):]|\s+[-=]+>?)|(?:step|task|phase|stage|action)\s+{word}(?:[:,]|\s+[-=]+>?)|\(?{roman}\))\s+(?=[a-z])"
)
"""What opens step `number`: "1.", "(1)", "T1:", "step 1:", "op #1 -", "step one:", "i)"."""
_WORDS = ("zero", "one", "two", "three", "four", "five", "six", "seven", "eight", "nine", "ten")
_ROMAN = ("", "i", "ii", "iii", "iv", "v", "vi", "vii", "viii", "ix", "x")
_LENGTH = r"(\d[\d.]*\s?(?:mm|cm|m))"
_CHANGE = lazy_regex.compile(rf"(?<=\s)(?:by\s+)?[dΔ]([xy])\s*[=:]?\s*([-+−]?)\s*{_LENGTH}\b", re.IGNORECASE)
_ALONG = lazy_regex.compile(
    rf"(?<=\s)(?:by\s+)?([-+−])\s?{_LENGTH}\s+(?:in |along |on )?([xy])\b(?!\s*[-=\d])", re.IGNORECASE
)
_CALL_AT = lazy_regex.compile(
    rf"\b(?:put|place|move|place_at|put_at|move_to)\({_ARGUMENT},\s*\(?\s*(-?[\d.]+)\s*,\s*(-?[\d.]+)\s*\)?\s*\)",
    re.IGNORECASE,
)
_CALL_ALONG = lazy_regex.compile(
    rf"\b(push|slide|move)\({_ARGUMENT},\s*[\"']?(left|right|forwards?|backwards?|back)[\"']?\s*(?:,\s*([\d.]+ ?[cm]?m)\s*)?\)",
    re.IGNORECASE,
)
_RANGE = lazy_regex.compile(
    r"\b([a-z]{2,}s) (?:no\.?\s|nos\.?\s)?[#\[(]?(\d+)(?:\s*[-–—]\s*|\.{2,}|…)#?(\d+)[\])]?(?!\s?[-–—](?![->])|\d|\.\d|\s*(?:cm|mm|m|inch|inches|times|x)\b)",
    re.IGNORECASE,
)
_NAMED_RANGE = lazy_regex.compile(
    r"\b([a-z]+)([_ ]?)(\d+)(?:[-–—]|\.{2,}|…| (?:through|thru) )\1\2(\d+)\b", re.IGNORECASE
)
_LETTERS = lazy_regex.compile(
    r"\b([a-z]{2,}s) ([a-w])(?: ?[-–—] ?|\.{2,}|…)([a-w])(?!\s?[-–—](?![->])|\w)", re.IGNORECASE
)
_HEADING = lazy_regex.compile(
    r"^\s*(?:seq|sequence|prog|program|cmd|cmds|req|todo|to-do|instr|instruction|instructions)\s*:\s+(?=\w)",
    re.IGNORECASE,
)
_NOT_APPLICABLE = lazy_regex.compile(
    r"[:=]?\s+\(?n/a\b\)?[\s,:(-]*(?:(?:to )?(?:stays?|remains?)\b\)?)?|[:=]\s*\(?(?:stays?|remains?)\)?(?=\s*(?:[.,;]|$))",
    re.IGNORECASE,
)
_TIMES = lazy_regex.compile(r"(?<=\s)[x×*] ?([2-9])(?=\s*(?:[.,;!?)]|$))|(?<=[\s(])([2-9]) ?[x×](?=\s*(?:[.,;!?)]|$))")
_OF_SKILLS = {
    ("pick", "object"): "pick up {object}",
    ("tap", "object"): "tap {object}",
    ("open_drawer", "drawer"): "open {drawer}",
    ("close_drawer", "drawer"): "close {drawer}",
    ("open", "part"): "open {part}",
    ("close", "part"): "close {part}",
    ("press", "part"): "press {part}",
    ("place_in", "container"): "place in {container}",
    ("place_on", "target"): "place on {target}",
    ("pour", "target"): "pour into {target}",
    ("place_at", "x", "y"): "place at {x}, {y}",
    ("stack", "object", "target"): "stack {object} on {target}",
    ("push", "object", "direction"): "push {object} {direction}",
    ("push", "object", "direction", "distance"): "push {object} {direction} {distance} m",
}
"""Calls as plans print them, by skill and names of arguments."""
_NAMED_CALL = lazy_regex.compile(
    r"\b([a-z_]+)\((\s*\w+\s*=\s*[\"']?[\w.-]+[\"']?\s*(?:,\s*\w+\s*=\s*[\"']?[\w.-]+[\"']?\s*)*)\)", re.IGNORECASE
)


_OF_TABLE = re.compile(r"\b(?:the )?table(?:['’]s)? (center|centre|middle)\b", re.IGNORECASE)
_FROM_MIDDLE = re.compile(r"\bfrom(?= the (?:center|centre|middle) of the table\b)", re.IGNORECASE)
_OF_WHOLE = re.compile(
    r"\bthe (\w+)['’]s ((?:(?:top|middle|bottom|upper|lower|left|right|front|back) )?"
    r"(?:drawer|door|knob|button|lid|compartment|layer|shelf|front|back))\b",
    re.IGNORECASE,
)


def written_out(text: str) -> str:
    """Return a prompt with its notation in words: "place_in(nut, tray)" as "place nut in tray", "cubes 1–3" as "cubes 1 to 3"."""
    if "(" in text:
        text = re.sub(r"(?<=[a-z])\(s\)", "s", text)
        text = _NAMED_CALL.sub(_named_call, text)
        text = _CALL_AT.sub(r"put \1 at \2, \3 ", text)
        text = _CALL_ALONG.sub(lambda call: f"{call[1]} {call[2]} {call[3]} {call[4] or ''} ", text)
        text = _ANY_CALL_OF_TWO.sub(_respelled_call, text)
        text = _CALL_OF_TWO.sub(_call_of_two, text)
        text = _CALL_OF_ONE.sub(lambda call: f"{call[1].replace('_', ' ')} {call[2]} ", text)
        text = _CALL_OF_NONE.sub(lambda call: f"{call[1].replace('_', ' ')} ", text)
    text = _FROM_MIDDLE.sub("in", _OF_TABLE.sub(r"the \1 of the table", text))
    text = _OF_WHOLE.sub(r"the \2 of the \1", text)
    text = _HEADING.sub("", text)
    text = _NAMED_RANGE.sub(r"\1s \3 to \4", text)
    text = _RANGE.sub(r"\1 \2 to \3", text)
    text = re.sub(r"(?<=\d)[–—](?=\d)", "-", _LETTERS.sub(_letters, text))
    text = _NOT_APPLICABLE.sub(" stays ", text)
    text = re.sub(r"\s*<(?:-+|=+)\s+(?=\w)", " gets ", text)
    text = re.sub(
        r"(?<=\s)@\s*(?=[(\d.-]|[xy]\b)", "at ", re.sub(r"(?<=\s)@\s*(?=[a-z_]{2})", "to ", text, flags=re.IGNORECASE)
    )
    text = _CHANGE.sub(lambda change: f"{change[2] or '+'}{change[1]} {change[3]}", text)
    text = re.sub(r"(?<=\s)by\s+(?=[-+−] ?[xy]\b)", "", _ALONG.sub(r"\1\3 \2", text), flags=re.IGNORECASE)
    if not re.search(r"\by(?![a-z])", text):
        text = _TIMES.sub(lambda times: f"{times[1] or times[2]} times", text)
    return re.sub(r"\b([xy]\s*[=:]?)\s*minus\s+(?=\d)", r"\1 -", text, flags=re.IGNORECASE)


def in_steps(text: str) -> str:
    """Replace "1. ... 2. ...", "T1: ... T2: ...", "step 1: ... step 2: ..." by sentences."""
    start, number = 0, 1
    while number < len(_WORDS):
        label = _LABEL.format(number=number, word=_WORDS[number], roman=_ROMAN[number])
        match = re.compile(rf"(?:^|(?<=[\s.;,])){label}", re.IGNORECASE).search(text, start)
        if match is None:
            break
        if number == 1 and text[: match.start()].strip(" ,"):
            break
        text = f"{text[: match.start()]} . {text[match.end() :]}"
        start, number = match.start() + 3, number + 1
    return text


def _named_call(call: re.Match[str]) -> str:
    named = dict(re.findall(r"(\w+)\s*=\s*[\"']?([\w.-]+)", call[2]))
    form = _OF_SKILLS.get((call[1].lower(), *named))
    return f"{form.format(**named)} " if form else call[0]


def _call_of_two(call: re.Match[str]) -> str:
    name = call[1].lower()
    verb = "put" if name.startswith("pick") else "swap" if name == "swap" else name.split("_")[0]
    return f"{verb} {call[2]} {_BETWEEN[name]} {call[3]} "


def _respelled_call(call: re.Match[str]) -> str:
    """As in "stcak(cup, tray)": without its name nothing tells which of the two goes where."""
    from rapidfuzz.distance import OSA

    name = call[1].lower()
    near = [known for known in _BETWEEN if OSA.distance(name, known, score_cutoff=1) == 1]
    return near[0] if len(near) == 1 and name not in _BETWEEN else call[1]


def _letters(match: re.Match[str]) -> str:
    rising = match[2].islower() == match[3].islower() and match[2] < match[3]
    return f"{match[1]} {match[2]} to {match[3]}" if rising else match[0]
