"""The words for things: nouns, colours, sizes, orders, numbers, and what stands before and after a noun.

Each table maps what people say to one canonical value. Multi-word entries are matched whole.
"""

from __future__ import annotations

from robosandbox.agent.language.wordlist import word_set
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
POSITIONS: dict[str, str] = {
    "left": "left, left hand, lefthand, left side, left handed",
    "right": "right, right hand, righthand, right side, right handed",
    "near": "front, near, close",
    "far": "back, rear, far, distant, hind",
    "middle": "middle, center, centre, central, middlemost, centermost",
}
HYPONYMS: dict[str, frozenset[str]] = {"ball": frozenset({"marble"})}
"""Kinds of a kind that have a name of their own: of all balls, a marble is one."""
SHAPES: dict[str, frozenset[str]] = {
    **dict.fromkeys(("round", "rounded", "circular"), frozenset({"sphere", "cylinder", "capsule", "bowl", "cup"})),
    **dict.fromkeys(("spherical",), frozenset({"sphere"})),
    **dict.fromkeys(("cylindrical", "tubular"), frozenset({"cylinder", "capsule"})),
    **dict.fromkeys(
        ("square", "cubic", "cubical", "boxy", "rectangular", "blocky", "squarish", "cuboid"), frozenset({"box", "bin"})
    ),
}
"""The kinds of objects that have a shape."""
