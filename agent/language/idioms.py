"""Verbs and idioms of everyday speech, each with the plain verb that the grammar knows; tried where a command begins."""

from __future__ import annotations

import re

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
        "take across, carry across, carry over, carry off, transfer over, sit down, set up, place back, set back, chuck, "
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
    ),
    "pour": "slosh, dribble, upend, tip the contents of, transfer the contents of, empty the contents of, dump the contents of, tip up",
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
_OPENING = r"(^|[,.;!:?]|and|then|to|you|but|start|try|would|could|can|not|i want)"
_FOUND = re.compile(
    rf"(?:(?<=\s)|^)({_OPENING[1:-1]}) ({'|'.join(map(re.escape, sorted(PLAIN, key=len, reverse=True)))}) (?!$|[,.;!?:] |and |then )"
)
_HOMEWARD = re.compile(
    rf"(?:(?<=\s)|^)({_OPENING[1:-1]}) ({'|'.join(sorted((p for p, v in PLAIN.items() if v == 'go home'), key=len, reverse=True))})"
    r"(?= (?:[,.;!?]|and|then|now) | $)"
)
_DRAWER = r"((?:the |that |this |my |your )?(?:\w+ ){0,2}?(?:drawer|cabinet|cupboard|drawers)(?: \w)?)"
_SPLIT: tuple[tuple[re.Pattern[str], str], ...] = tuple(
    (re.compile(pattern), replacement)
    for pattern, replacement in (
        (rf" (?:yank|crack|pop|jerk|ease|fling|tug|pull|draw|slide|pry|prise|swing|throw|wrench|whip|get|roll) {_DRAWER} (?:open|out|ajar)(?= )", r" open \1"),
        (rf" (?:slam|push|shove|ease|bang|snap|pull|draw|nudge|slide|pop|knock|bump|press|swing|roll|get|put) {_DRAWER} (?:back )?(?:shut|closed|in|to|home|closed up)(?= (?:[,.;!?]|and|then|again) | $)", r" close \1"),
        (rf" (?:pull|slide|draw|roll) out {_DRAWER}(?= )", r" open \1"),
        (rf" (?:push|slide|shove|press) (?:back )?in {_DRAWER}(?= )", r" close \1"),
    )
)  # fmt: skip


def plainly(text: str) -> str:
    """Return a sentence, its words joined by spaces, with plain verbs for those of everyday speech."""
    for pattern, replacement in _SPLIT:
        text = pattern.sub(replacement, text)
    text = _HOMEWARD.sub(r"\1 go home", text)
    return _FOUND.sub(lambda match: f"{match[1]} {PLAIN[match[2]]} ", text)
