"""Forms of English words: plurals of nouns, and what verbs are in third person, in -ing and as participles."""

from __future__ import annotations

import re

_IRREGULAR: dict[str, tuple[str, ...]] = {
    "put": ("puts", "putting"),
    "set": ("sets", "setting"),
    "get": ("gets", "getting", "got"),
    "let": ("lets", "letting"),
    "grab": ("grabs", "grabbing", "grabbed"),
    "nab": ("nabs", "nabbing", "nabbed"),
    "snag": ("snags", "snagging", "snagged"),
    "pop": ("pops", "popping", "popped"),
    "plop": ("plops", "plopping", "plopped"),
    "drop": ("drops", "dropping", "dropped"),
    "stick": ("sticks", "sticking", "stuck"),
    "lay": ("lays", "laying", "laid"),
    "leave": ("leaves", "leaving", "left_"),
    "slot": ("slots", "slotting", "slotted"),
    "slip": ("slips", "slipping", "slipped"),
    "tap": ("taps", "tapping", "tapped"),
    "swap": ("swaps", "swapping", "swapped"),
    "shut": ("shuts", "shutting", "shut"),
    "build": ("builds", "building", "built"),
    "make": ("makes", "making", "made"),
    "take": ("takes", "taking", "taken", "took"),
    "throw": ("throws", "throwing", "thrown"),
    "bring": ("brings", "bringing", "brought"),
    "send": ("sends", "sending", "sent"),
    "hold": ("holds", "holding", "held"),
    "seize": ("seizes", "seizing", "seized"),
    "go": ("goes", "going", "gone", "went"),
    "come": ("comes", "coming", "came"),
    "rise": ("rises", "rising", "risen", "rose"),
    "sink": ("sinks", "sinking", "sunk", "sank"),
    "spin": ("spins", "spinning", "spun"),
    "swing": ("swings", "swinging", "swung"),
    "draw": ("draws", "drawing", "drawn", "drew"),
    "bend": ("bends", "bending", "bent"),
    "drive": ("drives", "driving", "driven", "drove"),
    "give": ("gives", "giving", "given", "gave"),
    "slide": ("slides", "sliding", "slid"),
    "drag": ("drags", "dragging", "dragged"),
    "tip": ("tips", "tipping", "tipped"),
    "choose": ("chooses", "choosing", "chosen"),
    "bin": ("bins", "binning", "binned"),
    "pat": ("pats", "patting", "patted"),
    "hit": ("hits", "hitting"),
    "grip": ("grips", "gripping", "gripped"),
    "transfer": ("transfers", "transferring", "transferred"),
    "carry": ("carries", "carrying", "carried"),
    "tidy": ("tidies", "tidying", "tidied"),
    "empty": ("empties", "emptying", "emptied"),
    "lie": ("lies", "lying"),
    "be": (),
}


def inflections(verb: str) -> tuple[str, ...]:
    """Return the forms of a verb's first word: base, third person, -ing, participle."""
    if verb in _IRREGULAR:
        return (verb, *_IRREGULAR[verb])
    third = verb + ("es" if verb.endswith(("s", "sh", "ch", "x", "z")) else "s")
    stem = verb[:-1] if verb.endswith("e") else verb
    if re.fullmatch("[^aeiou]*[aeiou][^aeiouwxy]", verb):
        # "dip", "dipping"
        stem += verb[-1]
    return (verb, third, stem + "ing", stem + "ed")


def plural(noun: str) -> str:
    """Return the plural of a noun, or of a noun phrase by its last word."""
    if noun.endswith(("s", "x", "ch", "sh")):
        return noun + "es"
    return noun[:-1] + "ies" if noun.endswith("y") and noun[-2] not in "aeiou" else noun + "s"
