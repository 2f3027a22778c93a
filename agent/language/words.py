"""The words that are no verbs: nouns, colours, sizes, orders, prepositions, directions, units, fillers.

Each table maps what people say to one canonical value. Multi-word entries are matched whole.
"""

from __future__ import annotations

from robosandbox.agent.language.wordlist import word_set

NOUNS: dict[str, str] = {
    "cube": "cube, dice, die",
    "block": "block, brick, building block, wooden block, cuboid, lego",
    "box": "box",
    "ball": (
        "ball, sphere, orb, marble, globe, round one, round thing, round object, round item, spherical one, spherical thing, "
        "spherical object, spherical item"
    ),
    "can": "can, tin, tin can, soda can, coke can, beer can, drink can, soda, coke",
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
    "lid": "lid",
    "pad": "pad, mat, coaster",
    "thing": (
        "thing, object, item, piece, toy, thingy, stuff, shape, guy, article, element, thingamajig, doodad, gizmo"
    ),
    "one": "one",
    "tower": "tower, stack, pile, column, heap, pyramid",
    "handle": "handle",
}
IRREGULAR_PLURALS: dict[str, str] = {
    "boxes": "box",
    "dice": "cube",
    "glasses": "mug",
    "dishes": "bowl",
    "flasks": "bottle",
    "ones": "one",
    "stuff": "thing",
    "trash": "bin",
    "rubbish": "bin",
    "garbage": "bin",
    "tumblers": "mug",
    "brushes": "brush",
}
MASS_NOUNS = frozenset({"trash", "rubbish", "garbage", "stuff", "dice", "soda", "coke", "glass"})

ABSENT_NOUNS = word_set(
    """
    apple banana orange_fruit pear lemon grape strawberry tomato potato carrot onion egg bread sandwich cake
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
    hose domino puzzle jenga peg wedge bead button lever switch knob
    """
)
"""Common things that have no shape here; an object may bear one as its id, else it is not found."""

