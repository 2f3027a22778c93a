"""The words for things: nouns, colours, sizes, orders, numbers, and what stands before and after a noun.

Each table maps what people say to one canonical value. Multi-word entries are matched whole.
"""

from __future__ import annotations

from robosandbox.agent.language.wordlist import phrase_list, word_set
from robosandbox.shapes import shapes

PARTS: dict[str, frozenset[str]] = {
    "drawer": word_set("drawer layer"),
    "door": word_set("door lid flap"),
    "knob": word_set("knob dial lever handle switch"),
    "button": word_set("button switch"),
    "compartment": word_set("compartment section slot"),
}
"""Words for what moves on something else, by how it moves."""
NOUNS: dict[str, str] = {
    "cube": "cube, dice, die, square",
    "block": "block, brick, building block, wooden block, cuboid, lego",
    "box": "box",
    "ball": (
        "ball, sphere, orb, marble, globe, round one, round thing, round object, round item, spherical one, spherical thing, "
        "spherical object, spherical item"
    ),
    "can": "can, tin, tin can, soda can, coke can, beer can, drink can, soda, coke, canister",
    "cylinder": (
        "cylinder, tube, barrel, drum, pillar, column, cylindrical one, cylindrical thing, cylindrical object, "
        "cylindrical item"
    ),
    "bottle": "bottle, flask",
    "mug": "mug, cup, teacup, beaker, glass, tumbler, coffee cup, coffee mug",
    "capsule": "capsule, pill",
    "bin": (
        "bin, container, tray, basket, bucket, crate, tub, pail, trash, rubbish, garbage, trash bin, rubbish bin, "
        "garbage bin, dustbin, "
        "waste bin, wastebasket, waste basket, trash can, garbage can, trashcan, recycling bin, receptacle, "
        "carton, hamper, "
        "trough, storage box, storage bin, recycle bin, wastepaper basket"
    ),
    "bowl": "bowl, dish, basin",
    "drawer": "drawer, cabinet, cupboard, cabinet drawer",
    "plate": "plate, saucer",
    "shelf": "shelf, cabinet shelf, bookshelf",
    "lid": "lid",
    "pad": "pad, mat, coaster",
    "thing": (
        "thing, object, item, piece, toy, thingy, stuff, shape, guy, article, element, thingamajig, doodad, gizmo"
    ),
    "one": "one",
    "tower": "tower, stack, pile, column, heap, pyramid",
    "handle": "handle",
    "fruit": "fruit",
    "vegetable": "vegetable, veggie, veg",
    "tool": "tool",
    "animal": "animal",
    "vehicle": "vehicle",
    "drink": "drink, beverage",
    "snack": "snack",
    "utensil": "utensil, piece of cutlery, cutlery",
    "food": "food, foodstuff, edible, eatable, food item, grocery",
    "stationery": "stationery, writing tool, office supply",
    "fastener": "fastener, fixing, hardware",
    "condiment": "condiment, seasoning, spice",
    "crockery": "crockery, tableware, dishware",
    "chess piece": "chess piece, chess figure, chessman",
    "gem": "gem, gemstone, jewel, precious stone",
}
_KNOWN = {phrase.strip() for phrases in NOUNS.values() for phrase in phrases.split(",")}
# Kinds of objects bring their own words.
NOUNS.update(
    {
        noun: noun
        for shape in shapes().values()
        for noun in shape.nouns
        if not shape.is_plural and noun not in {*NOUNS, *_KNOWN}
    }
)
KINDS_OF: dict[str, frozenset[str]] = {
    "fruit": word_set(
        """
        apple banana orange pear lemon lime grape grapes strawberry peach plum apricot cherry mango kiwi melon fig
        pineapple tangerine mandarin clementine satsuma nectarine grapefruit raspberry blueberry blackberry cranberry
        gooseberry currant papaya guava lychee pomegranate coconut date watermelon cantaloupe pomelo persimmon quince
        passionfruit avocado berry kumquat
        """
    ),
    "vegetable": word_set(
        """
        tomato potato carrot onion cucumber pepper cabbage lettuce broccoli corn radish beet beetroot aubergine eggplant
        courgette zucchini celery spinach kale leek garlic turnip parsnip pea peas bean pumpkin squash cauliflower
        mushroom asparagus artichoke chilli chili ginger shallot sprout yam
        """
    ),
    "tool": word_set(
        """
        hammer screwdriver wrench spanner pliers saw drill chisel file clamp mallet scissors ruler knife
        tweezers crowbar level plane rasp awl vice ratchet socket soldering caliper calipers trowel axe hatchet cutter
        """
    ),
    "animal": word_set(
        """
        cat dog bird fish horse elephant duck bear teddy dino dinosaur cow pig sheep lion tiger rabbit frog mouse giraffe
        zebra monkey panda penguin owl fox wolf goat chicken hen turtle snake crocodile hippo rhino kangaroo koala bunny
        donkey whale shark dolphin octopus crab bee butterfly unicorn dragon
        """
    ),
    "vehicle": word_set(
        "car truck bus train plane boat bike lorry van tractor taxi ambulance helicopter jet ship rocket motorbike scooter tram digger excavator bulldozer"
    ),
    "drink": word_set("coke cola pepsi sprite fanta water juice soda beer lemonade milk wine cider"),
    "snack": word_set("""
        chips crisps cookie cookies biscuit chocolate candy popcorn pretzel pretzels cracker crackers sweet sweets wafer gum
        brownie granola
        """),
    "utensil": word_set("knife fork spoon spatula ladle whisk chopsticks teaspoon tablespoon tongs peeler spork"),
    "stationery": word_set(
        "pen pencil marker crayon eraser rubber ruler stapler notebook envelope highlighter sharpener"
    ),
    "fastener": word_set("bolt nut screw nail washer rivet bracket hinge"),
    "condiment": word_set("salt pepper ketchup mustard vinegar mayonnaise mayo paprika cinnamon"),
    "chess piece": word_set("pawn rook knight bishop queen king"),
    "crockery": word_set("plate saucer cup mug teacup bowl dish teapot"),
    "gem": word_set("ruby emerald diamond sapphire amethyst opal topaz garnet turquoise jade aquamarine"),
}
KINDS_OF["stone"] = KINDS_OF["gem"] | word_set("gem gemstone jewel")
KINDS_OF["gem"] |= {"pearl"}
KINDS_OF["food"] = (
    KINDS_OF["fruit"]
    | KINDS_OF["vegetable"]
    | KINDS_OF["snack"]
    | word_set(
        "egg eggs bread toast sandwich cake pizza burger cheese bun bagel muffin donut doughnut croissant ham sausage meat fish rice pasta nut honey jam butter"
    )
) - {"pepper", "nut", "fish"}
"""Words for many kinds of things, by what an id may call them; never by shape."""
COMPOUND_HEADS = word_set(
    """
    brush spoon book driver knife pot board bottle cloth bag lamp light cake berry bread melon fish lid pan paper plate
    rack saw shell stick stone wheel band case truck mill corn nut boat plane bird tape glass glove
    """
)
"""Nouns that end other nouns written in one word, each of which is one of them: a paintbrush is a brush."""
POTS = word_set("pot jar tub")
POTTED = word_set("paint glue ink jam honey varnish lacquer primer cream mustard yoghurt yogurt marmalade")
"""What comes in a pot, and may be called one."""
PLURAL_NOUNS = frozenset({"crockery", "tableware", "dishware", "stationery", "hardware", "cutlery", "stuff", "dice"})
COLLECTIVE_NOUNS = frozenset({"fruit", "veg"})
"""Which may be one or all of them."""
MASS_NOUNS = frozenset({"trash", "rubbish", "garbage", "soda", "coke", "glass"})
ABSENT_NOUNS = word_set(
    """
    cherry chocolate cream lime mint olive salmon tangerine rose apple banana orange_fruit pear lemon grape strawberry tomato potato carrot onion egg bread sandwich cake
    cookie biscuit pizza burger cheese milk juice tea coffee beer wine knife fork spoon spatula pan pot kettle
    toaster pen pencil marker crayon eraser rubber ruler paper book notebook magazine newspaper letter envelope
    stapler scissors tape glue phone telephone smartphone laptop computer keyboard mouse monitor screen tablet
    camera charger cable battery lamp bulb candle clock watch key keys coin wallet purse bag backpack hat shoe
    sock shirt glove scarf towel sponge brush soap toothbrush comb bottle jar vase flower plant tree cat dog bird
    fish horse elephant car truck bus train plane boat bike wheel tyre tire hammer screwdriver wrench spanner
    pliers saw drill nail screw bolt nut washer spring gear pipe rod stick rope string wire chain hook magnet
    stone rock pebble sand cone pyramid prism ring donut doughnut disc disk star triangle square circle hexagon
    rectangle chair sofa bed shelf door window wall ceiling remote controller puck duck teddy bear doll robot_toy
    figurine chess pawn card ticket photo picture painting mirror cork tongs whisk ladle sieve napkin tissue straw
    hose domino puzzle jenga peg wedge bead button lever switch knob compartment layer
    """
)
"""Common things that have no shape here; an object may bear one as its id, else it is not found."""
COLOURS: dict[str, str] = {
    "red": "red, crimson, scarlet, ruby, cherry, maroon, burgundy, reddish, vermilion",
    "green": "green, lime, emerald, olive, greenish, mint",
    "blue": "blue, navy, azure, cobalt, bluish, sapphire, indigo",
    "yellow": "yellow, golden, gold, lemon, yellowish",
    "orange": "orange, amber, tangerine, orangey, orangish",
    "purple": "purple, violet, magenta, lilac, lavender, mauve, purplish",
    "pink": "pink, rose, salmon, fuchsia, pinkish",
    "brown": "brown, tan, beige, chocolate, brownish",
    "black": "black, ebony, blackish",
    "white": "white, ivory, cream, whitish",
    "grey": "grey, gray, silver, greyish, grayish, charcoal",
    "cyan": "cyan, teal, turquoise, aqua",
}
SHADES: dict[str, str] = {
    "dark": "dark, darker, deep, darkest",
    "light": "light, pale, bright, brighter, palest",
}
SIZES: dict[str, str] = {
    "big": "big, large, huge, giant, great, massive, enormous, sizable, bulky, fat, chunky",
    "small": "small, little, tiny, mini, wee, miniature, teeny, petite, teensy, itty bitty, compact",
    "tall": "tall, high",
    "short": "short, low, squat",
    "wide": "wide, broad, thick",
    "narrow": "narrow, thin, slim, skinny, slender",
    "medium": "middle height, medium height, mid height, middle sized, average sized, medium, medium sized, middle sized, mid sized, medium size, mid size",
    "long": "long",
    "flat": "flat",
}
SUPERLATIVES: dict[str, str] = {
    "left": (
        "leftmost, left most, furthest left, farthest left, furthest to the left, farthest to the left, "
        "most to the left, closest to the left, nearest to the left, closest to the left edge, most left, "
        "far left, extreme left, leftest"
    ),
    "right": (
        "rightmost, right most, furthest right, farthest right, furthest to the right, farthest to the right, "
        "most to the right, closest to the right, nearest to the right, closest to the right edge, most right, "
        "far right, extreme right"
    ),
    "near": (
        "nearest, closest, most close, most near, most close to you, most near to you, closer, nearer, nearest to you, closest to you, nearest to the robot, closest to the robot, frontmost, "
        "front most, "
        "nearest to yourself, closest to yourself, nearest you, closest you, nearest to the arm, closest to the arm, "
        "nearest the robot, closest to your base, closest to the base, nearest to the base, "
        "closest to the robot arm, nearest to the robot arm, nearest the arm, closest to the gripper"
    ),
    "far": (
        "most far, most far away, farthest, furthest, farther, further, farther away, further away, more distant, most distant, rearmost, backmost, farthest away, furthest away, farthest from you, "
        "furthest from you, farthest from the robot, furthest from the robot, farthest away from you, "
        "furthest away from you, furthest away from the robot, farthest away from the robot, furthest back, "
        "farthest back, "
        "farthest from the arm, furthest from the arm, furthest from the base, farthest from the base, "
        "farthest from yourself, furthest from yourself, hindmost"
    ),
    "big": "most big, most large, more big, biggest, largest, hugest, bigger, larger, greatest, chunkiest, bulkiest, fattest",
    "small": "most small, most little, more small, smallest, littlest, tiniest, smaller, tinier",
    "tall": "most tall, most high, tallest, taller, longest, longer",
    "short": "shortest, shorter, flattest, flatter",
    "wide": "widest, wider, broadest, thickest, thicker, broader",
    "narrow": "narrowest, narrower, thinnest, thinner, slimmest, slimmer, skinniest",
    "top": "topmost, top, uppermost, highest, upper",
    "bottom": "bottommost, bottom, lowest, lowermost, lower",
    "medium": "middle sized one, medium sized one",
}
_SIDES = {"left": "left", "right": "right", "near": "front", "far": "back"}
for _key, _side in _SIDES.items():
    _edges = (
        f"{_most} {_to}the {_hand}{_part}"
        for _most in ("closest", "nearest")
        for _to in ("to ", "")
        for _hand in ((_side, f"{_side} hand") if _key in ("left", "right") else (_side,))
        for _part in ("", " side", " edge", " end", " side of the table", " edge of the table", " end of the table")
        if _to or _part
    )
    SUPERLATIVES[_key] += "".join(f", {_edge}" for _edge in _edges)
