"""Properties of things by their names: of metal or wood, edible, soft, sharp; true, false or not known."""

from __future__ import annotations

from robosandbox.agent.language.match import NOUN_CLASS
from robosandbox.agent.language.scene_words import id_parts
from robosandbox.agent.language.things import ABSENT_NOUNS, KINDS_OF
from robosandbox.agent.language.wordlist import word_set

_EDIBLE = (
    KINDS_OF["food"]
    | KINDS_OF["fruit"]
    | KINDS_OF["vegetable"]
    | KINDS_OF["snack"]
)  # fmt: skip
_METAL = word_set(
    """
    metal steel iron aluminium aluminum copper brass tin can bolt nut screw nail washer wrench spanner hammer coin key
    chain spring gear knife fork spoon scissors pliers screwdriver pan kettle whisk ladle chisel saw drill needle pin
    paperclip clip padlock bell wire hook trowel
    """
)
_WOOD = word_set("wood wooden oak pine timber plank log twig chopsticks toothpick pencil dowel plywood matchstick")
_OTHER: dict[str, frozenset[str]] = {
    "plastic": word_set("plastic lego toothbrush comb"),
    "rubber": word_set("rubber eraser tyre"),
    "glass": word_set("glass marble lens mirror"),
    "ceramic": word_set("ceramic porcelain mug cup teacup saucer plate vase teapot china"),
    "stone": word_set("stone rock pebble brick concrete marble"),
    "paper": word_set(
        "paper cardboard book notebook newspaper magazine envelope letter card ticket box carton napkin tissue"
    ),
    "cloth": word_set("cloth towel rag sock shirt glove scarf hat sponge teddy cushion pillow bean_bag cotton wool"),
}
_SOFT = word_set("sponge towel cloth rag sock shirt glove scarf teddy pillow cushion plush marshmallow tissue napkin")
_SHARP = word_set("knife scissors saw needle nail scalpel cutter chisel pin razor blade")
_MADE: dict[str, frozenset[str]] = {"metal": _METAL, "wood": _WOOD, **_OTHER}
_CLAIMED: dict[str, str] = {
    "metal": "metal", "metallic": "metal", "wooden": "wood", "wood": "wood", "plastic": "plastic", "rubber": "rubber",
    "rubbery": "rubber", "glass": "glass", "ceramic": "ceramic", "porcelain": "ceramic", "paper": "paper",
    "cardboard": "paper", "cotton": "cloth", "woollen": "cloth",
}  # fmt: skip
_KNOWN = frozenset(word for words in _MADE.values() for word in words) | _EDIBLE
_INEDIBLE = _KNOWN - _EDIBLE | word_set(
    "block cube ball bar battery bottle tray bowl basket bin crate bucket drawer tool toy tape glue soap candle pen"
)


_HOUSEHOLD = word_set(
    """
    cereal ice flour sugar oats muesli porridge soup stew salad noodle noodles sauce oil syrup cream yoghurt yogurt tofu
    vial beaker pipette petri flask funnel syringe cuvette sample swab dish rack stand holder case parcel package
    postcard stamp label badge pad mat coaster lid cork cap stopper bottle jug kettle thermos shampoo lotion perfume
    lipstick razor sponge weight rod bar dowel plank tile pebble shell feather leaf acorn pinecone fidget yoyo kite
    puppet marble jack rattle whistle trumpet guitar violin piano radio speaker headphones mouse usb dongle adapter plug
    socket fuse resistor capacitor chip board motor servo sensor wheel axle pulley lens prism compass protractor calculator
    sticky note notes clip pushpin tack band string twine yarn thread needle button zip ribbon foil film medicine pill
    plaster bandage mask thermometer stethoscope trowel pot seed seeds bulb bottle_opener corkscrew grater strainer deck
    domino joker loupe magnifier ingot microphone amplifier paint paintbrush palette varnish sandpaper easel canvas
    """
)
_NAMED = (
    _HOUSEHOLD
    | _KNOWN
    | _INEDIBLE
    | ABSENT_NOUNS
    | {*NOUN_CLASS}
    | frozenset(w for words in KINDS_OF.values() for w in words)
)


def is_familiar(name: str) -> bool:
    """Say whether an object's id has a word of which it is known what sort of thing it names."""
    return any(part in _NAMED or part.rstrip("s") in _NAMED for part in id_parts(name))


def told(claim: str, name: str) -> bool | None:
    """Say what an object's id tells of an adjective: that it fits, that it does not, or nothing (None).

    Args:
        claim: The adjective ("wooden", "edible").
        name: The object's id.
    """
    parts = {part.rstrip("s") if part.endswith("s") and not part.endswith("ss") else part for part in id_parts(name)}
    parts |= set(id_parts(name))
    if claim in ("edible", "eatable"):
        return True if parts & _EDIBLE else False if parts & _INEDIBLE else None
    if claim in ("soft", "squishy", "fluffy", "sharp", "pointy"):
        words = _SHARP if claim in ("sharp", "pointy") else _SOFT
        return True if parts & words else False if parts & _KNOWN else None
    stuff = _CLAIMED.get(claim)
    if stuff is None:
        return None
    if claim in parts or stuff in parts:
        return True
    if any(other in parts for other in _MADE if other != stuff):
        # A wood block is no block of metal, whatever blocks are made of.
        return False
    return True if parts & _MADE[stuff] else False if parts & _KNOWN else None