COLOURS: dict[str, str] = {
    "red": "red, crimson, scarlet, ruby, cherry, maroon, burgundy, reddish, vermilion",
    "green": "green, lime, emerald, olive, greenish, mint",
    "blue": "blue, navy, azure, cobalt, bluish, sapphire, indigo",
    "yellow": "yellow, golden, gold, lemon, yellowish",
    "orange": "orange, amber, tangerine",
    "purple": "purple, violet, magenta, lilac, lavender, mauve",
    "pink": "pink, rose, salmon, fuchsia",
    "brown": "brown, tan, beige, chocolate",
    "black": "black, ebony",
    "white": "white, ivory, cream",
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
    "medium": "medium, medium sized, middle sized, mid sized, medium size, mid size",
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
        "nearest, closest, closer, nearer, nearest to you, closest to you, nearest to the robot, closest to the robot, frontmost, "
        "front most, "
        "nearest to yourself, closest to yourself, nearest you, closest you, nearest to the arm, closest to the arm, "
        "nearest the robot, closest to your base, closest to the base, nearest to the base, "
        "closest to the robot arm, nearest to the robot arm, nearest the arm, closest to the gripper"
    ),
    "far": (
        "farthest, furthest, farther, further, farther away, further away, more distant, most distant, rearmost, backmost, farthest away, furthest away, farthest from you, "
        "furthest from you, farthest from the robot, furthest from the robot, farthest away from you, "
        "furthest away from you, furthest away from the robot, farthest away from the robot, furthest back, "
        "farthest back, "
        "farthest from the arm, furthest from the arm, furthest from the base, farthest from the base, "
        "farthest from yourself, furthest from yourself, hindmost"
    ),
    "big": "biggest, largest, hugest, bigger, larger, greatest, chunkiest, bulkiest, fattest",
    "small": "smallest, littlest, tiniest, smaller, tinier",
    "tall": "tallest, taller, longest, longer",
    "short": "shortest, shorter",
    "wide": "widest, wider, broadest, thickest, thicker, broader",
    "narrow": "narrowest, narrower, thinnest, thinner, slimmest, slimmer, skinniest",
    "top": "topmost, top, uppermost, highest, upper",
    "bottom": "bottommost, bottom, lowest, lowermost, lower",
    "medium": "middle sized one, medium sized one",
}
POSITIONS: dict[str, str] = {
    "left": "left, left hand, lefthand, left side, left handed",
    "right": "right, right hand, righthand, right side, right handed",
    "near": "front, near, close",
    "far": "back, rear, far, distant, hind",
    "middle": "middle, center, centre, central, middlemost, centermost",
}
ORDINALS: dict[str, int] = {
    "first": 1, "1st": 1, "second": 2, "2nd": 2, "third": 3, "3rd": 3, "fourth": 4, "4th": 4, "fifth": 5, "5th": 5,
    "sixth": 6, "6th": 6, "seventh": 7, "7th": 7, "eighth": 8, "8th": 8, "last": -1, "final": -1, "next": 0,
}  # fmt: skip
ORDER_FROM: dict[str, str] = {
    "left": (
        "from the left, from left, counting from the left, from left to right, going left to right, "
        "starting from the left, "
        "on the left, when counting from the left, left to right, from the left side, from the left hand side, "
        "starting at the left"
    ),
    "right": (
        "from the right, from right, counting from the right, from right to left, going right to left, "
        "starting from the right, "
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
NUMBERS: dict[str, float] = {
    "zero": 0, "one": 1, "two": 2, "three": 3, "four": 4, "five": 5, "six": 6, "seven": 7, "eight": 8, "nine": 9, "ten": 10,
    "eleven": 11, "twelve": 12, "thirteen": 13, "fourteen": 14, "fifteen": 15, "sixteen": 16, "seventeen": 17, "eighteen": 18,
    "nineteen": 19, "twenty": 20, "thirty": 30, "forty": 40, "fifty": 50, "sixty": 60, "seventy": 70, "eighty": 80, "ninety": 90,
    "hundred": 100, "half": 0.5, "half a": 0.5, "half an": 0.5, "a quarter": 0.25, "quarter": 0.25, "three quarters": 0.75, "a half": 0.5, "quarter of a": 0.25, "a quarter of a": 0.25, "a": 1, "an": 1,
    "a couple of": 2, "a couple": 2, "couple of": 2, "a few": 3, "several": 3, "one and a half": 1.5, "two and a half": 2.5,
    "twenty five": 25, "a hundred": 100, "one hundred": 100, "a dozen": 12,
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
    "a bit": 0.05, "a little": 0.05, "a little bit": 0.05, "slightly": 0.05, "a touch": 0.03, "a tad": 0.03, "a smidge": 0.03,
    "a tiny bit": 0.03, "some": 0.10, "a small amount": 0.05, "a small distance": 0.05, "a short distance": 0.05, "a bit more": 0.05,
    "a short way": 0.05, "a little way": 0.05, "a hair": 0.02, "somewhat": 0.05, "a wee bit": 0.03, "just a bit": 0.05, "a smidgen": 0.03,
    "a little further": 0.05, "a bit further": 0.05, "a little more": 0.05, "a fraction": 0.02, "ever so slightly": 0.03,
}  # fmt: skip
ABOUT = (
    "by, about, around, roughly, approximately, exactly, precisely, approx, another, like, by about, "
    "by around, by roughly, by approximately, by exactly, for, some, maybe, a distance of, by a distance of, "
    "at least, up to, by another"
)

SIDE_WORDS = {"left": "left", "right": "right"}
DIRECTIONS: dict[str, str] = {
    "forward": (
        "forward, forwards, ahead, straight ahead, straight forward, onward, onwards, away from you, "
        "away from yourself, "
        "away from the robot, away from the arm, away from your base, away from the base, farther away, "
        "further away, "
        "to the front, frontward, frontwards, in the forward direction, in a forward direction, "
        "in the +x direction, outward, outwards, "
        "further from you, farther from you, out in front, further forward, along x, along +x, in front of you"
    ),
    "back": (
        "to you, to yourself, over to you, over to yourself, back to you, back to yourself, back, backward, backwards, rearward, rearwards, towards you, toward you, towards yourself, toward yourself, "
        "towards the robot, toward the robot, towards your base, toward your base, to the back, "
        "in the backward direction, "
        "towards the arm, toward the arm, closer to you, closer to yourself, closer to the robot, nearer to you, "
        "nearer to yourself, "
        "towards the base, to the rear, towards the robot arm, back towards you, back toward you, "
        "back towards yourself, "
        "towards the robot base, in your direction, closer to the base, nearer the robot, nearer to the robot"
    ),
    "left": (
        "left, leftward, leftwards, to the left, to your left, to left, towards the left, toward the left, "
        "over to the left, "
        "off to the left, on your left, toward your left, towards your left, "
        "in the left direction, further left, sideways to the left, to its left, left wards, along +y, "
        "in the leftward direction, more to the left, "
        "to the robot left, further to the left, over to your left, leftways"
    ),
    "right": (
        "right, rightward, rightwards, to the right, to your right, to right, towards the right, toward the right, "
        "over to the right, "
        "off to the right, on your right, toward your right, towards your right, "
        "further right, sideways to the right, to its right, right wards, along -y, in the rightward direction, "
        "more to the right, "
        "to the robot right, further to the right, over to your right, rightways"
    ),
}
PARTICLES = (
    "places, positions, spots, locations, places with each other, out of my way, out of our way, out of my way, out of our way, out of the road, up, down, off, out, away, over, together, apart, aside, open, closed, shut, to one side, out of the way, "
    "to the side, "
    "in the air, into the air, up in the air, up into the air, off the table, up off the table, up from the table, "
    "off of the table, off the ground, from the ground, off the desk, off the surface, around, round, over here, "
    "into your gripper, in your gripper, into the gripper, with one another, with each other, "
    "back up, for me, each other, one another, in your hand, into your hand, off the tabletop, from the tabletop, "
    "off of the desk, off to one side, off to the side, in your grip, in your claw, on its own, by itself, "
    "back down, "
    "up high, in your grasp, on top of each other, on top of one another, on each other, on one another, "
    "next to each other, beside each other, side by side, next to one another, beside one another, "
    "in a row, in a line, in line, into a row, into a line, in one row, in a straight line, in one line, "
    "in a neat row, in a neat line, "
    "on top of it all, on top of the other, one on top of the other, one on another, over to one side"
)
RELATIONS: dict[str, str] = {
    "on": (
        "on, on top of, atop, upon, on the top of, over, above, on top, overtop, over the top of, "
        "on the surface of, up on"
    ),
    "in": "in, inside, inside of, within, down in, inside the",
    "left": (
        "left of, to the left of, on the left of, on the left side of, to the left side of, at the left of, "
        "on the left hand side of, to the left hand side of, at the left side of, just left of, "
        "just to the left of, immediately left of, immediately to the left of, "
        "on the lefthand side of, to the left from, directly left of, directly to the left of, "
        "over to the left of, off to the left of, left from"
    ),
    "right": (
        "right of, to the right of, on the right of, on the right side of, to the right side of, at the right of, "
        "on the right hand side of, to the right hand side of, at the right side of, just right of, "
        "just to the right of, immediately right of, immediately to the right of, "
        "on the righthand side of, to the right from, directly right of, directly to the right of, "
        "over to the right of, off to the right of, right from"
    ),
    "front": (
        "in front of, in the front of, to the front of, at the front of, just in front of, right in front of, "
        "directly in front of, on the near side of, on this side of"
    ),
    "back": (
        "behind, in back of, at the back of, to the rear of, to the back of, just behind, right behind, "
        "directly behind, at the rear of, beyond, on the far side of, on the other side of"
    ),
    "beside": (
        "next to, beside, by, near, nearby, near to, close to, alongside, adjacent to, right next to, "
        "at the side of, by the side of, "
        "to the side of, just next to, right beside, along side, side by side with, close by, right by, just beside, "
        "up next to, directly next to, in the vicinity of, at, on the side of, touching"
    ),
    "between": (
        "between, in between, in the middle of, midway between, halfway between, half way between, "
        "in the gap between, in the space between"
    ),
    "under": "under, underneath, below, beneath",
}
DIRECTIONAL: dict[str, str] = {
    "on": "onto, on to, onto the top of, onto top of, up onto, up on, down on, down onto",
    "in": "into, in to, down into, inside, to the inside of, over into, back into, back in, back inside",
    "to": "to, over to, up to, over by, across to",
    "towards": "towards, toward, in the direction of, closer to, nearer to, nearer, closer towards",
    "away": "away from, further from, farther from, further away from, farther away from",
    "against": "against, up against, until it touches, so that it touches, so it touches",
}
SOURCES = (
    "from, off, off of, out of, from off, from on top of, from inside, from off of, from within, out from, "
    "out from inside, up from, from on, from atop, from the top of, off the top of, from inside of"
)
TABLE = (
    "table, table top, tabletop, desk, desktop, surface, counter, countertop, workbench, bench, work surface, "
    "worktop, working surface, "
    "workspace, work area"
)
FLOOR = "floor, ground, carpet"
ROBOT = (
    "you, yourself, the robot, your base, the base, the arm, the robot arm, robot, the robot base, your arm, "
    "base of the robot"
)
PRONOUNS: dict[str, str] = {
    "it": "it, that, this, that one, this one, the same one, him, her, the latter, itself, themselves",
    "them": "both of them, all of them, each of them, the two of them, the both of them, all three of them, them, those, these, they, all of them, those ones, these ones, all of those, em",
}

FILLERS = (
    "please, pls, plz, plase, kindly, um, umm, uh, uhh, uhm, er, erm, err, hmm, hm, mmm, ah, oh, okay, ok, "
    "okey, okie, hey, hi, hello, yo, "
    "hey there, hi there, hello there, good morning, good afternoon, good evening, greetings, dear, "
    "hey robot, hi robot, hello robot, ok robot, okay robot, dear robot, mr robot, hey arm, robot friend, "
    "buddy, mate, pal, dude, bro, bruv, man, friend, my friend, bot, "
    "now, just, simply, thanks, thank you, thank you very much, thanks a lot, many thanks, thx, ty, cheers, "
    "ta, much appreciated, "
    "if you please, if you do not mind, if possible, if that is okay, if that is ok, if that is possible, "
    "if you have a moment, if you have time, if it is not too much trouble, if it is no trouble, "
    "if you would be so kind, "
    "when you get a chance, when you have a moment, when you have time, when you can, when you are ready, "
    "whenever you are ready, when possible, "
    "pretty please, again, one more time, once again, for me, for us, carefully, gently, slowly, quickly, fast, softly, smoothly, nicely, "
    "neatly, properly, "
    "real quick, real quickly, right now, right away, straight away, immediately, asap, at once, this instant, "
    "this minute, very carefully, very gently, very slowly, "
    "once more, also, too, as well, alright, all right, basically, literally, honestly, perhaps, maybe, "
    "quite, really, directly, simply, there is a good robot, there you go, "
    "with the gripper, with your gripper, using the gripper, using your gripper, with the arm, with your arm, "
    "using your arm, with your claw, using the arm, with the claw, "
    "with your hand, using your hand, with your robotic arm, with care, in one go, in that order, in this order, "
    "for a moment, for a second, for a sec, quick, like so, you know, i guess, i think, kind of, sort of, say, "
    "right there, "
    "that would be great, that would be lovely, that would be nice, would be great, would be nice, "
    "would be lovely, much obliged, "
    "good robot, be a dear, be a dear and, be a darling and, be a love and, be an angel and, be a sweetheart and, be a good lad and, under any circumstances, whatever happens, be so kind as to, be so kind to, be so kind and, be kind enough to, be a good robot and, "
    "do me a favor and, do me a favour and, do me a favor, do me a favour, "
    "there is a dear, darling, sweetheart, lad, sir, madam, boss, chief, "
    "be careful, be gentle, take care, take your time, easy, nice and easy, nice and slow, nice and gently, "
    "steady, one at a time, one by one, "
    "step by step, task, next task, your next task, command, instruction, then please, so please, simple task, "
    "yeah, yep, yup, good job, well done, lol, haha"
)
PREAMBLES = (
    "would it be okay to, would it be ok to, would it be alright to, is it okay to, is it ok to, the next step is to, "
    "the first step is to, i would appreciate it if you, it would be great if you, it would help if you, i would like it if you, "
    "mind, if you could, if you would, if you can, i would love it if you could, i would love it if you would, "
    "it would be great if you could, it would be nice if you could, it would be lovely if you could, "
    "it would be great if you would, would you be able to, would you be so kind as to, i am asking you to, "
    "what about, "
    "can you, could you, would you, will you, can ya, could ya, can u, could u, can we, could we, shall we, "
    "would you mind, do you mind, would u, will u, "
    "i want you to, i would like you to, i need you to, i would love for you to, i would love you to, "
    "i want to have you, i would like to have you, i ask you to, "
    "i would appreciate it if you could, i would appreciate it if you would, i would be grateful if you could, "
    "i would be happy if you could, "
    "i was wondering if you could, i wonder if you could, i was hoping you could, "
    "i was wondering if you would, i would like for you to, i wanna see you, i would like to see you, "
    "you should, you can, you could, you must, you need to, you have to, you may, you are to, you will, "
    "your task is to, your job is to, the task is to, your goal is to, your mission is to, your assignment is to, "
    "what i need is for you to, what i want is for you to, what i would like is for you to, what i need you to do is, "
    "what i want you to do is, what i would like you to do is, what you need to do is, what you have to do is, "
    "what you should do is, all i want is for you to, all you need to do is, all you have to do is, "
    "so what i need is for you to, so what i want is for you to, so what i want you to do is, "
    "so what i need you to do is, so what i would like you to do is, the thing to do is, the plan is to, "
    "the idea is to, we are going to, you are going to, let us go and, "
    "go ahead and, go ahead, try to, try and, try, attempt to, make sure to, make sure you, "
    "make sure that you, be sure to, be sure you, remember to, "
    "do not forget to, let us, how about you, how about, why do not you, why not, what about you, proceed to, "
    "start by, begin by, "
    "start off by, begin with, start with, start, begin, continue by, finish by, end by, finish off by, "
    "go on and, go and, go, feel free to, it is time to, time to, i say, i said, "
    "please do, do, would it be possible to, would it be possible for you to, is it possible to, "
    "is it possible for you to, are you able to, "
    "may i ask you to, might you, can i ask you to, could i ask you to, can i get you to, could i get you to, "
    "may i trouble you to, "
    "i require you to, i request you to, i request that you, i ask that you, i want that you, "
    "i hereby order you to, i command you to, i order you to, "
    "we need to, we have to, we want to, we should, let me see you, let me have you, we need you to, "
    "we want you to, we would like you to, "
    "so, well, alright then, right then, right, all i want is for you to, all you need to do is, "
    "all you have to do is, what i want you to do is, what i need you to do is, "
    "the next thing to do is, next you should, next thing is to, you are going to, you wanna, you gotta, "
    "you got to, kindly do, do please, "
    "i am going to need you to, i am gonna need you to, gonna need you to, help me, help me to, "
    "help me out and, help by, help, could you help me, use the gripper to, use your gripper to, "
    "use your arm to, use the arm to, "
    "turn around and, manage to, quickly go, be a good sport and, want you to, need you to, would like you to, "
    "would love you to, robot, arm"
)
DESIRES = (
    "make, let, i want, i need, i would like, i would love, i require, i want to have, i would like to have, "
    "i need to have, i want to see, "
    "i would like to see, make sure, make sure that, ensure, ensure that, see to it that, we need, we want, "
    "we would like, "
    "i would prefer, let us have, let us get, can i have, could i have, may i have, can we have, "
    "could we have, can i get, could i get, have, get, i wish, "
    "i expect, i would like it if, it would be nice if, let me have, see that, i wanna have, i wanna see, "
    "i wanna, i like, the goal is to have, "
    "the goal is for, the goal is to get, we would love, would like, need, want"
)
COPULAS = (
    "to be, be, should be, should go, must be, must go, needs to be, need to be, needs to go, "
    "need to go, goes, go, belongs, belong, to go, "
    "ends up, end up, to end up, sits, sit, to sit, should sit, should end up, has to be, has to go, "
    "have to go, have to be, gets, is to go, "
    "sitting, resting, to come, comes, should come, should rest, to rest, ought to be, ought to go, will go, "
    "can go, could go, would go, standing, lying, "
    "to stand, should stand, is supposed to be, is supposed to go, are supposed to go, is meant to be, "
    "is meant to go, wants to be, wants to go, has gotta be, gotta be, gotta go"
)
IS = (
    "that is, which is, that are, which are, that sits, which sits, that lies, which lies, that stands, "
    "which stands, who is, "
    "sitting, lying, standing, placed, located, resting, positioned, situated, found, that is sitting, "
    "that is lying, that is standing, "
    "which is sitting, which is lying, which is standing, that is resting, which is resting, that is placed, "
    "that is located, which is located, that is currently, which is currently, currently, "
    "that you see, you see, that you can see, you can see, that we have, we have, that i see, i see, "
    "that are currently, laying, that is laying, which is laying, stacked, stored, kept, "
    "that are sitting, that are lying, that are standing, that are located, which are sitting, over, "
    "that rests, that is found, that has been placed, "
    "that is the, which is the, that are the, nearby, being, that lie, that sit, that stand, "
    "that you will find, you will find, that you have, you have, that is positioned, "
    "that is stacked, which is stacked, that are stacked, that is situated, that was placed, directly, right, "
    "just, immediately"
)
NOT_IS = (
    "that is not, which is not, that are not, which are not, that do not, is not, not, that is neither, "
    "which are neither, that are neither"
)
EXCEPT = (
    "except, except for, but, but not, other than, apart from, besides, excluding, save for, aside from, "
    "with the exception of, minus, not counting, barring, and not, but skip, but leave out, bar, "
    "not including, without"
)
AVOID = (
    "without touching, without bumping, without bumping into, "
    "without hitting, without knocking, "
    "without picking up, without pushing, without using, without affecting, "
    "without colliding with, "
    "while avoiding, avoiding, avoid, avoid touching, while not touching, not touching, but do not touch, "
    "but leave, and do not touch, do not touch, do not move, do not disturb, "
    "do not bump, do not hit, "
    ""
    "do not knock over, do not bump into, "
    "do not mess with, do not disturb, do not even touch, do not ever touch, do not go near, "
    "never touch, never move, leave, stay away from, keep away from, "
    "stay clear of, steer clear of, keep clear of, keep your hands off, hands off, "
    "avoid moving, avoid bumping, refrain from touching, refrain from moving, "
    "stop touching, quit touching, ignore, skip, "
    "forget, "
    "you must not touch, you must not move, must not touch, must not move, you should not touch, "
    "you should not move, should not touch, "
    "i do not want you to touch, i do not want you to move, "
    ""
    "you are not allowed to touch, you are not allowed to move, you may not touch, you may not move, "
    "you can not touch, "
    "no touching, no moving, no need to touch, no need to move, "
    "you do not need to touch, you do not need to move, "
    "you do not have to touch, you do not have to move, make sure not to touch, "
    "make sure you do not touch, make sure not to move, "
    "be careful not to touch, be careful not to move, be careful not to bump, be careful not to bump into, "
    "be careful not to knock over, be careful not to hit, try not to touch, try not to move, try not to bump, "
    "be careful not to disturb, take care not to touch, take care not to disturb, take care not to bump, "
    "keep off, let it be, keep clear from, mind, watch out for, careful with, be careful with, be careful of, "
    "and leave, but never touch, "
    "while leaving, leaving, without interfering with, with no contact with, not disturbing, not moving, "
    "but avoid, and avoid, but ignore, but do not move, but do not disturb, but stay away from, "
    "but keep away from"
)
AVOID_TAILS = (
    "alone, be, where it is, where they are, where it stands, in place, in its place, as it is, untouched, "
    "as is, there, undisturbed, in peace, out of it, out of this, still, at all, unmoved, where it was, "
    "as they are, in their place, out, over, under any circumstances, whatever you do"
)
CONNECTORS = (
    "and then, then, and, after that, and after that, afterwards, afterward, and afterwards, after which, "
    "next, and next, finally, and finally, lastly, and lastly, "
    "followed by, subsequently, and subsequently, later, and later, thereafter, and also, plus, "
    "before you finish, once that is done, once done, when done, when that is done, "
    "when you are done, once you are done, when you have done that, once you have done that, once finished, "
    "when finished, after this, and once done, and when done, "
    "and once that is done, to finish, and to finish, to end, second, secondly, third, thirdly, now, and now, "
    "as well as, so that you can, "
    "at the end, in the end, at last, after you are done, and after this, then next, next up, "
    "and to finish off, to finish off, as a last step, as the last step, as a final step, lastly then, "
    "followed up by, from there, and from there, "
    "after doing that, after doing so, and after doing that, after you have done that, and last, last, "
    "last of all, and last of all, when that is finished, once that is finished, with that done, that done, "
    "having done that, in order to, straight after that, "
    "immediately after that, right after that, once you have it, once you have got it, "
    "once you are holding it, once it is in your gripper, once it is there, when it is there, once there, "
    "when you have it, after it"
)
FIRST = (
    "before you do anything else, before doing anything else, before anything, first things first, "
    "the first thing to do is, as a first thing, start off with, first, firstly, first of all, to begin, "
    "to begin with, to start, to start with, first off, before anything else, initially, first up, at first, "
    "as a first step, step one, for starters, start off, first things first, before all else"
)
FIRST_BUT = (
    "but first, but before that, but before you do that, but before doing that, before that, but first of all, "
    "after first, but beforehand, beforehand, but prior to that, prior to that, but start by, only after, "
    "but only after, only once"
)
BEFORE = (
    "before, before you, prior to, but before, and before, before then, but before you, and before you, "
    "ahead of, just before"
)
AFTER = (
    "after, after you, once you have, when you have, after having, as soon as you have, once you, "
    "after you have, and after, and once you have, when you, right after, immediately after, straight after, "
    "having, after you are done, once you are done, when you are done, when done, once done, after finishing, "
    "after you finish, once you finish, as soon as you, upon"
)
ORDER_UP = (
    "from bottom to top, bottom to top, bottom up, from the bottom up, starting from the bottom, "
    "starting at the bottom, in that order from the bottom, from the bottom to the top, bottom first, "
    "starting with the bottom, from bottom up, going up, upwards, counting from the bottom, from the bottom"
)
ORDER_DOWN = (
    "from top to bottom, top to bottom, top down, from the top down, starting from the top, "
    "from the top to the bottom, top first, starting at the top, from top down, going down, downwards, "
    "from the top"
)
BY_COLOUR = (
    "by colour, by color, by their colour, by their color, by colours, by colors, according to colour, "
    "according to color, according to their colour, according to their color, based on colour, based on color, "
    "based on their colour, based on their color, colour wise, color wise, per colour, per color, "
    "in terms of color, in terms of colour, colorwise, colourwise, by the color, by the colour, "
    "depending on colour, depending on color, depending on their color, depending on their colour, "
    "on the basis of color"
)
BY_OTHER = (
    "by size, by shape, by type, by kind, by weight, by height, alphabetically, by their size, by their shape, "
    "according to size, according to shape, based on size, based on shape, by name, from smallest to largest, "
    "from largest to smallest, from small to large, from big to small"
)
MATCHING = (
    "matching, corresponding, same coloured, same colored, similarly colored, like colored, like coloured, "
    "appropriate, correct, respective, "
    "correctly colored, color matched, correctly coloured"
)
SAME_COLOUR = (
    "of the same colour, of the same color, with the same colour, with the same color, of its colour, "
    "of its color, of their colour, of their color, that matches its colour, "
    "that matches its color, that matches, that match, of matching colour, of matching color, "
    "that matches their color, that matches their colour, with a matching color, with a matching colour, "
    "which matches its color, "
    "that has the same color, that has the same colour, that share its color, that shares its color, "
    "that shares its colour, with the matching color, that match their color, that match their colour, "
    "matching its color, matching their color, matching its colour, matching their colour"
)
TIMES: dict[str, int] = {
    "once": 1,
    "twice": 2,
    "thrice": 3,
    "one time": 1,
    "two times": 2,
    "three times": 3,
    "four times": 4,
    "five times": 5,
}
HOMES = (
    "home, home position, home pose, home configuration, start position, starting position, start pose, "
    "starting pose, start, rest position, resting position, rest pose, rest, initial position, "
    "initial pose, neutral position, neutral pose, default position, default pose, ready position, ready pose, "
    "original position, initial configuration, base position, idle position, parking position, "
    "beginning, starting point, starting place, home base, park position, neutral, home state, initial state, "
    "home location, safe position, zero position, zero pose, standby, starting configuration, "
    "default configuration, resting pose, start point"
)
ARM = (
    "arm, robot, gripper, hand, robot arm, manipulator, yourself, robotic arm, claw, end effector, effector, "
    "system, machine, fingers, position, pose"
)
QUESTIONS = word_set(
    """
    what where which who whom whose how when is are was were am does did has had why may might shall
    """
)
CONDITIONS = frozenset(
    {"if", "unless", "whether", "until", "while", "whenever", "every time", "otherwise", "else", "when"}
)
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
    "of them, of them all, of all, of the two, of the three, of the four, of these, of those, of the lot, "
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
ORIGINAL = (
    "back where it was, back where you found it, where it was, where you found it, back to where it was, "
    "back in its place, back in place, back to its place, where it came from, back where it came from, "
    "back to its original position, back to its original place, to its original position, "
    "to its original place, in its original position, in its original place, to where it was, "
    "back to where you found it, "
    "back to where it came from, to where you found it, back to its starting position, "
    "back to its original location, back to its original spot, in its original spot, to its original spot, "
    "back in its original place, "
    "back in its original position, back in its original spot, where it was before, back where it was before, "
    "where you got it from, back where you got it, where you got it, back where you got it from, "
    "back to its spot, back in its spot, "
    "back where it started, where it started, where you picked it up from, where you took it from, "
    "to its starting position, to where it started, back to where it started, where it used to be, "
    "where it originally was, back where you picked it up, exactly where it was, back to where you got it"
)
EVERYTHING = (
    "everything, all, every thing, anything, the lot, the whole lot, all of it, all the stuff, "
    "all of the stuff, everything there is, each thing, all things, all objects, all items, "
    "anything and everything, the whole bunch, every last thing, stuff, things, everything on the table, "
    "everything that is on the table"
)
EVERYTHING_ELSE = (
    "everything else, all else, anything else, all the others, all others, all the rest, all of the rest, "
    "all of the others, every other thing, all the other ones, all the remaining ones"
)
TOPS = (
    "on top, on the top, at the top, top, up top, at top, uppermost, topmost, as the top, as the top one, "
    "last, on the very top, at the very top"
)
BOTTOMS = (
    "below, beneath, at the bottom, on the bottom, bottom, on bottom, as the base, as a base, as the bottom, "
    "as the bottom one, as the foundation, at the base, at bottom, as its base, first, at the very bottom, "
    "on the very bottom, underneath, lowest"
)
ONE_OF = "one of, any of, any one of, either of, one out of, either one of, some one of"
SOMETHING = "something, anything, some thing, any thing"
MATERIAL = (
    "with, of, from, out of, using, made of, made up of, consisting of, made from, made out of, by stacking, containing"
)
SWAP_OF = (
    "the positions of, positions of, the places of, places of, the locations of, the position of, "
    "the spots of, the place of, places between, positions between, the order of, locations of, "
    "the location of"
)
NOR = "nor, or, and, or is, nor is"
FREE_SPOTS = (
    "somewhere free, anywhere free, some free spot, on some free spot, at some free spot, in some free spot, "
    "somewhere, anywhere, somewhere else, elsewhere, somewhere free, anywhere free, anywhere else, "
    "some place else, someplace else, in an empty spot, in a free spot, somewhere empty, on an empty spot, "
    "on a free spot, "
    "at a free spot, in a free space, in an empty space, to an empty spot, to a free spot, "
    "wherever there is space, wherever you like, wherever you want, anywhere you like, anywhere you want, "
    "wherever there is room, "
    "where there is space, where there is room, somewhere safe, in a clear spot, on an empty patch, "
    "to a free space, to an empty space, in the open, in an open spot, on a clear spot, in an empty area, "
    "to an empty area, where there is free space"
)
CONTENTS = (
    "water, contents, content, liquid, coffee, tea, juice, milk, beans, rice, beads, balls, sand, stuff, "
    "grains, pellets, drink, the contents of, contents of, the content of, the stuff in, what is in, "
    "the water in, whatever is in, "
    "the contents in, the contents from, contents from, all the contents of, everything in, the liquid in, "
    "the liquid from, the water from, water from, the beads in, the beads from, the beans from, the beans in, "
    "the drink in, what is inside, whatever is inside, the coffee from, the coffee in, the rice from, "
    "the rice in, the balls from, the balls in"
)
START_FILLERS = "scratch that, forget that, never mind that, never mind, forget it, change of plan, change of plans, sorry, wait, no wait, oh wait, actually, i mean, oops, and, then, but, no"
CORRECTION = (
    "no, no wait, wait no, wait, wait a second, wait a minute, hang on, hold on, sorry, i mean, i meant, "
    "actually, actually no, no actually, or rather, rather, make that, scratch that, correction, oops, oh no, "
    "no sorry, sorry i mean, sorry i meant, sorry no, not that, not that one, i meant to say, no i mean, "
    "no i meant, no make that, oh wait, oh sorry, wait i mean, wait i meant, oops i mean, oops i meant, "
    "strike that, on second thought, on second thoughts, no wait actually, wait actually, no not that one, "
    "no not that, no hang on, my bad, my mistake, well actually, well no, better, er no, no no, or actually, "
    "oops no, oops sorry"
)
INSTEAD = (
    "instead of, rather than, and not, not, as opposed to, but not, instead of picking up, "
    "rather than picking up, instead of using, in preference to"
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
LIGHT_ADJECTIVES = (
    "gentle, little, small, quick, light, tiny, slight, good, nice, soft, bit of a, careful, firm, hard, big, short"
)
LIGHT_NOUNS = {"push": "push, shove, nudge, prod, bump", "tap": "tap, poke, touch, pat, press", "pick": "lift"}
MIDDLES = "in the middle, in between, middle, in the centre, in the center, between them, in between them"
END_FILLERS = (
    "instead, actually, if you could, if you can, if you would, if you will, already, for god sake, for me now, "
    "once and for all, would you, will you, could you, can you, would ya, for me please, you know, "
    "and stay there, and stay put, and that is it, "
    "if you would like, ok then, okay then, then please, there is a good lad, mate, thank you so much, "
    "that is all, ok robot"
)
ASIDE_FILLERS = (
    "right, so, go, like, fine, there, here, let us see, let me see, let me think, let us think, "
    "you know what, guess what, alright, very good, brilliant, thanks, no rush, quick one, listen, listen up, "
    "cheers, wow, hang on, hold on"
)
EDGE_FILLERS = (
    "all done, done, finished, all finished, yes, sure, of course, awesome, good, great, nice, perfect, cool, excellent, so, well, robot, look, "
    "listen, listen up, now then, right then, here is what i want, here is the plan, here we go, here goes, "
    "dear, man, love, fine, see, so then, well then, excuse me, pardon me, attention, as i said, in that case, "
    "panda, franka, robo, hal, robby"
)
GRAMMAR_WORDS = word_set(
    """
    the a an and or of to in on at by from with without then that which is are it them them one ones all both
    every each not no put pick up down left right front back top bottom middle next beside between under over into
    onto off out away corner edge side table robot me my your you number coordinates position x y z cm mm half end
    area region spot place point location part portion colour color coloured but than
    """
)

NEGATIONS = (
    "do not, never, you must not, you should not, must not, should not, i do not want you to, you are not to, no need to, you do not need to, "
    "you do not have to, refrain from, stop, you are not allowed to, you may not, make sure not to, make sure you do not, be careful not to, "
    "try not to, do not even, do not ever, do not you dare, you can not, you shall not, i would rather you did not, i would prefer you did not, "
    "can you not, could you not, would you not, please do not, better not, you better not, under no circumstances, i forbid you to, avoid, without, "
    "and do not, but do not, and never, but never"
)
ITS_SIDES = {
    "left": "on its left, to its left, on its left side, to its left side, on its left hand side, at its left, on the left of it, left of it",
    "right": "on its right, to its right, on its right side, to its right side, on its right hand side, at its right, on the right of it, right of it",
}

SO_THAT = (
    "so that it is, such that it is, so it is, so that it sits, so it sits, so that it ends up, so it ends up, such that it sits, so that it stands, "
    "so that they are, so they are, such that it ends up, so that it rests, such that it rests, so it will be, so that it will be"
)
SAME = (
    "do the same with, do the same for, do the same to, do the same thing with, do the same thing for, the same with, the same for, same for, same with, "
    "do that with, do that for, do likewise with, likewise with, likewise for, repeat with, repeat for, repeat this with, repeat that with, repeat that for, "
    "do it for, do so with, do this with, do it again with, do the same thing to, repeat the same with, repeat the process with, repeat this for"
)
IS_NOW = "is, are, is already, are already, is now"

STILL = "without moving, without disturbing, without shifting, without displacing, without knocking over, without toppling, without disrupting"