POSITIONS: dict[str, str] = {
    "left": "left, left hand, lefthand, left side, left handed",
    "right": "right, right hand, righthand, right side, right handed",
    "near": "front, near, close",
    "far": "back, rear, far, distant, hind",
    "middle": "middle, center, centre, central, middlemost, centermost",
}
ORDINALS: dict[str, int] = {
    "first": 1, "1st": 1, "second": 2, "2nd": 2, "third": 3, "3rd": 3, "fourth": 4, "4th": 4, "fifth": 5, "5th": 5,
    "sixth": 6, "6th": 6, "seventh": 7, "7th": 7, "eighth": 8, "8th": 8, "last": -1, "final": -1, "second to last": -2, "next to last": -2, "last but one": -2, "penultimate": -2, "second last": -2, "third to last": -3, "next": 0,
}  # fmt: skip
_ORDERED = "in order from, in order, in order starting from, in order starting at, in order beginning from"
ORDER_FROM: dict[str, str] = {
    "left": (
        "from the left, from left, counting from the left, from left to right, going left to right, "
        "starting from the left, starting on the left, starting left, beginning on the left, beginning from the left, "
        "on the left, when counting from the left, left to right, from the left side, from the left hand side, "
        "starting at the left"
    ),
    "right": (
        "from the right, from right, counting from the right, from right to left, going right to left, "
        "starting from the right, starting on the right, starting right, beginning on the right, beginning from the right, "
        "on the right, when counting from the right, right to left, from the right side, from the right hand side, "
        "starting at the right"
    ),
    "near": (
        "from the front, from front, from the robot, from you, counting from the front, from front to back, "
        "from your side, from the near side"
    ),
    "far": "from the back, from back, from the rear, counting from the back, from back to front, from the far side",
    "top": "from the top, from top, counting from the top, from above",
    "bottom": "from the bottom, from bottom, counting from the bottom, from below",
}
ORDER_FROM |= {"small": "in rising size", "big": "in falling size"}
for _name, _other in (("left", "right"), ("right", "left")):
    # "from the left to the right", "going from left to right"
    _ends = [f"{_one}{_name} to {_two}{_other}" for _one in ("", "the ") for _two in ("", "the ")]
    _runs = [f"{_how}from {_end}" for _end in _ends for _how in ("", "going ", "in order ", "working ", "moving ")]
    ORDER_FROM[_name] += "".join(f", {_run}" for _run in _runs if _run not in phrase_list(ORDER_FROM[_name]))
