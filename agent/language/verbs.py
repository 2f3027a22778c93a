"""The verbs people use, by what they make the arm do, with their inflections."""

from __future__ import annotations

from robosandbox.agent.language.wordlist import phrase_list, word_set

VERBS: dict[str, str] = {
    "pick": (
        "pick, pick up, grab, grab hold of, grasp, get, get hold of, get a hold of, fetch, take, take hold of, "
        "lift, lift up, "
        "raise, hoist, hold, hold on to, hold onto, catch, seize, snatch, snatch up, collect, retrieve, clutch, grip, "
        "clasp, acquire, "
        "nab, snag, scoop up, pick out, choose, select, secure, elevate, remove, extract, take out, clamp, gather, "
        "gather up, go get, go grab, go pick up, go fetch, go and get, go and grab, go and pick up, go and fetch, "
        "go take, "
        "pull up, pluck, bag, hoist up, latch onto"
    ),
    "put": (
        "put, lower, place, set, lay, position, rest, deposit, pop, stick, plop, plonk, plunk, dump, "
        "stash, store, "
        "leave, insert, load, transfer, relocate, carry, deliver, transport, bring, send, tuck, slot, drop off, "
        "stow, bung, "
        "lob, whack, settle, arrange, balance, perch, situate, haul, ferry, return, drop, plant, pile, "
        "install, locate, dispose of, discard, bin, throw away, get rid of, set down, put down, place down, "
        "lay down, hang, "
        "whisk, slap, center, centre, cram, stuff, fit, plump, land, dunk, file, pack, slip, bring over, hoick, wedge, "
        "push down, hide, stand, shelve, serve, ship, release, collect, gather, gather up, round up, heap"
    ),
    "load": "load, fill, load up, fill up, stock, pack",
    "discard": (
        "throw away, throw out, chuck out, chuck away, toss out, toss away, bin, trash, dispose of, discard, get rid of, scrap, junk, ditch"
    ),
    "move": "move, shift, get, take, reposition, scoot, displace, budge, advance, transfer, relocate, bring",
    "throw": "throw, toss, chuck, lob, sling, fling, hurl, pitch",
    "relocate": "move, shift, relocate, reposition, transfer",
    "push": (
        "push, shove, slide, nudge, drag, pull, tug, haul, scoot, poke, prod, press, thrust, sweep, knock, bump, "
        "edge, translate, jog, "
        "jostle, inch, propel, bulldoze, scooch, drive, glide, wheel, draw, give a push, give a shove, give a nudge"
    ),
    "release": (
        "release, let go, let go of, drop, put down, set down, lay down, place down, let loose, unhand, let down, lower"
    ),
    "stack": "stack, stack up, pile, pile up, heap, heap up, build up",
    "build": "build, make, construct, create, erect, form, assemble, build up",
    "pour": "dump, sow, pour, pour out, tip, tip out, empty, decant, empty out, dump out, spill",
    "open": "open, open up, pull open, slide open, unclose",
    "close": "close, shut, close up, push shut, slide shut, push closed, slide closed",
    "tap": (
        "tap, touch, bop, poke, press, tap on, press on, prod, boop, press down on, pat, push down on, hit, bump, "
        "knock on, dab, contact"
    ),
    "swap": (
        "change places, change positions, trade places, swap, switch, exchange, trade, interchange, swap over, switch over, swap around, switch around, "
        "transpose, swap round"
    ),
    "sort": (
        "sort, sort out, organise, organize, group, separate, arrange, categorise, categorize, distribute, "
        "classify, divide"
    ),
    "line_up": "line up, align, arrange, set up, lay out, line",
    "unstack": (
        "unstack, dismantle, take apart, disassemble, take down, break down, break up, knock down, destack, tear down"
    ),
    "tidy": (
        "tidy, tidy up, clean up, clear, clear up, clear off, clear out, tidy away, clear away, put away, "
        "pack away, clean out"
    ),
    "clean": "clean",
    "empty": "empty, empty out, clear out, unload, clear off",
    "go": (
        "go, return, move, come, drive, get, head, travel, retreat, retract, go back, come back, move back, "
        "get back, head back, return back, be"
    ),
    "home": (
        "take a break, take a rest, relax, come back, home, rehome, reset, retract, go home, park, stow, return home, retreat, head home, come home, "
        "go to sleep, stand down"
    ),
    "want": "want, need, require, like, love, prefer, wish",
    "give": "give, hand, pass, hand over, serve, lend, present, offer",
}
"""Canonical verb -> how it is said. A word may stand under several: the arguments decide."""

UNSUPPORTED_VERBS = word_set(
    """
    rotate turn spin flip twist tilt roll paint colour color cut slice chop break smash crush destroy eat drink
    cook bake boil fry wash wipe dry clean scrub dust weld solder screw unscrew drill hammer nail sew knit fold
    unfold wrap unwrap tie untie juggle dance sing play jump hop walk run fly swim wave point nod bow look see
    watch find search scan inspect examine check identify describe tell say speak talk explain show list count
    measure weigh read write draw print type call email text ring buy sell order pay throw kick punch slap bite
    lick kiss hug tickle scratch squeeze crumple bend stretch fling shake stir mix blend whisk swirl sharpen
    polish glue tape staple pin clip attach detach connect disconnect plug unplug switch start stop halt pause
    freeze wait sleep wake calibrate initialise initialize shutdown restart reboot record film photograph snap
    assemble repair fix build charge recharge learn teach train remember forget think imagine pretend guess
    predict calculate compute solve translate seek chase follow catch bounce dribble shoot fire burn light
    ignite melt freeze heat cool warm water feed plant dig hang hook unhook lock unlock lever peel crack pierce
    stab poison kill attack fight hurt hit knock topple tip overturn invert straighten align orient reorient
    levitate teleport duplicate copy clone delete erase shrink grow enlarge resize open_gripper balance vacuum
    sweep mop iron feel smell taste hear listen help do be have unscrew salute high-five clap snap whistle applaud
    wiggle jiggle vibrate rattle wobble trace circle hover orbit tidy celebrate shrug blink bless curse hack
    repeat undo redo cancel abort continue resume compare sanitize sterilize assess evaluate verify confirm answer
    reply ask greet thank apologize name rename label mark stamp sign scribble sketch design engrave sand saw
    plane file varnish decorate garnish season toast butter spread sprinkle squirt spray hose dunk dip soak rinse
    fill refill drain siphon pump inflate deflate
    """
)
"""Things people may ask of a robot and this one has no skill for; known, so that the refusal can be exact."""

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
    "go": ("goes", "going", "gone"),
    "come": ("comes", "coming"),
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
    return (verb, third, stem + "ing", stem + "ed")


BASE_FORMS = frozenset(phrase.split()[0] for phrases in VERBS.values() for phrase in phrase_list(phrases))
"""How verbs begin that ask for something; "picked up the can" and "picks up the can" tell of it."""


def forms(phrase: str) -> tuple[str, ...]:
    """Return every inflected form of a verb phrase ("pick up" -> "picking up", ...)."""
    first, _, rest = phrase.partition(" ")
    return tuple(f"{form} {rest}".strip() for form in inflections(first))
