"""Verbs and idioms of everyday speech, each with the plain verb that the grammar knows; tried where a command begins."""

from __future__ import annotations

from collections.abc import Sequence

from robosandbox.agent.language.lexicon import Phrases
from robosandbox.agent.language.speech import OPENERS
from robosandbox.agent.language.tokens import MARKS, Token
from robosandbox.agent.language.wordlist import phrase_list

_HANDS = ("hands", "claws", "fingers", "gripper", "hand", "claw", "paws", "mitts", "grippers", "pincers")
_IDIOMS: dict[str, str] = {
    "pick up": (
        "lay hold of, lay hands on, get a grip on, get a grip of, get a hold on, get a good hold of, "
        "reach out and take, reach out and grab, reach over and grab, reach over and take, heave, heave up, "
        "snap up, fish out, fish up, dig out, dig up, uplift, upraise, yank up, haul up, jack up, hike up, heft, capture, "
        "catch hold of, take up, swipe, nick, pinch, cop, grapple, lift off, hold up, bring up, help yourself to, procure, "
        "obtain, claim, take possession of, snaffle, pull up, scoop, latch on to, clutch at, clasp hold of, "
        "seize hold of, grab a hold of, grab on to, grab onto, grab up, grip hold of, winch up, whip off, "
        "take a firm hold of, take a good hold of, go and lift, go and take, go over and grab, go lift, come and get, "
        "have a hold of, have hold of, take to hand, get up, lift aloft, hold aloft, raise aloft, hold in the air"
    ),
    "put": (
        "nestle, seat, lodge, park, dispatch, convey, mount, prop, prop up, ensconce, house, bed, sit, cart, cart off, lug, "
        "shuttle, tote, guide, usher, escort, shepherd, route, consign, commit, relegate, post, sneak, shoehorn, jam, dock, "
        "station, schlep, move over, shift over, sink, flop, squirrel away, tuck away, stow away, store away, "
        "file away, hide away, smuggle, embed, slide over, whip over, whisk over, whisk off, drop off, "
        "take and put, go put, go and put, get and put, pick and put, pick and place, grab and put, take over, bring across, "
        "take across, carry across, carry over, carry off, transfer over, sit down, set up, place back, set back, "
        "lay out, plonk down, plunk down, plop down, pop down, stick down, bang down, dump down, put down, introduce, add, drop down, "
        "lever, ease down, let down, rehouse, reposition"
    ),
    "move": "ease, coax, manoeuvre, maneuver, steer, work, wangle, hump, heave over, get over",
    "push": (
        "shunt, shuffle, skid, shimmy, budge, force, urge, scrape, tow, yank, jerk, hustle, creep, give a push to, "
        "nudge along, push along, slide along, shove along, shove over, push over, nudge over, scoot over, slide across, "
        "push across, draw over, scoot along, elbow, shoulder, trundle, squish, heave along, press on with"
    ),
    "open": (
        "yank open, crack open, pop open, jerk open, ease open, fling open, tug open, draw open, slide out, unshut, pry open, "
        "prise open, swing open, throw open, haul open, wrench open, nudge open, push open, bring open, roll open, whip open"
    ),
    "close": "slam, slam shut, ease shut, bang shut, snap shut, pull shut, draw shut, nudge shut, swing shut, knock shut, roll shut, seal up, bump shut",
    "tap": (
        "rap, rap on, make contact with, lay a finger on, put a finger on, tap at, pat on, peck, peck at, bonk, touch upon, knock upon, "
        "touch down on, lightly touch, briefly touch, tap upon, make a tap on, come into contact with, get in touch with, "
        "boop on, bop on, high five, get in contact with, tap lightly on"
    ),
    "go home": (
        "return to base, return to your base, go back to base, go back to your base, fall back, withdraw, back to base, "
        "back to your base, back to start, go to your resting place, get yourself home, take yourself home, bring yourself home, "
        "assume your home position, assume the home position, take up your home position, resume your home position, take your home position, "
        "go to bed, call it a day, go and rest, have a rest, take five, have a break, return yourself home"
        + "".join(f", {go}{rest} {at} {home}" for go in ("", "go ") for rest in ("rest", "relax", "settle", "sleep", "park", "stay", "retire", "wait")
                  for at in ("at", "in") for home in ("home", "your home position", "the home position"))
    ),
    "pour": "slosh, dribble, sprinkle, scatter, drizzle, upend, tip the contents of, transfer the contents of, empty the contents of, dump the contents of, tip up",
    "swap": "flip flop, change over, change round, change around, do a swap of, do a swap with, make a swap of",
    "tidy": "declutter, neaten up, spruce up",
}  # fmt: skip
_IDIOMS["pick up"] += "".join(
    f", {get} your {hands} {on}"
    for get in ("get", "put", "lay", "wrap", "close", "clamp", "clasp", "place")
    for hands in _HANDS
    for on in ("on", "around", "round", "over", "onto")
    if get in ("wrap", "close", "clamp", "clasp") or (get in ("get", "lay") and on in ("on", "around"))
)
PLAIN: dict[str, str] = {phrase: verb for verb, phrases in _IDIOMS.items() for phrase in phrase_list(phrases)}
OPENING = frozenset(phrase.split()[0] for phrase in PLAIN)
"""How idioms begin."""
_PHRASES = Phrases()
for _phrase, _verb in PLAIN.items():
    _PHRASES.add(_phrase, "IDIOM", _verb)


def plainly(tokens: Sequence[Token]) -> tuple[Token, ...]:
    """Return the tokens with plain verbs for those of everyday speech, where a command begins."""
    made: list[Token] = []
    i, n = 0, len(tokens)
    while i < n:
        opens = i == 0 or tokens[i - 1].text in OPENERS or [t.text for t in tokens[max(0, i - 2) : i]] == ["i", "want"]
        for end, _, verb in sorted(_PHRASES.at(tokens, i) if opens else (), key=lambda hit: -hit[0]):
            closed = end == n or tokens[end].text in MARKS or tokens[end].text in ("and", "then")
            if verb == "go home" or not closed:
                made += [Token(word, word, "word") for word in str(verb).split()]
                i = end
                break
        else:
            made.append(tokens[i])
            i += 1
    return tuple(made)