for _name, _side in (
    ("left", "the left"),
    ("left", "left to right"),
    ("right", "the right"),
    ("right", "right to left"),
):
    ORDER_FROM[_name] += "".join(f", {ordered} {_side}" for ordered in _ORDERED.split(", "))
NUMBERS: dict[str, float] = {
    "zero": 0, "one": 1, "two": 2, "three": 3, "four": 4, "five": 5, "six": 6, "seven": 7, "eight": 8, "nine": 9, "ten": 10,
    "eleven": 11, "twelve": 12, "thirteen": 13, "fourteen": 14, "fifteen": 15, "sixteen": 16, "seventeen": 17, "eighteen": 18,
    "nineteen": 19, "twenty": 20, "thirty": 30, "forty": 40, "fifty": 50, "sixty": 60, "seventy": 70, "eighty": 80, "ninety": 90,
    "hundred": 100, "half": 0.5, "one half": 0.5, "one quarter": 0.25, "one third": 1 / 3, "half a": 0.5, "half an": 0.5, "a quarter": 0.25, "quarter": 0.25, "three quarters": 0.75, "a half": 0.5, "quarter of a": 0.25, "a quarter of a": 0.25, "a": 1, "an": 1,
    "a couple of": 2, "a couple": 2, "couple of": 2, "a few": 3, "several": 3, "one and a half": 1.5, "two and a half": 2.5,
    "twenty five": 25, "a hundred": 100, "half a dozen": 6, "one hundred": 100, "a dozen": 12,
    "a single": 1, "half of a": 0.5, "three quarters of a": 0.75, "a third of a": 1 / 3,
}  # fmt: skip
UNITS: dict[str, float] = {
    "m": 1.0, "meter": 1.0, "meters": 1.0, "metre": 1.0, "metres": 1.0,
    "cm": 0.01, "cms": 0.01, "centimeter": 0.01, "centimeters": 0.01, "centimetre": 0.01, "centimetres": 0.01, "centi": 0.01, "centis": 0.01,
    "mm": 0.001, "mms": 0.001, "millimeter": 0.001, "millimeters": 0.001, "millimetre": 0.001, "millimetres": 0.001, "mil": 0.001,
    "dm": 0.1, "decimeter": 0.1, "decimeters": 0.1, "decimetre": 0.1, "decimetres": 0.1,
    "inch": 0.0254, "inches": 0.0254, '"': 0.0254, "foot": 0.3048, "feet": 0.3048, "ft": 0.3048,
    "yard": 0.9144, "yards": 0.9144, "km": 1000.0, "kilometer": 1000.0, "kilometers": 1000.0, "kilometre": 1000.0,
    "kilometres": 1000.0, "mile": 1609.0, "miles": 1609.0,
}  # fmt: skip
AMOUNTS: dict[str, float] = {
    "a bit": 0.05, "a little": 0.05, "a little bit": 0.05, "little bit": 0.05, "slightly": 0.05, "a touch": 0.03, "a tad": 0.03, "a smidge": 0.03,
    "a tiny bit": 0.03, "some": 0.10, "a small amount": 0.05, "a small distance": 0.05, "a short distance": 0.05, "a bit more": 0.05,
    "far": 0.20, "a long way": 0.20, "quite far": 0.20, "very far": 0.20, "a short way": 0.05, "a little way": 0.05, "a hair": 0.02, "somewhat": 0.05, "a wee bit": 0.03, "just a bit": 0.05, "a smidgen": 0.03,
    "a finger width": 0.02, "a thumb width": 0.02, "a hand width": 0.10, "a palm width": 0.08, "a little further": 0.05, "a bit further": 0.05, "a little more": 0.05, "a fraction": 0.02, "ever so slightly": 0.03,
}  # fmt: skip
ABOUT = (
    "say, by, about, around, roughly, approximately, exactly, precisely, approx, another, like, by about, "
    "by around, by roughly, by approximately, by exactly, for, some, maybe, a distance of, by a distance of, "
    "at least, up to, by another, at most, no more than, not more than, by no more than, by at most, by at least, a full, by a full, something like, by something like"
)
PRONOUNS: dict[str, str] = {
    "it": "it, that, this, that one, this one, the same one, him, her, itself, themselves",
    "them": "both, both of them, all of them, each of them, the two of them, the both of them, all three of them, them, those, these, they, all of them, those ones, these ones, all of those, em",
}
DEFINITES = "the, this, that, these, those, my, your, our, said, the one, these here, that there, this here, its, their"
INDEFINITES = (
    "a, an, any, one, some, any one, any old, whichever, whatever, just any, any single, a single, either, "
    "some random, a random, any random"
)
UNIVERSALS = (
    "all, all the, all of the, all of, all these, all those, all of these, all of those, every, each, "
    "each of the, every one of the, every single one of the, every single, each and every, "
    "all my, all your, any and all, each one of the, all of my, the whole set of, the entire set of, "
    "each of these, each of those, every last"
)
HYPONYMS: dict[str, frozenset[str]] = {"ball": frozenset({"marble"})}
"""Kinds of a kind that have a name of their own: of all balls, a marble is one."""
BOTHS = (
    "both, both the, both of the, both these, both those, both of these, both of those, the pair of, the two, "
    "each of the two, both my"
)
OTHERS = "other, remaining, leftover, left over, rest of the"
RESTS = (
    "rest, others, remainder, rest of them, remaining ones, rest of the stuff, rest of it, other ones, "
    "ones that are left, ones left"
)
OF_THEM = (
    "over there, over here, right over there, right there, right here, of them, of them all, of all, of the two, of the three, of the four, of these, of those, of the lot, "
    "of the bunch, of all of them, of the group, of the set, out of them, out of the two, out of all of them, "
    "of both, of the pair, of the bunch, in the scene, there is, around, here, available, in the bunch, "
    "in the lot, of any, you can find, you can see, in sight, you see, among them, in view, in the set, "
    "in the group, that you can see, that there is, overall"
)
CALLED = (
    "called, named, labelled, labeled, known as, with id, with the id, with name, with the name, "
    "with the label, with label, id"
)
NON = "non, not"
COLOURED = "coloured, colored, color, colour, in color, in colour"
EVERYTHING = (
    "everything, all, every thing, anything, the lot, the whole lot, all of it, all of this, all this, all the stuff, "
    "all of the stuff, everything there is, each thing, all things, all objects, all items, "
    "anything and everything, the whole bunch, every last thing, stuff, things, everything on the table, "
    "everything that is on the table"
)
EVERYTHING_ELSE = (
    "everything else, all else, anything else, all the others, all others, all the rest, all of the rest, "
    "all of the others, every other thing, all the other ones, all the remaining ones"
)
ONE_OF = "one of, any of, any one of, either of, one out of, either one of, some one of"
SOMETHING = "something, anything, some thing, any thing"
CONTENTS = (
    "water, contents, content, liquid, coffee, tea, juice, milk, beans, rice, beads, balls, sand, stuff, "
    "grains, pellets, drink, the contents of, contents of, the content of, the stuff in, what is in, "
    "the water in, whatever is in, "
    "the contents in, the contents from, contents from, all the contents of, everything in, the liquid in, "
    "the liquid from, the water from, water from, the beads in, the beads from, the beans from, the beans in, "
    "the drink in, what is inside, whatever is inside, the coffee from, the coffee in, the rice from, "
    "the rice in, the balls from, the balls in"
)
HELD = (
    "you are holding, that you are holding, which you are holding, you hold, you are currently holding, "
    "that you are currently holding, in your hand, in your gripper, in the gripper, in your claw, "
    "that is in your hand, that is in your gripper, that is in the gripper, you have, you have in your hand, "
    "you have in your gripper, you have picked up, you just picked up, you picked up, that you just picked up, "
    "that you picked up, you are gripping, in your grip, you have got, in hand"
)
HELD_THING = (
    "what you are holding, whatever you are holding, what you have, what you hold, whatever you have, "
    "whatever you hold, what is in your hand, what is in your gripper, what is in the gripper, "
    "whatever is in your gripper, whatever is in your hand, what you are currently holding, "
    "what you picked up, what you just picked up, whatever is in the gripper, what you have in your hand, "
    "what you have in your gripper, what you have got"
)
